"""No false alarm: on a device that conforms, however unusual it is, no item fails.

`unusual_devices.yaml` says in what they are unusual. Each device is judged by a share of the requirements,
another one each time, so that together they meet them all. Here a few of the devices have their turn;
`make unusual` takes all of them.
"""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count, cycle
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from ruamel.yaml import YAML

from conformance.catalogue import load_checks
from conformance.resources import find, names
from conformance.spec.load import load_spec

PART = int(os.environ.get("UNUSUAL_PART", "20"))
"""One device of so many is tried."""
SHARES = int(os.environ.get("UNUSUAL_SHARES", "20"))
"""A device meets one requirement of so many."""

YAML_ = YAML(typ="safe", pure=True)
LISTS = YAML_.load(Path(__file__).with_name("unusual_devices.yaml").read_text("utf-8"))
BENCH = YAML_.load(find("fixtures/benches", "simulator", "").read_text("utf-8"))
DEVICES = names("device_specs")
VARIANTS = {
    name: cycle(load_spec(find("device_specs", name, "")).variants)
    for name in names("device_specs")
}
REQUIREMENTS = sorted(load_checks())
Knobs: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True)
class Unusual:
    """A conforming device, and the bus it is on.

    Args:
        device: Name of its spec.
        what: In what it is unusual.
        inject: Knobs of its simulation.
        options: Of the simulated bus.
        bitrate: In bit/s; the factory's when None.
        node_id: The factory's when None.
        seed: Of everything random.
        variant: Of its spec.
        place: Decides which requirements it meets.
    """

    device: str
    what: str
    inject: Knobs = field(default_factory=dict)
    options: Knobs = field(default_factory=dict)
    bitrate: int | None = None
    node_id: int | None = None
    seed: int = 0
    variant: str = ""
    place: int = 0

    def __str__(self) -> str:
        return f"{self.place} {self.device} {self.variant}: {self.what}"

    @property
    def select(self) -> str:
        mine = (it for n, it in enumerate(REQUIREMENTS) if (n + self.place) % SHARES == 0)
        return " or ".join(mine)

    @property
    def may_stay_open(self) -> bool:
        """Frames may come too late to tell times; LSS has no code for 100 kbit/s."""
        late = "load" in self.options or self.inject.get("sdo_answer_delay_ms", 0) > 10
        return late or self.bitrate == 100_000

    def write_bench(self, path: Path) -> None:
        options = {**BENCH["options"], **self.options}
        bench = {**BENCH, "options": options}
        if self.bitrate is not None:
            bench["bitrate"] = options["device_bitrate"] = self.bitrate
        if "load" in options:
            bench["allow"] = [effect for effect in BENCH["allow"] if effect != "bitrate"]
        with path.open("w", encoding="utf-8") as file:
            YAML_.dump(bench, file)

    def write_fault(self, path: Path) -> None:
        with path.open("w", encoding="utf-8") as file:
            YAML_.dump({"format": 1, "what": self.what, "inject": dict(self.inject)}, file)


def _alone() -> Iterator[Unusual]:
    """Return devices that are unusual in one thing."""
    for device in DEVICES:
        for what, inject in LISTS["habits"].items():
            yield Unusual(device, what, inject)
        for what, changes in LISTS["objects"].items():
            yield Unusual(device, what, {"changes": changes})
        for serial in LISTS["serial_numbers"]:
            yield Unusual(device, f"serial number {serial}", options={"serial_number": serial})
        for what, changes in LISTS["versions"].get(device, {}).items():
            yield Unusual(device, what, {"changes": changes})
        for rate in LISTS["bit_rates"][device]:
            yield Unusual(device, f"{rate} bit/s", bitrate=rate)
        for load in LISTS["loads"]:
            for seed in (1, 2):
                yield Unusual(device, f"load {load}", options={"load": load}, seed=seed)
    for node_id, device in zip(range(1, 128), cycle(DEVICES), strict=False):
        yield Unusual(device, f"node-ID {node_id}", node_id=node_id)


def _combined() -> Iterator[Unusual]:
    """Return devices that are unusual in up to five things."""
    draw = random.Random("unusual")  # noqa: S311 - the same ones each time
    for device, seed in zip(cycle(DEVICES), range(LISTS["combined"]), strict=False):
        habit = draw.choice(list(LISTS["habits"].values()))
        changes = draw.choice(list(LISTS["objects"].values()))
        options = {"serial_number": draw.choice(LISTS["serial_numbers"])}
        if draw.random() < 0.5:
            options["load"] = draw.choice(LISTS["loads"])
        rates = [it for it in LISTS["bit_rates"][device] if it >= 100_000]
        yield Unusual(
            device,
            f"combination {seed}",
            {**habit, "changes": changes},
            options,
            draw.choice(rates),
            draw.randrange(1, 128),
            seed,
        )


def _all() -> list[Unusual]:
    places = count()
    return [
        replace(it, place=next(places), variant=next(VARIANTS[it.device]))
        for it in (*_alone(), *_combined())
    ]


UNUSUAL = _all()


def test_there_are_enough_of_them() -> None:
    assert len({str(it) for it in UNUSUAL}) == len(UNUSUAL) >= 300


@pytest.mark.parametrize("unusual", UNUSUAL[::PART], ids=str)
def test_a_conforming_device_fails_nothing(
    unusual: Unusual, judge: Callable[..., Any], tmp_path: Path
) -> None:
    bench, fault = tmp_path / "bench.yaml", tmp_path / "fault.yaml"
    unusual.write_bench(bench)
    unusual.write_fault(fault)
    node_id = () if unusual.node_id is None else ("--node-id", str(unusual.node_id))

    finished = judge(
        *("--variant", unusual.variant, "--bench", bench, "--fault", fault, *node_id),
        *("--seed", str(unusual.seed), "--select", unusual.select),
        device=unusual.device,
    )

    assert finished.items("fail") == [], finished.out
    assert unusual.may_stay_open or finished.items("inconclusive") == [], finished.out
    assert finished.code in ((0, 2) if unusual.may_stay_open else (0,)), finished.out
