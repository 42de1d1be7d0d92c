"""The setting of a PDO's byte order."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from conformance.bench.node.node import Node
from conformance.bench.sensor.slope import Seen, watch
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.tpdo import TpdoPort
from conformance.checks import cases
from conformance.checks.pdo.tpdos import Pace, listen, paced, port_of, tpdos
from conformance.checks.profile.shown import distance, margin_of
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.spec.services import ByteOrder
from conformance.verdict import Verdict

TILT_DEG = 3.0


@dataclass(frozen=True, slots=True)
class Ordered:
    """A TPDO whose byte order can be set.

    Args:
        number: 1…512.
        order: What the manual says of it.
        little_endian: A value that leaves the low octets first.
    """

    number: int
    order: ByteOrder
    little_endian: int


def _ordered(spec: DeviceSpec) -> Iterable[Case]:
    order = spec.services.tpdo.byte_order if spec.services.tpdo else None
    entry = spec.entry(order.object) if order else None
    if order is None or entry is None or not cases.present(entry, spec):
        return
    little = [value for value in entry.values or () if value != order.big_endian]
    if little:
        for case in tpdos(spec):
            subject = Ordered(case.subject, order, little[0])
            yield Case(case.label, subject, order.source)


@requirement(
    "DEV-26",
    level="manual",
    cases=("tpdo", _ordered),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_byte_order_turns_the_octets_round(
    node: Node, tpdo: Ordered, stimulus: Stimulus, verdict: Verdict
) -> None:
    """A TPDO has the low octet of each object first, or the high one, as its byte order is set."""
    stimulus.tilt(TILT_DEG, -TILT_DEG)
    port, pace = port_of(node, tpdo.number), paced(node, tpdo.number)
    node.download(tpdo.order.object, 0, tpdo.little_endian)
    port.configure(pace.transmission_type, event_ms=pace.event_ms)
    held = _held(node, port)
    port.start()

    low_first = _data(node, port, pace)
    node.download(tpdo.order.object, 0, tpdo.order.big_endian)
    high_first = _data(node, port, pace)

    _judge(verdict, "low octets first", low_first, held, {"as mapped": None})
    turned = {"reversed": None, **_whole(node.spec)}
    _judge(verdict, "high octets first", high_first, held, turned)


def _held(node: Node, port: TpdoPort) -> list[tuple[Entry, Seen]]:
    """Watch the mapped objects.

    Raises:
        SetupRefused: Their values look the same either way round.
    """
    entries = [node.spec.entry(word.index, word.sub) for word in port.mapping()]
    held = [(entry, watch(node, entry.key)) for entry in entries if entry is not None]
    plain = b"".join(entry.type.encode(seen.value) for entry, seen in held)
    if len(held) < len(entries) or _fits("reversed", plain, held):
        raise SetupRefused("the values of the mapped objects do not show in which order they are")
    return held


def _data(node: Node, port: TpdoPort, pace: Pace) -> bytes:
    """Return a TPDO's octets; the first one may have been on its way when the order was set."""
    seen = listen(node, port, pace)
    if len(seen) < 2:
        raise SetupRefused("the TPDO does not come, see TPDO-01")
    return seen[-1].frame.data


Forms = dict[str, tuple[str, int] | None]
"""How the octets may be ordered, with the ambiguity and reading by which they are."""


def _whole(spec: DeviceSpec) -> Forms:
    """Return whether the octets of the whole PDO may be reversed."""
    for services, other in spec.services_readings:
        order = services.tpdo.byte_order if services.tpdo else None
        if order is not None and order.reverses == "pdo":
            return {"reversed as a whole": (other.ambiguity, other.reading) if other else None}
    return {}


def _judge(
    verdict: Verdict, what: str, data: bytes, held: list[tuple[Entry, Seen]], forms: Forms
) -> None:
    fitting = [form for form in forms if _fits(form, data, held)]
    values = ", ".join(f"{seen.value} in {entry.address}" for entry, seen in held)
    verdict.holds(
        what,
        expected=f"{values}, {' or '.join(forms)}",
        actual=data.hex(" ").upper(),
        ok=bool(fitting),
    )
    reading = forms[fitting[0]] if fitting else None
    if reading is not None:
        verdict.follows(*reading)


def _fits(form: str, data: bytes, held: list[tuple[Entry, Seen]]) -> bool:
    """Tell whether the octets, put right, are what the mapped objects hold."""
    length = sum(entry.type.size or 0 for entry, _ in held)
    if len(data) < length:
        return False
    octets = data[:length][::-1] if form == "reversed as a whole" else data[:length]
    for entry, seen in held:
        size = entry.type.size or 0
        part, octets = octets[:size], octets[size:]
        value = int(entry.type.decode(part[::-1] if form == "reversed" else part))
        if distance(value, seen.value, 0) > margin_of(seen):
            return False
    return True
