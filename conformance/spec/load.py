"""Loading a device spec: read, validated and linted as a whole, then resolved as often as needed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from conformance.errors import Problem, SpecError
from conformance.spec.document import SpecDocument
from conformance.spec.lint import lint_document, lint_entries, lint_services
from conformance.spec.model import DeviceSpec
from conformance.spec.resolve import (
    EntryResolver,
    Report,
    chosen_readings,
    patched,
    touched_objects,
    with_alternatives,
)
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import Path_, YamlFile, read_yaml


@dataclass(frozen=True, slots=True)
class SpecFile:
    """A device spec file that holds together."""

    yaml: YamlFile
    document: SpecDocument

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self.yaml.path.stem

    @property
    def variants(self) -> tuple[str, ...]:
        """Names of the variants; the first one is the default."""
        return tuple(self.document.variants)

    def resolve(
        self,
        variant: str | None = None,
        node_id: int | None = None,
        readings: Mapping[str, int] | None = None,
    ) -> DeviceSpec:
        """Return the spec of one variant at one node-ID.

        Args:
            variant: Name of a variant; the first one of the file when None.
            node_id: 1..127; the factory's when None.
            readings: Ambiguity id to reading number, for those that shall not be as judged.

        Raises:
            SpecError: There is no such variant, node-ID or reading.
        """
        variant = self._variant(variant)
        node_id = self._node_id(node_id)
        chosen = self._readings(readings or {})
        document = self._under(chosen)
        resolver = EntryResolver(variant, node_id, _ignore)
        others = []
        for ambiguity in self.document.ambiguities:
            if ambiguity.judged_by != "either" or ambiguity.id in (readings or {}):
                continue
            indices = touched_objects(
                {path: None for reading in ambiguity.readings for path in reading.changes}
            )
            for number in range(1, len(ambiguity.readings) + 1):
                if indices and number != chosen[ambiguity.id]:
                    other = self._under({**chosen, ambiguity.id: number})
                    entries = {e.key: e for i in indices for e in resolver.object(other, i)}
                    others.append((ambiguity.id, number, indices, entries))
        return DeviceSpec(
            name=self.name,
            device=document.device,
            manual=document.manual,
            variant=variant,
            node_id=node_id,
            bitrate=document.factory.bitrate,
            services=document.services,
            entries=with_alternatives(resolver.entries(document), others),
            ambiguities=tuple(document.ambiguities),
            readings=chosen,
            sha256=hashlib.sha256(self.yaml.text).hexdigest(),
        )

    def _variant(self, name: str | None) -> str:
        if name is None:
            return self.variants[0]
        if name not in self.variants:
            raise SpecError(
                f"--variant: expected one of {', '.join(self.variants)} ({self.name}), got {name!r}"
            )
        return name

    def _node_id(self, node_id: int | None) -> int:
        if node_id is None:
            return self.document.factory.node_id
        if not 1 <= node_id <= 127:
            raise SpecError(f"--node-id: expected 1 to 127, got {node_id}")
        return node_id

    def _readings(self, asked: Mapping[str, int]) -> dict[str, int]:
        known = {a.id: len(a.readings) for a in self.document.ambiguities}
        for name, number in asked.items():
            if name not in known:
                raise SpecError(f"--reading: expected an ambiguity of {self.name}, got {name!r}")
            if not 1 <= number <= known[name]:
                raise SpecError(f"--reading: expected 1 to {known[name]} for {name}, got {number}")
        return chosen_readings(self.document.ambiguities, asked)

    def _under(self, chosen: Mapping[str, int]) -> SpecDocument:
        changes: dict[str, Any] = {}
        for ambiguity in self.document.ambiguities:
            changes.update(ambiguity.readings[chosen[ambiguity.id] - 1].changes)
        return patched(self.document, self.yaml.data, changes)


def _ignore(path: Path_, text: str) -> None:
    """Mistakes were reported when the file was loaded."""


def find_problems(path: Path) -> tuple[SpecFile | None, list[Problem]]:
    """Return the spec file, if it can be used, and every problem found in it."""
    try:
        yaml = read_yaml(path)
    except SpecError as error:
        return None, [p for p in error.problems if isinstance(p, Problem)]
    if yaml.data is None:
        return None, [Problem(path, 0, "", "expected a device spec, got an empty file")]
    document, invalid = validate(SpecDocument, yaml)
    problems = [*yaml.problems, *invalid]
    if document is not None:
        problems += _lint(SpecFile(yaml, document))
    if problems or document is None:
        return None, sorted(dict.fromkeys(problems), key=lambda problem: problem.line)
    return SpecFile(yaml, document), []


def _lint(file: SpecFile) -> list[Problem]:
    problems: list[Problem] = []

    def report(path: Path_, text: str) -> None:
        problems.append(file.yaml.problem(path, text))

    lint_document(file.document, file.yaml.data, report)
    if problems:
        return problems
    for variant in file.variants:
        resolver = EntryResolver(variant, file.document.factory.node_id, report)
        entries = resolver.entries(file.document)
        lint_entries(entries, entries, file.document, report)
        lint_services(entries, file.document.services, report)
        for document, indices in _every_reading(file, report):
            changed = {e.key: e for i in indices for e in resolver.object(document, i)}
            kept = {key: e for key, e in entries.items() if key[0] not in indices}
            lint_entries(changed, dict(sorted((kept | changed).items())), document, report)
    return problems


def _every_reading(file: SpecFile, report: Report) -> Iterator[tuple[SpecDocument, list[int]]]:
    """Return the document under each single reading, with the objects it changes."""
    for number, ambiguity in enumerate(file.document.ambiguities):
        for place, reading in enumerate(ambiguity.readings):
            if not reading.changes:
                continue
            try:
                document = patched(file.document, file.yaml.data, reading.changes)
            except ValidationError as error:
                report(
                    ("ambiguities", number, "readings", place, "changes"),
                    f"expected a value that fits its path, got: {error.errors()[0]['msg']}",
                )
            else:
                yield document, touched_objects(reading.changes)


def load_spec(path: Path) -> SpecFile:
    """Return the spec in a file.

    Raises:
        SpecError: With every problem of the file.
    """
    stat = path.stat() if path.exists() else None
    return _load(path, stat and (stat.st_mtime_ns, stat.st_size))


@lru_cache(maxsize=32)
def _load(path: Path, _state: tuple[int, int] | None) -> SpecFile:
    file, problems = find_problems(path)
    if file is None:
        raise SpecError(*problems)
    return file
