"""TPDOs in a recording: when they come, and how long they are (CiA 301 v4.2.0, 7.2.2 and 7.5.2.37)."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise

from conformance.checks.pdo.tpdos import tpdos as sent_tpdos
from conformance.judging.recording import Seen
from conformance.judging.rhythm import rhythm
from conformance.judging.sightings import Sighting
from conformance.judging.states import LATE, LOSSY, UNTOLD, parted, prompt, state_in, told
from conformance.judging.timeline import Timeline
from conformance.judging.tpdo_content import content
from conformance.requirements import Case
from conformance.spec.document import Tpdo
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtState
from conformance.wire.pdo import MappingEntry

COB_ID, TYPE, INHIBIT, EVENT_TIMER = 1, 2, 3, 5
BY_TIMER = (254, 255)
CAN_ID, UNUSED = 0x7FF, 1 << 31 | 1 << 29
FASTER = "the manual leaves open what else sends it"
NOT_SENDING = (NmtState.PRE_OPERATIONAL, NmtState.STOPPED)


def tpdos(timeline: Timeline) -> Iterator[Sighting]:
    """Return what a recording shows of the TPDOs."""
    service = timeline.spec.services.tpdo
    for case in sent_tpdos(timeline.spec):
        if service is not None:
            yield from _Producer(timeline, service, case).sightings()


class _Producer:
    """One TPDO.

    Args:
        timeline: The recording.
        service: The spec's.
        case: The TPDO's number, and where the manual has it.
    """

    def __init__(self, timeline: Timeline, service: Tpdo, case: Case) -> None:
        self._timeline = timeline
        self._service = service
        self._case = case
        self._communication = service.communication + case.subject - 1
        self._mapping = service.mapping + case.subject - 1

    def sightings(self) -> Iterator[Sighting]:
        """Return what the recording shows of it."""
        timeline = self._timeline
        lines = [*timeline.recording.breaks, *(seen.line for seen, _ in timeline.commands)]
        lines += [it.line for it in timeline.boot_ups]
        indices = (self._communication, self._mapping)
        lines += timeline.changes({key for key in timeline.spec.entries if key[0] in indices})
        for can_id in self._identifiers():
            for begins, part in parted(timeline, timeline.on(can_id), lines):
                known = told(timeline, (self._communication, COB_ID), part)
                if known is not None and (known.value & CAN_ID, known.value & UNUSED) != (
                    can_id,
                    0,
                ):
                    continue  # they are another node's
                doubt = UNTOLD if known is None else ""
                yield from self._length(part, doubt)
                yield from self._period(begins, part, doubt)
        yield from self._states()

    def _identifiers(self) -> list[int]:
        """Return the CAN-IDs that it may have been sent on: by default, and by what was told."""
        told_words = self._timeline.told((self._communication, COB_ID))
        words = [self._default(self._communication, COB_ID), *told_words]
        return sorted({it & CAN_ID for it in words if it is not None and not it & UNUSED})

    def _default(self, index: int, sub: int) -> int | None:
        entry = self._timeline.spec.entry(index, sub)
        return entry.default if entry is not None and isinstance(entry.default, int) else None

    def _held(self, index: int, sub: int, part: Sequence[Seen]) -> tuple[int | None, bool]:
        """Return what one of its parameters holds, and whether the recording tells."""
        known = told(self._timeline, (index, sub), part)
        return (self._default(index, sub), False) if known is None else (known.value, True)

    def _length(self, part: Sequence[Seen], doubt: str) -> Iterator[Sighting]:
        count, sure = self._held(self._mapping, 0, part)
        if count is None:
            return
        bits, words = 0, []
        for sub in range(1, count + 1):
            word, is_told = self._held(self._mapping, sub, part)
            if word is None:
                return
            words.append(word)
            bits, sure = bits + MappingEntry.from_word(word).bits, sure and is_told
        octets = {(bits + 7) // 8}
        for services, _ in self._timeline.spec.services_readings:
            octets |= {services.tpdo.octets} if services.tpdo and services.tpdo.octets else set()
        doubt = doubt or ("" if sure else UNTOLD)
        judge = content(self._timeline.spec, words, part)
        if judge is not None:
            label, section = self._case.label, self._case.section
            lossy = LOSSY if self._timeline.exchanges.disturbed else ""
            yield Sighting("TPDO-05", label, section, part[0], part[-1], judge, doubt or lossy)
        lengths = sorted({len(it.frame.data) for it in part})
        yield Sighting(
            "TPDO-05",
            self._case.label,
            self._case.section,
            part[0],
            part[-1],
            partial(_judge_length, lengths=lengths, octets=sorted(octets)),
            doubt,
        )

    def _period(self, begins: Seen | None, part: Sequence[Seen], doubt: str) -> Iterator[Sighting]:
        kind, sure = self._held(self._communication, TYPE, part)
        period_ms, is_told = self._held(self._communication, EVENT_TIMER, part)
        if kind not in BY_TIMER or period_ms is None:
            return
        found = rhythm(self._timeline, part, period_ms, faster=FASTER)
        if found is None:
            return
        known = told(self._timeline, (self._communication, EVENT_TIMER), part)
        inhibit, is_free = self._held(self._communication, INHIBIT, part)
        unhindered = inhibit is None or (is_free and inhibit == 0)
        doubt = doubt or found.doubt
        if not (sure and is_told and known is not None):
            doubt = UNTOLD
        elif self._timeline.exchanges.disturbed:
            doubt = doubt or LOSSY
        elif not unhindered:
            doubt = doubt or "it may have been kept back by an inhibit time"
        elif not prompt(self._timeline, begins, part, known, period_ms):
            doubt = doubt or LATE
        label = f"{self._case.label}/{period_ms}ms"
        judge = partial(found.judge, what="TPDO")
        section = self._case.section
        yield Sighting("TPDO-02", label, section, part[0], part[-1], judge, doubt, proof=True)

    def _states(self) -> Iterator[Sighting]:
        """Return in which states it came: where it may not, or both where it may and not elsewhere."""
        spans = list(self._spans())
        unsent = [state in NOT_SENDING for state, _, _ in spans]
        for state, came, sighting in spans:
            if (came and state in NOT_SENDING) or (any(unsent) and not all(unsent)):
                yield sighting

    def _spans(self) -> Iterator[tuple[NmtState, bool, Sighting]]:
        """Return the state between two heartbeats that say the same, and whether it came there."""
        timeline = self._timeline
        commands = [seen.line for seen, _ in timeline.commands]
        for can_id in self._identifiers():
            frames = timeline.on(can_id)
            lines = [it.line for it in frames]
            for first, last in pairwise(timeline.error_control):
                state = state_in(first)
                between = frames[bisect_left(lines, first.line) : bisect_left(lines, last.line)]
                if state != state_in(last) or state is None or state is NmtState.BOOT_UP:
                    continue
                if bisect_left(commands, first.line) != bisect_left(commands, last.line):
                    continue
                if not between and state not in NOT_SENDING:
                    continue
                known = timeline.known((self._communication, COB_ID), first.line)
                is_its = known is not None and known.value & CAN_ID == can_id
                judge = partial(_judge_state, state=state, count=len(between))
                label, section = self._case.label, self._case.section
                doubt = "" if is_its else UNTOLD
                shown = Sighting("TPDO-01", label, section, first, last, judge, doubt)
                yield state, bool(between), shown


def _judge_length(verdict: Verdict, lengths: list[int], octets: list[int]) -> None:
    shown = " and ".join(map(str, lengths))
    verdict.holds(
        "octets",
        expected=" or ".join(map(str, octets)),
        actual=shown,
        ok=set(lengths) <= set(octets),
    )


def _judge_state(verdict: Verdict, state: NmtState, count: int) -> None:
    name = state.name.capitalize().replace("_", "-")
    wanted = "none" if state in NOT_SENDING else "some"
    verdict.equal(f"TPDOs in {name}", "some" if count else "none", wanted)
