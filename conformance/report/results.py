"""The record of a run, `results.json`; every other report is made from it."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

from conformance.errors import BenchError
from conformance.report.scanned import Scanned
from conformance.verdict import VerdictWord

JsonValue: TypeAlias = str | int | float | bool | list[Any] | dict[str, Any] | None
VERDICTS: tuple[VerdictWord, ...] = (
    "pass",
    "fail",
    "inconclusive",
    "skipped",
    "not_applicable",
)


@dataclass(frozen=True, slots=True)
class Item:
    """One check's result.

    Args:
        id: Stable: device, requirement and object.
        requirement: Requirement id.
        sentence: The rule in words.
        level: ``manual``, ``shall`` or ``should``.
        source: Where the rule stands.
        service: CANopen service.
        object: What the check was applied to.
        verdict: One of `VERDICTS`.
        expected: What the deciding measurement expected; empty without one.
        actual: What it found.
        unit: Its unit.
        quantity: What it compares.
        reason: Why there is no pass or fail.
        duration_s: On the bench's clock.
        trace: Slice of the trace, ``trace.log:12-40``.
        readings: Ambiguity to the reading that the device follows here.
        deviations: Every comparison that failed.
        measurements: Every comparison of numbers, failed or not: ``quantity``, ``unit``, ``values``
            and their limits ``least``, ``most`` and ``nominal``, each of them null where there is none.
        eds: What the EDS says of a deviation's object, and who stands alone; empty without an EDS.
        begins: Line of the trace at which the check itself begins, its set-up done.
        repro: The command that runs a failed item again.
        marker: Its number in the marker frames; 0 without them.
        known: Who knows its deviation, why and until when; empty if nobody.
        tried: What came of tries before the one that is told here; empty without any.
    """

    id: str
    requirement: str
    sentence: str
    level: str
    source: str
    service: str
    object: str
    verdict: VerdictWord
    expected: str = ""
    actual: str = ""
    unit: str = ""
    quantity: str = ""
    reason: str = ""
    duration_s: float = 0.0
    trace: str = ""
    readings: Mapping[str, int] = field(default_factory=dict)
    deviations: tuple[Mapping[str, str], ...] = ()
    measurements: tuple[Mapping[str, JsonValue], ...] = ()
    eds: Mapping[str, str] = field(default_factory=dict)
    begins: int = 0
    repro: str = ""
    marker: int = 0
    known: str = ""
    tried: str = ""

    @property
    def seen(self) -> str:
        """What was seen, against what was expected."""
        return f"{self.quantity}: {self.actual} against {self.expected}"

    def undecided(self, reason: str) -> Item:
        """Return the same item as one that blames nobody, for a reason."""
        return replace(
            self, verdict="inconclusive", reason=reason, repro="", deviations=(), known=""
        )


@dataclass(slots=True)
class Results:
    """A run's record.

    Args:
        run: Provenance: suite, spec, bench, seed, times.
        device: What was judged.
        items: In the order in which they ran.
        strict: Deviations at level ``should`` count.
        aborted: Why the run ended early, empty if it did not.
        left_changed: What the run did not leave as it was, empty if all is.
        illegal: What the node did that no node may, empty if nothing.
        scanned: What a walk over the object dictionary found; None without one.
        manual: What the manual says and leaves open, for the report: ``statements``, ``ambiguities``.
    """

    run: dict[str, JsonValue]
    device: dict[str, JsonValue]
    items: list[Item] = field(default_factory=list)
    strict: bool = False
    aborted: str = ""
    left_changed: str = ""
    illegal: str = ""
    complete: bool = False
    scanned: Scanned | None = None
    manual: dict[str, JsonValue] = field(default_factory=dict)
    _texts: list[str] = field(default_factory=list, repr=False)

    def replace_last(self, item: Item) -> None:
        """Take back what was said of the last item, written or not."""
        self.items[-1] = item
        del self._texts[len(self.items) - 1 :]

    def take_last(self) -> Item:
        """Take the last item off and return it."""
        del self._texts[len(self.items) - 1 :]
        return self.items.pop()

    def put_in_order(self, ids: Sequence[str]) -> None:
        """Put the items into the order of some ids."""
        places = {it: place for place, it in enumerate(ids)}
        self.items.sort(key=lambda item: places[item.id])
        self._texts.clear()

    def abort(self, reason: str) -> None:
        """Note why the run ended early; the first reason stays."""
        self.aborted = self.aborted or reason

    def counts(self) -> dict[str, int]:
        """Return how many items have each verdict."""
        counted = Counter(item.verdict for item in self.items)
        return {word: counted[word] for word in VERDICTS}

    def deviations(self) -> list[Item]:
        """Return the failed items for which the device does not conform, known or not."""
        return [item for item in self.items if self.deviates(item)]

    def deviates(self, item: Item) -> bool:
        """Tell whether an item failed that decides the run."""
        return item.verdict == "fail" and (self.strict or item.level != "should")

    def remarks(self) -> list[Item]:
        """Return the failed items at level ``should``, which do not decide the run."""
        return (
            []
            if self.strict
            else [i for i in self.items if i.verdict == "fail" and i.level == "should"]
        )

    @property
    def exit_code(self) -> int:
        """0 conforms, 1 deviations that nobody knows, 2 inconclusive or the bench failed."""
        if not all(item.known for item in self.deviations()):
            return 1
        counts = self.counts()
        decided = counts["pass"] + counts["fail"]
        if (
            self.aborted
            or self.left_changed
            or self.illegal
            or not self.complete
            or counts["inconclusive"]
            or not decided
        ):
            return 2
        return 0

    @property
    def verdict(self) -> str:
        """The run in one word: ``conforms``, ``deviates``, known or not, or ``inconclusive``."""
        if self.deviations():
            return "deviates"
        return ("conforms", "deviates", "inconclusive")[self.exit_code]

    def to_json(self) -> str:
        """Return the record as JSON text."""
        summary: dict[str, JsonValue] = {
            "verdict": self.verdict,
            "exit_code": self.exit_code,
            "complete": self.complete,
            "aborted": self.aborted,
            "left_changed": self.left_changed,
            "illegal": self.illegal,
            "items": len(self.items),
            "known": sum(bool(item.known) for item in self.deviations()),
        }
        summary.update(self.counts())
        self._texts += (_to_line(item) for item in self.items[len(self._texts) :])
        parts = {
            "run": _to_json(self.run),
            "device": _to_json(self.device),
            "items": "[\n" + ",\n".join(self._texts) + "\n]",
            "summary": _to_json(summary),
        }
        if self.manual:
            parts["manual"] = _to_json(self.manual)
        if self.scanned is not None:
            parts["scan"] = _to_json(asdict(self.scanned))
        return "{\n" + ",\n".join(f'"{name}": {text}' for name, text in parts.items()) + "\n}"

    def write(self, path: Path) -> None:
        """Write the record so that a reader never sees half of it.

        Raises:
            BenchError: The disk does not take it.
        """
        draft = path.with_suffix(".tmp")
        try:
            draft.write_text(self.to_json(), encoding="utf-8", newline="\n")
            os.replace(draft, path)  # noqa: PTH105 - atomic on every system
        except OSError as error:
            raise BenchError(f"cannot write {path}: {error.strerror or error}") from error


def _to_line(item: Item) -> str:
    content = {name: getattr(item, name) for name in Item.__slots__}
    return json.dumps(content, ensure_ascii=True)


def _to_json(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=1, ensure_ascii=True)
