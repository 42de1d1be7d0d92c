"""TPDOs that only some readings of a manual have (CiA 301 v4.2.0, 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.services.tpdo import TpdoPort
from conformance.checks.pdo.tpdos import (
    ASYNCHRONOUS,
    EVENT_MS,
    NOT_VALID,
    TYPE_SUB,
    WINDOW_S,
    others_off,
    send_syncs,
)
from conformance.checks.steps import COB_ID_SUB
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec, OtherServices, address
from conformance.spec.services import Tpdo
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode
from conformance.wire.nmt import NmtCommand

MISSING = (AbortCode.OBJECT_DOES_NOT_EXIST, AbortCode.SUB_INDEX_DOES_NOT_EXIST)
FREE_CAN_ID = 0x6A8
"""No service of the predefined connection set has it, and none is kept from it."""


class Further(NamedTuple):
    """A TPDO that the judged reading does not have.

    Args:
        number: 2…512.
        tpdo: The service as a reading has it that has the TPDO.
        reading: That reading.
    """

    number: int
    tpdo: Tpdo
    reading: OtherServices


def _further(spec: DeviceSpec) -> Iterable[Case]:
    count = 0 if spec.services.tpdo is None else spec.services.tpdo.count
    for services, other in spec.services_readings:
        if services.tpdo is not None and other is not None:
            for number in range(count + 1, services.tpdo.count + 1):
                label = address(services.tpdo.communication + number - 1)
                yield Case(label, Further(number, services.tpdo, other), services.tpdo.source)
                count = number


def _types(tpdo: Tpdo) -> Iterator[int]:
    """Return the transmission types at the ends of what is documented."""
    yield from dict.fromkeys(edge for interval in tpdo.transmission_types for edge in interval)


@requirement("TPDO-68", level="manual", cases=("further", _further), effects=("reads", "writes"))
def test_further_tpdo_is_whole_or_missing(node: Node, further: Further, verdict: Verdict) -> None:
    """A TPDO that only some readings have is missing, or sent by its types on the COB-ID it is given."""
    number, tpdo, reading = further
    communication, mapping = tpdo.communication + number - 1, tpdo.mapping + number - 1
    found = [node.sdo.upload(communication, COB_ID_SUB), node.sdo.upload(mapping, 0)]
    verdict.holds(
        f"{address(communication)} and {address(mapping)}",
        expected="both, or none",
        actual="; ".join(map(str, found)),
        ok=len({it.confirmed for it in found}) == 1
        and all(it.confirmed or it.abort in MISSING for it in found),
    )
    if not all(it.confirmed for it in found):
        return
    verdict.follows(reading.ambiguity, reading.reading)
    others_off(node, number)
    for word in (FREE_CAN_ID | NOT_VALID, FREE_CAN_ID):
        node.download(communication, COB_ID_SUB, word)
    port = TpdoPort(node, tpdo, number)

    for kind in _types(tpdo):
        event_ms = EVENT_MS if kind in ASYNCHRONOUS else 0
        port.configure(kind, event_ms=event_ms)
        held = node.number(communication, TYPE_SUB)
        port.start()
        each = [port.listen(WINDOW_S)] if event_ms else send_syncs(node, port, kind)
        count = sum(map(len, each))
        node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        verdict.equal(f"type of {address(communication)}", held, kind)
        verdict.holds(
            f"TPDOs of type {kind} on {FREE_CAN_ID:03X}h",
            expected="some" if event_ms else "one",
            actual=str(count),
            ok=bool(count) if event_ms else count == 1,
        )
