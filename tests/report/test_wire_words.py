"""What recorded frames say, in words, and which of them are shown."""

from __future__ import annotations

from pathlib import Path

import pytest

from conformance.report.frames import MOST_FRAMES, TraceFile
from conformance.report.wire_words import WireWords
from conformance.wire.frame import Frame

SAID = [
    ("000#8132", "NMT to node 50: reset node"),
    ("000#0100", "NMT to all nodes: start"),
    ("000#0732", "NMT to node 50: reserved command 07h"),
    ("000#01", "NMT request: expected 2 bytes, got 1 (01)"),
    ("080#", "SYNC"),
    ("080#05", "SYNC, counter 5"),
    ("100#0000000000", "TIME"),
    ("732#00", "node 50: boot-up"),
    ("732#05", "node 50: heartbeat, Operational"),
    ("732#R1", "node guarding: asks node 50 for its state"),
    ("632#4018100100000000", "to node 50: SDO request: read 1018h:01"),
    ("5B2#4318100195010000", "node 50: SDO response: 1018h:01 holds 95 01 00 00 (405)"),
    ("5B2#4108100006000000", "node 50: SDO response: 1008h:00 holds 6 octets, in segments"),
    ("5B2#03494D5333363000", "node 50: SDO response: segment, the last: 49 4D 53 33 36 30 ('IMS360')"),
    ("632#2B17100064000000", "to node 50: SDO request: write 1017h:00: 64 00 (100)"),
    ("5B2#6017100000000000", "node 50: SDO response: 1017h:00 written"),
    (
        "5B2#8000200000000206",
        "node 50: SDO response: abort of 2000h:00: 0602 0000h object does not exist",
    ),
    ("632#E000000000000000", "to node 50: SDO request: expected a known command, got E0 00 00 00 00 00 00 00"),
    ("7E5#0401000000000000", "LSS master: switch state global, mode 1"),
    ("7E4#5E32000000000000", "LSS slave: inquire reply, command 5Eh (inquire node id), value 50"),
    ("1B2#0000", "CAN-ID of TPDO1 of node 50 by default"),
    ("4B2#R8", "asks for what has the CAN-ID of TPDO4 of node 50 by default"),
    ("232#00", "CAN-ID of RPDO1 of node 50 by default"),
    (
        "0B2#2081110000000000",
        "CAN-ID of the EMCY of node 50 by default: error 8120h, error register 11h, 00 00 00 00 00",
    ),
    ("6E0#55", ""),
    ("00000732#00", ""),
]  # fmt: skip


def frame(text: str) -> Frame:
    can_id, _, data = text.partition("#")
    remote = data.startswith("R")
    octets = b"" if remote else bytes.fromhex(data)
    return Frame(int(can_id, 16), octets, remote=remote, extended=len(can_id) == 8)


@pytest.mark.parametrize(("text", "words"), SAID, ids=[text for text, _ in SAID])
def test_what_a_frame_says(text: str, words: str) -> None:
    said = WireWords().of(frame(text))

    assert said.removeprefix("to node 50: ") == words.removeprefix("to node 50: ")


def test_the_segments_of_a_block_are_none_of_the_requests_they_look_like() -> None:
    words = WireWords()
    upload = ["632#A404100804000000", "5B2#C604100808000000", "632#A300000000000000"]
    segments = ["5B2#0141424344454647", "5B2#8248000000000000"]
    ends = ["632#A202080000000000", "5B2#D955550000000000", "632#A100000000000000"]

    said = [words.of(frame(text)) for text in (*upload, *segments, *ends)]

    assert said[3] == "node 50: segment 1 of a block: 41 42 43 44 45 46 47"
    assert said[4].startswith("node 50: segment 2 of a block, the last: 48")
    assert said[6].startswith("node 50: SDO response: block upload end reply")


def trace(folder: Path, *lines: str) -> TraceFile:
    (folder / "trace.log").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return TraceFile(folder / "trace.log")


def test_the_frames_of_an_item_are_told_from_its_set_up(tmp_path: Path) -> None:
    log = trace(
        tmp_path,
        "(0.5) can0 732#00 R",
        "(1.000000) can0 632#4017100000000000 T",
        "(1.250000) can0 732#7F R",
        "(1.500000) can0 732#7F R",
    )

    evidence = log.evidence("trace.log:2-4", 3, "1017h")

    assert evidence.note == ""
    assert [it.line for it in evidence.frames] == [2, 3, 4]
    assert [it.set_up for it in evidence.frames] == [True, False, False]
    assert [it.sent for it in evidence.frames] == [True, False, False]
    assert [it.after_ms for it in evidence.frames] == [None, None, 250.0]


def test_of_many_frames_those_about_the_object_are_shown(tmp_path: Path) -> None:
    other = ["(1.0) can0 732#7F R"] * MOST_FRAMES
    log = trace(tmp_path, *other, "(2.0) can0 632#4017100000000000 T", *other)

    about = log.evidence(f"trace.log:1-{2 * MOST_FRAMES + 1}", 1, "1017h/100ms")
    rest = log.evidence(f"trace.log:1-{2 * MOST_FRAMES + 1}", 1, "2000h")

    assert [it.line for it in about.frames] == [MOST_FRAMES + 1]
    assert "1 of 121 frames are shown: those that name 1017h" in about.note
    assert [it.line for it in rest.frames] == list(range(MOST_FRAMES + 2, 2 * MOST_FRAMES + 2))
    assert "the last ones" in rest.note


@pytest.mark.parametrize(
    ("place", "note"),
    [
        ("", "The item has no frames of its own."),
        ("trace.log:1-9", "the trace ends before line 9"),
        ("elsewhere", "The item has no frames of its own."),
    ],
)
def test_what_the_trace_does_not_hold_is_not_shown(place: str, note: str, tmp_path: Path) -> None:
    evidence = trace(tmp_path, "(0.5) can0 732#00 R").evidence(place, 1, "1017h")

    assert not evidence.frames
    assert note in evidence.note


@pytest.mark.parametrize(
    "line", ["", "(1.0) can0 7", "(1.0) can0 732#7 R", "(1.0) can0 FFF#00 R", "ÿ"]
)
def test_a_line_that_is_torn_is_shown_as_it_is(line: str, tmp_path: Path) -> None:
    (seen,) = trace(tmp_path, line, "(1.0) can0 732#00 R").evidence("trace.log:1-1", 1, "").frames

    assert seen.words.startswith("not a ")
