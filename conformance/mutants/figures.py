"""Defects of services and behaviours: every figure that stands in their blocks, a little different."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from conformance.mutants.defect import Defect, change, path, without
from conformance.spec.fields import shape
from conformance.spec.model import DeviceSpec
from conformance.spec.services import HeartbeatProducer, Tpdo

NO_FIGURES = frozenset(
    {
        *("source", "sources", "variants", "rule", "holds", "count"),
        *("codes", "register_bits", "examples", "communication", "mapping", "objects"),
        *("response", "parameters", "otherwise", "wear_cycles"),
    }
)
"""Keys of a block that say where it is documented, what it is, or what a reader may see of it."""

NAMES = frozenset(
    {
        *("object", "value", "selector", "command", "cut_off", "error_register", "history"),
        *("inhibit", "offset", "preset", "resolution", "operating_parameter"),
        *("differential_offset", "slopes"),
    }
)
"""Keys that name an object: another one would be another device, not a wrong figure."""

UNSAID = frozenset({"open", "any", "either"})
"""Choices by which a spec says that the manual leaves something open: nothing that a device does."""

LIMIT_DEG = 2
"""How far the limit of an error is moved: more than a bench may be off."""

TPDO_FIGURES = (2, 5)
"""Sub-indices of a TPDO's communication parameter whose ranges its service repeats."""

SEEN_BY = {
    "nmt": ("NMT-", "BOOT-"),
    "sdo_server": ("SDO-",),
    "heartbeat_producer": ("HB-", "OD-"),
    "sync_consumer": ("SYNC-", "TPDO-"),
    "emcy_producer": ("EMCY-", "DEV-03"),
    "tpdo": ("TPDO-", "SYNC-", "OD-", "DEV-26"),
    "store": ("STO-",),
    "restore": ("RST-",),
    "node_id": ("NID-",),
    "bitrate": ("BIT-",),
    "lss": ("LSS-",),
    "leds": ("LED-",),
    "bus_errors": ("EMCY-",),
    "supply": ("DEV-41",),
    "paired": ("NID-", "BIT-"),
    "same-value": ("DEV-", "NID-", "BIT-"),
    "slope": ("DEV-", "TPDO-"),
    "zeroing": ("DEV-",),
    "reset-command": ("DEV-",),
    "status-bits": ("DEV-", "EMCY-"),
    "low-pass-filter": ("DEV-",),
}
"""Beginnings of the requirements that a service or the rule of a behaviour is judged by."""


def service_defects(spec: DeviceSpec) -> Iterator[Defect]:
    """Return a defect for every figure of every service of a variant."""
    for name in type(spec.services).model_fields:
        service = getattr(spec.services, name)
        if service is not None:
            for place, value, what in _Walk(spec.variant).block(service, ()):
                made = _defect(("services", name, *place), value, what, SEEN_BY[name])
                again = _repetitions(spec, service, place, value)
                yield replace(made, faults=(*made.faults, *again))


def behaviour_defects(spec: DeviceSpec) -> Iterator[Defect]:
    """Return a defect for every figure of every behaviour of a variant, and one without it."""
    for name, behaviour in spec.behaviours.items():
        place = ("behaviours", name)
        seen_by = SEEN_BY[behaviour.rule]
        yield _defect((*place, "holds"), False, "the rule does not hold", seen_by)
        for more, value, what in _Walk(spec.variant).block(behaviour, ()):
            yield _defect((*place, *more), value, what, seen_by)


def _defect(place: tuple[Any, ...], value: Any, what: str, seen_by: tuple[str, ...]) -> Defect:
    short = path(*place[1:])
    return Defect(
        id=f"{short}={what}",
        what=f"{' '.join(str(key).replace('_', ' ') for key in place[1:])}: {what}",
        faults=(change(path(*place), value),),
        attribute=str(place[2]),
        area=str(place[1]),
        seen_by=seen_by,
    )


def _repetitions(
    spec: DeviceSpec, service: BaseModel, place: tuple[Any, ...], value: Any
) -> Iterator[str]:
    """Return the same change where entries repeat a figure of a service in their ranges."""
    match service:
        case HeartbeatProducer():
            keys = [(service.object, 0)]
        case Tpdo():
            indices = range(service.communication, service.communication + service.count)
            keys = [(index, sub) for index in indices for sub in TPDO_FIGURES]
        case _:
            return
    old = _value_at(service, place)
    for key in keys:
        entry = spec.entries.get(key)
        if entry is None or entry.ranges is None:
            continue
        ranges = [list(it) for it in entry.ranges]
        if isinstance(value, list):
            changed = [value if it == old else it for it in ranges]
        else:
            changed = [[value if end == old else end for end in it] for it in ranges]
        if changed != ranges:
            below = ("subs", entry.sub) if entry.in_record else ()
            yield change(path("objects", entry.index, *below, "ranges"), changed)


def _value_at(block: Any, place: tuple[Any, ...]) -> Any:
    for key in place:
        block = getattr(block, key) if isinstance(block, BaseModel) else block[key]
    return block


Change = tuple[tuple[Any, ...], Any, str]
"""Place in a block, value there instead, and words for it."""


class _Walk:
    """A walk over a block, each figure of one variant in turn a little different.

    Args:
        variant: The variant.
    """

    def __init__(self, variant: str) -> None:
        self._variant = variant

    def block(self, block: BaseModel, place: tuple[Any, ...]) -> Iterator[Change]:
        """Return the changes of a block.

        Args:
            block: The block.
            place: Where it stands.
        """
        for name, info in type(block).model_fields.items():
            if name in block.model_fields_set - NO_FIGURES:
                yield from self._value(getattr(block, name), info.annotation, (*place, name))

    def _value(self, value: Any, kind: Any, place: tuple[Any, ...]) -> Iterator[Change]:
        choices = _choices(kind)
        if isinstance(value, BaseModel):
            yield from self.block(value, place)
        elif isinstance(value, bool):
            yield place, not value, f"{not value}".lower()
        elif choices and isinstance(value, str):
            others = (other for other in choices if other != value and other not in UNSAID)
            yield from ((place, other, str(other)) for other in others)
        elif isinstance(value, int | float) and place[-1] not in NAMES:
            step = value // 2 if place[-1].endswith("_us") else 1
            yield from ((place, other, f"{other}") for other in (value - step, value + step))
        elif isinstance(value, list):
            yield from self._list(value, kind, place)
        elif shape(value) == "by_variant" and self._variant in value and not choices:
            yield from self._value(value[self._variant], None, (*place, self._variant))
        elif isinstance(value, dict):
            yield from self._dict(value, kind, place)
        if _optional(kind) and isinstance(value, BaseModel | str | int):
            yield place, None, "none"

    def _list(self, value: list[Any], kind: Any, place: tuple[Any, ...]) -> Iterator[Change]:
        if "patterns" in place:
            yield from (
                (place, _at(value, n, 2 * it), f"{n}: {2 * it}") for n, it in enumerate(value)
            )
        elif _is_interval(value):
            for n, it in enumerate(value):
                step = LIMIT_DEG if "limits" in place else 1
                for other in (it - step, it + step):
                    yield place, _at(value, n, other), f"{_at(value, n, other)}"
        else:
            for n, it in enumerate(value):
                if isinstance(it, BaseModel):
                    yield from self.block(it, (*place, n))
                elif isinstance(it, list):
                    yield from self._list(it, None, (*place, n))
                else:
                    yield place, [*value[:n], *value[n + 1 :]], f"without {it}"
            for other in _choices(kind):
                if other not in value:
                    yield place, [*value, other], f"{other} too"

    def _dict(self, value: dict[Any, Any], kind: Any, place: tuple[Any, ...]) -> Iterator[Change]:
        choices = _choices(kind)
        for key, it in value.items():
            below = (*place, key)
            if isinstance(it, BaseModel):
                yield from self.block(it, below)
            elif isinstance(it, list):
                yield from self._list(it, None, below)
            elif isinstance(it, dict):
                yield from self._dict(it, None, below)
            elif isinstance(it, str):
                others = (other for other in choices if other != it and other not in UNSAID)
                yield from ((below, other, str(other)) for other in others)
            yield place, _plain(without(value, key)), f"without {key}"


def _at(value: list[Any], place: int, other: Any) -> list[Any]:
    return [*value[:place], other, *value[place + 1 :]]


def _is_interval(value: list[Any]) -> bool:
    numbers = all(isinstance(it, int | float) and not isinstance(it, bool) for it in value)
    return numbers and len(value) == 2


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(exclude_unset=True)
    if isinstance(value, dict):
        return {key: _plain(it) for key, it in value.items()}
    return [_plain(it) for it in value] if isinstance(value, list) else value


def _choices(kind: Any) -> tuple[Any, ...]:
    """Return the words that a type allows, wherever in it they stand."""
    if get_origin(kind) is Literal:
        return get_args(kind)
    if get_origin(kind) in (Union, UnionType, Annotated, list, dict):
        parts = get_args(kind)[1:] if get_origin(kind) is dict else get_args(kind)
        return tuple(dict.fromkeys(word for part in parts for word in _choices(part)))
    return ()


def _optional(kind: Any) -> bool:
    return get_origin(kind) in (Union, UnionType) and type(None) in get_args(kind)
