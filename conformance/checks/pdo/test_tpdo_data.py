"""TPDO: its data follow what is measured, and what stands behind them (CiA 301 v4.2.0, 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.sensor.slope import watch
from conformance.bench.sensor.stimulus import Stimulus
from conformance.checks.pdo.tilted_tpdos import (
    carry_the_tilt,
    is_slope,
    mapped_entries,
    slopes_in,
    tilted,
)
from conformance.checks.pdo.tpdos import listen, paced, port_of, set_up, tpdos
from conformance.checks.profile.shown import distance, margin_of
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict

MAPPING = f"{CIA301}, 7.5.2.38"
TILTS_DEG = (3.0, -3.0)


def _filled(spec: DeviceSpec) -> Iterable[Case]:
    every = [it.tpdo for it, _ in spec.services_readings if it.tpdo is not None]
    zero = all(tpdo.filler == "zero" for tpdo in every)
    return tpdos(spec) if zero and any(tpdo.octets for tpdo in every) else ()


@requirement(
    "TPDO-18",
    level="manual",
    cases=("number", _filled),
    effects=("reads", "writes"),
)
def test_octets_behind_the_mapped_objects(node: Node, number: int, verdict: Verdict) -> None:
    """Octets of a TPDO behind its mapped objects are 0, as far as there are any."""
    port, pace = port_of(node, number), paced(node, number)
    set_up(node, port, pace.transmission_type, pace.event_ms)
    octets = port.mapped_octets
    port.start()

    seen = listen(node, port, pace)

    if not seen:
        raise SetupRefused("the TPDO does not come, see TPDO-01")
    behind = {it.frame.data[octets:].strip(b"\0") for it in seen} - {b""}
    actual = " or ".join(it.hex(" ").upper() for it in sorted(behind))
    verdict.holds(
        "octets behind the mapped objects", expected="0", actual=actual or "0", ok=not behind
    )


@requirement(
    "TPDO-19",
    level="shall",
    cases=("number", tilted),
    source=MAPPING,
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_tpdo_follows_the_tilt(
    node: Node, number: int, stimulus: Stimulus, verdict: Verdict
) -> None:
    """While the device is tilted this way and that, a TPDO carries the slopes that an upload reads then."""
    port, pace = port_of(node, number), paced(node, number)
    carry_the_tilt(node, port, pace.transmission_type, pace.event_ms)
    entries = mapped_entries(node, port)
    slopes = [entry for entry in entries if is_slope(entry)]
    port.start()
    shown = set()

    for tilt_deg in TILTS_DEG:
        stimulus.tilt(tilt_deg, -tilt_deg)
        held = {entry.address: watch(node, entry.key) for entry in slopes}
        seen = listen(node, port, pace)
        if not seen:
            raise SetupRefused("the TPDO does not come, see TPDO-01")
        carried = slopes_in(seen[-1].frame.data, entries)
        shown.add(tuple(it.value for it in held.values()))
        for address, wanted in held.items():
            verdict.holds(
                f"{address} in the TPDO at {tilt_deg:g} deg",
                expected=f"{wanted.value} ± {margin_of(wanted)}",
                actual=str(carried.get(address, "too short")),
                ok=address in carried
                and distance(carried[address], wanted.value, 0) <= margin_of(wanted),
            )
    if len(shown) < len(TILTS_DEG):
        raise SetupRefused("the slopes do not follow the tilt, see DEV-01")
