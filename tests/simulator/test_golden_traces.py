"""The frames that the manuals print, replayed byte for byte (``fixtures/traces``)."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Final, Literal, Self, TypeAlias

import pytest
from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

from conformance.errors import SpecError
from conformance.resources import data
from conformance.simulator.device import SimulatedDevice
from conformance.spec.load import SpecFile, load_spec
from conformance.spec.model import Key
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import read_yaml
from conformance.wire import nmt, sdo
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtRequest

MS: Final = 1_000_000
PATIENCE_NS: Final = 1_000 * MS
"""How long an answer or a periodic frame may take."""
REST_NS: Final = 50 * MS
"""How long the device must be silent after the last line."""

UNMENDED: Final[dict[str, str]] = {}
"""Traces that the simulated device does not follow yet, and why."""

_FRAME: Final = re.compile(r"\(?[<>] ([0-9A-F]{3})#((?:[0-9A-F]{2}|\.\.){0,8})\)?")
_ACT: Final = re.compile(
    r"! (?:power-cycle|tilt(?: -?\d+\.\d+){2}|error(?:-gone)? 0x[0-9A-F]{4}|silence \d+)"
)
_PLACE: Final = re.compile(r"\{(\w+)\}")
_STATES: Final = {"operational": NmtCommand.START, "stopped": NmtCommand.STOP}

Text: TypeAlias = Annotated[str, StringConstraints(min_length=1)]
Number: TypeAlias = Annotated[int, Field(ge=1)]
Digits: TypeAlias = Annotated[str, StringConstraints(pattern=r"^[0-9A-F]+$")]


class Strict(BaseModel):
    """A mapping of a trace file; what it does not know is a mistake."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Given(Strict):
    """What holds before the first line; the world's quantities have their names in it."""

    tilt_x_deg: float | None = None
    tilt_y_deg: float | None = None
    rate_x_deg_s: float | None = None
    rate_y_deg_s: float | None = None
    rate_z_deg_s: float | None = None
    temperature_degc: float | None = None
    written: dict[int | str, int] = Field(default={})
    state: Literal["pre-operational", "operational", "stopped"] = "pre-operational"

    @property
    def world(self) -> dict[str, float]:
        return self.model_dump(exclude={"written", "state"}, exclude_none=True)


class Corrected(Strict):
    """A line that the manual prints otherwise."""

    frame: Number
    printed: Text
    ambiguities: Annotated[list[Text], Field(min_length=1)]
    why: Text


class NotReplayed(Strict):
    """An example that no bus can show."""

    source: Text
    printed: Text
    because: Text


class Trace(Strict):
    """One worked example."""

    id: Annotated[str, StringConstraints(pattern=r"^[a-z0-9.-]+$")]
    source: Text
    what: Text
    variant: Text | None = None
    node_id: Number | None = None
    readings: dict[str, Number] = Field(default={})
    given: Given = Given()
    fill: dict[str, Digits] = Field(default={})
    frames: Annotated[list[Text], Field(min_length=1)]
    bitrate_after: Number | None = None
    corrected: list[Corrected] = Field(default=[])

    @model_validator(mode="after")
    def _holds_together(self) -> Self:
        places = set(_PLACE.findall("".join(self.frames)))
        if places != set(self.fill):
            raise ValueError(f"expected fill for {sorted(places)}, got {sorted(self.fill)}")
        for line in self.lines:
            if not is_line(line):
                raise ValueError(f"expected a line as README.md has it, got {line!r}")
        for one in self.corrected:
            line = self.lines[one.frame - 1] if one.frame <= len(self.lines) else "no line"
            if not is_printed(line) or line[2:] == one.printed:
                raise ValueError(f"corrected {one.frame}: expected a printed frame, got {line!r}")
        return self

    @property
    def lines(self) -> list[str]:
        return [_PLACE.sub(lambda place: self.fill.get(place[1], "?"), it) for it in self.frames]

    @property
    def sdo_requests(self) -> Iterator[sdo.Request]:
        for line in self.lines:
            match = _FRAME.fullmatch(line)
            if match is not None and 0x600 < int(match[1], 16) < 0x680:
                yield sdo.decode_request(bytes.fromhex(match[2]))


class TraceFile(Strict):
    """The examples of one manual."""

    format: Literal[1]
    device: Text
    printed: Number
    traces: Annotated[list[Trace], Field(min_length=1)]
    not_replayed: list[NotReplayed] = Field(default=[])

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        ids = [trace.id for trace in self.traces]
        again = sorted({one for one in ids if ids.count(one) > 1})
        if again:
            raise ValueError(f"expected each id once, got {', '.join(again)} again")
        printed = sum(is_printed(line) for trace in self.traces for line in trace.lines)
        if printed != self.printed:
            raise ValueError(f"expected {self.printed} printed lines, got {printed}")
        return self


def is_line(line: str) -> bool:
    whole = line.startswith("(") == line.endswith(")")
    if _FRAME.fullmatch(line) is not None:
        return whole and not (">" in line and "." in line)
    return _ACT.fullmatch(line) is not None


def is_printed(line: str) -> bool:
    return line[0] in "<>"


def to_frame(can_id: str, digits: str) -> Frame:
    return Frame(int(can_id, 16), bytes.fromhex(digits))


def to_text(frame: Frame) -> str:
    return f"{frame.can_id:03X}#{frame.data.hex().upper()}"


def to_key(address: int | str) -> Key:
    index, _, sub = str(address).partition(":")
    return int(index, 0), int(sub or "0", 0)


def load_traces(path: Path) -> TraceFile:
    """Read a trace file.

    Raises:
        SpecError: It is wrong; a sentence with file and line for each mistake.
    """
    yaml = read_yaml(path)
    file, problems = validate(TraceFile, yaml)
    if file is None or yaml.problems:
        raise SpecError(*yaml.problems, *problems)
    return file


@cache
def spec_of(device: str) -> SpecFile:
    return load_spec(data("device_specs") / f"{device}.yaml")


FILES: Final = {
    path.stem: load_traces(path) for path in sorted(data("fixtures/traces").glob("*.yaml"))
}


@dataclass(frozen=True)
class Case:
    """One trace and the device it is for."""

    device: str
    trace: Trace

    def __str__(self) -> str:
        return f"{self.device}/{self.trace.id}"

    @property
    def spec_file(self) -> SpecFile:
        return spec_of(self.device)

    def build(self) -> SimulatedDevice:
        trace = self.trace
        return SimulatedDevice(
            self.spec_file,
            variant=trace.variant,
            node_id=trace.node_id,
            readings=trace.readings,
        )


CASES: Final = [Case(file.device, trace) for file in FILES.values() for trace in file.traces]
every_trace: Final = pytest.mark.parametrize("case", CASES, ids=str)


class Replay:
    """A simulated device without a bus, and the frames it has sent so far."""

    def __init__(self, case: Case) -> None:
        self.device = case.build()
        self._trace = case.trace
        self._now_ns = 0
        self._sent: deque[Frame] = deque()
        for name, value in case.trace.given.world.items():
            setattr(self.device.world, name, value)
        self.device.power_on(0)
        self._wait(PATIENCE_NS)
        for address, value in case.trace.given.written.items():
            self._sent.clear()
            self._write(to_key(address), value)
        command = _STATES.get(case.trace.given.state)
        if command is not None:
            self._take(nmt.encode_request(NmtRequest(command, self.device.node_id)))
        self._wait(REST_NS)
        self._sent.clear()

    def play_all(self) -> None:
        for line in self._trace.lines:
            self._play(line)
        self._expect_silence(REST_NS, before="the end")
        assert self.device.bitrate == self._trace.bitrate_after or not self._trace.bitrate_after

    def _play(self, line: str) -> None:
        match = _FRAME.fullmatch(line)
        if match is None:
            self._act(*line.split()[1:])
        elif ">" in line:
            self._expect_silence(2 * MS, before=line)
            self._take(to_frame(match[1], match[2]))
        else:
            self._expect(f"{match[1]}#{match[2]}")

    def _act(self, name: str, *values: str) -> None:
        device = self.device
        if name == "silence":
            self._expect_silence(int(values[0]) * MS, before="the next line")
        elif name == "power-cycle":
            self._expect_silence(PATIENCE_NS, before=name)
            device.power_off()
            self._wait(REST_NS)
            device.power_on(self._now_ns)
        elif name == "tilt":
            device.world.tilt_x_deg, device.world.tilt_y_deg = map(float, values)
            device.world_changed()
        elif name == "error":
            device.raise_error(int(values[0], 16))
        else:
            device.clear_error(int(values[0], 16))
        self._take()

    def _write(self, key: Key, value: int) -> None:
        entry = self.device.spec.entry(*key)
        assert entry is not None, key
        request = sdo.InitiateDownload(*key, entry.type.encode(value))
        self._take(Frame(0x600 + self.device.node_id, sdo.encode(request)))
        self._wait(5 * MS)
        answers = [sdo.decode_response(it.data) for it in self._sent if it.can_id >> 7 == 0xB]
        assert answers == [sdo.InitiateDownloadAck(*key)], f"given: {key} = {value}"

    def _take(self, *frames: Frame) -> None:
        self._sent.extend(self.device.step(self._now_ns, frames))

    def _wait(self, duration_ns: int) -> None:
        end_ns = self._now_ns + duration_ns
        while self._advance(end_ns):
            pass
        self._now_ns = end_ns

    def _advance(self, end_ns: int) -> bool:
        due_ns = self.device.deadline_ns
        if due_ns is None or due_ns > end_ns:
            return False
        self._now_ns = due_ns
        self._take()
        return True

    def _expect(self, wanted: str) -> None:
        end_ns = self._now_ns + PATIENCE_NS
        while not self._sent and self._advance(end_ns):
            pass
        got = to_text(self._sent.popleft()) if self._sent else "silence"
        same = re.fullmatch(wanted, got) is not None
        assert same, f"expected {wanted}, got {got}"

    def _expect_silence(self, duration_ns: int, before: str) -> None:
        self._wait(duration_ns)
        got = ", ".join(map(to_text, self._sent))
        assert not got, f"expected silence before {before}, got {got}"


def replayed() -> Iterator[object]:
    for case in CASES:
        reason = UNMENDED.get(str(case))
        marks = () if reason is None else pytest.mark.xfail(reason=reason, strict=True)
        yield pytest.param(case, marks=marks, id=str(case))


@pytest.mark.parametrize("case", list(replayed()))
def test_the_simulated_device_sends_what_the_manual_prints(case: Case) -> None:
    Replay(case).play_all()


def test_a_file_is_named_after_its_device() -> None:
    assert set(FILES) >= {"siko_ims360", "baumer_gim140r", "danfoss_dst_x730"}
    assert [file.device for file in FILES.values()] == list(FILES)


def test_what_is_unmended_is_a_trace() -> None:
    assert set(UNMENDED) <= set(map(str, CASES))


@every_trace
def test_a_corrected_frame_cites_ambiguities_of_the_spec(case: Case) -> None:
    known = {ambiguity.id for ambiguity in case.spec_file.document.ambiguities}

    assert {name for one in case.trace.corrected for name in one.ambiguities} <= known


@every_trace
def test_sdo_requests_fit_the_object_dictionary(case: Case) -> None:
    entries = case.build().spec.entries
    for request in case.trace.sdo_requests:
        if isinstance(request, sdo.InitiateDownload):
            entry = entries[request.index, request.sub]
            assert entry.writable
            assert len(request.data) == entry.type.size
        elif isinstance(request, sdo.InitiateUpload):
            assert entries[request.index, request.sub].readable


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["! power-cycle", "< 732#7F"], "expected 732#7F, got 732#00"),
        (["! power-cycle", "< 732#00", "< 732#00"], "expected 732#00, got silence"),
        (["> 632#4000100000000000"], "silence before the end, got 5B2#430010009A010307"),
        (["> 632#4000100000000000", "! silence 1"], "silence before the next line, got 5B2"),
        (["> 632#4000100000000000", "< 5B2#43001000......07"], None),
    ],
)
def test_a_replay_notices_every_difference(lines: list[str], message: str | None) -> None:
    replay = Replay(Case("siko_ims360", Trace(id="a", source="1", what="w", frames=lines)))

    if message is None:
        replay.play_all()
    else:
        with pytest.raises(AssertionError, match=message):
            replay.play_all()


GOOD: Final = """\
format: 1
device: some
printed: 1
traces:
  - {id: a, source: "1", what: w, frames: ["> 67F#40{index}000000000000"], fill: {index: "10"}}
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("printed: 1", "printed: 2", "1: expected 2 printed lines, got 1"),
        ("what: w", "what: w, when: now", "5: traces.0.when: expected a known key"),
        ("what: w", "what: ''", "5: traces.0.what: expected at least 1 characters"),
        ("40{index}", "4{index}", "expected a line as README.md has it"),
        ("> 67F", "(> 67F", "expected a line as README.md has it"),
        ("40{index}", "..{index}", "expected a line as README.md has it"),
        ("{index}", "", r"expected fill for \[\], got \['index'\]"),
        ("what: w", "what: w, corrected: [{frame: 2, printed: x, ambiguities: [X-1], why: y}]",
         "corrected 2: expected a printed frame, got 'no line'"),
        ("traces:", "traces:\n  - {id: a, source: '1', what: v, frames: ['! power-cycle']}",
         "expected each id once, got a again"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_file_is_told_with_its_line(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "some.yaml"
    path.write_text(GOOD.replace(old, new, 1), "utf-8")

    with pytest.raises(SpecError, match=message):
        load_traces(path)


def test_the_good_file_is_good(tmp_path: Path) -> None:
    path = tmp_path / "some.yaml"
    path.write_text(GOOD, "utf-8")

    assert load_traces(path).traces[0].lines == ["> 67F#4010000000000000"]
