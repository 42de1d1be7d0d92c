"""Where a series of lots is kept: in a file, or in the history, which several stations share."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol

from pydantic import ValidationError

from conformance.bench.given_back.safe_file import write_safely
from conformance.errors import Problem, SpecError
from conformance.lots.lot_file import Lot
from conformance.lots.series import Terms, require_terms
from conformance.lots.switching import Concluded

if TYPE_CHECKING:
    from conformance.history.acting import Entering


class KeptSeries(Protocol):
    """The lots of a series that were concluded."""

    def load(self, lot: Lot) -> list[Concluded]:
        """Return the lots of the series that a lot belongs to, none where there is no series yet.

        Raises:
            SpecError: What is kept is damaged, or of lots that are inspected otherwise.
            BenchError: The database fails.
        """

    def note(self, lot: Lot, made: Concluded | None) -> None:
        """Note what became of a lot, in its place if it was noted before; None takes that back.

        Raises:
            SpecError: As of `load`.
            BenchError: It cannot be written.
        """


def kept_series(lot: Lot, history: Entering | None) -> KeptSeries | None:
    """Return where the series of a lot is kept; None for a lot without one.

    Raises:
        SpecError: It is kept in the history, which is not given.
    """
    name = lot.content.series
    if not name:
        return None
    if not lot.content.series_shared:
        return SeriesFile(Path(lot.path.parent, name))
    if history is None:
        raise SpecError(
            f"{lot.path}: series: expected --history, which keeps the series {name!r}, got none; "
            f"or the name of a file, as {name}.json"
        )
    return SharedSeries(history, name)


class _File(Terms):
    format: Literal[1] = 1
    lots: list[Concluded]


class SeriesFile:
    """A series in a file, for one station.

    Args:
        path: Of the file; it is made when it is not there.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def load(self, lot: Lot) -> list[Concluded]:
        """See `KeptSeries`."""
        path = self._path
        if not path.exists():
            return []
        try:
            known = _File.model_validate_json(path.read_text("ascii"))
        except (OSError, UnicodeDecodeError, ValidationError) as error:
            text = "expected a series of lots, got what is none"
            raise SpecError(Problem(path, 0, "", text)) from error
        require_terms(path, Terms(part=known.part, level=known.level, aql=known.aql), lot)
        return known.lots

    def note(self, lot: Lot, made: Concluded | None) -> None:
        """See `KeptSeries`."""
        lots = self.load(lot)
        place = next((nth for nth, it in enumerate(lots) if it.lot == lot.content.order), len(lots))
        lots[place : place + 1] = [] if made is None else [made]
        content = _File(**Terms.of(lot).model_dump(), lots=lots).model_dump(mode="json")
        write_safely(self._path, json.dumps(content, indent=1, ensure_ascii=True))


class _Row(Terms):
    lot: Concluded


class SharedSeries:
    """A series in the history; of two stations at once, none loses what the other notes.

    Args:
        history: The history.
        name: Of the series.
    """

    def __init__(self, history: Entering, name: str) -> None:
        self._history = history
        self._name = name

    def load(self, lot: Lot) -> list[Concluded]:
        """See `KeptSeries`."""
        found: list[Concluded] = []
        for content in self._history.series(self._name):
            try:
                row = _Row.model_validate_json(content)
            except ValidationError as error:
                text = f"series {self._name}: expected a concluded lot in the history, got what is none"
                raise SpecError(text) from error
            require_terms(
                f"series {self._name}", Terms(part=row.part, level=row.level, aql=row.aql), lot
            )
            found.append(row.lot)
        return found

    def note(self, lot: Lot, made: Concluded | None) -> None:
        """See `KeptSeries`."""
        content = None
        if made is not None:
            row = _Row(**Terms.of(lot).model_dump(), lot=made)
            content = json.dumps(row.model_dump(mode="json"), ensure_ascii=True)
        self._history.conclude(self._name, lot.content.order, content)
