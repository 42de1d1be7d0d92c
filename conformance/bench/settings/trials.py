"""Store and restore tried as a whole; every setting is observed at once, and put back afterwards."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.settings.second_values import second_values
from conformance.bench.settings.settings import Settings, Values
from conformance.errors import ConformanceError, NodeTimeout, SetupRefused
from conformance.spec.document import Store
from conformance.spec.model import Entry, Key
from conformance.wire.nmt import NmtCommand


@dataclass(frozen=True, slots=True)
class Kept:
    """What became of settings over a restart.

    Args:
        found: What was stored before.
        chosen: What they were given.
        after: What they hold after the restart.
        told: What the sub-indices that stored them answer then.
    """

    found: Mapping[Key, bytes]
    chosen: Mapping[Key, bytes]
    after: Mapping[Key, bytes]
    told: Mapping[Key, Transfer] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Refused:
    """What became of wrong signatures.

    Args:
        answers: By sub-index and signature.
        kept: What became of the settings over the reset after them.
    """

    answers: Mapping[int, Mapping[bytes, Transfer]]
    kept: Kept


@dataclass(frozen=True, slots=True)
class Restored:
    """What a restore did.

    Args:
        answer: To the signature.
        chosen: What the settings held, and had stored, before it.
        before: What they held between its confirmation and the restart.
        after: After the restart.
        saved: After a store between restore and restart, where the restart alone changed nothing and by
            a reading need not.
        lasting: After a store of what was restored and a power cycle.
        told: What the sub-index answers after the restart.
    """

    answer: Transfer
    chosen: Mapping[Key, bytes]
    before: Mapping[Key, bytes]
    after: Mapping[Key, bytes]
    saved: Mapping[Key, bytes] | None = None
    lasting: Mapping[Key, bytes] | None = None
    told: Mapping[Key, Transfer] = field(default_factory=dict)

    @property
    def final(self) -> Mapping[Key, bytes]:
        """What the settings hold once all is done that a restore may take."""
        return self.after if self.saved is None else self.saved


@dataclass(frozen=True, slots=True)
class Unsaved:
    """What became of settings whose defaults were restored and not stored.

    Args:
        answer: To the signature.
        chosen: What the settings had stored.
        after: What they hold after the second start.
    """

    answer: Transfer
    chosen: Mapping[Key, bytes]
    after: Mapping[Key, bytes]


@contextmanager
def changed_settings(
    node: Node, *, save: bool, default_will_do: bool = True
) -> Iterator[tuple[Settings, Values]]:
    """Give every setting a second value; afterwards the node has stored what it had before."""
    settings = Settings(node)
    try:
        settings.begin()
        wanted = second_values(node.spec, settings.found, default_will_do=default_will_do)
        chosen = settings.read(settings.write(wanted, settings.found))
        if save:
            settings.save()
        yield settings, chosen
    finally:
        settings.put_back()


def observe_kept(node: Node, *, save: bool, power: bool) -> Kept:
    """Change the settings, store them or not, restart the node, and see what they hold."""
    with changed_settings(node, save=save) as (settings, chosen):
        _restart(node, power=power)
        return Kept(settings.found, chosen, settings.read(), _told(node, node.spec.services.store))


def observe_defaults_stored(node: Node) -> Kept:
    """Store other settings, then their defaults again, reset the node, and see what they hold.

    Raises:
        SetupRefused: The defaults were kept, and yet the node does not take back what it had stored.
    """
    seen: list[Kept] = []
    try:
        with changed_settings(node, save=True, default_will_do=False) as (settings, changed):
            chosen = settings.read(settings.write(_defaults(node, changed), changed))
            settings.save()
            node.reset()
            seen.append(Kept(changed, chosen, settings.read()))
    except SetupRefused:
        if all(it.after == it.chosen for it in seen):
            raise
    return seen[0]


def _defaults(node: Node, changed: Values) -> Values:
    """Return the documented defaults of settings, those aside that have none."""
    entries = (node.spec.entries[key] for key in changed)
    known = ((entry, entry.default_value) for entry in entries)
    return {it.key: it.type.encode(value) for it, value in known if value is not None}


@contextmanager
def stored_value(node: Node, key: Key, value: int) -> Iterator[Settings]:
    """Store one value that may act only afterwards; at the end the node has stored what it had before."""
    settings = Settings(node)
    try:
        settings.begin()
        node.download(*key, value)
        settings.save()
        yield settings
    finally:
        settings.put_back()


def observe_late(node: Node, key: Key, value: int) -> Values:
    """Store a value that may act only afterwards, restart the node, and see what the settings hold."""
    with stored_value(node, key, value) as settings:
        node.reset()
        return settings.read()


def _told(node: Node, service: Store | None) -> dict[Key, Transfer]:
    """Return what the sub-indices of store or restore answer."""
    keys = [] if service is None else [(service.object, sub) for sub in service.groups]
    return {key: node.sdo.upload(*key) for key in keys}


def observe_reset_communication(node: Node) -> Kept:
    """Change the settings, reset the communication alone, and see what they hold."""
    with changed_settings(node, save=False) as (settings, chosen):
        node.reset(NmtCommand.RESET_COMMUNICATION)
        return Kept(settings.found, chosen, settings.read())


def observe_wrong_signatures(
    node: Node, service: Store, subs: Iterable[int], *, save: bool
) -> Refused:
    """Write wrong signatures with changed settings, reset the node, and see what they did."""
    with changed_settings(node, save=save, default_will_do=not save) as (settings, chosen):
        answers = {
            sub: {
                wrong: node.write(service.object, sub, wrong) for wrong in wrong_signatures(service)
            }
            for sub in subs
        }
        node.reset()
        return Refused(answers, Kept(settings.found, chosen, settings.read()))


def wrong_signatures(service: Store) -> tuple[bytes, ...]:
    """Return signatures that must not be taken: in capitals, turned round, of the other service."""
    right = service.signature.encode("ascii")
    other = b"load" if right == b"save" else b"save"
    return right.upper(), right[::-1], other, bytes(4), b"\xff" * 4


def observe_restored(node: Node, service: Store, sub: int, *, power: bool) -> Restored:
    """Restore a group with other settings stored, and see at which step they come back.

    Args:
        node: The node under test.
        service: The restore service.
        sub: The group.
        power: The restart is a power cycle; what was restored is also stored and seen again.
    """
    word = service.word.to_bytes(4, "little")
    with changed_settings(node, save=True, default_will_do=False) as (settings, chosen):
        answer = node.write(service.object, sub, word)
        before = settings.read()
        if not answer.confirmed:
            return Restored(answer, chosen, before, before)
        _restart(node, power=power)
        after, saved, lasting, told = settings.read(), None, None, _told(node, service)
        lasting_ones = [key for key in chosen if _is_restored(node, service, sub, key)]
        if _may_wait_for_a_store(node) and all(after[key] == chosen[key] for key in lasting_ones):
            node.write(service.object, sub, word)
            settings.save()
            _restart(node, power=power)
            saved = settings.read()
        if power:
            settings.save()
            node.power_cycle()
            lasting = settings.read()
        return Restored(answer, chosen, before, after, saved, lasting, told)


def observe_late_restored(node: Node, service: Store, sub: int, key: Key, value: int) -> Restored:
    """Restore a group with a value stored that may act only afterwards, and see when its default is back."""
    word = service.word.to_bytes(4, "little")
    chosen = {key: node.spec.entries[key].type.encode(value)}
    with stored_value(node, key, value) as settings:
        answer = node.write(service.object, sub, word)
        before = settings.read()
        if not answer.confirmed:
            return Restored(answer, chosen, before, before)
        node.reset()
        after, saved = settings.read(), None
        if after[key] == chosen[key]:
            node.write(service.object, sub, word)
            settings.save()
            node.reset()
            saved = settings.read()
        return Restored(answer, chosen, before, after, saved)


def observe_unsaved(node: Node, service: Store, sub: int) -> Unsaved:
    """Restore a group with other settings stored, switch the supply twice, and see what they hold.

    The first start is the restart that a restore may wait for.
    """
    with changed_settings(node, save=True, default_will_do=False) as (settings, chosen):
        answer = node.write(service.object, sub, service.word.to_bytes(4, "little"))
        for _ in range(2):
            node.power_cycle()
        return Unsaved(answer, chosen, settings.read())


def _may_wait_for_a_store(node: Node) -> bool:
    """Tell whether by any reading what was restored acts once it is stored."""
    services = [services.restore for services, _ in node.spec.services_readings]
    return any(it is not None and it.effective == "after-store-and-reset" for it in services)


def _is_restored(node: Node, service: Store, sub: int, key: Key) -> bool:
    """Tell whether a setting outlasts a restart, unless a restore brings back its default."""
    entry = node.spec.entries[key]
    return service.covers(sub, key[0]) and all(it.persistent for it in entry.readings)


def observe_defaults(node: Node, service: Store, sub: int) -> dict[Key, bytes | ConformanceError]:
    """Restore a group and see what every entry holds; what was stored before is put back."""
    settings = Settings(node)
    word = service.word
    try:
        settings.begin()
        node.download(service.object, sub, word)
        node.reset()
        if settings.found and settings.read() == settings.found:
            _save_between(node, settings, service, sub)
        return {
            entry.key: _held(node, entry)
            for entry in node.spec.entries.values()
            if entry.readable and entry.kind == "config"
        }
    finally:
        settings.put_back()


def _held(node: Node, entry: Entry) -> bytes | ConformanceError:
    try:
        return node.upload(*entry.key)
    except (SetupRefused, NodeTimeout) as error:
        return error


def _save_between(node: Node, settings: Settings, service: Store, sub: int) -> None:
    """Restore with a store before the reset, where a reading has it so."""
    restores = [services.restore for services, _ in node.spec.services_readings]
    if any(it is not None and it.effective != "after-reset" for it in restores):
        try:
            node.download(service.object, sub, service.word)
            settings.save()
        except SetupRefused:
            return
        node.reset()


def _restart(node: Node, *, power: bool) -> None:
    if power:
        node.power_cycle()
    else:
        node.reset()
