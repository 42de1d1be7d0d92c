"""From a device spec to an EDS (CiA 306-1): what an EDS can hold, the rest as its comments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from conformance.spec.eds.device_info import device_info
from conformance.spec.eds.model import ARRAY, DOMAIN, LISTS, RECORD, VAR, list_of
from conformance.spec.eds.values import Relative
from conformance.spec.load import SpecFile
from conformance.spec.model import DeviceSpec, Entry, Range
from conformance.wire.datatypes import DataType, Value

_PROBES: Final = (1, 2, 127)
"""Node-IDs that tell a value that counts from the node-ID from others."""

_TEXTS: Final = (DataType.VISIBLE_STRING, DataType.UNICODE_STRING)
_REALS: Final = (DataType.REAL32, DataType.REAL64)
_RECORDS: Final = (0x1018, *range(0x1200, 0x1C00))
"""Objects that CiA 301 makes records though their entries may all be alike."""


def to_eds(
    file: SpecFile,
    variant: str | None,
    node_id: int | None,
    file_name: str,
    created: datetime,
) -> str:
    """Return one variant of a device spec as the text of an EDS.

    Args:
        file: The device spec.
        variant: The first one when None.
        node_id: Evaluate formulas with it; they stay formulas when None.
        file_name: Of the EDS.
        created: Date and time to put into it.

    Raises:
        SpecError: There is no such variant or node-ID.
    """
    nodes = _PROBES if node_id is None else (node_id,) * len(_PROBES)
    writer = _Objects(file, tuple(file.resolve(variant, node) for node in nodes))
    spec = file.resolve(variant, node_id)
    return "\r\n".join((*device_info(spec, file_name, created), *writer.lines()))


@dataclass(frozen=True, slots=True)
class _Objects:
    """The objects of an EDS.

    Args:
        file: The device spec.
        probes: One variant of it at the node-IDs of `_PROBES`, or thrice at one node-ID.
    """

    file: SpecFile
    probes: tuple[DeviceSpec, ...]

    @property
    def spec(self) -> DeviceSpec:
        """The variant."""
        return self.probes[0]

    def lines(self) -> Iterator[str]:
        """Return the lists of objects, each with its objects."""
        indices = [i for i in self.spec.indices() if self._listed(i)]
        for name in LISTS:
            members = [index for index in indices if list_of(index) == name]
            yield f"[{name}]"
            yield f"SupportedObjects={len(members)}"
            yield from (f"{n}=0x{index:04X}" for n, index in enumerate(members, 1))
            yield ""
            for index in members:
                yield from self._object(index)

    def _listed(self, index: int) -> list[Entry]:
        return [entry for entry in self.spec.subs(index) if not entry.reserved]

    def _object(self, index: int) -> Iterator[str]:
        entries = self._listed(index)
        reserved = [entry.address for entry in self.spec.subs(index) if entry.reserved]
        if not entries[0].in_record:
            yield f"[{index:04X}]"
            yield from self._entry(entries[0])
            return
        yield f"[{index:04X}]"
        yield f"ParameterName={_name(self._title(index))}"
        yield f"ObjectType=0x{_object_type(entries):X}"
        yield f"SubNumber={len(entries)}"
        if reserved:
            yield f"; reserved: {', '.join(reserved)}"
        yield ""
        for entry in entries:
            yield f"[{index:04X}sub{entry.sub:X}]"
            yield from self._entry(entry)

    def _title(self, index: int) -> str:
        """Return the name of an object; one that only a reading adds has none of its own."""
        doc = self.file.document.objects.get(index)
        return f"Object {index:04X}h" if doc is None else doc.name

    def _entry(self, entry: Entry) -> Iterator[str]:
        versions = [probe.entries[entry.key] for probe in self.probes]
        yield f"ParameterName={_name(entry.name)}"
        yield f"ObjectType=0x{DOMAIN if entry.type is DataType.DOMAIN else VAR:X}"
        yield f"DataType=0x{entry.type:04X}"
        yield f"AccessType={entry.access}"
        yield f"DefaultValue={_shown(entry, [v.default for v in versions])}"
        hulls = [_hull(version) for version in versions]
        if None not in hulls:
            for name, end in (("LowLimit", 0), ("HighLimit", 1)):
                yield f"{name}={_shown(entry, [h[end] for h in hulls if h is not None])}"
        if entry.mappable is not None:
            yield f"PDOMapping={int(entry.mappable)}"
        yield from (f"; {remark}" for remark in _remarks(entry))
        yield ""


def _shown(entry: Entry, values: list[Value | None]) -> str:
    """Return a value as an EDS has it, from its values at the node-IDs of `_PROBES`."""
    value = values[0]
    if value is None:
        return ""
    if isinstance(value, str):
        return _text(entry, value)
    if not isinstance(value, int):
        return str(value)
    offsets = {v - node for v, node in zip(values, _PROBES, strict=True) if isinstance(v, int)}
    if len(offsets) == 1:
        return str(Relative(offsets.pop()))
    return f"0x{value:X}" if value > 0xFF and entry.type.minimum == 0 else str(value)


def _text(entry: Entry, text: str) -> str:
    if entry.type is DataType.BOOLEAN:
        return str(int(text.lower() in ("1", "true")))
    if entry.type in _TEXTS or entry.type in _REALS:
        return text
    return text.encode("latin-1").hex().upper()


def _hull(entry: Entry) -> Range | None:
    """Return the least and the greatest legal value; an EDS can hold no gaps between them."""
    legal = entry.legal
    return None if not legal else (min(low for low, _ in legal), max(high for _, high in legal))


def _remarks(entry: Entry) -> Iterator[str]:
    """Return what the spec says and an EDS has no key for."""
    if entry.optional:
        yield "it is left open whether this exists"
    if entry.values is not None:
        yield f"values: {_name(', '.join(f'{v} = {text}' for v, text in entry.values.items()))}"
    elif len(entry.ranges or ()) > 1:
        yield f"ranges: {', '.join(f'{low} to {high}' for low, high in entry.ranges or ())}"
    if entry.limits_by is not None:
        index, sub = entry.limits_by.key
        yield f"limits depend on {index:04X}h:{sub:02X}"
    if entry.unit is not None:
        yield f"unit: {_name(entry.unit)}"


def _object_type(entries: list[Entry]) -> int:
    members = {(entry.type, entry.access) for entry in entries if entry.sub}
    return ARRAY if len(members) == 1 and entries[0].index not in _RECORDS else RECORD


def _name(text: str) -> str:
    """Return a text that stays on its line and is not cut short as a comment."""
    return " ".join(text.replace(" ;", ",").split())
