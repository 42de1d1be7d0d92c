"""Linting a whole spec: every variant as judged, then under each other reading of its ambiguities."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from conformance.errors import Problem
from conformance.spec.document import Ambiguity, SpecDocument
from conformance.spec.lint import lint_entries
from conformance.spec.lint_behaviours import lint_behaviours
from conformance.spec.lint_document import (
    lint_ambiguities,
    lint_causes,
    lint_objects,
    lint_service_variants,
)
from conformance.spec.lint_services import lint_services
from conformance.spec.model import Entry, Key
from conformance.spec.readings import (
    ChangeError,
    changes_of,
    parse_path,
    patched,
    touched_objects,
)
from conformance.spec.resolve import EntryResolver
from conformance.spec.yaml_reader import Path_, YamlFile, spell


def find_mistakes(file: YamlFile, document: SpecDocument) -> list[Problem]:
    """Return every problem of a file whose content is a spec document."""
    return list(_Linter(file, document).problems())


class _Mistakes(list[tuple[Path_, str]]):
    """Paths, as if the changes of readings stood in the file itself, each with a sentence."""

    def report(self, path: Path_, text: str) -> None:
        self.append((path, text))


class _Linter:
    """Lints one file.

    Args:
        file: The file.
        document: Its content.
    """

    def __init__(self, file: YamlFile, document: SpecDocument) -> None:
        self._file = file
        self._document = document
        self._ambiguities = document.ambiguities
        self._judged = [_judged(ambiguity) for ambiguity in document.ambiguities]
        self._entries: dict[str, dict[Key, Entry]] = {}
        self._doubted = {
            parse_path(text)
            for ambiguity in document.ambiguities
            for reading in ambiguity.readings
            for text in reading.changes
        }

    def problems(self) -> Iterator[Problem]:
        """Return every problem, some more than once."""
        base, found = self._as_judged()
        places: dict[Path_, Path_] = {}
        for number, reading in enumerate(self._judged):
            places |= self._places(number, reading)
        for path, text in found:
            yield self._problem(path, text, places)
        known = {path for path, _ in found}
        for number, ambiguity in enumerate(self._ambiguities):
            for reading in range(1, len(ambiguity.readings) + 1):
                changes = ambiguity.readings[reading - 1].changes
                here = ("ambiguities", number, "readings", reading - 1) if changes else None
                for path, text in self._under(base, number, reading):
                    if path not in known:
                        yield self._problem(path, text, self._places(number, reading), here)

    def _as_judged(self) -> tuple[bool, _Mistakes]:
        """Lint the whole file; the first value tells whether the judged readings fit it."""
        found = _Mistakes()
        lint_ambiguities(self._ambiguities, found.report)
        document, fits = self._document, True
        try:
            changes = changes_of(self._ambiguities, self._judged)
            document = patched(document, self._file.data, changes)
        except ChangeError as error:
            found += error.mistakes
            fits = False
        lint_objects(document.objects, document, found.report)
        for variant in document.variants:
            resolver = EntryResolver(variant, document.factory.node_id, found.report)
            entries = self._entries[variant] = resolver.entries(document)
            lint_entries(document.objects, entries, self._doubted, found.report)
            lint_services(entries, document.services.of_variant(variant), found.report)
        lint_causes(document, found.report)
        lint_service_variants(document, found.report)
        lint_behaviours(document, found.report)
        return fits, found

    def _under(self, judged_fits: bool, number: int, reading: int) -> _Mistakes:
        """Lint what one reading changes, all other ambiguities being read as judged."""
        found = _Mistakes()
        ambiguity, judged = self._ambiguities[number], self._judged[number]
        own = ambiguity.readings[reading - 1].changes
        instead_of = ambiguity.readings[judged - 1].changes
        if reading == judged or not (own or instead_of):
            return found
        if judged_fits:
            numbers = [*self._judged[:number], reading, *self._judged[number + 1 :]]
            changes = changes_of(self._ambiguities, numbers)
        else:
            changes = own
        try:
            document = patched(self._document, self._file.data, changes)
        except ChangeError as error:
            found += error.mistakes
            return found
        touched = touched_objects({**instead_of, **own})
        lint_objects([i for i in touched if i in document.objects], document, found.report)
        lint_causes(document, found.report)
        lint_service_variants(document, found.report)
        lint_behaviours(document, found.report)
        for variant in document.variants:
            self._lint_variant(document, variant, touched, found)
        return found

    def _lint_variant(
        self, document: SpecDocument, variant: str, touched: list[int], found: _Mistakes
    ) -> None:
        resolver = EntryResolver(variant, document.factory.node_id, found.report)
        entries = {key: e for key, e in self._entries[variant].items() if key[0] not in touched}
        for index in touched:
            if index in document.objects:
                entries |= {entry.key: entry for entry in resolver.object(document, index)}
        entries = dict(sorted(entries.items()))
        lint_entries(_with_dependents(touched, entries), entries, self._doubted, found.report)
        lint_services(entries, document.services.of_variant(variant), found.report)

    def _places(self, number: int, reading: int) -> dict[Path_, Path_]:
        """Return for each path that a reading changes where in the file it says so."""
        place = ("ambiguities", number, "readings", reading - 1, "changes")
        changes = self._ambiguities[number].readings[reading - 1].changes
        return {parse_path(text): (*place, text) for text in changes}

    def _problem(
        self, path: Path_, text: str, places: Mapping[Path_, Path_], here: Path_ | None = None
    ) -> Problem:
        """Return a problem at the change that is to blame, else at ``here`` or where it shows."""
        best = max(places, key=lambda changed: _shared(changed, path), default=())
        shared = _shared(best, path)
        if places and (shared == min(len(best), len(path)) or (here and shared >= 2)):
            here = places[best]
        if here is None:
            return self._file.problem(path, text)
        return self._file.problem(here, text if path == best else f"{text} ({spell(path)})")


def _judged(ambiguity: Ambiguity) -> int:
    """Return the number of the judged reading; the first one when there is no such reading."""
    judged = ambiguity.judged_by
    return judged if isinstance(judged, int) and 1 <= judged <= len(ambiguity.readings) else 1


def _shared(one: Path_, other: Path_) -> int:
    """Return how many keys two paths share from the beginning."""
    shared = 0
    for a, b in zip(one, other, strict=False):
        if a != b:
            break
        shared += 1
    return shared


def _with_dependents(touched: Iterable[int], entries: Mapping[Key, Entry]) -> list[int]:
    """Return some indices and those whose limits depend on them."""
    indices = set(touched)
    for entry in entries.values():
        if entry.limits_by is not None and entry.limits_by.key[0] in touched:
            indices.add(entry.index)
    return sorted(indices)
