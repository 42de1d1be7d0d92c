"""Loading a device spec: read, validated and linted as a whole, then resolved as often as needed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from conformance.errors import Problem, SpecError
from conformance.spec.behaviours import Behaviour, named_objects
from conformance.spec.document import SpecDocument
from conformance.spec.fields import key_of
from conformance.spec.linter import find_mistakes
from conformance.spec.model import DeviceSpec, Entry, Key, OtherBehaviours, OtherServices
from conformance.spec.readings import (
    ChangeError,
    changes_of,
    patched,
    touched_objects,
    touches_behaviours,
    touches_services,
)
from conformance.spec.resolve import EntryResolver, chosen_readings, with_alternatives
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import Path_, YamlFile, read_yaml, spell


@dataclass(frozen=True, slots=True)
class SpecFile:
    """A device spec file that holds together.

    Args:
        yaml: The file.
        document: Its content.
        changes: Path to the value a device has there instead, whatever reading it follows.
    """

    yaml: YamlFile
    document: SpecDocument
    changes: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self.yaml.path.stem

    @property
    def variants(self) -> tuple[str, ...]:
        """Names of the variants; the first one is the default."""
        return tuple(self.document.variants)

    def changed(self, changes: Mapping[str, Any]) -> SpecFile:
        """Return the spec of a device that differs from this one.

        Args:
            changes: Path in the file (``objects/0x1017/default``) to the value there instead.

        Raises:
            SpecError: A path does not exist, or a value does not fit it.
        """
        try:
            patched(self.document, self.yaml.data, changes)
        except ChangeError as error:
            raise SpecError(
                *(f"--fault: {spell(path)}: {text}" for path, text in error.mistakes)
            ) from error
        return replace(self, changes=dict(changes))

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
            SpecError: There is no such variant, node-ID or reading, or readings exclude each other.
        """
        asked = readings or {}
        variant = self._variant(variant)
        node_id = self._node_id(node_id)
        chosen = self._readings(asked)
        try:
            document = self._under(chosen)
        except ChangeError as error:
            raise SpecError(self._conflict(asked, error)) from error
        resolver = EntryResolver(variant, node_id, _ignore)
        others = self._other_readings(resolver, chosen, asked)
        entries = resolver.entries(document)
        return DeviceSpec(
            name=self.name,
            device=document.device,
            manual=document.manual,
            variant=variant,
            node_id=node_id,
            bitrate=document.factory.bitrate,
            services=document.services.of_variant(variant),
            entries=with_alternatives(entries, others),
            ambiguities=tuple(document.ambiguities),
            readings=chosen,
            sha256=hashlib.sha256(self.yaml.text).hexdigest(),
            behaviours=_that_hold(document.behaviours, entries),
            other_services=tuple(self._other_services(variant, chosen, asked)),
            other_behaviours=tuple(self._other_behaviours(chosen, asked, entries)),
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

    def _other_readings(
        self, resolver: EntryResolver, chosen: Mapping[str, int], asked: Mapping[str, int]
    ) -> list[tuple[str, int, list[int], dict[Key, Entry]]]:
        """Return what each reading not chosen of an open ambiguity makes of the entries."""
        others = []
        for ambiguity in self.document.ambiguities:
            if ambiguity.judged_by != "either" or ambiguity.id in asked:
                continue
            indices = touched_objects(
                {path: None for reading in ambiguity.readings for path in reading.changes}
            )
            for number in range(1, len(ambiguity.readings) + 1):
                if not indices or number == chosen[ambiguity.id]:
                    continue
                try:
                    other = self._under({**chosen, ambiguity.id: number})
                except ChangeError:  # a reading that those asked for exclude
                    continue
                entries = {
                    entry.key: entry
                    for index in indices
                    if index in other.objects
                    for entry in resolver.object(other, index)
                }
                others.append((ambiguity.id, number, indices, entries))
        return others

    def _other_services(
        self, variant: str, chosen: Mapping[str, int], asked: Mapping[str, int]
    ) -> Iterator[OtherServices]:
        """Return the services under each reading not chosen of an open ambiguity about them."""
        for ambiguity in self.document.ambiguities:
            if ambiguity.judged_by != "either" or ambiguity.id in asked:
                continue
            changes = {path: None for reading in ambiguity.readings for path in reading.changes}
            for number in range(1, len(ambiguity.readings) + 1):
                if number != chosen[ambiguity.id] and touches_services(changes):
                    try:
                        other = self._under({**chosen, ambiguity.id: number})
                    except ChangeError:  # a reading that those asked for exclude
                        continue
                    services = other.services.of_variant(variant)
                    yield OtherServices(ambiguity.id, number, services)

    def _other_behaviours(
        self, chosen: Mapping[str, int], asked: Mapping[str, int], entries: Mapping[Key, Entry]
    ) -> Iterator[OtherBehaviours]:
        """Return the behaviours under each reading not chosen of an open ambiguity about them."""
        for ambiguity in self.document.ambiguities:
            if ambiguity.judged_by != "either" or ambiguity.id in asked:
                continue
            changes = {path: None for reading in ambiguity.readings for path in reading.changes}
            for number in range(1, len(ambiguity.readings) + 1):
                if number != chosen[ambiguity.id] and touches_behaviours(changes):
                    try:
                        other = self._under({**chosen, ambiguity.id: number})
                    except ChangeError:  # a reading that those asked for exclude
                        continue
                    holding = _that_hold(other.behaviours, entries)
                    yield OtherBehaviours(ambiguity.id, number, holding)

    def _under(self, chosen: Mapping[str, int]) -> SpecDocument:
        ambiguities = self.document.ambiguities
        changes = changes_of(ambiguities, [chosen[ambiguity.id] for ambiguity in ambiguities])
        return patched(self.document, self.yaml.data, {**changes, **self.changes})

    def _conflict(self, asked: Mapping[str, int], error: ChangeError) -> str:
        path, text = error.mistakes[0]
        got = ", ".join(f"{name}={number}" for name, number in asked.items())
        reason = f"{spell(path)}: {text}"
        return f"--reading: expected readings that do not exclude each other, got {got} ({reason})"


def _that_hold(
    behaviours: Mapping[str, Behaviour], entries: Mapping[Key, Entry]
) -> dict[str, Behaviour]:
    """Return the behaviours that hold where there are these entries."""
    return {
        name: behaviour
        for name, behaviour in behaviours.items()
        if behaviour.holds
        and all(key_of(named) in entries for _, named in named_objects(behaviour))
    }


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
        problems += find_mistakes(yaml, document)
    if problems or document is None:
        return None, sorted(dict.fromkeys(problems), key=lambda problem: problem.line)
    return SpecFile(yaml, document), []


def load_spec(path: Path) -> SpecFile:
    """Return the spec in a file.

    Raises:
        SpecError: With every problem of the file.
    """
    return _load(path, state_of(path))


def state_of(path: Path) -> tuple[int, ...]:
    """Return what changes when a file does."""
    try:
        stat = path.stat()
    except (OSError, ValueError):  # reading it tells why
        return ()
    return stat.st_dev, stat.st_ino, stat.st_mtime_ns, stat.st_size


@lru_cache(maxsize=32)
def _load(path: Path, _state: tuple[int, ...]) -> SpecFile:
    file, problems = find_problems(path)
    if file is None:
        raise SpecError(*problems)
    return file
