"""Two nodes of one kind and one node-ID on a bus, told apart by LSS (CiA 305 v3.0, 6.3 and 6.4)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.lss import LssPort
from conformance.checks.lss.lss_cases import CIA305, offers, once
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire import lss as wire
from conformance.wire.lss import LssCommand
from conformance.wire.nmt import NmtCommand


def _twins(spec: DeviceSpec) -> Iterable[Case]:
    needed = once("two-nodes", "switch-state-selective", state="waiting")(spec)
    serial = spec.entry(0x1018, 4)
    configures = all(
        True in offers(spec, service, "configuration")
        for service in ("configure-node-id", "store-configuration")
    )
    if serial is not None and configures:
        yield from (Case(case.label, serial, case.section) for case in needed)


@requirement(
    "LSS-23",
    level="manual",
    cases=("serial", _twins),
    source=f"{CIA305}, 6.3 and 6.4",
    effects=("reads", "node-id", "resets", "non-volatile", "other-nodes"),
    needs=("second-node",),
)
def test_two_nodes_with_one_node_id_are_told_apart(
    lss: LssPort, node: Node, stimulus: Stimulus, serial: Entry, verdict: Verdict
) -> None:
    """Of two nodes with one node-ID each is selected by its serial number, and given its own."""
    lss.begin()
    own, twin = lss.address.serial, lss.address.serial ^ 1
    away = lss.free_node_id()
    mark = node.link.mark()
    with stimulus.second_node(twin):
        node.await_boot_up(mark)
        selected = {number: _selected(lss, number) for number in (own, twin)}
        if not selected[own]:
            raise SetupRefused("the node was not selected, see LSS-03")
        never_numbered = [it for it in serial.alternatives if it.entry.default == own]
        if never_numbered and set(selected[own]) == {own} and not selected[twin]:
            verdict.equal("serial number", own, own)
            verdict.follows(never_numbered[0].ambiguity, never_numbered[0].reading)
            return
        for number, seen in selected.items():
            verdict.equal(f"serial numbers selected by {number:08X}h", seen, [number], show=_list)
        if any(seen != [number] for number, seen in selected.items()):
            return
        lss.enter()
        lss.configure(serial=twin)
        lss.prepared("a node-ID", lss.node_id(away), "LSS-13")
        lss.prepared("the store", lss.store(), "LSS-18")
        lss.wait()
        mark = node.link.mark()
        node.nmt(NmtCommand.RESET_COMMUNICATION)
        node.await_boot_up(mark)
        for node_id, number in ((node.node_id, own), (away, twin)):
            node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node_id=node_id)
            transfer = lss.at(node_id).upload(*serial.key)
            data = serial.type.encode(number)
            verdict.holds(
                f"serial number at node-ID {node_id}",
                expected=data.hex(" ").upper(),
                actual=str(transfer),
                ok=transfer.data == data,
            )


def _selected(lss: LssPort, serial: int) -> list[int]:
    """Return the serial numbers of the slaves in LSS configuration once one was selected."""
    lss.enter()
    lss.require_waiting()
    lss.ask_all(*lss.address.select(serial))
    answers = [answer.message for answer in lss.serial_answers()]
    return [
        it.value
        for it in answers
        if isinstance(it, wire.InquireReply) and it.command is LssCommand.INQUIRE_SERIAL
    ]


def _list(numbers: list[int]) -> str:
    return " and ".join(f"{number:08X}h" for number in numbers) or "none"
