"""How a node is reached: node-ID and bit rate, and when a new one takes effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from conformance.simulator.dictionary import ObjectDictionary
from conformance.simulator.memory import NonVolatileMemory
from conformance.simulator.node import Node
from conformance.spec.behaviours import Paired
from conformance.spec.bit_rates import bits_per_second, documented_rates
from conformance.spec.document import Changeable
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Entry, Key
from conformance.wire.datatypes import Value

SWITCH_DELAY_NS: Final = 5_000_000
"""From a download that takes effect at once to the change, so that its answer is on the bus before."""

SLOWEST: Final = 10_000
FASTEST: Final = 1_000_000


def usable_node_id(node_id: int) -> bool:
    """Return whether a node can have this node-ID."""
    return 1 <= node_id <= 127


def usable_bitrate(bitrate: int) -> bool:
    """Return whether a CAN controller can be set to this bit rate."""
    return SLOWEST <= bitrate <= FASTEST


def changeable_entry(spec: DeviceSpec, service: Changeable | None) -> Entry | None:
    """Return the entry of the object that holds node-ID or bit rate."""
    return None if service is None else spec.entry(service.object)


def holders(spec: DeviceSpec, service: Changeable | None) -> list[Entry]:
    """Return every entry that holds node-ID or bit rate: the object, its partner, its aliases."""
    entry = changeable_entry(spec, service)
    if entry is None:
        return []
    return [spec.entries[key] for key in spec.companions(entry.key)]


def changes_at_reset(service: Changeable | None) -> bool:
    """Return whether an NMT reset is enough for a new setting to take effect."""
    return service is None or not service.effective.endswith("power-cycle")


def settle_pairs(
    spec: DeviceSpec, memory: NonVolatileMemory, *, one_is_enough: bool = False
) -> set[Key]:
    """Give both objects of a pair that disagree what they last agreed on, and return them."""
    settled: set[Key] = set()
    for rule in spec.behaviours.values():
        if not isinstance(rule, Paired):
            continue
        first, *_ = keys = [key_of(it) for it in rule.objects]
        stored = {memory.values.get(key, spec.entries[key].default) for key in keys}
        if len(stored) == 1:
            memory.agreed[first] = memory.values.get(first)
        else:
            before = memory.agreed.get(first)
            given = [it for key in keys if (it := memory.values.get(key)) != before]
            memory.keep(dict.fromkeys(keys, given[0] if one_is_enough else before))
            settled.update(keys)
    return settled


def moved(values: Mapping[Key, Value], before: DeviceSpec, after: DeviceSpec) -> dict[Key, Value]:
    """Return what a change of the node-ID makes of values that differ from their defaults."""
    result: dict[Key, Value] = {}
    for key, value in values.items():
        entry, old = after.entries.get(key), before.entries.get(key)
        if entry is None or old is None or entry.after_node_id_change == "kept":
            result[key] = value
        elif entry.after_node_id_change == "difference-kept":
            result[key] = int(value) + int(entry.default or 0) - int(old.default or 0)
    return result


def remember_node_id(spec: DeviceSpec, memory: NonVolatileMemory, node_id: int) -> None:
    """Store a node-ID in the non-volatile memory."""
    memory.node_id = node_id
    for entry in holders(spec, spec.services.node_id):
        memory.keep({entry.key: None if entry.default == node_id else node_id})


def remember_bitrate(spec: DeviceSpec, memory: NonVolatileMemory, bitrate: int) -> None:
    """Store a bit rate in the non-volatile memory, in bit/s, as far as its objects can hold it."""
    memory.bitrate = bitrate
    value = documented_rates(spec).get(bitrate, bitrate)
    for entry in holders(spec, spec.services.bitrate):
        held = value & entry.type.maximum
        memory.keep({entry.key: None if entry.default == held else held})


def configured_node_id(spec: DeviceSpec, memory: NonVolatileMemory) -> int:
    """Return the node-ID for the next start."""
    entry = changeable_entry(spec, spec.services.node_id)
    value = None if entry is None else _configured(entry, memory)
    return value if value is not None and usable_node_id(value) else memory.node_id


def configured_bitrate(spec: DeviceSpec, memory: NonVolatileMemory) -> int:
    """Return the bit rate for the next start, in bit/s."""
    entry = changeable_entry(spec, spec.services.bitrate)
    value = None if entry is None else _configured(entry, memory)
    rate = 0 if entry is None or value is None else bits_per_second(entry, value)
    return rate if usable_bitrate(rate) else memory.bitrate


def _configured(entry: Entry, memory: NonVolatileMemory) -> int | None:
    stored = None if entry.key in memory.defaults_once else memory.values.get(entry.key)
    value = entry.default if stored is None else stored
    return value if isinstance(value, int) else None


def observe_identity(
    node: Node,
    spec: DeviceSpec,
    memory: NonVolatileMemory,
    use_node_id: Callable[[int], None],
    use_bitrate: Callable[[int], None],
) -> None:
    """Let downloads to the node-ID and bit rate objects take effect when the spec says."""
    _drop_useless(node, spec)
    _take_anything(node, spec)
    for service, use, moment in (
        (spec.services.node_id, use_node_id, node.faults.node_id_change),
        (spec.services.bitrate, use_bitrate, node.faults.bitrate_change),
    ):
        for entry in holders(spec, service):
            if service is None or moment == "never":
                continue
            if service.effective.startswith("after-store") and moment == "documented":
                continue
            at_once = "at-once" in (moment, service.effective)
            if entry.persistent is False and not at_once:
                continue
            act = _switch(node, entry, use) if at_once else _remember_at(memory, entry)
            node.dictionary.observers[entry.key].append(act)


def _drop_useless(node: Node, spec: DeviceSpec) -> None:
    """Keep the present value where one was confirmed that stands for nothing."""
    for service, is_usable in (
        (spec.services.node_id, usable_node_id),
        (spec.services.bitrate, usable_bitrate),
    ):
        for entry in holders(spec, service):
            if node.faults.holds_useless_places:
                node.dictionary.ranges[entry.key] = None
            else:
                drop = partial(_usable, node.dictionary, entry, is_usable)
                node.dictionary.adjusts[entry.key] = drop


def _usable(
    dictionary: ObjectDictionary, entry: Entry, is_usable: Callable[[int], bool], value: Value
) -> Value:
    usable = is_usable(bits_per_second(entry, int(value)))
    return value if usable else dictionary.number(*entry.key)


def _take_anything(node: Node, spec: DeviceSpec) -> None:
    """Let values in that stand for nothing, where the device has that defect."""
    dictionary = node.dictionary
    if node.faults.node_id_masked:
        for entry in holders(spec, spec.services.node_id):
            dictionary.ranges[entry.key] = None
            dictionary.adjusts[entry.key] = lambda value: int(value) & 0x7F
    if node.faults.bitrate_takes_any:
        known = documented_rates(spec).values()
        for entry in holders(spec, spec.services.bitrate):
            dictionary.ranges[entry.key] = None
            dictionary.adjusts[entry.key] = lambda value: value if value in known else min(known)


def _remember_at(memory: NonVolatileMemory, entry: Entry) -> Callable[[Value], None]:
    def remember(value: Value) -> None:
        memory.values[entry.key] = value

    return remember


def _switch(node: Node, entry: Entry, use: Callable[[int], None]) -> Callable[[Value], None]:
    def due(_due_ns: int) -> None:
        use(bits_per_second(entry, node.dictionary.number(*entry.key)))

    timer = node.agenda.timer(due)

    def switch(_value: Value) -> None:
        timer.start(node.agenda.now_ns + SWITCH_DELAY_NS)

    return switch
