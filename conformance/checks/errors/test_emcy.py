"""EMCY: what an emergency message carries, and when it comes (CiA 301 v4.2.0, 7.2.7)."""

from __future__ import annotations

from conformance.bench.node.node import Node
from conformance.bench.services.emcy import EmcyPort, decoded
from conformance.bench.services.provocations import AnyProvocation, Provocation
from conformance.checks.errors.emcies import (
    NO_ERROR,
    any_errors,
    both_sides,
    came_about,
    code_word,
    code_words,
    documented_bits,
    judge,
    producers,
    provoked,
    register_object,
    register_word,
    require_told,
    told,
    with_register,
)
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, requirement
from conformance.spec.document import EmcyProducer
from conformance.spec.model import DeviceSpec, address
from conformance.verdict import Verdict

USAGE = f"{CIA301}, 7.2.7.1"
PROTOCOL = f"{CIA301}, 7.2.7.3.1"
REGISTER = f"{CIA301}, 7.5.2.2"
BOOT_S = 0.5
OCTETS = 8
_GENERIC = 0


@requirement(
    "EMCY-01",
    level="shall",
    cases=("index", producers),
    source=USAGE,
    effects=("reads", "resets"),
)
def test_no_emcy_without_an_error(node: Node, emcy: EmcyPort, index: int, verdict: Verdict) -> None:
    """After a start without an error no EMCY is sent."""
    emcy.watch()

    codes = _start(node, emcy)

    _require_no_error(codes)
    verdict.equal(f"EMCYs ({address(index)}) after the start", len(codes), 0)


@requirement(
    "EMCY-02",
    level="manual",
    cases=("index", register_object),
    source=REGISTER,
    effects=("reads", "resets"),
)
def test_register_is_zero_without_an_error(
    node: Node, emcy: EmcyPort, index: int, verdict: Verdict
) -> None:
    """After a start without an error the error register is 0."""
    emcy.watch()
    _require_no_error(_start(node, emcy))

    register = emcy.register()

    verdict.equal(f"error register {address(index)}", register, 0, show=register_word)


def _start(node: Node, emcy: EmcyPort) -> list[int]:
    """Reset the node and return the error codes that it sends."""
    mark = node.link.mark()
    node.reset()
    emcy.watch()
    emcy.listen(BOOT_S)
    return [decoded(seen).error_code for seen in node.link.since(mark, emcy.matches)]


def _require_no_error(codes: list[int]) -> None:
    present = [code for code in codes if code != NO_ERROR]
    if present:
        raise SetupRefused(f"the node starts with an error: {code_words(present)}")


@requirement(
    "EMCY-03",
    level="manual",
    cases=("error", both_sides),
    source=USAGE,
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_error_is_told_by_its_code(
    spec: DeviceSpec, emcy: EmcyPort, error: Provocation, verdict: Verdict
) -> None:
    """An angle beyond its limit is told by an EMCY with the documented error code."""
    emcy.calm()

    seen = emcy.provoke(error)

    if not came_about(spec, emcy, error, seen, verdict):
        return
    if not seen:
        verdict.holds("EMCY", expected=code_word(error.code), actual="none", ok=False)
        return
    verdict.equal("error code", decoded(seen[0]).error_code, error.code, show=code_word)


@requirement(
    "EMCY-04",
    level="shall",
    cases=("error", provoked),
    source=PROTOCOL,
    effects=("reads", "writes"),
)
def test_emcy_has_eight_octets(
    spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """An EMCY has eight octets."""
    emcy.calm()

    seen = emcy.provoke(error)

    if came_about(spec, emcy, error, seen, verdict):
        lengths = [len(one.frame.data) for one in require_told(seen)]
        verdict.equal("octets", lengths, [OCTETS] * len(lengths))


@requirement(
    "EMCY-05",
    level="shall",
    cases=("error", with_register),
    source=PROTOCOL,
    effects=("reads", "writes"),
)
def test_emcy_carries_the_error_register(
    spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """Octet 2 of an EMCY is the error register."""
    messages = told(spec, emcy, error, verdict)

    if messages is not None:
        shown = emcy.register()
        verdict.equal("octet 2", messages[-1].error_register, shown, show=register_word)


@requirement(
    "EMCY-06",
    level="manual",
    cases=("error", with_register),
    source=REGISTER,
    effects=("reads", "writes"),
)
def test_register_shows_documented_bits(
    spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """With an error bit 0 of the error register is set if documented, and no undocumented bit."""
    if told(spec, emcy, error, verdict) is None:
        return

    register = emcy.register()

    bits = {bit for bit in range(8) if register >> bit & 1}
    if isinstance(error, Provocation):  # EMCY-28 has the bits of errors on the bus
        judge(
            spec,
            verdict,
            "bit 0 of the error register",
            _GENERIC in bits,
            lambda producer: {_GENERIC in producer.register_bits},
            show=lambda is_set: "set" if is_set else "clear",
        )
    undocumented = sorted(bits - documented_bits(spec))
    verdict.equal("undocumented bits of the error register", undocumented, [])


@requirement(
    "EMCY-07",
    level="manual",
    cases=("error", any_errors),
    source=PROTOCOL,
    effects=("reads", "writes"),
)
def test_emcy_carries_the_manufacturers_code(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """Octets 3 to 7 of an EMCY carry the documented object where documented, elsewhere 0."""
    messages = told(spec, emcy, error, verdict)
    if messages is None:
        return

    place = emcy.producer.manufacturer_code
    code = node.number(place.object) if place is not None else 0

    def wanted(producer: EmcyProducer) -> set[bytes]:
        field = bytearray(5)
        if producer.other_octets == "any":
            return {messages[-1].manufacturer}
        if producer.manufacturer_code is not None:
            field[producer.manufacturer_code.octet] = code & 0xFF
        return {bytes(field)}

    judge(
        spec,
        verdict,
        "octets 3 to 7",
        messages[-1].manufacturer,
        wanted,
        show=lambda field: field.hex(" ").upper(),
    )
    bits = _bits_of(spec, error)
    if place is not None and bits:
        verdict.holds(
            f"{address(place.object)} with an error of {error.axis}",
            expected=f"bit {' or '.join(map(str, bits))} set",
            actual=f"{code:02X}h",
            ok=any(code >> bit & 1 for bit in bits),
        )


def _bits_of(spec: DeviceSpec, error: AnyProvocation) -> list[int]:
    """Return the bit of an error in the manufacturer's code, under each reading."""
    found = {
        cause.bit
        for services, _ in spec.services_readings
        if services.emcy_producer is not None
        for cause in services.emcy_producer.causes
        if cause.cause == error.axis
    }
    return sorted(bit for bit in found if bit is not None)
