"""Slopes of a node under test, set up so that a check may look at them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from conformance.bench.node.node import Node
from conformance.bench.sensor.settling import Settling
from conformance.bench.sensor.slope import Seen, SlopePort
from conformance.bench.settings.in_force import InForce, may_wait
from conformance.checks.profile.shown import is_same
from conformance.checks.profile.slopes import MeasuredSlope, operating_parameter
from conformance.checks.waiting import put_in_force
from conformance.spec.model import Entry
from conformance.verdict import Verdict


def port_of(node: Node, slope: MeasuredSlope) -> SlopePort:
    """Return a slope of the node."""
    return SlopePort(node, slope.entry, slope.rule)


def upright_port_of(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> SlopePort:
    """Return a slope of the node, which is not inverted; stored first where it may have to be."""
    port = port_of(node, slope)
    _set_up(node, port, partial(port.invert, on=False), in_force, verdict)
    return port


def plain_port_of(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> SlopePort:
    """Return such a slope whose offsets count, without a differential offset."""
    port = port_of(node, slope)
    _set_up(node, port, port.count_upright, in_force, verdict)
    port.make_plain()
    return port


def _set_up(
    node: Node,
    port: SlopePort,
    change: Callable[[], None],
    in_force: InForce,
    verdict: Verdict,
) -> None:
    """Change a slope's operating parameter, which has to be stored unless the slope shows that it acts."""
    parameter = operating_parameter(node.spec, port.rule)
    if parameter is None or not may_wait(parameter):
        change()
        return
    held, before = node.number(*parameter.key), port.seen()
    change()

    def goes_on() -> bool | None:
        return None if is_same(before, 0.0, port.seen()) else False

    if node.number(*parameter.key) != held:
        put_in_force(in_force, verdict, [parameter], goes_on, Settling(node).wait)


def seen_with(
    node: Node,
    port: SlopePort,
    setting: Entry | None,
    in_force: InForce,
    verdict: Verdict,
    is_as_before: Callable[[Seen], bool],
) -> Seen:
    """Return what a slope shows with a new setting, stored first where it may have to be.

    Args:
        node: The node under test.
        port: The slope.
        setting: What was written.
        in_force: What stores it.
        verdict: To note the reading that the node follows.
        is_as_before: Tells whether what the slope shows says that the setting does not act.
    """

    def goes_on() -> bool:
        return is_as_before(port.seen())

    written = [] if setting is None else [setting]
    put_in_force(in_force, verdict, written, goes_on, Settling(node).wait)
    return port.seen()
