"""Store and restore parameters: 1010h, 1011h (CiA 301 v4.2.0, 7.5.2.13 and 7.5.2.14)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Final

from conformance.simulator.memory import NonVolatileMemory
from conformance.simulator.node import Node
from conformance.simulator.rejection import SdoAbortError
from conformance.spec.document import Services, Store
from conformance.spec.model import Key
from conformance.wire.abort import AbortCode
from conformance.wire.datatypes import Value

_MS: Final = 1_000_000


class ParameterStore:
    """Moves parameters between the object dictionary and the non-volatile memory."""

    def __init__(self, node: Node, memory: NonVolatileMemory, services: Services) -> None:
        self._node = node
        self._memory = memory
        self._services = services
        self._defaults_at_save: set[Key] = set()
        if services.store is not None:
            for sub in services.store.groups:
                self._offer(services.store, sub, self._save)
        if services.restore is not None:
            for sub in services.restore.groups:
                self._offer(services.restore, sub, self._restore)
        if services.store is None:
            self._store_at_once(self._persistent())
        elif node.faults.stores_at_once:
            groups = services.store.groups
            self._store_at_once(key for sub in groups for key in self._group(services.store, sub))

    def _offer(self, service: Store, sub: int, act: Callable[[Store, int], None]) -> None:
        key = service.object, sub
        if key not in self._node.dictionary.entries:
            return
        self._node.dictionary.guards[key].append(partial(self._check_signature, service))
        self._node.dictionary.actions[key] = lambda _value: self._act(act, service, sub)

    def _act(self, act: Callable[[Store, int], None], service: Store, sub: int) -> None:
        act(service, sub)
        if self._node.faults.store_keeps_signature:
            kept = {(service.object, sub): service.word}
            self._settle(service, partial(self._memory.keep, kept))

    def _persistent(self) -> Iterator[Key]:
        """Return the settings that are kept without supply."""
        for key, entry in self._node.dictionary.entries.items():
            if entry.kind == "config" and entry.persistent:
                yield key

    def _store_at_once(self, keys: Iterable[Key]) -> None:
        def keep(key: Key, value: Value) -> None:
            self._write(0, partial(self._memory.keep, {key: value}))

        for key in set(keys):
            self._node.dictionary.observers[key].append(partial(keep, key))

    def _check_signature(self, service: Store, value: Value) -> None:
        faults = self._node.faults
        stores = service is self._services.store
        if faults.store_refused if stores else faults.restore_refused:
            raise SdoAbortError(AbortCode.DATA_NOT_STORED)
        if value != service.word and not self._node.faults.store_any_signature:
            raise SdoAbortError(AbortCode.DATA_NOT_STORED)

    def _save(self, service: Store, sub: int) -> None:
        if self._node.faults.store_forgets:
            return
        dictionary = self._node.dictionary
        kept: dict[Key, Value | None] = {}
        for key in self._group(service, sub):
            value = dictionary.value(key)
            is_default = value == dictionary.default(key) or key in self._defaults_at_save
            if not (is_default and self._node.faults.store_skips_defaults):
                kept[key] = None if is_default else self._spoilt(value)
            self._defaults_at_save.discard(key)
            dictionary.stored(key)
        self._settle(service, partial(self._memory.keep, kept))

    def _spoilt(self, value: Value) -> Value:
        return value ^ 1 if self._node.faults.store_spoils and isinstance(value, int) else value

    def _restore(self, service: Store, sub: int) -> None:
        if self._node.faults.restore_forgets:
            return
        faults = self._node.faults
        subs = service.groups if faults.restore_acts_on_all else (sub,)
        keys = {key for each in subs for key in self._group(service, each)}
        if faults.restore_acts_at_once:
            self._set_defaults(keys)
        if service.effective == "after-store-and-reset":
            self._defaults_at_save |= keys
            return
        if service.effective == "at-once":
            self._set_defaults(keys)
        after_reset = service.effective == "after-reset"
        passes = after_reset and faults.restore_lost_at_power_off
        lasts = service.lasting or faults.restore_lasts or self._services.store is None
        if lasts and not passes:
            self._settle(service, partial(self._memory.keep, dict.fromkeys(keys)))
        elif after_reset:
            self._settle(service, partial(self._memory.defaults_once.update, keys))

    def _set_defaults(self, keys: set[Key]) -> None:
        for key in keys:
            self._node.dictionary.set(key, self._node.dictionary.default(key))

    def _settle(self, service: Store, act: Callable[[], None]) -> None:
        """Write to the non-volatile memory, which a reset before the end of it undoes."""
        self._write(service.settle_ms, act)

    def _write(self, settle_ms: int, act: Callable[[], None]) -> None:
        after_ms = settle_ms + self._node.faults.store_write_ms
        if after_ms:
            self._node.agenda.after(after_ms * _MS, act)
        else:
            act()

    def _group(self, service: Store, sub: int) -> Iterator[Key]:
        """Return the parameters of a group: what is not worked out at each upload, and can be kept."""
        ranges, dictionary = service.groups[sub], self._node.dictionary
        for key, entry in dictionary.entries.items():
            kept = entry.persistent is not False if entry.kind == "config" else entry.persistent
            if not kept or key in dictionary.computed:
                continue
            if any(int(low) <= key[0] <= int(high) for low, high in ranges):
                yield key
