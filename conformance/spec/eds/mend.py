"""What an EDS says must hold together as a device spec; what does not is left out, and told."""

from __future__ import annotations

from typing import Any, Final

from conformance.spec.document import SpecDocument
from conformance.spec.eds.draft import VARIANT, Draft
from conformance.spec.lint import lint_entries
from conformance.spec.lint_services import lint_services
from conformance.spec.resolve import EntryResolver
from conformance.spec.yaml_reader import Path_

_LINES: Final = {"ranges": ("low", "high")}
_KEYS: Final = {"default": "DefaultValue", "ranges": "LowLimit", "mappable": "PDOMapping"}
_OUT_OF_RANGE: Final = "expected a value in its range"


def mend(draft: Draft) -> None:
    """Leave out what `spec lint` would refuse, until it refuses nothing."""
    while mistakes := _mistakes(draft.data):
        before = len(draft.problems)
        for path, text in mistakes:
            _leave_out(draft, path, text)
        if len(draft.problems) == before:
            raise AssertionError(f"nothing to leave out for {mistakes}")


def _mistakes(data: dict[str, Any]) -> list[tuple[Path_, str]]:
    found: list[tuple[Path_, str]] = []
    document = SpecDocument.model_validate(data)

    def report(path: Path_, text: str) -> None:
        found.append((path, text))

    entries = EntryResolver(VARIANT, document.factory.node_id, report).entries(document)
    lint_entries(document.objects, entries, (), report)
    lint_services(entries, document.services, report)
    return found


def _leave_out(draft: Draft, path: Path_, text: str) -> None:
    if path[0] == "services":
        if draft.data["services"].pop(path[1], None) is not None:
            draft.comments["services",].append(f"{path[1]} is left out: {text}")
            draft.warn(0, f"services.{path[1]}", f"{text} (left out)")
        return
    place, found = _entry(draft, path)
    attribute = str(path[len(place)])
    if text.startswith(_OUT_OF_RANGE):
        attribute = "ranges"  # which of both is wrong is open; limits are what a check would try
    if found.pop(attribute, None) is None:
        return
    index, sub = place[1], place[3] if len(place) > 2 else 0
    assert isinstance(index, int)
    assert isinstance(sub, int)
    item = draft.eds.objects[index]
    entry = item.entries[sub]
    names = _LINES.get(attribute, (attribute,))
    draft.keep(place, *[entry.said[name] for name in names if name in entry.said])
    key = f"{item.address(sub)}.{_KEYS.get(attribute, attribute)}"
    draft.warn(entry.line_of(*names), key, f"{text} ({attribute} left out)")


def _entry(draft: Draft, path: Path_) -> tuple[Path_, dict[str, Any]]:
    """Return the entry that a path is about, and where it stands."""
    index = path[1]
    assert isinstance(index, int)
    found = draft.objects[index]
    if path[2] != "subs":
        return path[:2], found
    entry: dict[str, Any] = found["subs"][path[3]]
    return path[:4], entry
