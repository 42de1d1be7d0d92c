"""TPDO mapping: when it may be written (CiA 301 v4.2.0, 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.services.mapping import MappingPort, word_of
from conformance.checks.dictionary.held import held, judge_values
from conformance.checks.pdo import mapping
from conformance.checks.pdo.mapping import Frame
from conformance.checks.pdo.tpdos import listen, paced
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.document import Services, Tpdo
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict


def _every(spec: DeviceSpec) -> list[Tpdo]:
    return [it.tpdo for it, _ in spec.services_readings if it.tpdo is not None]


def _in_use(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs whose mapping entries no reading lets be written while they are sent."""
    return mapping.pairs(spec) if all(it.map_only_while for it in _every(spec)) else ()


def _valid(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs whose number of objects no reading lets be written while they are valid."""
    bound = all("disabled" in tpdo.map_only_while for tpdo in _every(spec))
    return mapping.pairs(spec) if bound else ()


def _counting(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs whose mapping entries no reading lets be written while they count."""
    bound = all("count-zero" in tpdo.map_only_while for tpdo in _every(spec))
    return mapping.pairs(spec) if bound else ()


@requirement(
    "TPDO-50",
    level="manual",
    cases=("frame", _in_use),
    source=mapping.MAPPING,
    effects=("reads", "writes"),
)
def test_mapping_entry_is_locked_in_use(node: Node, frame: Frame, verdict: Verdict) -> None:
    """A mapping entry of a TPDO in use does not change what the TPDO carries."""
    port = mapping.port_of(node, frame.number)
    if mapping.is_fixed(port, verdict):
        return
    mapped, other = frame.entries
    octets = _send(node, port, frame.number, mapped)

    step = port.try_word(1, word_of(other))

    mapping.judge_by_reading(node.spec, verdict, step.what, mapping.outcome(step.answer), _answer)
    _judge_goes_on(verdict, node, port, frame, octets)


@requirement(
    "TPDO-51",
    level="manual",
    cases=("frame", _valid),
    source=mapping.MAPPING,
    effects=("reads", "writes"),
)
def test_number_is_locked_while_valid(node: Node, frame: Frame, verdict: Verdict) -> None:
    """The number of mapped objects of a valid TPDO does not change what the TPDO carries."""
    port = mapping.port_of(node, frame.number)
    if mapping.is_fixed(port, verdict):
        return
    octets = _send(node, port, frame.number, frame.entries[0])

    step = port.try_count(0)

    mapping.judge_by_reading(node.spec, verdict, step.what, mapping.outcome(step.answer), _answer)
    _judge_goes_on(verdict, node, port, frame, octets)


@requirement(
    "TPDO-52",
    level="manual",
    cases=("frame", _counting),
    source=mapping.MAPPING,
    effects=("reads", "writes"),
)
def test_mapping_entry_is_locked_while_counted(node: Node, frame: Frame, verdict: Verdict) -> None:
    """A mapping entry is refused, and stays, while the number of mapped objects is not 0; or waits, as documented."""
    port = mapping.port_of(node, frame.number)
    if mapping.is_fixed(port, verdict):
        return
    mapped, other = frame.entries
    port.open()
    mapping.require_confirmed(port.offer([word_of(mapped)]))

    step = port.try_word(1, word_of(other))

    mapping.judge_by_reading(node.spec, verdict, step.what, mapping.outcome(step.answer), _answer)
    word = word_of(mapped if step.answer.refused else other)
    verdict.equal("mapping as read back", port.words(), [word], show=mapping.shown)


def _answer(services: Services) -> str:
    waits = services.tpdo is not None and services.tpdo.map_otherwise == "waits"
    return "confirmed" if waits else "refused"


def _send(node: Node, port: MappingPort, number: int, entry: Entry) -> int:
    """Let a TPDO come that carries one object, and return how many octets it has.

    Raises:
        SetupRefused: It does not.
    """
    pace = paced(node, number)
    port.configure(pace.transmission_type, event_ms=pace.event_ms, mapped=[entry])
    port.start()
    seen = listen(node, port, pace)
    if not seen:
        raise SetupRefused("the TPDO does not come, see TPDO-01")
    return len(seen[0].frame.data)


def _judge_goes_on(
    verdict: Verdict, node: Node, port: MappingPort, frame: Frame, octets: int
) -> None:
    """Judge that a TPDO still comes and carries the first object of a frame."""
    seen = listen(node, port, paced(node, frame.number))
    verdict.equal("TPDOs afterwards", "some" if seen else "none", "some")
    if seen:
        data = seen[-1].frame.data
        verdict.equal("octets of the TPDO", len(data), octets)
        judge_values(verdict, data, [held(node, frame.entries[0])])
