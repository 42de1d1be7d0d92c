"""A device spec in the making: its content as a file would have it, and the comments beside it."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

from conformance.errors import Problem
from conformance.spec.eds.ini import IniLine
from conformance.spec.eds.kinds import SERIAL_NUMBER, follows_of, kind_of
from conformance.spec.eds.model import EdsEntry, EdsFile, EdsObject
from conformance.spec.eds.services import MAPPING, UNSAID, services_of, tpdo_count
from conformance.spec.eds.values import Number
from conformance.spec.eds.yaml_text import Hex, is_frame
from conformance.spec.yaml_reader import Path_
from conformance.wire.datatypes import DataType
from conformance.wire.pdo import MappingEntry

VARIANT = "standard"


@dataclass(slots=True)
class Draft:
    """A device spec in the making.

    Args:
        eds: Where it comes from.
        data: What the file will hold.
        comments: Lines to print above a key, by its path.
        problems: What was left out, or read in one of several ways.
    """

    eds: EdsFile
    data: dict[str, Any] = field(default_factory=dict)
    comments: defaultdict[Path_, list[str]] = field(default_factory=lambda: defaultdict(list))
    problems: list[Problem] = field(default_factory=list)

    def warn(self, line: int, key: str, text: str) -> None:
        """Note a problem."""
        self.problems.append(Problem(self.eds.ini.path, line, key, text))

    def keep(self, path: Path_, *lines: IniLine) -> None:
        """Keep lines of the EDS as comments."""
        self.comments[path] += [
            f"line {line.number}: {line}" for line in lines if not is_frame(line.value)
        ]

    @property
    def objects(self) -> dict[int, dict[str, Any]]:
        """The objects of the spec."""
        objects: dict[int, dict[str, Any]] = self.data["objects"]
        return objects


def draft_objects(draft: Draft) -> None:
    """Enter the services and every object of the EDS."""
    draft.data["services"] = services_of(draft.eds)
    for name in draft.data["services"].keys() & UNSAID.keys():
        draft.comments["services", name].append(f"the EDS does not say {UNSAID[name]}")
    draft.data["objects"] = {}
    for index, item in draft.eds.objects.items():
        if item.entries:
            draft.objects[index] = _object(draft, item)
    _make_mappable(draft)


def _object(draft: Draft, item: EdsObject) -> dict[str, Any]:
    path: Path_ = ("objects", item.index)
    draft.keep(path, *item.left)
    source = f"line {item.line}"
    if not item.in_record:
        return {**_entry(draft, item, item.entries[0], path), "source": source}
    subs = {
        sub: _entry(draft, item, entry, (*path, "subs", sub)) for sub, entry in item.entries.items()
    }
    if 0 not in subs:
        draft.comments[*path, "subs", 0].append("the EDS lists no sub-index 0")
        draft.warn(item.line, f"{item.index:04X}", "expected sub-index 0, got none")
        subs = {0: _unlisted_count(), **subs}
    _doubt_uncounted(draft, item, subs)
    return {"name": item.name, "source": source, "subs": subs}


def _unlisted_count() -> dict[str, Any]:
    return {
        "name": "Highest sub-index",
        "type": DataType.UNSIGNED8.name,
        "access": "ro",
        "kind": "constant",
        "optional": True,
    }


def _doubt_uncounted(draft: Draft, item: EdsObject, subs: dict[int, dict[str, Any]]) -> None:
    """Leave open what a constant sub-index 0 and the sub-indices listed do not agree on."""
    count = subs[0].get("default")
    if subs[0]["kind"] != "constant" or not isinstance(count, int):
        return
    if count > max(subs):
        subs[0]["kind"] = "live"
        text = f"expected {max(subs)}, the highest sub-index listed, got {count} (not judged)"
        draft.warn(item.entries[0].line_of("default"), item.address(0), text)
    for sub, entry in subs.items():
        if sub > max(count, 0):
            entry["optional"] = True
            text = (
                f"expected at most sub-index {count}, as sub-index 0 says (left open if it exists)"
            )
            draft.warn(item.entries[sub].line, item.address(sub), text)


def _entry(draft: Draft, item: EdsObject, entry: EdsEntry, path: Path_) -> dict[str, Any]:
    draft.keep(path, *entry.left)
    kind = kind_of(entry, in_record=item.in_record)
    result: dict[str, Any] = {
        "name": entry.name,
        "type": (entry.type or DataType.DOMAIN).name,
        "access": entry.access or "ro",
        "kind": kind,
    }
    if (entry.index, entry.sub) == SERIAL_NUMBER:
        if entry.default is not None and "default" in entry.said:
            draft.keep(path, entry.said["default"])
    elif entry.default is not None:
        result["default"] = _value(entry.default, entry.said.get("default"))
    if entry.low is not None or entry.high is not None:
        result["ranges"] = [_limits(entry)]
    if entry.unit is not None:
        result["unit"] = entry.unit
    if entry.mappable is not None:
        result["mappable"] = entry.mappable
    follows = follows_of(entry, draft.data["device"].get("profile"))
    if follows is not None:
        result["follows"] = follows
    if not entry.understood:
        draft.comments[path].append("type or access is not understood: nothing is judged")
        result["optional"] = True
    if item.in_record:
        result["source"] = f"line {entry.line}"
    return result


def _value(value: Number | str, line: IniLine | None = None) -> int | str:
    """Return a value as a spec has it, in hexadecimal where the EDS has it so."""
    if isinstance(value, int):
        return Hex(value) if line is not None and "x" in line.value.lower() else value
    if isinstance(value, str):
        return value
    return f"0x{value.offset:X} + NODEID" if value.offset else "NODEID"


def _limits(entry: EdsEntry) -> list[int | str]:
    kind = entry.type or DataType.UNSIGNED8
    low = kind.minimum if entry.low is None else entry.low
    high = kind.maximum if entry.high is None else entry.high
    return [_value(low, entry.said.get("low")), _value(high, entry.said.get("high"))]


def _make_mappable(draft: Draft) -> None:
    """Leave open whether an object may be mapped that a TPDO maps though its flag forbids it."""
    for number in range(tpdo_count(draft.eds)):
        mapping = draft.eds.objects[MAPPING + number]
        count = mapping.entries[0].default
        most = count if isinstance(count, int) else max(mapping.entries)
        for sub, entry in mapping.entries.items():
            word = entry.default
            if not 0 < sub <= most or not isinstance(word, int) or not 0 < word <= 0xFFFF_FFFF:
                continue
            place = MappingEntry.from_word(word)
            target = draft.eds.entries.get((place.index, place.sub))
            if target is None or target.mappable is not False:
                continue
            path, found = find(draft, target)
            if found.pop("mappable", None) is not None:
                draft.keep(path, *[target.said[n] for n in ("mappable",) if n in target.said])
                text = f"expected 1, for {mapping.address(sub)} maps it, got 0 (left open)"
                draft.warn(target.line_of("mappable"), f"{target.index:04X}.PDOMapping", text)


def find(draft: Draft, entry: EdsEntry) -> tuple[Path_, dict[str, Any]]:
    """Return where an entry stands in the spec, and what it holds there."""
    path: Path_ = ("objects", entry.index)
    found = draft.objects[entry.index]
    if draft.eds.objects[entry.index].in_record:
        return (*path, "subs", entry.sub), found["subs"][entry.sub]
    return path, found
