"""What an exploration may do to a device: steps from its spec, within what the bench allows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from conformance.bench.definition import BenchDefinition
from conformance.bench.node.keeping import memory_keys
from conformance.explore.steps import (
    Download,
    Nmt,
    PowerCycle,
    Remote,
    Step,
    Sync,
    Tilt,
    Upload,
    Wait,
)
from conformance.explore.values import Values
from conformance.spec.behaviours import ResetCommand
from conformance.spec.document import Store
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Entry, Key
from conformance.wire.nmt import NmtCommand

RESERVED_INDICES: Final = (0x1004, 0xC000, 0xFFFF)
"""Indices that no device has."""
UNKNOWN_COMMANDS: Final = (3, 255)
WAITS_MS: Final = (1, 3, 10, 20, 50, 100, 150, 250, 500, 1000, 2000)
FIRST: Final = 3
"""How often the first TPDO counts, which no other service is as rich as."""
TILTS_DEG: Final = ((10.5, -4.25), (0.0, 0.0), (100.0, -100.0), (10.5, 100.0), (-75.0, 60.0))


@dataclass(frozen=True, slots=True)
class Group:
    """Objects that belong together, as one writes them.

    Args:
        objects: Downloads per object, in any order.
        series: Downloads that are made in their order, instead.
        works: Downloads that make their service do something.
        before: One of these comes first.
        after: One of these comes last.
        around: Further steps that matter to these objects.
    """

    objects: tuple[tuple[Download, ...], ...]
    series: tuple[tuple[Download, ...], ...] = ()
    works: tuple[tuple[Download, ...], ...] = ()
    before: tuple[Download, ...] = ()
    after: tuple[Download, ...] = ()
    around: tuple[Step, ...] = ()


@dataclass(frozen=True, slots=True)
class Choices:
    """The steps to choose from; those of one kind are equally likely.

    Args:
        groups: Objects that belong together, by service.
        uploads: Of every entry, and of what does not exist.
        downloads: Of every group.
        illegal: Downloads of what is out of range, too short or too long, or read-only.
        commands: NMT commands without a restart, unknown ones included.
        syncs: SYNC.
        requests: Remote frames.
        waits: Times to wait.
        restarts: Resets and, where the bench can, the supply.
        tilts: Where the bench can tilt.
    """

    groups: tuple[tuple[Group, ...], ...]
    uploads: tuple[Step, ...]
    downloads: tuple[Step, ...]
    illegal: tuple[Step, ...]
    commands: tuple[Step, ...]
    syncs: tuple[Step, ...]
    requests: tuple[Step, ...]
    waits: tuple[Step, ...]
    restarts: tuple[Step, ...]
    tilts: tuple[Step, ...]


def choices(spec: DeviceSpec, definition: BenchDefinition, *, as_made: bool) -> Choices:
    """Return the steps for a device on a bench.

    Args:
        spec: What the manual says.
        definition: The bench.
        as_made: The node has the node-ID and bit rate of the factory, so that restoring is harmless.
    """
    allowed = _Allowed(spec, definition, as_made=as_made)
    values = Values(spec, alone=definition.allows(["other-nodes"]))
    writes = definition.allows(["writes"])
    restarts: list[Step] = []
    if definition.allows(["resets"]):
        restarts += [Nmt(NmtCommand.RESET_NODE), Nmt(NmtCommand.RESET_COMMUNICATION)]
    if definition.switches_supply:
        restarts.append(PowerCycle())
    commands = (
        NmtCommand.START,
        NmtCommand.STOP,
        NmtCommand.ENTER_PRE_OPERATIONAL,
        *UNKNOWN_COMMANDS,
    )
    tilts = tuple(Tilt(*deg) for deg in TILTS_DEG if definition.has("tilt"))
    open_ = [it for it in spec.entries.values() if it.writable and allowed.may_write(it)]
    wrong = [(it.key, data) for it in open_ for data in values.illegal(it)]
    wrong += [(it.key, data) for it in spec.entries.values() for data in values.unwritable(it)]
    groups = _Groups(spec, values, allowed, tuple(restarts), tilts).all() if writes else ()
    written = [it for some in groups for group in some for it in group.objects]
    return Choices(
        groups=groups,
        uploads=tuple(Upload(key) for key in (*spec.entries, *_absent(spec))),
        downloads=tuple(step for downloads in written for step in downloads),
        illegal=tuple(allowed.download(*it) for it in wrong if writes),
        commands=tuple(Nmt(command) for command in commands),
        syncs=(Sync(),),
        requests=tuple(Remote(can_id) for can_id in values.tpdo_ids()),
        waits=tuple(Wait(ms) for ms in WAITS_MS),
        restarts=tuple(restarts),
        tilts=tilts,
    )


class _Groups:
    """Finds the objects that belong together.

    Args:
        spec: What the manual says.
        values: What is written.
        allowed: What may be written.
        restarts: What ends what was not stored.
        tilts: What leads to errors.
    """

    def __init__(
        self,
        spec: DeviceSpec,
        values: Values,
        allowed: _Allowed,
        restarts: tuple[Step, ...],
        tilts: tuple[Step, ...],
    ) -> None:
        self._values = values
        self._allowed = allowed
        self._restarts = restarts
        self._tilts = tilts
        self._entries = [it for it in spec.entries.values() if it.writable]
        every = spec.entries.values()
        self._open = {it.key for it in every if not it.writable or allowed.may_write(it)}
        self._stores = set(values.stores)

    def all(self) -> tuple[tuple[Group, ...], ...]:
        """Return the groups, by service."""
        values, tpdos = self._values, (self._communication, self._mapping)
        services = (
            [self._heartbeat()],
            [Group(self._objects(values.emcy()), around=self._tilts)],
            *([each(n)] for n in values.tpdos[:1] for each in tpdos for _ in range(FIRST)),
            [each(n) for n in values.tpdos[1:] for each in tpdos],
            [self._kept()],
            [Group(self._objects(map(values.legal, some))) for some in self._settings().values()],
        )
        found = (tuple(it for it in groups if it.objects) for groups in services)
        return tuple(groups for groups in found if groups)

    def _heartbeat(self) -> Group:
        objects = self._objects([self._values.heartbeat()])
        return Group(objects, works=objects and tuple((step,) for step in objects[0][:-1]))

    def _communication(self, number: int) -> Group:
        valid, invalid = self._switched(number)
        communication = self._objects(self._values.communication(number))
        objects = (*self._objects([self._values.cob_id(number)]), *communication)
        times = [pair for pair in zip(*communication[1:], strict=False) if len(pair) > 1]
        return Group(
            objects,
            series=tuple(order for pair in times for order in (pair, pair[::-1])),
            works=self._sending(number),
            before=invalid,
            after=valid,
            around=(Sync(),),
        )

    def _mapping(self, number: int) -> Group:
        valid, invalid = self._switched(number)
        objects = self._objects(self._values.mapping(number))
        none, one, *_ = objects[0]
        words = objects[1] if len(objects) > 1 else ()
        return Group(
            objects,
            series=((none, one), *((none, word, one) for word in words)),
            works=self._sending(number),
            before=invalid,
            after=valid,
            around=(Sync(), *self._restarts),
        )

    def _sending(self, number: int) -> tuple[tuple[Download, ...], ...]:
        """Return what makes a TPDO be sent, by its timer or by SYNC."""
        every = [it for some in self._values.sending(number) for it in self._objects([some])]
        return tuple((*some, *self._switched(number)[0]) for some in every)

    def _switched(self, number: int) -> tuple[tuple[Download, ...], tuple[Download, ...]]:
        """Return what makes a TPDO valid, and what makes it not valid."""
        found = self._objects([self._values.cob_id(number)])
        return (found[0][:1], found[0][1:2]) if found else ((), ())

    def _kept(self) -> Group:
        """Return the settings with what stores and restores them."""
        settings = [it for some in self._settings().values() for it in some]
        words = self._objects(
            self._values.legal(it) for it in self._entries if it.index in self._stores
        )
        after = tuple(step for steps in words for step in steps)
        objects = self._objects(map(self._values.legal, settings))
        return Group(objects, after=after, around=self._restarts)

    def _settings(self) -> dict[int, list[Entry]]:
        found: dict[int, list[Entry]] = {}
        for entry in self._entries:
            if entry.index not in self._stores:
                found.setdefault(entry.index, []).append(entry)
        return found

    def _objects(
        self, pairs: Iterable[Iterable[tuple[Key, bytes]]]
    ) -> tuple[tuple[Download, ...], ...]:
        """Return the downloads of each object that are allowed."""
        every = (
            tuple(self._allowed.download(*it) for it in some if it[0] in self._open)
            for some in pairs
        )
        return tuple(some for some in every if some)


def _absent(spec: DeviceSpec) -> Iterator[Key]:
    """Return what no device has, and the sub-index behind objects that have none."""
    yield from ((index, 0) for index in RESERVED_INDICES if not spec.subs(index))
    for entry in spec.entries.values():
        if not entry.in_record and len(spec.subs(entry.index)) == 1:
            yield entry.index, 1


class _Allowed:
    """What may be written on a bench.

    Args:
        spec: What the manual says.
        definition: The bench.
        as_made: Restoring does not move the node.
    """

    def __init__(self, spec: DeviceSpec, definition: BenchDefinition, *, as_made: bool) -> None:
        self._spec = spec
        every = [services for services, _ in spec.services_readings]
        moving = [it for one in every for it in (one.node_id, one.bitrate) if it is not None]
        self._moving = {key for it in moving for key in spec.companions((it.object, 0))}
        self._keeps = definition.allows(["non-volatile"])
        self._kept_at_once = any(one.store is None for one in every)
        self._memory = memory_keys(spec)
        restores = [one.restore.object for one in every if one.restore is not None]
        may_restore = as_made and definition.allows(["restores", "non-volatile"])
        self._restores = () if may_restore else tuple(restores)
        self._stores = [it for one in every for it in (one.store, one.restore) if it is not None]
        self._resets: dict[Key, int] = {}
        for rule in spec.behaviours.values():
            if isinstance(rule, ResetCommand):
                self._resets[key_of(rule.command)] = rule.value
        self._may_reset = definition.allows(["resets"])

    def may_write(self, entry: Entry) -> bool:
        """Tell whether downloads to an entry leave the node where and what it is."""
        if entry.key in self._moving or entry.index in self._restores:
            return False
        if entry.key in self._resets and not self._may_reset:
            return False
        kept = entry.key in self._memory or (self._kept_at_once and bool(entry.persistent))
        return self._keeps or not kept

    def download(self, key: Key, data: bytes) -> Download:
        """Return a download with what follows from it."""
        restarts = self._resets.get(key) == int.from_bytes(data, "little") and key in self._resets
        return Download(key, data, restarts, self._settle_s(self._stores, key))

    def _settle_s(self, services: list[Store], key: Key) -> float:
        return max((it.settle_ms for it in services if it.object == key[0]), default=0) / 1000
