"""Trials in parallel: one process per core, each with a session of its own."""

from __future__ import annotations

import multiprocessing
import os
import queue
import signal
from collections.abc import Iterator, Sequence
from typing import TypeAlias

from conformance import runner
from conformance.errors import BenchError
from conformance.mutants.defect import Defect
from conformance.mutants.trial import Outcome, Round, TrialRun, Trials
from conformance.options import RunOptions

PATIENCE_S = 1.0
"""How often to look whether the processes still live."""

Task: TypeAlias = tuple[Defect, list[Round]]
Tasks: TypeAlias = "multiprocessing.Queue[Task | None]"
Told: TypeAlias = "multiprocessing.Queue[Outcome | str]"


def outcomes(
    options: RunOptions, tasks: Sequence[Task], processes: int | None, *, whole: bool
) -> Iterator[Outcome]:
    """Return what the suite says of each defect, as it becomes known.

    Args:
        options: What device, variant and seed.
        tasks: Each defect, and rounds of item ids.
        processes: How many at once; as many as there are cores when None.
        whole: All items of a round are run, also when enough was seen.

    Raises:
        BenchError: A process ended before its time.
    """
    context = multiprocessing.get_context("spawn")
    waiting: Tasks = context.Queue()
    told: Told = context.Queue()
    count = min(processes or os.cpu_count() or 1, max(len(tasks), 1))
    for task in (*tasks, *[None] * count):
        waiting.put(task)
    workers = [
        context.Process(target=_work, args=(options, waiting, told, whole), daemon=True)
        for _ in range(count)
    ]
    for worker in workers:
        worker.start()
    try:
        for _ in tasks:
            yield _next(told, workers)
        for worker in workers:
            worker.join()  # what ends by itself prints nothing
    finally:
        for worker in workers:
            worker.terminate()
            worker.join()


def _next(told: Told, workers: Sequence[multiprocessing.process.BaseProcess]) -> Outcome:
    while True:
        try:
            outcome = told.get(timeout=PATIENCE_S)
        except queue.Empty:
            if any(worker.exitcode for worker in workers):
                raise BenchError("a process of the trials ended before its time") from None
            continue
        if isinstance(outcome, str):
            raise BenchError(f"the trials ended early: {outcome}")
        return outcome


def _work(options: RunOptions, waiting: Tasks, told: Told, whole: bool) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends its processes itself
    run = TrialRun(options)
    errors = runner.play(run, Trials(run, _tasks(waiting), told.put, whole=whole))
    if errors or run.results.aborted:
        told.put(run.results.aborted or "\n".join(errors))


def _tasks(waiting: Tasks) -> Iterator[Task]:
    """Return the tasks as long as there are some, and somebody to hear of them."""
    parent = multiprocessing.parent_process()
    while parent is None or parent.is_alive():
        try:
            task = waiting.get(timeout=PATIENCE_S)
        except queue.Empty:
            continue
        if task is None:
            return
        yield task
