"""Emergency messages in a recording (CiA 301 v4.2.0, 7.2.7)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from conformance.checks.errors.emcies import (
    NO_ERROR,
    code_word,
    documented_bits,
    producers,
)
from conformance.judging.recording import Seen
from conformance.judging.sightings import Sighting
from conformance.judging.states import UNTOLD
from conformance.judging.timeline import Timeline
from conformance.spec.document import EmcyProducer
from conformance.spec.model import DeviceSpec, address
from conformance.verdict import Verdict
from conformance.wire import emcy
from conformance.wire.cob_id import emcy as predefined
from conformance.wire.errors import WireError

CAN_ID, UNUSED = 0x7FF, 1 << 31 | 1 << 29
OCTETS = 8


def emcys(timeline: Timeline) -> Iterator[Sighting]:
    """Return what a recording shows of emergency messages."""
    spec = timeline.spec
    for case in producers(spec):
        entry = spec.entry(case.subject)
        by_default = entry.default if entry is not None else predefined(spec.node_id)
        words = [by_default, *timeline.told((case.subject, 0))]
        can_ids = {it & CAN_ID for it in words if isinstance(it, int) and not it & UNUSED}
        fixed = entry is None or not any(it.writable for it in entry.readings)
        for can_id in sorted(can_ids):
            for seen in timeline.on(can_id):
                known = timeline.known((case.subject, 0), seen.line)
                if known is not None and known.value & CAN_ID != can_id:
                    continue
                doubt = "" if known is not None or fixed else UNTOLD
                yield from _message(spec, case.subject, case.section, seen, doubt)


def _message(
    spec: DeviceSpec, index: int, section: str, seen: Seen, doubt: str
) -> Iterator[Sighting]:
    octets = len(seen.frame.data)
    judge = partial(_judge_octets, octets=octets)
    yield Sighting("EMCY-04", address(index), section, seen, seen, judge, doubt, proof=True)
    try:
        message = emcy.decode(seen.frame)
    except WireError:
        return
    codes = _codes(spec)
    if message.error_code != NO_ERROR:
        judge = partial(_judge_code, code=message.error_code, codes=codes)
        label = code_word(message.error_code).partition(" ")[0]
        yield Sighting("EMCY-03", label, section, seen, seen, judge, doubt, proof=True)
    judge = partial(_judge_bits, register=message.error_register, known=documented_bits(spec))
    yield Sighting("EMCY-06", address(index), section, seen, seen, judge, doubt, proof=True)
    if all(_has_zeros(it) for it in _producers(spec)):
        judge = partial(_judge_rest, octets=message.manufacturer)
        yield Sighting("EMCY-07", address(index), section, seen, seen, judge, doubt, proof=True)


def _producers(spec: DeviceSpec) -> list[EmcyProducer]:
    found = (services.emcy_producer for services, _ in spec.services_readings)
    return [it for it in found if it is not None]


def _has_zeros(producer: EmcyProducer) -> bool:
    return producer.other_octets == "zero" and producer.manufacturer_code is None


def _codes(spec: DeviceSpec) -> set[int]:
    """Return the error codes that some reading documents."""
    codes = {code for it in _producers(spec) for code in it.codes}
    for services, _ in spec.services_readings:
        if services.bus_errors is not None:
            told = (services.bus_errors.error_passive, services.bus_errors.after_bus_off)
            codes |= {code for code in told if code is not None}
    return codes


def _judge_octets(verdict: Verdict, octets: int) -> None:
    verdict.equal("octets", octets, OCTETS)


def _judge_code(verdict: Verdict, code: int, codes: set[int]) -> None:
    verdict.one_of("error code", code, sorted(codes), show=code_word)


def _judge_bits(verdict: Verdict, register: int, known: set[int]) -> None:
    undocumented = [bit for bit in range(8) if register >> bit & 1 and bit not in known]
    verdict.equal("undocumented bits of the error register", undocumented, [])


def _judge_rest(verdict: Verdict, octets: bytes) -> None:
    verdict.equal("octets 3 to 7", octets, bytes(5), show=lambda it: it.hex(" ").upper())
