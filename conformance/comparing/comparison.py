"""Two runs of one device side by side: what deviates anew, no longer, or still."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from conformance.comparing.baseline import Baseline, KnownDeviation
from conformance.comparing.measured import Shift, shifts
from conformance.errors import SpecError
from conformance.report.printable import printable
from conformance.report.record import Record
from conformance.report.results import Item

ABSENT: Final = "not judged"
_DECIDED: Final = ("pass", "fail")
_SETTINGS: Final = (
    ("suite", "suite"),
    ("spec_sha256", "hash of the spec"),
    ("bench", "bench"),
    ("select", "selection"),
    ("strict", "strict"),
)


@dataclass(frozen=True, slots=True)
class Change:
    """An item in both runs.

    Args:
        id: Of the item.
        before: Its verdict in the first run, `ABSENT` where it is not there.
        after: In the second.
        expected: In the run in which it deviates, the second if in both.
        actual: There.
        was: What it found in the first run, where both deviate and it is another.
        known: Who knows the deviation, empty if nobody.
    """

    id: str
    before: str
    after: str
    expected: str = ""
    actual: str = ""
    was: str = ""
    known: str = ""


@dataclass(frozen=True, slots=True)
class Comparison:
    """What became of a device from one run to another.

    Args:
        settings: What else is different: what, in the first run, in the second.
        new: Deviates in the second run alone, and nobody knows it.
        known: Deviates in the second run alone, and is in the baseline.
        unchanged: Deviates in both.
        fixed: Deviated, and passes.
        gone: Deviated, and the second run does not tell.
        open: The second run cannot tell where the first could.
        only_before: Items of the first run alone.
        only_after: Items of the second run alone.
        shifts: Figures that changed beyond noise.
        expired: Entries of the baseline that count no more, though the item deviates.
        no_longer: Entries of the baseline whose item passes.
        incomplete: Why it cannot be told whether there are more new deviations.
    """

    settings: tuple[tuple[str, str, str], ...]
    new: tuple[Change, ...]
    known: tuple[Change, ...]
    unchanged: tuple[Change, ...]
    fixed: tuple[Change, ...]
    gone: tuple[Change, ...]
    open: tuple[Change, ...]
    only_before: tuple[str, ...]
    only_after: tuple[str, ...]
    shifts: tuple[Shift, ...]
    expired: tuple[KnownDeviation, ...]
    no_longer: tuple[KnownDeviation, ...]
    incomplete: tuple[str, ...]

    @property
    def exit_code(self) -> int:
        """1 new deviations, 2 it cannot be told whether there are any, 0 there are none."""
        if self.new:
            return 1
        return 2 if self.incomplete else 0


def compare(before: Record, after: Record, baseline: Baseline | None = None) -> Comparison:
    """Return what became of a device.

    A deviation is new where the first run did not show it and the baseline does not know it. Where the
    first run ended before it came to an item that deviates, nobody can tell whether that is new.

    Raises:
        SpecError: The runs are of different devices.
    """
    if before.device.spec != after.device.spec:
        raise SpecError(
            f"{after.path}: expected a run of {printable(before.device.spec)}, "
            f"got one of {printable(after.device.spec)}"
        )
    old = {item.id: item for item in before.items}
    new = {item.id: item for item in after.items}
    deviating = [id_ for id_, item in new.items() if after.deviates(item)]
    changes = [_change(id_, old, new, baseline) for id_ in deviating]
    expired = baseline.expired(deviating) if baseline else []
    lapsed = {entry.item for entry in expired}
    # an entry that expired counts as new again, also where the first run shows it
    added = [it for it in changes if it.before != "fail" or it.id in lapsed]
    unknown = [it for it in added if not it.known]
    untold = {
        it.id
        for it in unknown
        if it.before == ABSENT and it.id not in lapsed and not _ended(before)
    }
    left = [_change(id_, old, new, None) for id_, it in old.items() if before.deviates(it)]
    passing = {id_ for id_, item in new.items() if item.verdict == "pass"}
    open_ = [
        _change(id_, old, new, None)
        for id_, item in new.items()
        if item.verdict == "inconclusive" and _verdict(old, id_) in ("pass", ABSENT)
    ]
    entries = baseline.entries.values() if baseline else ()
    return Comparison(
        settings=tuple(_settings(before, after)),
        new=tuple(it for it in unknown if it.id not in untold),
        known=tuple(it for it in added if it.known),
        unchanged=tuple(it for it in changes if it.before == "fail" and it.id not in lapsed),
        fixed=tuple(it for it in left if it.after == "pass"),
        gone=tuple(it for it in left if it.after not in _DECIDED),
        open=tuple(open_),
        only_before=tuple(id_ for id_ in old if id_ not in new),
        only_after=tuple(id_ for id_ in new if id_ not in old),
        shifts=tuple(shifts(before, after)),
        expired=tuple(expired),
        no_longer=tuple(it for it in entries if it.item in passing),
        incomplete=tuple(_incomplete(before, after, len(untold), len(open_))),
    )


def _verdict(items: dict[str, Item], id_: str) -> str:
    return items[id_].verdict if id_ in items else ABSENT


def _change(
    id_: str, old: dict[str, Item], new: dict[str, Item], baseline: Baseline | None
) -> Change:
    shown = new[id_] if _verdict(new, id_) == "fail" else old.get(id_, new.get(id_))
    assert shown is not None  # it is in one of them
    both = _verdict(old, id_) == _verdict(new, id_) == "fail"
    return Change(
        id=id_,
        before=_verdict(old, id_),
        after=_verdict(new, id_),
        expected=f"{shown.quantity}: {shown.expected}" if shown.quantity else shown.expected,
        actual=shown.actual,
        was=old[id_].actual if both and old[id_].actual != shown.actual else "",
        known=baseline.known(id_) if baseline else "",
    )


def _ended(record: Record) -> bool:
    """Tell whether a run came to all of its items."""
    return record.summary.complete and not record.summary.aborted


def _settings(before: Record, after: Record) -> Iterator[tuple[str, str, str]]:
    if before.device.variant != after.device.variant:
        yield "variant", before.device.variant, after.device.variant
    for key, name in _SETTINGS:
        old, new = (str(it.run.get(key, "")) for it in (before, after))
        if old != new:
            yield name, old or "none", new or "none"


def _incomplete(before: Record, after: Record, untold: int, undecided: int) -> Iterator[str]:
    if untold:
        yield f"{untold} items deviate that the first run did not come to, for it ended early"
    if not _ended(after):
        why = f": {after.summary.aborted}" if after.summary.aborted else ""
        yield f"the second run ended early{why}"
    for what in ("illegal", "left_changed"):
        if getattr(after.summary, what) and not getattr(before.summary, what):
            yield f"the second run does not stand: {getattr(after.summary, what)}"
    if undecided:
        yield f"{undecided} items are inconclusive that were not so in the first run"
    if not any(item.verdict in _DECIDED for item in after.items):
        yield "the second run decided nothing"
