"""Identity of the device as its label has it, read by the bench's operator (CiA 301 v4.2.0, 7.5.2.19)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict


def _on_label(spec: DeviceSpec) -> Iterable[Case]:
    for entry in spec.entries.values():
        if entry.on_label and entry.type.is_integer and not entry.optional:
            yield Case(entry.address, entry, entry.source_of("on_label"))


@requirement("ID-01", level="manual", cases=("entry", _on_label), needs=("operator",))
def test_serial_number_is_on_the_label(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """The serial number is the one on the label."""
    number = node.number(*entry.key)

    same = bench.operator.is_on_label(number)

    verdict.holds(
        f"serial number in {entry.address}",
        expected="the one on the label",
        actual=f"{number} ({number:X}h), {'the one' if same else 'which is not'} on the label",
        ok=same,
    )
