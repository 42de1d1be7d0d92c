"""The supply: the device works at either end of the range that its manual gives."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import PROBE, Node
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.emcy import decoded, errors_to_come
from conformance.checks.errors.emcies import code_words, kept, register_word
from conformance.checks.limits import allowed_supply_v
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict

STAYS_S = 1.0

OF_THE_SUPPLY = range(0x3000, 0x4000)


def _ends(spec: DeviceSpec) -> Iterable[Case]:
    supply = spec.services.supply
    if supply is not None:
        for end_v in (supply.min_v, supply.max_v):
            yield Case(f"{end_v:g}V", end_v, supply.source, kept(spec))


@requirement(
    "DEV-41",
    level="manual",
    cases=("end_v", _ends),
    effects=("reads", "writes", "resets"),
    needs=("supply",),
)
def test_node_works_at_the_ends_of_its_supply_range(
    node: Node, stimulus: Stimulus, end_v: float, verdict: Verdict
) -> None:
    """At either end of the documented supply range the node goes on, without an error of the supply."""
    volt = allowed_supply_v(node.spec, end_v, stimulus.tolerance_v)
    with errors_to_come(node, stimulus, reset=True) as emcy:
        mark = node.link.mark()

        stimulus.supply(volt)
        node.link.listen(STAYS_S, node.is_boot_up)

        boot_ups = len(node.link.since(mark, node.is_boot_up))
        seen = [] if emcy is None else node.link.since(mark, emcy.matches)
        transfer = node.sdo.upload(*PROBE)
        register = emcy.register() if emcy is not None and transfer.confirmed else 0

    codes = [code for code in (decoded(it).error_code for it in seen) if code in OF_THE_SUPPLY]
    at = f"with {volt:g} V"
    verdict.equal(f"error codes of the supply {at}", codes, [], show=code_words)
    verdict.equal(f"boot-up messages {at}", boot_ups, 0)
    verdict.equal(f"error register {at}", register, 0, show=register_word)
    verdict.holds(f"SDO {at}", expected="an answer", actual=str(transfer), ok=transfer.confirmed)
