"""What an exploration may do to a device: steps from its spec, within what the bench allows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from conformance.bench.definition import BenchDefinition
from conformance.bench.keeping import memory_keys
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
TILTS_DEG: Final = ((10.5, -4.25), (0.0, 0.0), (100.0, -100.0), (10.5, 100.0), (-75.0, 60.0))


@dataclass(frozen=True, slots=True)
class Choices:
    """The steps to choose from; those of one kind are equally likely.

    Args:
        uploads: Of every entry, and of what does not exist.
        heartbeat: Downloads that make the heartbeat producer do something.
        emcy: The same for EMCY.
        first_tpdo: The same for the first TPDO.
        other_tpdos: The same for the others.
        downloads: Further downloads that are legal.
        illegal: Downloads of what is out of range, too short or too long, or read-only.
        commands: NMT commands without a restart, unknown ones included.
        syncs: SYNC.
        requests: Remote frames.
        waits: Times to wait.
        restarts: Resets and, where the bench can, the supply.
        tilts: Where the bench can tilt.
        phrases: Steps that only together do something.
    """

    uploads: tuple[Step, ...]
    heartbeat: tuple[Step, ...]
    emcy: tuple[Step, ...]
    first_tpdo: tuple[Step, ...]
    other_tpdos: tuple[Step, ...]
    downloads: tuple[Step, ...]
    illegal: tuple[Step, ...]
    commands: tuple[Step, ...]
    syncs: tuple[Step, ...]
    requests: tuple[Step, ...]
    waits: tuple[Step, ...]
    restarts: tuple[Step, ...]
    tilts: tuple[Step, ...]
    phrases: tuple[tuple[Step, ...], ...]


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
    open_ = [it for it in spec.entries.values() if it.writable and allowed.may_write(it)]
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
    keys = {it.key for it in open_}
    tpdos = [_of(keys, it) for it in values.tpdos()]
    legal = [(it.key, data) for it in open_ for data in values.legal(it)]
    wrong = [(it.key, data) for it in open_ for data in values.illegal(it)]
    wrong += [(it.key, data) for it in spec.entries.values() for data in values.unwritable(it)]

    def downloads(pairs: Iterable[tuple[Key, bytes]]) -> tuple[Step, ...]:
        return tuple(allowed.download(*it) for it in pairs if writes)

    return Choices(
        uploads=tuple(Upload(key) for key in (*spec.entries, *_absent(spec))),
        heartbeat=downloads(_of(keys, values.heartbeat())),
        emcy=downloads(_of(keys, values.emcy())),
        first_tpdo=downloads(it for tpdo in tpdos[:1] for it in tpdo),
        other_tpdos=downloads(it for tpdo in tpdos[1:] for it in tpdo),
        downloads=downloads(legal),
        illegal=downloads(wrong),
        commands=tuple(Nmt(command) for command in commands),
        syncs=(Sync(),),
        requests=tuple(Remote(can_id) for can_id in values.tpdo_ids()),
        waits=tuple(Wait(ms) for ms in WAITS_MS),
        restarts=tuple(restarts),
        tilts=tuple(Tilt(*deg) for deg in TILTS_DEG if definition.has("tilt")),
        phrases=tuple(
            tuple(allowed.download(*it) for it in phrase)
            for phrase in values.phrases()
            if writes and {key for key, _ in phrase} <= keys
        ),
    )


def _of(keys: set[Key], pairs: Iterable[tuple[Key, bytes]]) -> list[tuple[Key, bytes]]:
    return [(key, data) for key, data in pairs if key in keys]


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
