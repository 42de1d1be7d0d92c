"""What the node keeps in its non-volatile memory, and what makes it do so."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import lru_cache

from conformance.spec.document import Services, Store
from conformance.spec.model import DeviceSpec, Key


def groups_of(service: Store, indices: Collection[int]) -> list[int]:
    """Return the fewest sub-indices that together act on all of some indices that any acts on."""
    left = {index for index in indices if any(service.covers(sub, index) for sub in service.groups)}
    chosen: list[int] = []
    while left:
        best = max(
            sorted(service.groups),
            key=lambda sub: (sum(service.covers(sub, index) for index in left), -sub),
        )
        chosen.append(best)
        left -= {index for index in left if service.covers(best, index)}
    return chosen


@lru_cache(maxsize=64)
def store_words(spec: DeviceSpec, indices: frozenset[int]) -> Mapping[Key, int]:
    """Return the commands, by any reading, that store the settings at some indices."""
    stores = [it.store for it, _ in spec.services_readings if it.store is not None]
    return {
        (store.object, sub): store.word for store in stores for sub in groups_of(store, indices)
    }


@lru_cache(maxsize=8)
def memory_keys(spec: DeviceSpec) -> frozenset[Key]:
    """Return the entries by which a download may write the non-volatile memory, by any reading."""
    keys = {key for it, _ in spec.services_readings for key in _kept_by_themselves(spec, it)}
    for service in (spec.services.store, spec.services.restore):
        if service is not None:
            keys |= {entry.key for entry in spec.subs(service.object)}
    return frozenset(keys)


def wear_cycles(spec: DeviceSpec) -> int | None:
    """Return how many writes the memory endures by the manual, None where that is not said."""
    services = [it for it in (spec.services.store, spec.services.restore) if it is not None]
    return next((it.wear_cycles for it in services if it.wear_cycles is not None), None)


def _kept_by_themselves(spec: DeviceSpec, services: Services) -> Iterator[Key]:
    for service in (services.node_id, services.bitrate):
        if service is not None and not service.effective.startswith("after-store"):
            yield from spec.companions((service.object, 0))
