"""What a recorder loses, swaps or never saw is never the device's fault."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from recorded_session import SPECS, session, write

from conformance.judging.record import Judging
from conformance.judging.recording import Recording, Seen, read_recording
from conformance.report.results import Results
from conformance.spec.load import load_spec

DEVICES = ("siko_ims360", "baumer_gim140r", "danfoss_dst_x730")
Spoil = Callable[[list[Seen], random.Random], Sequence[Seen]]


@cache
def _sound(device: str, folder: Path) -> Recording:
    return read_recording(write(session(device), folder / f"{device}.log"))


def _judge(device: str, recording: Recording) -> Results:
    spec = load_spec(SPECS / f"{device}.yaml").resolve(None, None)
    return Judging(recording, spec, spec.bitrate, 1.0).results()


def _of(recording: Recording, seen: Sequence[Seen]) -> Recording:
    lines = tuple(replace(it, line=line) for line, it in enumerate(seen, start=1))
    breaks = tuple(second.line for first, second in pairwise(lines) if second.time_s < first.time_s)
    return replace(recording, seen=lines, breaks=breaks)


def _gap(seen: list[Seen], chance: random.Random) -> Sequence[Seen]:
    begins = chance.randrange(len(seen))
    return seen[:begins] + seen[begins + chance.choice((1, 2, 3, 4, 10, 100)) :]


def _gaps(seen: list[Seen], chance: random.Random) -> Sequence[Seen]:
    return [it for it in seen if chance.random() > 0.02]


def _begun_late(seen: list[Seen], chance: random.Random) -> Sequence[Seen]:
    return seen[chance.randrange(len(seen) - 1) :]


def _swapped(seen: list[Seen], chance: random.Random) -> Sequence[Seen]:
    for place in range(len(seen) - 1):
        if chance.random() < 0.02:
            seen[place], seen[place + 1] = seen[place + 1], seen[place]
    return seen


def _written_in_another_order(seen: list[Seen], chance: random.Random) -> Sequence[Seen]:
    """Swap frames, but not their times, as a recorder does that stamps what it sends too late."""
    for place in range(len(seen) - 1):
        if chance.random() < 0.1:
            first, second = seen[place], seen[place + 1]
            seen[place] = replace(second, time_s=first.time_s)
            seen[place + 1] = replace(first, time_s=second.time_s)
    return seen


def _without_the_masters(seen: list[Seen], _: random.Random) -> Sequence[Seen]:
    return [it for it in seen if it.frame.can_id & 0x780 != 0x600]


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(
    "spoil",
    [_gap, _gaps, _begun_late, _swapped, _written_in_another_order, _without_the_masters],
)
def test_a_poor_recording_fails_no_sound_device(
    device: str, spoil: Spoil, tmp_path_factory: pytest.TempPathFactory
) -> None:
    sound = _sound(device, tmp_path_factory.getbasetemp())
    for seed in range(12):
        spoiled = _of(sound, spoil(list(sound.seen), random.Random(seed)))  # noqa: S311 - repeatable
        results = _judge(device, spoiled)
        failed = [it for it in results.items if it.verdict == "fail"]
        assert (seed, failed) == (seed, [])
        assert not results.illegal


def _readings() -> Iterator[tuple[str, str, int]]:
    for device in DEVICES:
        for ambiguity in load_spec(SPECS / f"{device}.yaml").document.ambiguities:
            for number, reading in enumerate(ambiguity.readings, start=1):
                if ambiguity.judged_by == "either" and number > 1 and reading.changes:
                    yield device, ambiguity.id, number


@pytest.mark.parametrize(
    ("device", "ambiguity", "number"),
    [*list(_readings())[::16], ("danfoss_dst_x730", "DST-43", 2)],
)
def test_a_device_may_follow_any_reading_of_its_manual(
    device: str, ambiguity: str, number: int, tmp_path: Path
) -> None:
    messages = session(device, readings={ambiguity: number})

    results = _judge(device, read_recording(write(messages, tmp_path / "customer.log")))

    assert [it.id for it in results.items if it.verdict == "fail"] == []


def test_a_second_master_between_request_and_response_decides_nothing(
    tmp_path: Path,
) -> None:
    # 1018h:01 is read by one master while another one's download of it waits for its abort
    lines = (
        "(1.000) can0 632#2318100101000000",
        "(1.001) can0 632#4018100100000000",
        "(1.002) can0 5B2#6018100100000000",
        "(1.003) can0 5B2#4318100101000000",
    )
    recording = tmp_path / "two.log"
    recording.write_text("\n".join(lines) + "\n", encoding="ascii")

    results = _judge("siko_ims360", read_recording(recording))

    (item,) = [it for it in results.items if it.id == "siko_ims360/OD-05/1018h:01"]
    assert item.verdict in ("inconclusive", "not_applicable")


def test_a_value_of_before_the_recording_decides_nothing(tmp_path: Path) -> None:
    recording = tmp_path / "running.log"
    beats = (f"({1 + n * 0.4:.3f}) can0 732#05" for n in range(20))
    recording.write_text("\n".join(beats) + "\n", encoding="ascii")

    results = _judge("siko_ims360", read_recording(recording))

    words = {it.verdict for it in results.items if it.requirement in ("HB-01", "HB-07", "HB-05")}
    assert "fail" not in words
