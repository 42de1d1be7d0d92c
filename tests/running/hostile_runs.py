"""Runs against a device that is meddled with: each in a process of its own, with its time and memory measured."""

from __future__ import annotations

import json
import os
import random
import resource
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import forked_command
from meddler import Meddler
from meddling import Mischief
from mischiefs import MISCHIEFS

from conformance import resources
from conformance.catalogue import load_checks
from conformance.spec.load import load_spec

MOST_CPU_S = 120
MOST_MEMORY_MB = 1024
ITEMS = 8


@dataclass(frozen=True)
class Hostile:
    """One hostile run.

    Args:
        kind: The mischief's name.
        seed: Its seed, and that of the choice of items.
        device: Name or path of the spec.
        select: What is judged; everything when empty.
    """

    kind: str
    seed: int
    device: str
    select: str = ""

    def __str__(self) -> str:
        return f"{self.kind} {self.seed} on {self.device}, {self.select or 'everything'}"


@dataclass(frozen=True)
class Ended:
    """How a hostile run ended.

    Args:
        code: Exit code; negative, the signal that ended it.
        cpu_s: Processor time.
        peak_mb: Most memory.
        meddled: Frames that were meddled with.
        illegal: Frames among them that no conforming device could have sent.
        everything: No SDO answer reached the bench as it was.
        folder: Where its record and output are.
    """

    code: int
    cpu_s: float
    peak_mb: float
    meddled: int
    illegal: int
    everything: bool
    folder: str


def catalogue_of(device: str) -> list[str]:
    """Return the ids of all items of a device."""
    spec = load_spec(resources.find("device_specs", device, "DEVICE")).resolve()
    return [
        f"{spec.name}/{requirement.id}/{case.label}"
        for requirement in load_checks().values()
        for case in requirement.cases(spec)
    ]


def choose(kind: str, seed: int, device: str, catalogue: Sequence[str]) -> Hostile:
    """Return a hostile run of some items of a catalogue, the services all as likely.

    Half of them have to do with the mischief, if there are any that have more to do with it than others.
    """
    draw = random.Random(f"{kind} {seed} {device}")  # noqa: S311 - repeatable
    services: dict[str, list[str]] = {}
    for item in catalogue:
        services.setdefault(item.split("/")[1].partition("-")[0], []).append(item)
    names = draw.choices(sorted(services), k=ITEMS)
    items = dict.fromkeys(draw.choice(services[name]) for name in names)
    prefers = MISCHIEFS[kind].prefers
    concerned = [it for it in catalogue if prefers and it.split("/")[1].startswith(prefers)]
    if concerned:
        items = dict.fromkeys((*list(items)[: ITEMS // 2], *draw.choices(concerned, k=ITEMS // 2)))
    return Hostile(kind, seed, device, " or ".join(items))


def carry_out(runs: Sequence[Hostile], folder: Path) -> None:
    """Carry out runs one after the other and write how they ended; for a process of its own."""
    warm_up(runs[0], folder / "first")
    ends = [
        in_own_process(run, MISCHIEFS[run.kind](run.seed), folder / str(number))
        for number, run in enumerate(runs)
    ]
    text = json.dumps([asdict(ended) for ended in ends])
    (folder / "ends.json").write_text(text, encoding="ascii")


def warm_up(run: Hostile, folder: Path) -> None:
    """Carry out a run that is not hostile in this process: what it loads its forks have."""
    with suppress(SystemExit):
        _command(run, folder)


def from_json(folder: Path) -> list[Ended]:
    """Return how the runs in a folder ended."""
    return [Ended(**it) for it in json.loads((folder / "ends.json").read_text("ascii"))]


def _command(run: Hostile, folder: Path) -> None:
    """Run the command in this process, with its record and what it prints in a folder to be made."""
    folder.mkdir(parents=True)
    arguments = ["run", run.device, "--report-dir", ".", "--select", run.select]
    forked_command.run(arguments, folder, folder / "out.txt", folder / "err.txt")


def _one(run: Hostile, mischief: Mischief, folder: Path) -> None:
    from conformance.simulator import channel, device  # noqa: PLC0415 - only what runs needs it

    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY_MB << 20, MOST_MEMORY_MB << 20))
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_CPU_S, MOST_CPU_S))
    witnesses = []

    def meddled(*arguments: Any, **options: Any) -> Meddler:
        made = Meddler(device.SimulatedDevice(*arguments, **options), mischief)
        witnesses.append(made.witness)
        return made

    setattr(channel, "SimulatedDevice", meddled)  # noqa: B010 - it has the shape, not the type
    try:
        _command(run, folder)
    finally:
        facts = {
            "meddled": mischief.count,
            "illegal": sum(witness.illegal for witness in witnesses),
            "everything": mischief.everything,
        }
        (folder / "facts.json").write_text(json.dumps(facts), encoding="ascii")


def in_own_process(run: Hostile, mischief: Mischief, folder: Path) -> Ended:
    """Carry out a run in a fork of this process."""
    pid = os.fork()
    if not pid:
        code = 99
        try:
            _one(run, mischief, folder)
        except SystemExit as left:
            code = int(left.code or 0)
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    _, status, usage = os.wait4(pid, 0)
    facts = folder / "facts.json"
    told = json.loads(facts.read_text("ascii")) if facts.exists() else {}
    return Ended(
        code=os.waitstatus_to_exitcode(status),
        cpu_s=usage.ru_utime + usage.ru_stime,
        peak_mb=usage.ru_maxrss / 1024,
        meddled=told.get("meddled", -1),
        illegal=told.get("illegal", -1),
        everything=told.get("everything", False),
        folder=str(folder),
    )
