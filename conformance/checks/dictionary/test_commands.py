"""Commands of the device, zeroing and restart, and its status (CiA 410)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

from conformance.bench.node.node import Node
from conformance.bench.sensor.slope import SlopePort
from conformance.bench.sensor.stimulus import Stimulus
from conformance.checks import cases
from conformance.checks.profile.shown import Outcome, confirmed, judge, turn_steps
from conformance.checks.profile.slope_ports import port_of
from conformance.checks.profile.slopes import (
    MeasuredSlope,
    Other,
    idle_offsets,
    measured_slopes,
    possible,
)
from conformance.checks.steps import require_alive
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.behaviours import ResetCommand, StatusBit, StatusBits, Zeroing
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Entry, OtherBehaviours
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtCommand

TILT_SHARES = (-0.25, 0.25, 0.6)
"""Apart by less than half of the range, so that a slope with the offset from one does not end at another."""


@dataclass(frozen=True, slots=True)
class Zero:
    """A zeroing command and a value for it.

    Args:
        command: The command.
        value: One of its documented values.
        zeroed: The slopes that it zeroes.
        others: Those that it leaves alone.
    """

    command: Entry
    value: int
    zeroed: tuple[MeasuredSlope, ...]
    others: tuple[MeasuredSlope, ...]


def _zeros(spec: DeviceSpec) -> Iterable[Case]:
    known = {slope.name: slope for slope in measured_slopes(spec)}
    for rule in spec.behaviours.values():
        command = spec.entries[key_of(rule.command)] if isinstance(rule, Zeroing) else None
        if not isinstance(rule, Zeroing) or command is None or not cases.present(command, spec):
            continue
        for value in command.values or ():
            if all(value in (r.values or ()) for r in command.readings):
                bits = {bit: known[name] for bit, name in rule.slopes.items() if name in known}
                zeroed = tuple(slope for bit, slope in bits.items() if value >> bit & 1)
                others = tuple(slope for bit, slope in bits.items() if not value >> bit & 1)
                zero = Zero(command, value, zeroed, others)
                label = f"{command.address}/{value}"
                yield Case(label, zero, rule.source, cases.reach(command, spec))


@requirement(
    "DEV-24",
    level="manual",
    cases=("zero", _zeros),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_zeroing_zeroes_its_axes(
    node: Node, zero: Zero, stimulus: Stimulus, verdict: Verdict
) -> None:
    """The zeroing command makes the slopes of its bits show 0, and leaves the others alone."""
    every = (*zero.zeroed, *zero.others)

    for share in TILT_SHARES:
        before = {it.name: port.seen() for it, port in _tilted(node, every, stimulus, share)}
        _command(node, zero, verdict)
        for slope in every:
            port, shown = port_of(node, slope), before[slope.name]
            outcomes = [Outcome(shown.value)]
            if slope in zero.zeroed:
                idle = idle_offsets(node.spec, slope)
                outcomes = [Outcome(0), *(Outcome(shown.value, (other,)) for other in idle)]
            judge(
                verdict,
                f"{slope.entry.address} after the command",
                port.seen(),
                outcomes,
                before=shown,
                turn_steps=turn_steps(slope, port.step_deg),
            )


def _command(node: Node, zero: Zero, verdict: Verdict) -> None:
    """Write the command and judge that it is confirmed."""
    data = zero.command.type.encode(zero.value)
    transfer = node.try_download(*zero.command.key, data)
    confirmed(verdict, f"download of {zero.value} to {zero.command.address}", transfer)


def _tilted(
    node: Node, every: Iterable[MeasuredSlope], stimulus: Stimulus, share: float
) -> list[tuple[MeasuredSlope, SlopePort]]:
    """Tilt all axes by something, so that a zero shows."""
    ports = [(slope, port_of(node, slope)) for slope in every]
    by_axis = {slope.entry.follows: slope.at(share) for slope, _ in ports}
    stimulus.tilt(by_axis.get("tilt-x", 0.0), by_axis.get("tilt-y", 0.0))
    return ports


@requirement(
    "DEV-25",
    level="manual",
    cases=("zero", _zeros),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_zeroing_calculates_the_offsets(
    node: Node, zero: Zero, stimulus: Stimulus, verdict: Verdict
) -> None:
    """After the zeroing command the offsets of its axes undo the measured angle, the others are as before."""
    every = [it for it in (*zero.zeroed, *zero.others) if it.rule and it.rule.offset is not None]

    for share in TILT_SHARES:
        tilted = _tilted(node, every, stimulus, share)
        before = {it.name: (port.seen(), port.offset) for it, port in tilted}
        _command(node, zero, verdict)
        for slope in every:
            port, (shown, offset) = port_of(node, slope), before[slope.name]
            judge(
                verdict,
                f"offset of {slope.entry.address} after the command",
                port.seen_offset(),
                _offsets(node.spec, zero, slope, shown.value, offset),
                before=shown,
                turn_steps=turn_steps(slope, port.step_deg),
            )


def _offsets(
    spec: DeviceSpec, zero: Zero, slope: MeasuredSlope, shown: int, offset: int
) -> list[Outcome]:
    """Return the offsets that a slope may have after the command."""
    if slope not in zero.zeroed:
        return [Outcome(offset)]
    outcomes = [Outcome(offset + sign * -shown, (other,)) for sign, other in _signs(spec, slope)]
    outcomes += [
        Outcome(sign * -shown, (other, without))
        for sign, other in _signs(spec, slope)
        for without in idle_offsets(spec, slope)
    ]
    return outcomes


def _signs(spec: DeviceSpec, slope: MeasuredSlope) -> list[tuple[int, Other | None]]:
    ways = possible(spec, slope, "offset_is")
    return [(-1 if way == "subtracted" else 1, other) for way, other in ways.items()]


def _reset_commands(spec: DeviceSpec) -> Iterable[Case]:
    for rule in spec.behaviours.values():
        if isinstance(rule, ResetCommand):
            entry = spec.entries[key_of(rule.command)]
            if cases.present(entry, spec):
                yield Case(entry.address, rule, rule.source)


@requirement(
    "DEV-22", level="manual", cases=("rule", _reset_commands), effects=("writes", "resets")
)
def test_command_restarts_the_node(node: Node, rule: ResetCommand, verdict: Verdict) -> None:
    """The command to restart is not refused, and the node boots up again."""
    entry = node.spec.entries[key_of(rule.command)]
    mark = node.link.mark()

    transfer = node.write(*entry.key, entry.type.encode(rule.value))
    boot_up = node.link.wait(node.is_boot_up, node.boot_up_timeout_s, mark)

    node.was_reset = True
    verdict.holds(
        f"download of {rule.value} to {entry.address}",
        expected="confirmed, or no response any more",
        actual=str(transfer),
        ok=transfer.confirmed or not transfer.answered,
    )
    verdict.holds(
        "boot-up message",
        expected=f"within {node.boot_up_timeout_s:g} s",
        actual="seen" if boot_up is not None else "not seen",
        ok=boot_up is not None,
    )
    node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    require_alive(node)


def _statuses(spec: DeviceSpec) -> Iterable[Case]:
    for name, rule in spec.behaviours.items():
        if isinstance(rule, StatusBits):
            entry = spec.entries[key_of(rule.object)]
            if cases.readable(entry, spec):
                yield Case(entry.address, name, rule.source)


@requirement("DEV-23", level="manual", cases=("name", _statuses))
def test_status_bits_without_an_error(node: Node, name: str, verdict: Verdict) -> None:
    """Without an error each documented bit of a status object tells what it stands for."""
    readings = [
        (rule, other)
        for rule, other in node.spec.behaviour_readings(name)
        if isinstance(rule, StatusBits)
    ]
    emcy = node.spec.services.emcy_producer
    if emcy is not None and emcy.error_register is not None and node.number(emcy.error_register):
        raise SetupRefused("the error register tells of an error")
    status = node.number(*key_of(readings[0][0].object))

    every = sorted({bit for rule, _ in readings for bit in rule.bits})
    allowed: dict[tuple[int, ...], OtherBehaviours | None] = {}
    for rule, other in readings:
        for values in product(*(_told(node, rule.bits.get(bit)) for bit in every)):
            allowed.setdefault(values, other)
    shown = tuple(status >> bit & 1 for bit in every)
    names = ", ".join(map(str, every))
    verdict.one_of(f"bits {names}", shown, list(allowed), show=lambda it: ", ".join(map(str, it)))
    if (reading := allowed.get(shown)) is not None:
        verdict.follows(reading.ambiguity, reading.reading)


def _told(node: Node, meaning: StatusBit | None) -> tuple[int, ...]:
    """Return what a bit may be, given what the node holds; 0 where nothing sets it."""
    if meaning is not None and meaning.object is not None:
        return (int(node.number(*key_of(meaning.object)) == meaning.value),)
    return (0, 1) if meaning is not None and meaning.factory_settings else (0,)
