"""The walk over an object dictionary: what it finds, and that it ends whatever the node does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

import pytest

from conformance import scanning
from conformance.bench.definition import load_bench
from conformance.bench.services import scan
from conformance.bench.session import Bench
from conformance.report.scanned import Scanned, area_of, as_text, guessed_type
from conformance.resources import data
from conformance.spec.load import load_spec

Walk: TypeAlias = Callable[..., tuple[Scanned, str]]
SPEC = data("device_specs") / "siko_ims360.yaml"
INDICES = 0x2100
HIDDEN = """
  0x0005:
    {name: Dummy, type: UNSIGNED32, access: ro, kind: constant, default: 8, source: "0"}
  0x20F0:
    {name: Word, type: UNSIGNED32, access: rw, kind: config, default: 0xDEADBEEF, source: "0"}
  0x20F1:
    {name: Text, type: VISIBLE_STRING, access: ro, kind: constant, default: "night [/]", source: "0"}
  0x20F2:
    {name: Key, type: UNSIGNED16, access: wo, kind: command, source: "0"}
"""


@pytest.fixture
def hidden(tmp_path: Path) -> Path:
    """A device with four objects that its manual does not name."""
    text = SPEC.read_text(encoding="utf-8")
    before, _, after = text.partition("\nobjects:\n")
    path = tmp_path / "hidden.yaml"
    path.write_text(f"{before}\nobjects:{HIDDEN}{after}", encoding="utf-8")
    return path


@pytest.fixture
def walk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Walk]:
    """Walk over the first indices of a simulated device."""
    monkeypatch.setattr(scan, "INDICES", INDICES)
    opened: list[Bench] = []

    def do(
        model: Path = SPEC,
        *faults: str,
        tell: scanning.ScanProgress | None = None,
        kept: list[Scanned] | None = None,
    ) -> tuple[Scanned, str]:
        definition = load_bench(Path(data("fixtures/benches")) / "simulator.yaml")
        simulation = {"channel": str(model), "faults": list(faults)}
        bench = Bench.open(definition, load_spec(SPEC).resolve(None), simulation, None)
        opened.append(bench)
        bench.find_node()
        kept = [] if kept is None else kept
        ended = scanning.scan(bench, kept.append, tell)
        return kept[-1], ended

    yield do
    for bench in opened:
        bench.close()


def test_nothing_is_found_on_a_device_as_documented(walk: Walk) -> None:
    scanned, ended = walk()

    assert (scanned.undocumented, scanned.complete, ended) == ((), True, "")
    assert scanned.indices == INDICES
    assert scanned.uploads > INDICES


def test_what_is_not_documented_is_told_with_what_it_holds(walk: Walk, hidden: Path) -> None:
    scanned, ended = walk(hidden)

    assert (scanned.complete, ended) == (True, "")
    assert [str(found) for found in scanned.undocumented] == [
        "0005h (data types): 4 octets, INTEGER32, UNSIGNED32 or REAL32, 08 00 00 00",
        "20F0h (manufacturer-specific): 4 octets, INTEGER32, UNSIGNED32 or REAL32, EF BE AD DE",
        "20F1h (manufacturer-specific): 9 octets, a text, 6E 69 67 68 74 20 5B 2F 5D, 'night [/]'",
        "20F2h (manufacturer-specific): abort 0601 0001h attempt to read a write-only object",
    ]


def test_another_sub_index_of_a_documented_object_is_found(walk: Walk, tmp_path: Path) -> None:
    text = SPEC.read_text(encoding="utf-8")
    start = text.index("\n  0x1018:\n")
    place = text.index("\n      1:", start)
    ninth = "\n      9: {name: Ninth, type: UNSIGNED8, access: ro, kind: constant, default: 1}"
    path = tmp_path / "more.yaml"
    head = text[start:place].replace("default: 4", "default: 9")
    path.write_text(text[:start] + head + ninth + text[place:], encoding="utf-8")

    scanned, _ = walk(path)

    assert [found.object for found in scanned.undocumented] == ["1018h:09"]


def test_a_value_that_never_ends_is_read_so_far(walk: Walk, hidden: Path) -> None:
    scanned, ended = walk(hidden, "sdo-never-ends")

    assert (scanned.complete, ended) == (True, "")
    text = next(found for found in scanned.undocumented if found.object == "20F1h")
    assert (text.length, text.text) == (None, "night [/]")
    assert text.says == "upload still not complete after 9 octets in 1003 segments"


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("unknown-object-reads-zero", "1000 entries that are not documented are enough"),
        ("garbage", "1000 entries that are not documented are enough"),
        ("sdo-loses-answers", "no answer to 8 uploads, at last of"),
        ("dies-after-20-frames", "no answer to 8 uploads, at last of"),
    ],
)
def test_the_walk_ends_at_a_node_that_does_not_tell(walk: Walk, fault: str, reason: str) -> None:
    scanned, ended = walk(SPEC, fault)

    assert not scanned.complete
    assert ended.startswith(reason)
    assert scanned.ended == ended


def test_any_abort_by_which_a_node_says_no_is_learnt(walk: Walk) -> None:
    scanned, ended = walk(SPEC, "sdo-wrong-abort-code")

    assert (scanned.undocumented, scanned.complete, ended) == ((), True, "")
    assert "0504 0005h out of memory" in scanned.absent


def test_an_interrupted_walk_is_kept(
    walk: Walk, hidden: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[Scanned] = []
    seen: list[tuple[int, int, int]] = []

    def interrupt(done: int, total: int, found: int) -> None:
        seen.append((done, total, found))
        raise KeyboardInterrupt

    monkeypatch.setattr(scanning, "TELL_EVERY_S", 0.0)
    with pytest.raises(KeyboardInterrupt):
        walk(hidden, tell=interrupt, kept=kept)
    assert seen == [(3, INDICES + 2, 0)]
    assert (kept[-1].indices, kept[-1].complete) == (0, False)


@pytest.mark.parametrize(
    ("index", "area"),
    [
        (0x0000, "reserved"),
        (0x0001, "data types"),
        (0x025F, "data types"),
        (0x0260, "reserved"),
        (0x1000, "communication profile"),
        (0x5FFF, "manufacturer-specific"),
        (0x9FFF, "device profile"),
        (0xA000, "network variables"),
        (0xBFFF, "system variables"),
        (0xFFFF, "reserved"),
    ],
)
def test_the_areas_are_those_of_the_standard(index: int, area: str) -> None:
    assert area_of(index) == area


@pytest.mark.parametrize(
    ("data", "text", "guess"),
    [
        (b"A", "", "BOOLEAN, INTEGER8 or UNSIGNED8"),
        (b"evas", "evas", "INTEGER32, UNSIGNED32 or REAL32"),
        (b"abcde\0\0\0\0", "abcde", "a text"),
        (b"HW 1.02a", "HW 1.02a", "a text"),
        (bytes(8), "", "INTEGER64, UNSIGNED64 or REAL64"),
        (b"\x1b[31m red", "", "a text, an array of octets"),
        (b"", "", "a text, an array of octets"),
    ],
)
def test_a_type_is_guessed_from_the_length(data: bytes, text: str, guess: str) -> None:
    assert as_text(data) == text
    assert guessed_type(data) == guess
