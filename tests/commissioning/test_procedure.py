"""Sensors fresh from the box on a simulated bus: given places, and brought back."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from conformance.bench.definition import BenchDefinition
from conformance.bench.session import Bench
from conformance.commissioning.procedure import Procedure
from conformance.commissioning.record import Record, load_record
from conformance.commissioning.searching import HIGHEST, Search, within
from conformance.errors import BenchError
from conformance.resources import find
from conformance.spec.load import load_spec

SERIALS = [1000, 1001, 1002]
BY_LSS = [("siko_ims360", SERIALS), ("baumer_gim140r", SERIALS), ("baumer_gim140r", [])]
DST = "danfoss_dst_x730"
ALL = ("siko_ims360", "baumer_gim140r", DST)
IDS = range(10, 20)

OpenBench = Callable[..., Bench]


@pytest.fixture
def opened() -> Iterator[OpenBench]:
    """Open a bench with devices of a kind, all with the factory's node-ID."""
    benches: list[Bench] = []

    def open_it(
        device: str,
        *,
        count: int = 3,
        first: int = SERIALS[0],
        power: str = "none",
        faults: str = "",
    ) -> Bench:
        path = str(find("device_specs", device, "device"))
        definition = BenchDefinition.model_validate(
            {
                "format": 1,
                "what": "Sensors fresh from the box.",
                "interface": "canopen_simulator",
                "operator": "simulator",
                "power": power,
                "allow": ["reads", "writes", "resets", "power"],
                "options": {"serial_number": first, "faults": faults},
                "channel": ",".join([path] * count),
            }
        )
        benches.append(Bench.open(definition, load_spec(Path(path)).resolve(), {}, None))
        return benches[-1]

    yield open_it
    for bench in benches:
        bench.close()


def rig_of(bench: Bench) -> Any:
    return bench.link.rig


def held(bench: Bench) -> list[Any]:
    return [{**it, "memory": None} for it in rig_of(bench).held()]


def places(bench: Bench) -> list[tuple[int, int]]:
    return [(it["node_id"], it["bitrate"]) for it in held(bench)]


def procedure(bench: Bench, record: Record, folder: Path) -> Procedure:
    return Procedure(bench, record, folder / "commission.json")


def fresh(device: str) -> Record:
    return Record(device=device, variant="", bench="")


@pytest.mark.parametrize(("device", "serials"), BY_LSS)
def test_all_at_once_and_back(
    device: str, serials: list[int], opened: OpenBench, tmp_path: Path
) -> None:
    bench, record = opened(device), fresh(device)
    before, home = held(bench), bench.reach.home

    assert procedure(bench, record, tmp_path).all_at_once(serials, IDS, home.bitrate) == []

    assert places(bench) == [(10, home.bitrate), (11, home.bitrate), (12, home.bitrate)]
    assert [unit.serial for unit in record.units] == SERIALS
    assert load_record(tmp_path / "commission.json") == record

    assert procedure(bench, record, tmp_path).back(one_by_one=False) == []
    assert held(bench) == before
    assert load_record(tmp_path / "commission.json").in_force == []


@pytest.mark.parametrize("device", ALL)
def test_one_by_one_with_another_bit_rate_and_back(
    device: str, opened: OpenBench, tmp_path: Path
) -> None:
    bench, record = opened(device), fresh(device)
    before = held(bench)

    assert procedure(bench, record, tmp_path).one_by_one(IDS, 500_000) == []

    assert places(bench) == [(10, 500_000), (11, 500_000), (12, 500_000)]
    assert procedure(bench, record, tmp_path).back(one_by_one=False) == []
    assert held(bench) == before


def test_a_serial_number_that_nobody_has(opened: OpenBench, tmp_path: Path) -> None:
    bench, record = opened("siko_ims360"), fresh("siko_ims360")

    wrong = procedure(bench, record, tmp_path).all_at_once([1001, 77], IDS, 125_000)

    assert [it.partition(" ")[0] for it in wrong] == ["serial", "a"]
    assert "serial 77 does not confirm" in wrong[0]
    assert "a sensor is still node-ID 50" in wrong[1]
    assert [unit.state for unit in record.units] == ["given", "planned"]
    assert [node_id for node_id, _ in places(bench)] == [50, 10, 50]


def test_node_ids_that_somebody_has_are_left_out(opened: OpenBench, tmp_path: Path) -> None:
    bench = opened("siko_ims360")
    procedure(bench, fresh(""), tmp_path).all_at_once([1000], [11], 125_000)

    procedure(bench, fresh(""), tmp_path).all_at_once([1001], [11, 50, 12], 125_000)

    assert [node_id for node_id, _ in places(bench)] == [11, 12, 50]


def test_too_few_node_ids_change_nothing(opened: OpenBench, tmp_path: Path) -> None:
    bench, record = opened("baumer_gim140r"), fresh("")

    with pytest.raises(BenchError, match="expected 3 free node-IDs, got 2"):
        procedure(bench, record, tmp_path).all_at_once([], [10, 11], 250_000)

    assert {node_id for node_id, _ in places(bench)} == {1}
    assert not record.units


@pytest.mark.parametrize("power", ["none", "simulator"])
def test_a_sensor_that_moves_at_a_power_cycle_alone(
    power: str, opened: OpenBench, tmp_path: Path
) -> None:
    bench = opened(DST, count=1, power=power, faults="services/node_id/effective=after-power-cycle")
    record = fresh(DST)

    wrong = procedure(bench, record, tmp_path).one_by_one(IDS, 250_000)

    if power == "none":
        assert "switch the supply off and on" in wrong[0]
        assert {unit.state for unit in record.units} == {"touched"}
    else:
        assert wrong == []
        assert [node_id for node_id, _ in places(bench)] == [10]


@pytest.mark.parametrize("count", [0, 1, 2, 9])
def test_the_search_finds_every_number(count: int) -> None:
    draw = random.Random(count)  # noqa: S311 - repeatable
    near = {draw.randrange(1000) for _ in range(count)}
    far = {draw.randrange(HIGHEST) for _ in range(count)}
    there = sorted({0, HIGHEST} | near | far if count else set())

    def is_any(low: int, high: int) -> bool:
        return any(low <= it <= high for it in there)

    assert list(within(0, HIGHEST, is_any)) == there


def test_a_late_answer_finds_nobody() -> None:
    """One yes too many leads down a branch in which nobody is."""
    asked: list[tuple[int, int]] = []

    def is_any(low: int, high: int) -> bool:
        asked.append((low, high))
        return low <= 700 <= high or len(asked) == 5

    assert list(within(0, HIGHEST, is_any)) == [700]


def test_another_sensor_in_the_place_of_one_is_not_touched(
    opened: OpenBench, tmp_path: Path
) -> None:
    record = fresh(DST)
    procedure(opened(DST, count=1), record, tmp_path).one_by_one(IDS, 250_000)
    bench = opened(DST, count=2, first=5)  # a bus of its own
    rig_of(bench).connect(1)
    before = held(bench)

    wrong = procedure(bench, record, tmp_path).back(one_by_one=False)

    assert wrong == ["serial 1000 is expected as node-ID 127 at 250 kbit/s, but serial 5 is there"]
    assert held(bench) == before
    assert [unit.state for unit in record.units] == ["given"]


def test_nobody_is_found_where_nobody_answers(opened: OpenBench) -> None:
    bench = opened(DST)  # has no LSS
    assert Search(bench.link, 0.1, 0x93, 0x64).addresses() == []
