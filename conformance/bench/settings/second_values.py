"""A second value for each setting: legal by every reading, neither the present one nor the default."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache

from conformance.bench.settings.settings import is_setting, tpdo_number
from conformance.spec.behaviours import Slope
from conformance.spec.document import Tpdo
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Entry, Key, is_legal
from conformance.wire.errors import WireError
from conformance.wire.pdo import MappingEntry

_FREE_CAN_IDS = range(0x681, 0x6E0)
"""Identifiers that nothing in the predefined connection set has (CiA 301 v4.2.0, 7.3.3)."""
_FLAGS = 0xC000_0000
_MANUFACTURERS = range(0x2000, 0x6000)
_NOT_VALID = 1 << 31
_PDO_BITS = 64
_HANDY = (1, 2, 3, 5, 10, 100, 1000, 250_000)


def can_be_set(entry: Entry, spec: DeviceSpec) -> bool:
    """Tell whether an entry is a setting that has a second value by every reading."""
    return entry.key in _settable(spec)


@lru_cache(maxsize=8)
def _settable(spec: DeviceSpec) -> frozenset[Key]:
    return frozenset(entry.key for entry in spec.entries.values() if _has_another(entry, spec))


def _has_another(entry: Entry, spec: DeviceSpec) -> bool:
    if not _is_free(entry, spec):
        return False
    if _mapping_of(entry, spec) is not None:
        words = _mapped(spec, entry.index)
        return bool(_counts(entry, words)) if entry.sub == 0 else entry.sub <= len(words)
    defaults = [it.default for it in entry.readings if isinstance(it.default, int)]
    candidates = _candidates(entry, spec, defaults[0] if defaults else 0)
    return any(number not in defaults for number in candidates)


def second_values(
    spec: DeviceSpec, found: Mapping[Key, bytes], *, default_will_do: bool
) -> dict[Key, bytes]:
    """Return a second value for every setting that can be set.

    Args:
        spec: What the node is held against.
        found: What the settings hold.
        default_will_do: Where nothing else is left, a default serves as well.
    """
    values: dict[Key, bytes] = {}
    for key, data in found.items():
        entry = spec.entries[key]
        if not _is_free(entry, spec):
            continue
        if _mapping_of(entry, spec) is not None:
            if entry.sub == 0:
                values |= _mapping(spec, entry.index, found)
            continue
        defaults = {_encoded(entry, reading.default_value) for reading in entry.readings}
        numbers = _candidates(entry, spec, int.from_bytes(data, "little"))
        others = [it for it in map(entry.type.encode, numbers) if it != data]
        chosen = [it for it in others if it not in defaults] or (others if default_will_do else [])
        if chosen:
            values[key] = chosen[0]
    return values


def _is_free(entry: Entry, spec: DeviceSpec) -> bool:
    """Tell whether a setting may be written by every reading and be given back afterwards."""
    return (
        not entry.optional
        and entry.type.is_integer
        and not _may_move_the_node(entry, spec)
        and entry.key not in _presets_with_fixed_offset(spec)
        and all(is_setting(reading, spec) and reading.writable for reading in entry.readings)
        and all(reading.reads == "written" for reading in entry.readings)
        and len({reading.type for reading in entry.readings}) == 1
    )


def _may_move_the_node(entry: Entry, spec: DeviceSpec) -> bool:
    """Tell whether nothing says what an object of the manufacturer does, such as set the node-ID."""
    known = spec.services.node_id is not None or spec.services.bitrate is not None
    return entry.index in _MANUFACTURERS and not known


def _presets_with_fixed_offset(spec: DeviceSpec) -> set[Key]:
    """Return the presets whose effect nothing could undo at another tilt."""
    presets = set()
    for rule in spec.behaviours.values():
        if isinstance(rule, Slope) and rule.preset is not None and rule.offset is not None:
            offset = spec.entry(*key_of(rule.offset))
            if offset is None or not all(reading.writable for reading in offset.readings):
                presets.add(key_of(rule.preset))
    return presets


def _encoded(entry: Entry, value: object) -> bytes | None:
    try:
        return entry.type.encode(value) if isinstance(value, int) else None
    except WireError:
        return None


def _candidates(entry: Entry, spec: DeviceSpec, present: int) -> Iterator[int]:
    if is_cob_id(entry, spec):
        yield from _cob_ids(entry, spec, present)
        return
    for number in (*_flipped(entry, spec, present), *_HANDY, *_edges(entry)):
        fits = entry.type.minimum <= number <= entry.type.maximum
        if fits and number not in entry.leaves_canopen and _always_legal(entry, number):
            yield number


def _flipped(entry: Entry, spec: DeviceSpec, present: int) -> Iterator[int]:
    """Return the value with the bit turned round that decides how the node starts."""
    rule = spec.services.nmt.start_by
    if rule is not None and key_of(rule.object) == entry.key:
        yield present ^ rule.mask


def _edges(entry: Entry) -> Iterable[int]:
    return sorted({edge for r in entry.readings for interval in r.legal or () for edge in interval})


def _always_legal(entry: Entry, number: int) -> bool:
    sets = [reading.legal for reading in entry.readings]
    for reading in entry.readings:
        if reading.limits_by is not None:
            sets += reading.limits_by.ranges.values()
    return all(is_legal(number, ranges) for ranges in sets)


def is_cob_id(entry: Entry, spec: DeviceSpec) -> bool:
    """Tell whether an entry is the COB-ID of SYNC, EMCY or a TPDO."""
    services = spec.services
    if entry.sub == 1 and services.tpdo is not None:
        first = services.tpdo.communication
        return first <= entry.index < first + services.tpdo.count
    sync, emcy = services.sync_consumer, services.emcy_producer
    return entry.index in {it.object for it in (sync, emcy) if it is not None}


def _cob_ids(entry: Entry, spec: DeviceSpec, present: int) -> Iterator[int]:
    """Return COB-IDs with an identifier of their own, of producers that are switched off."""
    sync = spec.services.sync_consumer
    listens = sync is not None and entry.index == sync.object
    start = entry.index % 0x10 + len(_FREE_CAN_IDS) // 2 * (entry.sub == 0)
    for offset in range(2):
        word = present & _FLAGS | _FREE_CAN_IDS[start + 0x10 * offset]
        yield word if listens else word | _NOT_VALID


# Mapping: as a whole, for the places depend on each other


def _mapping_of(entry: Entry, spec: DeviceSpec) -> Tpdo | None:
    tpdo = spec.services.tpdo
    if tpdo is None or entry.index < tpdo.mapping or tpdo_number(tpdo, entry.index) is None:
        return None
    return tpdo


def _mapped(spec: DeviceSpec, mapping: int) -> list[int]:
    """Return mapping words that fill as many places of a TPDO as every reading has."""
    tpdo = spec.services.tpdo
    count = spec.entry(mapping, 0)
    if tpdo is None or count is None or not _is_free(count, spec):
        return []
    most = min(it.tpdo.max_mapped for it, _ in spec.services_readings if it.tpdo is not None)
    places = 0
    while (
        places < most
        and (place := spec.entry(mapping, places + 1)) is not None
        and _is_free(place, spec)
    ):
        places += 1
    words: list[int] = []
    bits_left = _PDO_BITS
    for bits, key in sorted(_mappable(spec)):
        if len(words) < places and bits <= bits_left:
            words.append(MappingEntry(*key, bits).to_word())
            bits_left -= bits
    return words


def _mappable(spec: DeviceSpec) -> Iterator[tuple[int, Key]]:
    for entry in spec.entries.values():
        always = all(reading.mappable and reading.readable for reading in entry.readings)
        one_type = all(reading.type is entry.type for reading in entry.readings)
        if always and one_type and not entry.optional and entry.type.bits is not None:
            yield entry.type.bits, entry.key


def _mapping(spec: DeviceSpec, mapping: int, found: Mapping[Key, bytes]) -> dict[Key, bytes]:
    words = _mapped(spec, mapping)
    for shift in range(len(words)):
        turned = [*words[shift:], *words[:shift]]
        values = {
            (mapping, place): word.to_bytes(4, "little") for place, word in enumerate(turned, 1)
        }
        if all(_differs(spec.entries[key], data, found) for key, data in values.items()):
            number = spec.entries[mapping, 0]
            counts = [bytes([count]) for count in _counts(number, words)]
            others = [data for data in counts if data != found.get(number.key)]
            return {**values, number.key: next(iter(others), bytes([len(words)]))}
    return {}


def _counts(number: Entry, words: Sequence[int]) -> list[int]:
    """Return numbers of mapped objects that are no default and count mapping words alone."""
    defaults = {reading.default for reading in number.readings}
    return [count for count in range(len(words), 0, -1) if count not in defaults]


def _differs(entry: Entry, data: bytes, found: Mapping[Key, bytes]) -> bool:
    defaults = {_encoded(entry, reading.default_value) for reading in entry.readings}
    return data not in defaults and data != found.get(entry.key)
