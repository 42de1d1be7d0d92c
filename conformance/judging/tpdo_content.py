"""What TPDOs of a recording carry, held against the documented ranges of what is mapped (CiA 301 v4.2.0, 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from conformance.checks import cases
from conformance.judging.recording import Seen
from conformance.spec.model import DeviceSpec, Entry, is_legal
from conformance.verdict import Verdict
from conformance.wire.pdo import MappingEntry, unpack


def content(
    spec: DeviceSpec, words: Sequence[int], frames: Sequence[Seen]
) -> Callable[[Verdict], object] | None:
    """Return what judges the values of some TPDOs, None where no range of theirs is documented.

    Args:
        spec: What the device is held against.
        words: The mapping, an UNSIGNED32 each.
        frames: The TPDOs, with nothing between that may change the mapping.
    """
    mapped = [MappingEntry.from_word(word) for word in words if word]
    bits = [it.bits for it in mapped]
    if not all(bits) or max(bits, default=65) > 64:
        return None
    entries = [spec.entry(it.index, it.sub) for it in mapped]
    fields = [
        (place, entry)
        for place, entry in enumerate(entries)
        if entry is not None and _has_range(entry, spec) and entry.type.bits == bits[place]
    ]
    octets = (sum(bits) + 7) // 8
    whole = [unpack(it.frame.data, bits) for it in frames if len(it.frame.data) >= octets]
    if not fields or not whole:
        return None
    values = [(entry, [raw[place] for raw in whole]) for place, entry in fields]
    return partial(_judge_values, values=values)


def _has_range(entry: Entry, spec: DeviceSpec) -> bool:
    """Tell whether every reading gives an integer a range that is narrower than its type."""
    return all(
        it.type is entry.type
        and it.type.is_integer
        and cases.present(it, spec)
        and (it.legal is not None or it.limits_by is not None)
        and all(cases.illegal_values(it, limit) for limit in cases.limits(it))
        for it in entry.readings
    )


def _judge_values(verdict: Verdict, values: list[tuple[Entry, list[int]]]) -> None:
    for entry, raws in values:
        ranges = {
            interval
            for reading in entry.readings
            for limit in cases.limits(reading)
            for readings in limit.readings
            for interval in readings or ()
        }
        size = entry.type.size or 0
        decoded = {entry.type.decode(it.to_bytes(size, "little")) for it in raws}
        shown = sorted(it for it in decoded if isinstance(it, int))
        outside = [it for it in shown if not is_legal(it, tuple(ranges))]
        verdict.holds(
            f"{entry.address} in the TPDO",
            expected=" or ".join(f"{low} to {high}" for low, high in sorted(ranges)),
            actual=" and ".join(map(str, (outside or shown)[:3])),
            ok=not outside,
        )
