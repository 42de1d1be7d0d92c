"""The command line's `simulate`: simulated devices as a process of their own."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from conformance import resources
from conformance.commands.spec import (
    Device,
    FaultOption,
    NodeIdOption,
    ReadingOption,
    VariantOption,
)
from conformance.errors import SpecError
from conformance.numbers import node_ids
from conformance.report.console import console
from conformance.simulator.channel import NodeName, build_devices, parse_readings
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.serving.lines import Address
from conformance.simulator.serving.loop import ended_by_signals
from conformance.simulator.serving.process import Process


def simulate(
    device: Device,
    variant: VariantOption = None,
    node_id: NodeIdOption = None,
    nodes: Annotated[
        str, typer.Option(help="Node-IDs of several devices, such as 1-64 or 1,5,9-12.")
    ] = "",
    count: Annotated[
        int, typer.Option(min=1, max=127, help="So many devices with that one node-ID.")
    ] = 1,
    fault: FaultOption = None,
    reading: ReadingOption = None,
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 0,
    serial_number: Annotated[
        int, typer.Option(help="Of the first device; counted up for the others.")
    ] = 1,
    interface: Annotated[str, typer.Option(help="On this python-can interface …")] = "",
    channel: Annotated[str, typer.Option(help="… and its channel.")] = "",
    bitrate: Annotated[
        int | None, typer.Option(help="Bit rate in bit/s; the factory's by default.")
    ] = None,
    slcan_pty: Annotated[
        Path | None, typer.Option(help="As an slcan adapter on a pseudo-terminal with this link.")
    ] = None,
    socketcand: Annotated[
        str, typer.Option(help="As a socketcand server on HOST:PORT; port 0 takes a free one.")
    ] = "",
    control: Annotated[
        str, typer.Option(help="Take power, tilt and faults on HOST:PORT; port 0 takes a free one.")
    ] = "",
) -> None:
    """Let simulated devices live in real time, until Ctrl-C or SIGTERM."""
    if bool(interface) == bool(slcan_pty or socketcand):
        raise SpecError(
            "simulate: expected either --interface and --channel, or --slcan-pty or --socketcand"
        )
    spec = str(resources.find("device_specs", device, "DEVICE"))
    devices = build_devices(
        [NodeName(spec, variant, number) for number in _numbers(nodes, node_id, count)],
        readings=parse_readings(",".join(reading or ())),
        faults=fault or (),
        seed=seed,
        serial_number=serial_number,
        device_bitrate=bitrate,
    )
    with ExitStack() as stack:
        process = Process(stack, devices)
        if interface:
            loop = process.on_library_bus(interface, channel)
        else:
            loop = process.on_own_bus(slcan_pty, _address(socketcand, "--socketcand"))
        if (address := _address(control, "--control")) is not None:
            process.controlled(loop, address)
        stack.enter_context(ended_by_signals(loop))
        console.say(f"{_names(devices)} on {', '.join(process.places)}; Ctrl-C ends it")
        loop.run()


def _names(devices: Sequence[SimulatedDevice]) -> str:
    first = devices[0]
    ids = [device.node_id for device in devices]
    who = f"node {ids[0]}" if ids[0] == ids[-1] else f"{len(ids)} nodes, {ids[0]} to {ids[-1]},"
    who += f", {len(ids)} of them," if len(ids) > 1 and ids[0] == ids[-1] else ""
    spec = first.spec
    return f"{spec.name} {spec.variant} as {who} at {first.bitrate / 1000:g} kbit/s"


def _numbers(text: str, node_id: int | None, count: int) -> list[int | None]:
    """Return each device's node-ID, None for the factory's."""
    if not text:
        return [node_id] * count
    if node_id is not None or count > 1:
        raise SpecError("--nodes: expected no --node-id and no --count beside it")
    return list(node_ids("--nodes", text))


def _address(text: str, option: str) -> Address | None:
    if not text:
        return None
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or int(port) > 0xFFFF:
        raise SpecError(f"{option}: expected HOST:PORT, got {text!r}")
    return host, int(port)
