"""Boot-up, heartbeat and NMT state in a recording (CiA 301 v4.2.0, 7.2.8.3 and 7.3.2.2)."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise

from conformance.bench.services.heartbeat import name_of
from conformance.checks.limits import gap_tolerance_ms
from conformance.checks.steps import ENTER, state_word
from conformance.judging.recording import Seen
from conformance.judging.rhythm import Rhythm, rhythm
from conformance.judging.sightings import Sighting
from conformance.judging.timeline import RESETS, Known, Timeline
from conformance.spec.document import HeartbeatProducer
from conformance.spec.model import address
from conformance.verdict import Verdict
from conformance.wire.errors import WireError
from conformance.wire.nmt import NmtCommand, NmtRequest, NmtState, decode_heartbeat

SECONDS_MS = 1000
"""From here on a period is one of seconds, as HB-07 has it."""

TOO_SOON = 0.5
"""Another boot-up message within this part of the time that a start takes is of the same start, not of
another one that the supply brought about."""

AGAIN_S = 0.5
"""So long after a reset the node may still be starting."""

SETTLED = 2
"""The heartbeat after a command whose state is looked at: the first one may have been on its way."""

LEADS_TO = {command: state for state, command in ENTER.items()}
UNTOLD = "what it holds is not in the recording, and may have been changed before it began"
LOSSY = (
    "requests and responses do not match elsewhere in the recording, so that it may lack a change"
)
LATE = "the first came late, as if the recording had a gap there"


def states(timeline: Timeline) -> Iterator[Sighting]:
    """Return what a recording shows of starts, heartbeats and states."""
    yield from _boot_ups(timeline)
    producer = timeline.spec.services.heartbeat_producer
    if producer is not None:
        for boundary, beats in _runs(timeline, producer):
            yield from _period(timeline, producer, boundary, beats)
        yield from _states(timeline, producer)


def state_in(seen: Seen) -> NmtState | None:
    """Return the state in a heartbeat, None where it shows none."""
    try:
        return decode_heartbeat(seen.frame).state
    except WireError:
        return None


def _boot_ups(timeline: Timeline) -> Iterator[Sighting]:
    section, boot_ups = timeline.spec.services.nmt.source, timeline.boot_ups
    resets = [(seen, it) for seen, it in timeline.commands if it.command in RESETS]
    lines = [seen.line for seen, _ in resets]
    for reset, request in resets:
        end = next((it for it in lines if it > reset.line), len(timeline.recording.seen) + 1)
        after = [it for it in boot_ups if reset.line < it.line < end]
        if not after:
            continue
        start_s = (after[0].time_s - reset.time_s) * TOO_SOON
        same = [it for it in after if it.time_s - after[0].time_s <= start_s]
        way = NmtCommand(request.command).name.lower().replace("_", "-")
        label = way if request.node_id else f"{way}/broadcast"
        judge = partial(_judge_count, count=len(same))
        yield Sighting("BOOT-01", label, section, reset, same[-1], judge)


def _judge_count(verdict: Verdict, count: int) -> None:
    verdict.equal("boot-up messages", count, 1)


def _runs(
    timeline: Timeline, producer: HeartbeatProducer
) -> Iterator[tuple[Seen | None, list[Seen]]]:
    """Return the heartbeats between two places at which their period may change, and that place."""
    lines = [*timeline.changes({(producer.object, 0)}), *timeline.recording.breaks]
    lines += [seen.line for seen, _ in timeline.commands]
    lines += [it.line for it in timeline.boot_ups]
    beats = [it for it in timeline.error_control if it.frame.data != b"\0"]
    yield from parted(timeline, beats, lines)


def parted(
    timeline: Timeline, frames: Sequence[Seen], lines: list[int]
) -> Iterator[tuple[Seen | None, list[Seen]]]:
    """Return frames parted at some lines, each part with what it begins after, None at the start."""
    places = sorted(set(lines))
    parts: dict[int, list[Seen]] = {}
    for frame in frames:
        parts.setdefault(bisect_left(places, frame.line), []).append(frame)
    for number, part in parts.items():
        begins = timeline.recording.seen[places[number - 1] - 1] if number else None
        yield begins, part


def told(timeline: Timeline, key: tuple[int, int], part: Sequence[Seen]) -> Known | None:
    """Return what an object holds while some frames came, if an exchange before or meanwhile told."""
    if timeline.may_differ(part[0].line, part[-1].line):
        return None
    return timeline.known(key, part[-1].line)


def prompt(
    timeline: Timeline, begins: Seen | None, part: Sequence[Seen], known: Known, period_ms: int
) -> bool:
    """Tell whether nothing can have changed the period between what told it and the first frame."""
    if known.line > part[0].line:
        return True
    since = begins or timeline.recording.seen[0]
    most_ms = period_ms + gap_tolerance_ms(period_ms) + timeline.jitter_ms
    return (part[0].time_s - since.time_s) * 1000 <= 2 * most_ms


def _period(
    timeline: Timeline, producer: HeartbeatProducer, begins: Seen | None, beats: list[Seen]
) -> Iterator[Sighting]:
    entry = timeline.spec.entries.get((producer.object, 0))
    known = told(timeline, (producer.object, 0), beats)
    default = entry.default if entry is not None else None
    period_ms = known.value if known else default
    if not isinstance(period_ms, int):
        return
    found = rhythm(timeline, beats, period_ms)
    if found is None:
        return
    doubt = found.doubt
    if known is None:
        doubt = UNTOLD
    elif timeline.exchanges.disturbed:
        doubt = doubt or LOSSY
    elif not prompt(timeline, begins, beats, known, period_ms):
        doubt = doubt or LATE
    requirement = "HB-07" if period_ms >= SECONDS_MS else "HB-01"
    yield Sighting(
        requirement,
        f"{address(producer.object)}/{period_ms}ms",
        producer.source,
        beats[0],
        beats[-1],
        _judging(found, "heartbeat"),
        doubt,
        proof=True,
    )


def _judging(found: Rhythm, what: str) -> Callable[[Verdict], object]:
    return partial(found.judge, what=what)


def _states(timeline: Timeline, producer: HeartbeatProducer) -> Iterator[Sighting]:
    """Return what the heartbeats after commands say, and those after a start."""
    events: list[tuple[int, Seen, NmtRequest | None]] = [
        (it.line, it, None) for it in timeline.boot_ups
    ]
    events += [(seen.line, seen, request) for seen, request in timeline.commands]
    events.sort(key=lambda event: event[0])
    bounds = sorted({*timeline.recording.breaks, *(line for line, _, _ in events)})
    beats = [it for it in timeline.error_control if it.frame.data != b"\0"]
    lines = [it.line for it in beats]
    for line, seen, request in events:
        if request is not None and request.command not in LEADS_TO:
            continue
        end = next((it for it in bounds if it > line), len(timeline.recording.seen) + 1)
        after = beats[bisect_left(lines, line) : bisect_left(lines, end)]
        if len(after) <= SETTLED or _starts_differ(timeline, request is None):
            continue
        wanted = (
            _start_state(timeline) if request is None else LEADS_TO[NmtCommand(request.command)]
        )
        word = state_word(wanted)
        if word not in producer.states or (request is not None and _unready(timeline, seen)):
            continue
        gaps_s = [b.time_s - a.time_s for a, b in pairwise([seen, *after[: SETTLED + 1]])]
        doubt = "" if max(gaps_s[:2]) <= 1.5 * gaps_s[2] + timeline.jitter_ms / 1000 else LATE
        yield Sighting(
            "BOOT-02" if request is None else "HB-05",
            "reset-node" if request is None else word,
            timeline.spec.services.nmt.source if request is None else producer.source,
            seen,
            after[SETTLED],
            partial(_judge_state, seen=after[SETTLED], wanted=wanted),
            doubt,
        )


def _unready(timeline: Timeline, command: Seen) -> bool:
    """Tell whether the node may still have been starting when a command came."""
    return any(
        request.command in RESETS and 0 <= command.time_s - seen.time_s < AGAIN_S
        for seen, request in timeline.commands
    )


def _starts_differ(timeline: Timeline, is_start: bool) -> bool:
    """Tell whether readings or a stored value leave open in which state the node starts."""
    nmts = [services.nmt for services, _ in timeline.spec.services_readings]
    differ = any(it.start_by is not None for it in nmts)
    return is_start and (differ or len({it.automatic_start for it in nmts}) > 1)


def _start_state(timeline: Timeline) -> NmtState:
    automatic = timeline.spec.services.nmt.automatic_start
    return NmtState.OPERATIONAL if automatic else NmtState.PRE_OPERATIONAL


def _judge_state(verdict: Verdict, seen: Seen, wanted: NmtState) -> None:
    state = state_in(seen)
    shown = f"none ({seen.frame})" if state is None else name_of(state)
    verdict.equal("state", shown, name_of(wanted))
