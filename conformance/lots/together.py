"""Units on one bus, judged at once: a process for each, and turns for what must be done alone."""

from __future__ import annotations

import multiprocessing
import signal
import threading
from _thread import interrupt_main
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection, wait
from typing import Any, Final

from conformance.bench.definition import BenchDefinition
from conformance.errors import BenchError, ConformanceError, SpecError
from conformance.lots.company import Task
from conformance.lots.inspection import Try
from conformance.lots.judging import Judging
from conformance.simulator.bus import SimulatedBus
from conformance.simulator.channel import NodeName, build_devices
from conformance.simulator.hub import Hub

HUB: Final = "canopen_simulator_hub"
WAITING: Final = "waiting"
"""What a process says that has done all it can do beside others."""
GO: Final = "go"


class Together:
    """Processes that judge units of one bus.

    Args:
        judging: How units are judged.
        count: How many units may be on the bus at once.
    """

    def __init__(self, judging: Judging, count: int) -> None:
        self._judging = judging
        context = multiprocessing.get_context("spawn")
        self._hub = Hub(count + 1) if judging.bench.simulated else None
        ports: Sequence[Connection | None] = self._hub.ends[:-1] if self._hub else [None] * count
        pairs = [context.Pipe() for _ in range(count)]
        self._connections: list[Connection] = [own for own, _ in pairs]
        self._workers = [
            context.Process(target=_work, args=(end, port, judging), daemon=True)
            for (_, end), port in zip(pairs, ports, strict=True)
        ]
        for worker, (_, end) in zip(self._workers, pairs, strict=True):
            worker.start()
            end.close()
        if self._hub is not None:
            for end in self._hub.ends[:-1]:
                end.close()

    def connect(self, tasks: Sequence[Task], *, fresh: bool) -> None:
        """Have units on the bus, where it is simulated.

        Args:
            tasks: What is to be judged.
            fresh: They are fresh from the box, all at one node-ID.
        """
        if self._hub is not None:
            given = [replace(it, node_id=None) for it in tasks] if fresh else tasks
            self._hub.put(_bus(self._judging, given))

    @property
    def bench(self) -> BenchDefinition:
        """The bench as this process finds it."""
        bench = self._judging.bench
        return bench if self._hub is None else bench.model_copy(update={"options": {}})

    @property
    def options(self) -> Mapping[str, Any]:
        """What this process needs to be on the bus as well, beside what that bench says."""
        return {} if self._hub is None else {**_at(self._hub.ends[-1]), "node_id": 0}

    def judge(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Try]]:
        """Judge units, and return each when it is done.

        Raises:
            SpecError: No item is selected.
            BenchError: A process ended before its time.
            KeyboardInterrupt: The user ended it; what the processes changed is given back.
        """
        busy = dict(zip(self._connections, tasks, strict=False))
        for connection, task in busy.items():
            connection.send(task)
        try:
            yield from self._outcomes(busy)
        except KeyboardInterrupt:
            for connection in busy:  # each has had the same signal
                _last_word(connection)
            raise

    def _outcomes(self, busy: dict[Connection, Task]) -> Iterator[tuple[Task, Try]]:
        standing: list[Connection] = []
        while busy:
            if len(standing) == len(busy):
                standing.pop(0).send(GO)
            for connection in wait([it for it in busy if it not in standing]):
                assert isinstance(connection, Connection)  # what was waited for
                said = _heard(connection, busy[connection])
                if said == WAITING:
                    standing.append(connection)
                    continue
                task = busy.pop(connection)
                if not isinstance(said, Try):
                    raise said
                yield task, said

    def close(self) -> None:
        """End the processes; what one of them has changed is given back before."""
        for connection in self._connections:
            connection.close()
        for worker in self._workers:
            worker.terminate()
        for worker in self._workers:
            worker.join()
        if self._hub is not None:
            self._hub.close()


def _heard(connection: Connection, task: Task) -> Any:
    try:
        return connection.recv()
    except (EOFError, OSError):
        raise BenchError(f"the process that judged unit {task.unit} ended by itself") from None


def _last_word(connection: Connection) -> None:
    """Wait until a process has given its unit back."""
    try:
        while connection.recv() == WAITING:
            connection.send(GO)
    except (EOFError, OSError):
        return


def _bus(judging: Judging, tasks: Sequence[Task]) -> SimulatedBus:
    """Return a bus with the simulated units."""
    bus = SimulatedBus(judging.bench.bitrate or judging.spec.bitrate)
    for place, task in enumerate(tasks):
        asked: Mapping[str, Any] = judging.run(task).simulation
        (device,) = build_devices(
            [NodeName(asked["channel"], asked["variant"], asked["node_id"])],
            readings=asked["readings"],
            faults=asked["faults"],
            seed=asked["seed"] + place,
            serial_number=asked["serial_number"],
        )
        bus.add_node(device)
    return bus


def _at(port: Connection) -> dict[str, Any]:
    """Return the arguments of python-can for a place at the hub."""
    return {"interface": HUB, "channel": "hub", "connection": port}


def _end_with_parent() -> None:
    """Interrupt the run, which gives its unit back, when the process that asked for it was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        interrupt_main()


def _work(connection: Connection, port: Connection | None, judging: Judging) -> None:
    """Judge the units of one place on the bus, until nobody asks any more."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    hub = None if port is None else _at(port)

    def turn() -> None:
        try:
            connection.send(WAITING)
            connection.recv()
        except (EOFError, OSError):
            raise BenchError("whoever asked for this unit is gone") from None

    while True:
        try:
            task: Task = connection.recv()
        except (EOFError, OSError, KeyboardInterrupt):
            return
        bus = hub and {**hub, "node_id": task.node_id}
        try:
            said: object = judging.judge(task, bus, turn if task.others else None)
        except KeyboardInterrupt:
            said = KeyboardInterrupt()
        except ConformanceError as error:
            said = SpecError(str(error)) if isinstance(error, SpecError) else BenchError(str(error))
        signal.signal(signal.SIGINT, signal.default_int_handler)
        with suppress(OSError):  # nobody is there any more
            connection.send(said)
