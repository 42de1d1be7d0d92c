"""Marker frames: any trace of the bus can be cut by check, and nobody takes them for something else."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from conformance.bench.bus.markers import CODES, require_free, require_not_held
from conformance.errors import BenchError, SpecError
from conformance.report.results import VERDICTS
from conformance.resources import data
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec

BENCH = """format: 1
what: The simulated device, with marks.
interface: canopen_simulator
options: {{clock: virtual}}
power: simulator
allow: [reads, writes, resets]
markers: {can_id}
"""
LINE = re.compile(r"\((?P<time>\S+)\) \S+ 7F0#(?P<data>[0-9A-F]{12})")


@pytest.fixture
def judged(judge: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    def run(can_id: int, *arguments: str) -> Any:
        path = tmp_path / "bench.yaml"
        path.write_text(BENCH.format(can_id=can_id))
        return judge("--bench", path, *arguments)

    return run


@pytest.fixture(scope="module")
def spec() -> DeviceSpec:
    return load_spec(data("device_specs") / "siko_ims360.yaml").resolve()


def test_a_trace_is_cut_by_its_marks(judged: Callable[..., Any]) -> None:
    done = judged(
        0x7F0, "--select", "OD-15 or HB-01 or STO-01", "--fault", "heartbeat-double-period"
    )

    items = done.record["items"]
    by_number = {item["marker"]: item for item in items if item["marker"]}
    assert done.record["run"]["markers"] == 0x7F0
    lines = (done.folder / "trace.log").read_text().splitlines()
    marks = [
        (place, bytes.fromhex(found["data"]))
        for place, line in enumerate(lines, 1)
        if (found := LINE.match(line))
    ]
    begun = {int.from_bytes(it[:4], "little"): place for place, it in marks if it[4:] == b"\0\0"}
    ended = {int.from_bytes(it[:4], "little"): (place, it[5]) for place, it in marks if it[4] == 1}
    assert len(marks) == 2 * len(by_number)
    assert begun.keys() == ended.keys() == by_number.keys()
    for number, item in by_number.items():
        first, last = (int(it) for it in item["trace"].removeprefix("trace.log:").split("-"))
        assert begun[number] < first <= last < ended[number][0]
        assert ended[number][1] == CODES[item["verdict"]]
    assert {item["verdict"] for item in by_number.values()} >= {"pass", "fail"}
    assert all(not it["marker"] for it in items if it["verdict"] == "skipped")


def test_marks_change_no_verdict(judged: Callable[..., Any]) -> None:
    done = judged(0x7F0, "--select", "HB or NMT or SYNC or TPDO-01 or EMCY")
    assert done.code == 0, done.out


def test_without_marks_there_are_none(judge: Callable[..., Any]) -> None:
    done = judge("--select", "OD-15")
    assert {item["marker"] for item in done.record["items"]} == {0}
    assert "markers" not in done.record["run"]


def test_there_is_a_code_for_every_verdict() -> None:
    assert tuple(CODES) == VERDICTS
    assert sorted(CODES.values()) == [1, 2, 3, 4, 5]


@pytest.mark.parametrize(
    ("can_id", "use"),
    [
        (0x000, "NMT"),
        (0x080, "SYNC"),
        (0x100, "TIME"),
        (0x7E4, "LSS"),
        (0x7E5, "LSS"),
        (0x581, "SDO or heartbeat"),
        (0x67F, "SDO or heartbeat"),
        (0x732, "SDO or heartbeat"),
        (0x0B2, "EMCY or a PDO of this node"),
        (0x1B2, "EMCY or a PDO of this node"),
        (0x532, "EMCY or a PDO of this node"),
    ],
)
def test_an_identifier_in_use_is_refused(spec: DeviceSpec, can_id: int, use: str) -> None:
    assert spec.node_id == 0x32
    with pytest.raises(SpecError) as refused:
        require_free(can_id, spec)
    said = f"markers: expected a CAN-ID that nothing uses, got {can_id:03X}h, which is for {use}"
    assert str(refused.value) == said


def test_an_identifier_that_nothing_uses_is_free(spec: DeviceSpec) -> None:
    for can_id in (0x7F0, 0x6F0, 0x001, 0x7FF):
        require_free(can_id, spec)


def test_what_the_manual_gives_another_identifier_is_seen() -> None:
    entry = Mock(index=0x1800, sub=1, default=0x4000_06E5, address="1800h:01")
    other = Mock(node_id=1, entries={(0x1800, 1): entry})
    with pytest.raises(SpecError, match=r"6E5h, which is for what 1800h:01 of this node says"):
        require_free(0x6E5, other)
    entry.default |= 1 << 31
    require_free(0x6E5, other)


def test_what_the_node_holds_counts_as_well(spec: DeviceSpec) -> None:
    held = {(0x1800, 1): (0x4000_06E5).to_bytes(4, "little"), (0x1017, 0): b"\xe6\x06"}
    with pytest.raises(BenchError, match=r"the node uses 6E5h by its 1800h:01"):
        require_not_held(0x6E5, spec, held)
    require_not_held(0x6E6, spec, held)


def test_a_bench_with_such_an_identifier_is_wrong_usage(judged: Callable[..., Any]) -> None:
    done = judged(0x080)
    assert done.code == 3
    assert "markers: expected a CAN-ID that nothing uses, got 080h, which is for SYNC" in done.err


def test_an_identifier_has_eleven_bits(judged: Callable[..., Any]) -> None:
    done = judged(0x800)
    assert done.code == 3
    assert "markers: expected at most 2047, got 2048" in done.err
