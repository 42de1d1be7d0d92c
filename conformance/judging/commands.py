"""What a recording shows of NMT commands: where they lead, and what is served there (CiA 301 v4.2.0, 7.3.2.2)."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from functools import partial
from itertools import pairwise

from conformance.bench.services.heartbeat import name_of
from conformance.checks.steps import state_word
from conformance.judging.recording import Seen
from conformance.judging.sightings import Sighting
from conformance.judging.states import LATE, LEADS_TO, LOSSY, SETTLED, state_in
from conformance.judging.timeline import RESETS, Timeline
from conformance.verdict import Verdict
from conformance.wire.cob_id import heartbeat, sdo_request, sdo_response
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtState

GOES_ON_S = 5.0
"""So long a recording goes on after a reset that is said to bring no boot-up message."""

SHUT_S = 0.05
"""What comes sooner after a reset may have been on its way."""

STARTS = frozenset(heartbeat(node_id) for node_id in range(1, 128))
AROUND = 3
"""A recorder may write a boot-up message so many frames before the reset that brought it."""

SERVES = {
    NmtState.PRE_OPERATIONAL: "an answer",
    NmtState.OPERATIONAL: "an answer",
    NmtState.STOPPED: "no answer",
}


def commands(timeline: Timeline) -> Iterator[Sighting]:
    """Return what a recording shows of NMT commands."""
    yield from _missing_boot_ups(timeline)
    if timeline.spec.services.heartbeat_producer is not None:
        yield from _transitions(timeline)
        yield from _services(timeline)


def _missing_boot_ups(timeline: Timeline) -> Iterator[Sighting]:
    """Return resets after which the node goes on without a boot-up message."""
    seen, section = timeline.recording.seen, timeline.spec.services.nmt.source
    starts = [it.line for it in timeline.boot_ups]
    events = sorted({*timeline.recording.breaks, *(it.line for it, _ in timeline.commands)})
    own = (sdo_response(timeline.spec.node_id), heartbeat(timeline.spec.node_id))
    lossy = bool(timeline.recording.breaks or timeline.exchanges.disturbed)
    for reset, request in timeline.commands:
        if request.command not in RESETS:
            continue
        place = bisect_right(events, reset.line)
        end = events[place] if place < len(events) else len(seen) + 1
        if end - 2 < reset.line or seen[end - 2].time_s - reset.time_s < GOES_ON_S:
            continue
        if any(reset.line - AROUND <= line < end for line in starts):
            continue
        soon = [it for it in seen[reset.line : end - 1] if it.time_s - reset.time_s <= GOES_ON_S]
        if any(_starts(it.frame) for it in soon):
            continue
        alive = [
            it
            for it in soon
            if it.frame.can_id in own and not it.frame.remote and it.time_s - reset.time_s > SHUT_S
        ]
        if not alive:
            continue
        way = NmtCommand(request.command).name.lower().replace("_", "-")
        label = way if request.node_id else f"{way}/broadcast"
        doubt = LOSSY if lossy else ""
        yield Sighting("BOOT-01", label, section, reset, alive[-1], _judge_missing, doubt)


def _starts(frame: Frame) -> bool:
    """Tell whether a frame is a boot-up message, whoever's: the node may have a new node-ID."""
    return frame.can_id in STARTS and frame.data == b"\0" and not frame.remote


def _judge_missing(verdict: Verdict) -> None:
    verdict.equal("boot-up messages", 0, 1)


def _transitions(timeline: Timeline) -> Iterator[Sighting]:
    """Return commands between heartbeats that show the state before and after them."""
    beats = [it for it in timeline.error_control if it.frame.data != b"\0"]
    lines = [it.line for it in beats]
    events = {*timeline.recording.breaks, *(seen.line for seen, _ in timeline.commands)}
    places = sorted({*events, *(it.line for it in timeline.boot_ups)})
    section = timeline.spec.services.nmt.source
    for command, request in timeline.commands:
        if request.command not in LEADS_TO:
            continue
        wanted = LEADS_TO[NmtCommand(request.command)]
        place = bisect_right(places, command.line)
        end = places[place] if place < len(places) else len(timeline.recording.seen) + 1
        since = places[place - 2] if place > 1 else 1
        before = beats[bisect_right(lines, since) : bisect_right(lines, command.line)]
        after = beats[bisect_right(lines, command.line) : bisect_right(lines, end - 1)]
        if len(before) <= SETTLED or len(after) <= SETTLED:
            continue
        was = state_in(before[-1])
        if was is None or was not in SERVES or was is wanted or state_in(before[-2]) is not was:
            continue
        around = [*before[-2:], *after[: SETTLED + 1]]
        gaps_s = [b.time_s - a.time_s for a, b in pairwise(around)]
        even = max(gaps_s) <= 1.5 * min(gaps_s) + timeline.jitter_ms / 1000
        suffix = "" if request.node_id else "/broadcast"
        yield Sighting(
            "NMT-01",
            f"{state_word(was)}-to-{state_word(wanted)}{suffix}",
            section,
            command,
            after[SETTLED],
            partial(_judge_state, seen=after[SETTLED], wanted=wanted),
            "" if even else LATE,
        )


def _judge_state(verdict: Verdict, seen: Seen, wanted: NmtState) -> None:
    state = state_in(seen)
    shown = f"none ({seen.frame})" if state is None else name_of(state)
    verdict.equal("state", shown, name_of(wanted))


def _services(timeline: Timeline) -> Iterator[Sighting]:
    """Return SDO requests between two heartbeats of the same state, and whether they are answered."""
    node_id, section = timeline.spec.node_id, timeline.spec.services.nmt.source
    changes = sorted({*timeline.recording.breaks, *(seen.line for seen, _ in timeline.commands)})
    for first, last in pairwise(timeline.error_control):
        state = state_in(first)
        if state is None or state not in SERVES or state is not state_in(last):
            continue
        if bisect_right(changes, first.line) != bisect_right(changes, last.line):
            continue
        command = timeline.commanded(first.line)
        if command is None or LEADS_TO.get(command) is not state:
            continue
        between = timeline.recording.seen[first.line : last.line - 1]
        asked = [it for it in between if it.frame.can_id == sdo_request(node_id)]
        replies = [it for it in between if it.frame.can_id == sdo_response(node_id)]
        answered = bool(asked and [it for it in replies if it.line > asked[0].line])
        if not asked or (not answered and state is not NmtState.STOPPED):
            continue
        yield Sighting(
            "NMT-02",
            state_word(state),
            section,
            first,
            last,
            partial(_judge_service, state=state, answered=answered),
            LOSSY if timeline.recording.breaks else "",
        )


def _judge_service(verdict: Verdict, state: NmtState, *, answered: bool) -> None:
    shown = "an answer" if answered else "no answer"
    verdict.equal(f"SDO request in {name_of(state)}", shown, SERVES[state])
