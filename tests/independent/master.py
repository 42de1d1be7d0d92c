"""python-canopen as master of a simulated device, on one virtual clock and in one thread.

Where python-canopen would wait in its thread for another one to receive, simulated time goes on until
what it waits for is there.
"""

from __future__ import annotations

import queue
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from functools import cache
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from unittest import mock

import canopen
from canopen import objectdictionary
from canopen.objectdictionary import ObjectDictionary
from virtual_time import LibraryBus, Notifier, Station

from conformance.resources import data, names
from conformance.simulator.bus import SimulatedBus
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.segment import SECOND
from conformance.spec.eds.writer import to_eds
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec, Entry

SPECS = [data("device_specs") / f"{name}.yaml" for name in names("device_specs")]
DEVICES = [(path, variant) for path in SPECS for variant in load_spec(path).variants]
SERIAL_NUMBER = 7
BOOT_UP_S = 2.0
SET_BY_PROCEDURE = range(0x1800, 0x1C00)
"""TPDO parameters, which are written in an order that python-canopen's `PdoMap.save` knows."""
EDS_NAME = "simulated.eds"
WAITING = ("canopen.sdo.client", "canopen.lss", "canopen.nmt", "canopen.emcy", "canopen.pdo.base")
"""The modules of python-canopen that wait."""


def name_of(device: tuple[Path, str]) -> str:
    """Return what a device is called in the id of a test."""
    path, variant = device
    return f"{path.stem}-{variant}"


@cache
def _dictionary(path: Path, variant: str) -> ObjectDictionary:
    """Return a device's object dictionary, from the EDS that its spec makes."""
    file = load_spec(path)
    node_id = file.resolve(variant).node_id
    source = StringIO(to_eds(file, variant, node_id, EDS_NAME, datetime.now(UTC)))
    source.name = EDS_NAME
    return objectdictionary.import_od(source, node_id)


class Master:
    """A network with one simulated device, known by the EDS that its spec makes.

    Attributes:
        device: The simulated device.
        node: It, as python-canopen sees it.
        network: python-canopen's.
        bus: What they are connected by.
        station: What the master is on the bus.
    """

    def __init__(self, path: Path, variant: str | None) -> None:
        self.device = SimulatedDevice(load_spec(path), variant=variant, serial_number=SERIAL_NUMBER)
        self.bus = SimulatedBus(self.device.bitrate)
        self.station = Station(self.device.bitrate)
        # The bus asks its nodes for bit rate, deadline, step and power, which a station has.
        self._participant = cast("SimulatedDevice", self.station)
        self.bus.add_node(self._participant)
        # canopen is partly untyped
        self.network: Any = canopen.Network(LibraryBus(self.station))
        self.network.connect()
        self._dictionary = _dictionary(path, self.spec.variant)
        self.node: Any = None
        self.speak_with(self.spec.node_id)

    @property
    def spec(self) -> DeviceSpec:
        return self.device.spec

    @property
    def now_s(self) -> float:
        return self.bus.now_ns / SECOND

    def speak_with(self, node_id: int) -> None:
        """Have the device at a node-ID from now on."""
        self.node = self.network.add_node(canopen.RemoteNode(node_id, self._dictionary))

    def boot(self) -> None:
        """Switch the device on, off before if it was on, and wait until it says so."""
        if self.device in self.bus.nodes:
            self.bus.power_off(self.device)
            self.bus.power_on(self.device)
        else:
            self.bus.add_node(self.device)
        self.node.nmt.wait_for_bootup(BOOT_UP_S)

    @property
    def entries(self) -> list[Entry]:
        """The entries that the device surely has."""
        return [it for it in self.spec.entries.values() if not it.reserved and not it.optional]

    @property
    def settings(self) -> list[Entry]:
        """The settings that are written with nothing else to be done before."""
        return [
            entry
            for entry in self.entries
            if entry.kind == "config"
            and entry.access == "rw"
            and entry.default is not None
            and not entry.writable_while
            and entry.index not in SET_BY_PROCEDURE
        ]

    def variable(self, entry: Entry) -> Any:
        """Return an entry as python-canopen has it, as a variable to read and write."""
        found = self.node.sdo[entry.index]
        return found[entry.sub] if entry.in_record else found

    def read(self, entry: Entry) -> Any:
        """Return what an entry holds."""
        return self.variable(entry).raw

    def stimulate(self, act: Callable[[SimulatedDevice], None]) -> None:
        """Do something to the device from outside."""
        self.bus.stimulate(self.device, act)

    def wait(self, until: Callable[[], object], timeout_s: float) -> bool:
        """Let time pass until something is so; return whether it is."""
        limit_ns = self.bus.now_ns + round(timeout_s * SECOND)
        self._step()
        while not until() and self.bus.advance(limit_ns):
            pass
        self._step()
        return bool(until())

    def _step(self) -> None:
        """Hand over what python-canopen has sent, and tell its timers the time."""
        self.bus.stimulate(self._participant, lambda _: None)

    def sleep(self, duration_s: float) -> None:
        self.wait(lambda: False, duration_s)


class _Queue:
    """Stands in for `queue.Queue`."""

    def __init__(self, master: Callable[[], Master]) -> None:
        self._master = master
        self._items: deque[Any] = deque()

    def put(self, item: Any) -> None:
        self._items.append(item)

    def empty(self) -> bool:
        return not self._items

    def get(self, block: bool = True, timeout: float = 0.0) -> Any:
        if not self._master().wait(lambda: self._items, timeout if block else 0.0):
            raise queue.Empty
        return self._items.popleft()


class _Condition:
    """Stands in for `threading.Condition`."""

    def __init__(self, master: Callable[[], Master]) -> None:
        self._master = master
        self._notified = False

    def __enter__(self) -> None:
        pass

    def __exit__(self, *_: object) -> None:
        pass

    def wait(self, timeout: float) -> bool:
        self._notified = False
        return self._master().wait(lambda: self._notified, timeout)

    def notify_all(self) -> None:
        self._notified = True


@contextmanager
def master_of(path: Path, variant: str | None = None) -> Iterator[Master]:
    """Return the master of a device that is still off."""
    made: list[Master] = []

    def master() -> Master:
        return made[0]

    def now_s() -> float:
        return master().now_s

    stands_in = {
        "queue": SimpleNamespace(Queue=lambda: _Queue(master), Empty=queue.Empty),
        "threading": SimpleNamespace(Condition=lambda: _Condition(master)),
        "time": SimpleNamespace(time=now_s, sleep=lambda duration_s: master().sleep(duration_s)),
    }
    with ExitStack() as stack:
        for module in WAITING:
            for name, substitute in stands_in.items():
                if name in vars(__import__(module, fromlist=["_"])):
                    stack.enter_context(mock.patch(f"{module}.{name}", substitute))
        stack.enter_context(mock.patch("can.Notifier", Notifier))
        made.append(Master(path, variant))
        yield made[0]
        made[0].network.disconnect()
