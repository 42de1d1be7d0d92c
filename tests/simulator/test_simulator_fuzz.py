from __future__ import annotations

from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from conformance.resources import names
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.fault_files import FOLDER, load_faults
from conformance.simulator.faults import Faults
from conformance.spec.load import load_spec
from conformance.wire.frame import Frame

SPEC = load_spec(Path(__file__).parent / "invented.yaml")
MS = 1_000_000

INDICES = st.sampled_from([key[0] for key in SPEC.resolve().entries] + [0x3000, 0xFFFF])
IDENTIFIERS = st.sampled_from([0x000, 0x080, 0x10A, 0x18A, 0x60A, 0x7E5, 0x70A]) | st.integers(
    0, 0x7FF
)


@st.composite
def sdo_requests(draw: st.DrawFn) -> Frame:
    command = draw(
        st.sampled_from([0x40, 0x2F, 0x2B, 0x23, 0x22, 0x21, 0x20]) | st.integers(0, 255)
    )
    head = (
        bytes((command,)) + draw(INDICES).to_bytes(2, "little") + bytes((draw(st.integers(0, 9)),))
    )
    tail = draw(st.sampled_from([b"save", b"load", bytes(4)]) | st.binary(min_size=4, max_size=4))
    return Frame(0x60A, head + tail)


@st.composite
def any_frames(draw: st.DrawFn) -> Frame:
    if draw(st.booleans()):
        return draw(sdo_requests())
    if draw(st.integers(0, 9)) == 0:
        return Frame(draw(st.integers(0, 0x1FFF_FFFF)), draw(st.binary(max_size=8)), extended=True)
    if draw(st.integers(0, 9)) == 0:
        return Frame(draw(IDENTIFIERS), remote=True, dlc=draw(st.integers(0, 8)))
    return Frame(draw(IDENTIFIERS), draw(st.binary(max_size=8)))


STEPS = st.lists(st.tuples(st.integers(0, 50), st.lists(any_frames(), max_size=4)), max_size=30)
READINGS = st.fixed_dictionaries(
    {
        ambiguity.id: st.integers(1, len(ambiguity.readings))
        for ambiguity in SPEC.document.ambiguities
    }
)


def live_through(device: SimulatedDevice, steps: list[tuple[int, list[Frame]]]) -> int:
    """Step the device through frames and all its deadlines; return the time."""
    now_ns = 300 * MS
    device.power_on(0)
    device.step(now_ns)
    for pause_ms, frames in steps:
        end_ns = now_ns + pause_ms * MS
        while device.deadline_ns is not None and device.deadline_ns <= end_ns:
            assert device.deadline_ns >= now_ns
            now_ns = device.deadline_ns
            device.step(now_ns)
        now_ns = end_ns
        device.step(now_ns, frames)
    return now_ns


@settings(max_examples=300, deadline=None)
@given(steps=STEPS, readings=READINGS)
def test_after_any_frames_a_valid_upload_is_answered(
    steps: list[tuple[int, list[Frame]]], readings: dict[str, int]
) -> None:
    device = SimulatedDevice(SPEC, readings=readings)
    now_ns = live_through(device, steps) + 1000 * MS
    device.step(now_ns)
    now_ns += 1000 * MS
    device.step(now_ns, [Frame(0x000, b"\x80\x00")])
    request = bytes.fromhex("4000100000000000")
    device.step(now_ns + MS, [Frame(0x600 + device.node_id, request)])
    answers = device.step(now_ns + 2 * MS)
    assert Frame(0x580 + device.node_id, bytes.fromhex("430010009A010400")) in answers


@settings(max_examples=300, deadline=None)
@given(steps=STEPS, fault=st.sampled_from(names(FOLDER)))
def test_no_frames_break_a_device_with_a_fault(
    steps: list[tuple[int, list[Frame]]], fault: str
) -> None:
    live_through(SimulatedDevice(SPEC, faults=load_faults([fault])), steps)


@settings(max_examples=100, deadline=None)
@given(steps=STEPS)
def test_the_same_frames_give_the_same_answers(steps: list[tuple[int, list[Frame]]]) -> None:
    def trace() -> list[list[Frame]]:
        device = SimulatedDevice(SPEC, faults=Faults(heartbeat_jitter_ms=5.0), seed=3)
        device.power_on(0)
        sent = [device.step(300 * MS)]
        for number, (_, frames) in enumerate(steps):
            sent.append(device.step((301 + number) * MS, frames))
        return sent

    assert trace() == trace()


@settings(max_examples=200, deadline=None)
@given(
    index=INDICES,
    sub=st.integers(0, 10),
    data=st.binary(min_size=1, max_size=4),
)
def test_what_a_download_confirms_an_upload_gives_back(index: int, sub: int, data: bytes) -> None:
    device = SimulatedDevice(SPEC)
    entry = device.spec.entry(index, sub)
    device.power_on(0)
    device.step(300 * MS)
    multiplexer = index.to_bytes(2, "little") + bytes((sub,))
    command = 0x23 | (4 - len(data)) << 2
    device.step(400 * MS, [Frame(0x60A, bytes((command,)) + multiplexer + data.ljust(4, b"\0"))])
    confirmed = Frame(0x58A, b"\x60" + multiplexer + bytes(4)) in device.step(401 * MS)
    if not confirmed or entry is None or entry.kind != "config" or entry.access == "wo":
        return
    device.step(402 * MS, [Frame(0x60A, b"\x40" + multiplexer + bytes(4))])
    answer = bytes((0x43 | (4 - len(data)) << 2,)) + multiplexer + data.ljust(4, b"\0")
    assert Frame(0x58A, answer) in device.step(403 * MS)
