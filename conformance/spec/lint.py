"""What an entry says must hold together: defaults in their ranges, limits, sub-index 0."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

from conformance.spec.model import Entry, Key, Range, address, is_legal
from conformance.spec.resolve import Report
from conformance.spec.yaml_reader import Path_, shown
from conformance.wire.datatypes import DataType
from conformance.wire.errors import WireError

Mistakes = Iterator[tuple[Path_, str]]


def entry_path(entry: Entry) -> Path_:
    """Return where an entry stands in the file."""
    top: Path_ = ("objects", entry.index)
    return (*top, "subs", entry.sub) if entry.in_record else top


def lint_entries(
    indices: Iterable[int],
    entries: Mapping[Key, Entry],
    doubted: Collection[Path_],
    report: Report,
) -> None:
    """Report each entry of some objects that contradicts itself or its neighbours.

    Args:
        indices: The objects.
        entries: All entries of the variant.
        doubted: Paths that an ambiguity of the manual changes.
        report: Called with path and sentence.
    """
    for index in indices:
        subs = [entry for key, entry in entries.items() if key[0] == index]
        for entry in subs:
            path = entry_path(entry)
            for place, text in _mistakes(entry, entries):
                report((*path, *place), text)
        for path, text in _highest_sub_mistakes(subs, doubted):
            report(path, text)


def interval_mistakes(ranges: Iterable[Range], low: int, high: int, what: str) -> Iterator[str]:
    """Return what is wrong with some intervals that must lie within ``low`` to ``high``."""
    for first, last in ranges:
        if first > last:
            yield f"expected the lower end first, got {first} to {last}"
        elif first < low or last > high:
            yield f"expected {low} to {high} for {what}, got {first} to {last}"


def _mistakes(entry: Entry, entries: Mapping[Key, Entry]) -> Mistakes:
    unfit: tuple[str, ...]
    if entry.type.is_integer:
        yield from _integer_mistakes(entry)
        yield from _limits_mistakes(entry, entries)
        unfit = ("octets",)
    else:
        yield from _text_mistakes(entry)
        unfit = ("ranges", "values", "bits", "limits_by")
    for attribute in unfit:
        if getattr(entry, attribute) is not None:
            yield (attribute,), f"expected no {attribute} for {entry.type.name}, got some"


def _integer_mistakes(entry: Entry) -> Mistakes:
    low, high, name = entry.type.minimum, entry.type.maximum, entry.type.name
    wrong_ranges = list(interval_mistakes(entry.ranges or (), low, high, name))
    for text in wrong_ranges:
        yield ("ranges",), text
    for value in entry.values or ():
        if not low <= value <= high:
            yield ("values", value), f"expected {low} to {high} for {name}, got {value}"
    for bit in entry.bits or ():
        if not 0 <= bit < (entry.type.bits or 0):
            yield ("bits", bit), f"expected bit 0 to {(entry.type.bits or 0) - 1}, got {bit}"
    if not isinstance(entry.default, int):
        return
    if not low <= entry.default <= high:
        yield ("default",), f"expected {low} to {high} for {name}, got {entry.default}"
    elif _default_counts(entry) and not wrong_ranges and not is_legal(entry.default, entry.legal):
        wanted = _spell_ranges(entry.legal)
        yield ("default",), f"expected a value in its range ({wanted}), got {entry.default}"


def _default_counts(entry: Entry) -> bool:
    """Tell whether the default is a value that the entry must be able to hold."""
    return entry.kind in ("config", "constant", "identity")


def _spell_ranges(ranges: tuple[Range, ...] | None) -> str:
    return ", ".join(f"{a}" if a == b else f"{a} to {b}" for a, b in ranges or ())


def _limits_mistakes(entry: Entry, entries: Mapping[Key, Entry]) -> Mistakes:
    limits = entry.limits_by
    if limits is None:
        return
    low, high, name = entry.type.minimum, entry.type.maximum, entry.type.name
    wrong = False
    for value, ranges in limits.ranges.items():
        for text in interval_mistakes(ranges, low, high, name):
            wrong = True
            yield ("limits_by", "ranges", value), text
    other = entries.get(limits.key)
    if other is None or not other.type.is_integer:
        what = "a documented" if other is None else "an integer"
        got = address(*limits.key)
        yield ("limits_by", "object"), f"expected {what} object, got {got}"
        return
    for value in limits.ranges:
        if not is_legal(value, other.legal):
            wanted = f"a value of {other.address} ({_spell_ranges(other.legal)})"
            yield ("limits_by", "ranges", value), f"expected {wanted}, got {value}"
    if wrong or not isinstance(other.default, int) or not isinstance(entry.default, int):
        return
    allowed = limits.ranges.get(other.default)
    if _default_counts(entry) and not is_legal(entry.default, allowed):
        wanted = f"{_spell_ranges(allowed)} while {other.address} is {other.default}"
        yield ("default",), f"expected {wanted}, got {entry.default}"


def _text_mistakes(entry: Entry) -> Mistakes:
    octets = entry.octets
    if octets is not None and not 0 <= octets[0] <= octets[1]:
        wanted = "expected least and greatest length in octets"
        yield ("octets",), f"{wanted}, got {octets[0]} to {octets[1]}"
        return
    if not isinstance(entry.default, str):
        return
    wanted, encode = _TEXTS.get(entry.type, _OTHER_TEXT)
    try:
        length = len(encode(entry.default))
    except (ValueError, WireError):
        got = shown(entry.default)
        yield ("default",), f"expected {wanted} for {entry.type.name}, got {got}"
        return
    low, high = octets or (entry.type.size or length, entry.type.size or length)
    if not low <= length <= high:
        yield ("default",), f"expected {_spell_ranges(((low, high),))} octets, got {length}"


def _real(text: str) -> bytes:
    if not math.isfinite(float(text)):
        raise ValueError(text)
    return bytes(8)


def _boolean(text: str) -> bytes:
    if text.lower() not in ("0", "1", "false", "true"):
        raise ValueError(text)
    return bytes(1)


_TEXTS: dict[DataType, tuple[str, Callable[[str], bytes]]] = {
    DataType.BOOLEAN: ('"0" or "1"', _boolean),
    DataType.REAL32: ("a number", lambda text: _real(text)[:4]),
    DataType.REAL64: ("a number", _real),
    DataType.VISIBLE_STRING: ("printable ASCII characters", DataType.VISIBLE_STRING.encode),
    DataType.UNICODE_STRING: ("Unicode characters", DataType.UNICODE_STRING.encode),
}
_OTHER_TEXT: tuple[str, Callable[[str], bytes]] = (
    "characters up to FFh",
    lambda text: text.encode("latin-1"),
)


def _highest_sub_mistakes(subs: list[Entry], doubted: Collection[Path_]) -> Mistakes:
    if not subs or not subs[0].in_record:
        return
    first = subs[0]
    if first.sub != 0:
        yield ("objects", first.index, "subs"), "expected sub-index 0, got none"
        return
    path = (*entry_path(first), "default")
    counts_something_else = first.access in ("rw", "wo") or first.kind in ("live", "counter")
    if counts_something_else or path in doubted or first.default is None:
        return
    highest = max(entry.sub for entry in subs)
    certain = max((entry.sub for entry in subs if not entry.optional), default=highest)
    if not isinstance(first.default, int) or not certain <= first.default <= highest:
        wanted = f"expected {highest}, the highest sub-index listed"
        yield path, f"{wanted}, got {shown(first.default)}"
