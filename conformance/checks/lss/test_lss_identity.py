"""LSS identity: inquiring and searching for it (CiA 305 v3.0, 6.6 and 6.7)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.services.lss import LssPort
from conformance.checks.lss.lss_cases import (
    CIA305,
    NUMBERS,
    SILENT,
    ever,
    inquiry,
    judge_support,
    once,
)
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec, address
from conformance.spec.services import LssService
from conformance.verdict import Verdict
from conformance.wire import lss as wire
from conformance.wire.lss import LssCommand


def _inquiries(spec: DeviceSpec) -> Iterable[Case]:
    for number in range(len(NUMBERS)):
        for source in ever(spec, _service_of(number), "configuration"):
            yield Case(address(0x1018, number + 1), number, source)


def _service_of(number: int) -> LssService:
    return "inquire-serial-number" if number == len(NUMBERS) - 1 else "inquire-identity"


@requirement("LSS-06", level="manual", cases=("number", _inquiries), source=f"{CIA305}, 6.6")
def test_inquiry_tells_the_identity(
    lss: LssPort, spec: DeviceSpec, number: int, verdict: Verdict
) -> None:
    """An inquiry for a number of the LSS address is answered with the value in 1018h."""
    lss.enter()
    lss.configure()

    answer = lss.ask(inquiry(number))

    if judge_support(verdict, spec, _service_of(number), "configuration", answer):
        expected = wire.InquireReply(inquiry(number).command, lss.address.numbers[number])
        verdict.equal(NUMBERS[number], answer.message, expected, show=_value)
    elif not lss.configuring:
        raise SetupRefused("the node went silent for good")


def _value(reply: wire.SlaveMessage | None) -> str:
    if isinstance(reply, wire.InquireReply):
        return f"{reply.value:08X}h"
    return f"no such answer ({reply})"


@requirement(
    "LSS-07", level="manual", cases=once("5Eh", "inquire-node-id"), source=f"{CIA305}, 6.6"
)
def test_inquiry_tells_the_node_id(
    lss: LssPort, spec: DeviceSpec, node: Node, verdict: Verdict
) -> None:
    """An inquiry for the node-ID is answered with the one in force."""
    lss.enter()
    lss.configure()

    answer = lss.ask(wire.InquireNodeId())

    if judge_support(verdict, spec, "inquire-node-id", "configuration", answer):
        expected = wire.InquireReply(LssCommand.INQUIRE_NODE_ID, node.node_id)
        verdict.equal("node-ID", answer.message, expected, show=_value)
    elif not lss.configuring:
        raise SetupRefused("the node went silent for good")


@requirement(
    "LSS-09",
    level="manual",
    cases=once("46h-4Bh", "identify-remote-slave", state="waiting"),
    source=f"{CIA305}, 6.7",
)
def test_search_finds_the_node(lss: LssPort, spec: DeviceSpec, verdict: Verdict) -> None:
    """A search whose ranges include the node's numbers, limits included, is answered."""
    lss.enter()

    wide = lss.ask(*lss.address.search())
    exact = lss.ask(*lss.address.search(exact=True))

    if judge_support(verdict, spec, "identify-remote-slave", "waiting", wide):
        for answer in (wide, exact):
            found = isinstance(answer.message, wire.IdentifySlave)
            verdict.holds("answer to a search", expected="4Fh", actual=str(answer), ok=found)
        return
    verdict.equal("answer to a search for this node alone", str(exact), SILENT)
    lss.configure()


def _outside(spec: DeviceSpec) -> Iterable[Case]:
    revision = spec.entry(0x1018, 3)
    for source in ever(spec, "identify-remote-slave", "waiting"):
        for command in range(LssCommand.IDENTIFY_VENDOR, LssCommand.IDENTIFY_SERIAL_HIGH + 1):
            nothing_below = revision is None or any(it.default == 0 for it in revision.readings)
            if command != LssCommand.IDENTIFY_REVISION_HIGH or not nothing_below:
                yield Case(f"{command:02X}h", LssCommand(command), source)


@requirement("LSS-10", level="shall", cases=("limit", _outside), source=f"{CIA305}, 6.7")
def test_search_elsewhere_does_not_find_the_node(
    lss: LssPort, spec: DeviceSpec, limit: LssCommand, verdict: Verdict
) -> None:
    """A search that one number or limit keeps from including the node is not answered."""
    lss.enter()

    answer = lss.ask(*lss.address.search(excluded_by=limit))

    verdict.equal(f"answer with {limit:02X}h beyond the node", str(answer), SILENT)
    found = lss.ask(*lss.address.search())
    judge_support(verdict, spec, "identify-remote-slave", "waiting", found)
    lss.configure()
