"""What a recording shows of one requirement: sightings, and what they come to.

A gap in a recording can make one exchange of two, so that a single sighting is no proof unless the
frames speak for themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from conformance.judging.recording import Seen
from conformance.verdict import Nonconformity, Unresolved, Verdict, VerdictWord

WITNESSES = 2
"""So many sightings of a deviation no single gap brings about."""

SEEN_ONCE = "seen once, which a gap in the recording can bring about as well"


@dataclass(frozen=True, slots=True)
class Sighting:
    """One place of a recording that bears on a requirement.

    Args:
        requirement: Its id.
        label: Last part of the item's id.
        section: Of the manual.
        first: Where it begins.
        last: Where it ends.
        judge: Compares expected and actual.
        doubt: Why nothing follows from it if it deviates; empty if something does.
        proof: One suffices if it deviates.
    """

    requirement: str
    label: str
    section: str
    first: Seen
    last: Seen
    judge: Callable[[Verdict], object]
    doubt: str = ""
    proof: bool = False


@dataclass(frozen=True, slots=True)
class Found:
    """What the sightings of one item come to.

    Args:
        word: The verdict.
        reason: Why it is neither pass nor fail, else empty.
        verdict: The comparisons that decide.
        first: Line of the trace where the sightings that decide begin.
        last: Line where they end.
        section: Of the manual.
    """

    word: VerdictWord
    reason: str
    verdict: Verdict
    first: int
    last: int
    section: str


def conclude(sightings: Iterable[Sighting], jitter_ms: float) -> Found:
    """Return what the sightings of one item come to, at least one."""
    tried = [(it, *_tried(it, jitter_ms)) for it in sightings]
    bad = [it for it, word, _ in tried if word == "fail" and not it.doubt]
    if any(it.proof for it in bad) or len(bad) >= WITNESSES:
        return _found("fail", "", bad, jitter_ms)
    if bad:
        return _found("inconclusive", f"{_words(bad[0])}: {SEEN_ONCE}", bad, jitter_ms)
    doubtful = [it for it, word, _ in tried if word == "fail"]
    if doubtful:
        reason = f"{_words(doubtful[0])}: {doubtful[0].doubt}"
        return _found("inconclusive", reason, doubtful, jitter_ms)
    open_ones = [(it, why) for it, word, why in tried if word == "inconclusive"]
    if open_ones:
        return _found("inconclusive", open_ones[0][1], [open_ones[0][0]], jitter_ms)
    return _found("pass", "", [it for it, _, _ in tried], jitter_ms)


def _tried(sighting: Sighting, jitter_ms: float) -> tuple[VerdictWord, str]:
    verdict = Verdict(lambda: jitter_ms)
    sighting.judge(verdict)
    try:
        verdict.conclude()
    except Nonconformity:
        return "fail", ""
    except Unresolved as error:
        return "inconclusive", str(error)
    return "pass", ""


def _words(sighting: Sighting) -> str:
    verdict = Verdict()
    sighting.judge(verdict)
    failed = next(it for it in verdict.measurements if not it.ok)
    return f"{failed.quantity}: expected {failed.expected}, got {failed.actual}"


def _found(word: VerdictWord, reason: str, deciding: list[Sighting], jitter_ms: float) -> Found:
    verdict = Verdict(lambda: jitter_ms)
    for sighting in deciding[:WITNESSES]:
        sighting.judge(verdict)
    shown = deciding[:WITNESSES] if word != "pass" else deciding
    lines = [line for it in shown for line in (it.first.line, it.last.line)]
    return Found(word, reason, verdict, min(lines), max(lines), deciding[0].section)
