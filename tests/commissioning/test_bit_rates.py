"""Another bit rate for sensors that share a bus: no frame is destroyed by one that is at another already."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeAlias, cast

import pytest

from conformance.bench.definition import BenchDefinition
from conformance.bench.node.reach import Place
from conformance.bench.session import Bench
from conformance.bench.surroundings.operator import SimulatedOperator
from conformance.commissioning.by_lss import ByLss
from conformance.commissioning.giving import NONE_RESTARTED, Giving, Trip
from conformance.commissioning.procedure import Procedure
from conformance.commissioning.record import Record, Unit
from conformance.errors import BenchError, SetupRefused
from conformance.resources import find
from conformance.simulator.bus import SimulatedBus
from conformance.simulator.interface import SimulatorBus
from conformance.spec.load import load_spec
from conformance.wire.frame import Frame

SERIALS = [1000, 1001, 1002]
IMS, GIM, DST = "siko_ims360", "baumer_gim140r", "danfoss_dst_x730"
IDS = range(10, 20)
FAST = 500_000

OpenBench: TypeAlias = Callable[..., Bench]


@pytest.fixture
def destroyed(monkeypatch: pytest.MonkeyPatch) -> list[Frame]:
    """Return the frames that a sensor at another bit rate destroyed, as it does on copper."""
    frames: list[Frame] = []
    end_frame = SimulatedBus._end_frame

    def end(bus: SimulatedBus) -> None:
        others = {node.bitrate for node in bus.nodes if node.powered} - {bus._frame_bitrate}
        if others:
            frames.append(bus._frame)
            bus._sender = None
            return
        end_frame(bus)

    monkeypatch.setattr(SimulatedBus, "_end_frame", end)
    return frames


@pytest.fixture
def opened(destroyed: list[Frame]) -> Iterator[OpenBench]:
    """Open a bench with three devices of a kind, all with the factory's node-ID."""
    benches: list[Bench] = []

    def open_it(path: Path, *, faults: str = "") -> Bench:
        definition = BenchDefinition.model_validate(
            {
                "format": 1,
                "what": "Sensors fresh from the box.",
                "interface": "canopen_simulator",
                "operator": "simulator",
                "allow": ["reads", "writes", "resets"],
                "options": {"serial_number": SERIALS[0], "faults": faults},
                "channel": ",".join([str(path)] * 3),
            }
        )
        benches.append(Bench.open(definition, load_spec(path).resolve(), {}, None))
        benches[-1].operator = OneAtATime(benches[-1])
        return benches[-1]

    yield open_it
    for bench in benches:
        bench.close()
    assert not destroyed


class OneAtATime(SimulatedOperator):
    """Connects the sensor that is asked for, and no other."""

    def __init__(self, bench: Bench) -> None:
        super().__init__(bench.link, rig_of(bench))
        self._bench = bench
        self.asked: list[str] = []

    def connect(self, nth: int, what: str, /) -> bool:
        self.asked.append(what)
        return connect(self._bench, *SERIALS[nth - 1 : nth])


def connect(bench: Bench, *serials: int) -> bool:
    """Supply these sensors and no other; tell whether there is any."""
    with rig_of(bench).present() as bus:
        for node in bus.nodes:
            (bus.power_on if node.memory.serial_number in serials else bus.power_off)(node)
    bench.link.listen(1.0, lambda _: False)
    return bool(serials)


def rig_of(bench: Bench) -> SimulatorBus:
    return cast("SimulatorBus", bench.link.rig)


def held(bench: Bench) -> list[dict[str, Any]]:
    return [{**it, "memory": None} for it in rig_of(bench).held()]


def places(bench: Bench) -> list[tuple[int, int]]:
    return [(it["node_id"], it["bitrate"]) for it in held(bench)]


def procedure(bench: Bench, record: Record, folder: Path) -> Procedure:
    return Procedure(bench, record, folder / "commission.json")


def fresh() -> Record:
    return Record(device="", variant="", bench="")


def spec(device: str) -> Path:
    return find("device_specs", device, "DEVICE")


@pytest.mark.parametrize(("device", "serials"), [(IMS, SERIALS), (GIM, SERIALS), (GIM, [])])
def test_all_are_switched_at_the_same_moment_and_back(
    device: str, serials: list[int], opened: OpenBench, tmp_path: Path
) -> None:
    bench, record = opened(spec(device)), fresh()
    before = held(bench)

    assert procedure(bench, record, tmp_path).all_at_once(serials, IDS, FAST) == []

    assert places(bench) == [(10, FAST), (11, FAST), (12, FAST)]
    assert {unit.state for unit in record.units} == {"given"}
    assert procedure(bench, record, tmp_path).back(one_by_one=False) == []
    assert held(bench) == before
    assert {unit.state for unit in record.units} == {"undone"}


@pytest.mark.parametrize("refuses", SERIALS)
def test_none_is_switched_where_one_refuses(
    refuses: int, opened: OpenBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, record = opened(spec(IMS)), fresh()
    before, configure = held(bench), ByLss.configure

    def refusing(way: ByLss, unit: Unit, start: Place, to: Place, *, rate: bool) -> Place:
        here = configure(way, unit, start, to, rate=rate)
        if unit.serial == refuses and to.bitrate == FAST:
            raise SetupRefused(f"{unit} does not confirm the store")
        return here

    monkeypatch.setattr(ByLss, "configure", refusing)

    wrong = procedure(bench, record, tmp_path).all_at_once(SERIALS, IDS, FAST)

    assert wrong[0] == f"serial {refuses} does not confirm the store"
    assert wrong[1:] == [NONE_RESTARTED]
    assert places(bench) == [(10, 125_000), (11, 125_000), (12, 125_000)]
    assert {it["memory"]["bitrate"] for it in rig_of(bench).held()} == {125_000}
    assert procedure(bench, record, tmp_path).back(one_by_one=False) == []
    assert held(bench) == before


def test_nothing_is_changed_where_somebody_would_stay_at_the_bit_rate(
    opened: OpenBench, tmp_path: Path
) -> None:
    bench = opened(spec(IMS))
    procedure(bench, fresh(), tmp_path).all_at_once([1000], [5], 125_000)
    before = held(bench)

    with pytest.raises(BenchError, match="somebody answers as node-ID 5 and would stay at 125 kb"):
        procedure(bench, fresh(), tmp_path).all_at_once([1001, 1002], IDS, FAST)

    assert held(bench) == before


def test_nobody_is_switched_while_one_is_left_whose_serial_number_nobody_gave(
    opened: OpenBench, tmp_path: Path
) -> None:
    bench, record = opened(spec(IMS)), fresh()
    before = held(bench)

    wrong = procedure(bench, record, tmp_path).all_at_once(SERIALS[:2], IDS, FAST)

    assert wrong[0].startswith("a sensor is still node-ID 50 at 125 kbit/s, and tells nobody its")
    assert wrong[1].startswith("the bit rate was left as it is")
    assert places(bench) == [(10, 125_000), (11, 125_000), (50, 125_000)]
    assert procedure(bench, record, tmp_path).back(one_by_one=False) == []
    assert held(bench) == before


def test_somebody_who_came_meanwhile_keeps_all_from_going_back(
    opened: OpenBench, tmp_path: Path
) -> None:
    bench, record = opened(spec(IMS)), fresh()
    procedure(bench, record, tmp_path).all_at_once(SERIALS, IDS, FAST)
    record.units.pop()  # it is nobody's now

    wrong = procedure(bench, record, tmp_path).back(one_by_one=False)

    assert len(wrong) == 1
    assert wrong[0].startswith("somebody answers as node-ID 12 and would stay at 500 kbit/s")
    assert places(bench) == [(10, FAST), (11, FAST), (12, FAST)]


def test_a_bit_rate_that_the_adapter_does_not_take_changes_nothing(
    opened: OpenBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = opened(spec(IMS))
    before = held(bench)

    def refuse(bitrate: int) -> None:
        raise BenchError(f"cannot open the bus at {bitrate}")

    monkeypatch.setattr(bench.link, "use_bitrate", refuse)

    with pytest.raises(BenchError, match="the adapter does not take 500 kbit/s"):
        procedure(bench, fresh(), tmp_path).all_at_once(SERIALS, IDS, FAST)

    assert held(bench) == before


def test_without_lss_what_acts_at_a_reset_goes_back_at_the_same_moment(
    opened: OpenBench, tmp_path: Path
) -> None:
    bench, record = opened(spec(DST)), fresh()
    before = held(bench)
    assert procedure(bench, record, tmp_path).one_by_one(IDS, FAST) == []
    assert places(bench) == [(10, FAST), (11, FAST), (12, FAST)]
    connect(bench, *SERIALS)

    assert procedure(bench, record, tmp_path).back(one_by_one=False) == []

    assert held(bench) == before


def without_lss(folder: Path, effective: str) -> Path:
    """Return the spec of a device whose LSS gives nothing, and whose bit rate acts at some moment."""
    path = folder / "without_lss.yaml"
    text, cut = re.subn(r"\n      - configure-node-id\n", "\n", spec(IMS).read_text("utf-8"))
    text, changed = re.subn(r"(bitrate: .*effective: )[a-z-]+", rf"\g<1>{effective}", text)
    assert cut == changed == 1
    path.write_text(text, "utf-8")
    return path


def test_what_acts_at_once_goes_back_one_after_the_other(opened: OpenBench, tmp_path: Path) -> None:
    bench, record = opened(without_lss(tmp_path, "at-once")), fresh()
    before = held(bench)
    assert procedure(bench, record, tmp_path).one_by_one(IDS, FAST) == []
    connect(bench, *SERIALS)
    person = cast("OneAtATime", bench.operator)
    person.asked.clear()

    assert procedure(bench, record, tmp_path).back(one_by_one=False) == []

    assert person.asked == [
        f"serial {serial} and no other (it is expected as node-ID {node_id} at 500 kbit/s)"
        for serial, node_id in zip(SERIALS, IDS, strict=False)
    ]
    connect(bench, *SERIALS)
    assert held(bench) == before


def test_what_acts_at_once_against_its_manual_stops_the_others(
    opened: OpenBench, tmp_path: Path, destroyed: list[Frame]
) -> None:
    path = without_lss(tmp_path, "after-store-and-reset")
    bench, record = opened(path, faults="bit-rate-at-once"), fresh()
    before = held(bench)
    assert procedure(bench, record, tmp_path).one_by_one(IDS, FAST) == []
    connect(bench, *SERIALS)

    wrong = procedure(bench, record, tmp_path).back(one_by_one=False)

    assert wrong[-1] == NONE_RESTARTED
    assert places(bench)[1:] == [(11, FAST), (12, FAST)]
    assert procedure(bench, record, tmp_path).back(one_by_one=True) == []
    connect(bench, *SERIALS)
    assert held(bench) == before
    assert destroyed
    destroyed.clear()  # it could not be known


@pytest.mark.parametrize("device", [IMS, GIM])
def test_sensors_that_were_told_and_not_restarted_are_brought_back(
    device: str, opened: OpenBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, record = opened(spec(device)), fresh()
    before, given = held(bench), procedure(bench, record, tmp_path)

    def pull_the_plug(_: Giving, *_places: object, **_how: object) -> None:
        raise BenchError("the plug was pulled")

    with monkeypatch.context() as broken:
        broken.setattr(Giving, "_restart", pull_the_plug)
        with pytest.raises(BenchError, match="the plug was pulled"):
            given.all_at_once(SERIALS, IDS, FAST)
    assert procedure(bench, record, tmp_path).back(one_by_one=False) == []
    assert held(bench) == before

    restart = Giving._restart

    def pull_it_later(
        giving: Giving, places: set[Place], trips: Sequence[Trip], *, everybody: bool = False
    ) -> list[Trip]:
        if everybody:
            raise BenchError("the plug was pulled")
        return restart(giving, places, trips)

    record = fresh()
    with monkeypatch.context() as broken:
        broken.setattr(Giving, "_restart", pull_it_later)
        with pytest.raises(BenchError, match="the plug was pulled"):
            procedure(bench, record, tmp_path).all_at_once(SERIALS, IDS, FAST)
    assert {it["memory"]["bitrate"] for it in rig_of(bench).held()} == {FAST}
    assert procedure(bench, record, tmp_path).back(one_by_one=False) == []
    assert held(bench) == before
    assert {it["memory"]["bitrate"] for it in rig_of(bench).held()} == {before[0]["bitrate"]}
