"""What stands in a channel name and its options: the simulated nodes of a bus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from conformance.errors import SpecError
from conformance.resources import find, is_file
from conformance.simulator.bus import SimulatedBus
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.fault_files import load_faults
from conformance.simulator.neighbours import neighbours
from conformance.spec.load import load_spec

Clock: TypeAlias = Literal["virtual", "real"]


@dataclass(frozen=True, slots=True)
class NodeName:
    """One node of a channel: ``NAME_OR_PATH[:VARIANT][@NODEID]``."""

    spec: str
    variant: str | None = None
    node_id: int | None = None


def parse_channel(channel: str) -> list[NodeName]:
    """Return the nodes of a channel, separated by commas; the path of a file is one node.

    Raises:
        SpecError: A node has no name, or a node-ID that is no number.
    """
    if is_file(channel):
        return [NodeName(channel)]
    return [_node_name(part.strip()) for part in channel.split(",")]


def _node_name(text: str) -> NodeName:
    name, at, number = text.rpartition("@")
    if not at:
        name = text
    spec, colon, variant = name.rpartition(":")
    if not colon or "/" in variant or "\\" in variant:  # the colon of C:\...
        spec, variant = name, ""
    if not spec:
        raise SpecError(f"channel: expected NAME[:VARIANT][@NODEID],..., got {text!r}")
    node_id = integer(number, "channel") if at else None
    return NodeName(spec, variant or None, node_id)


def integer(value: int | str, option: str) -> int:
    """Return an option given as a number or as text (``5``, ``0x05``).

    Raises:
        SpecError: It is neither.
    """
    try:
        return value if isinstance(value, int) else int(value, 0)
    except ValueError:
        raise SpecError(f"{option}: expected a number, got {value!r}") from None


def share(value: float | str, option: str) -> float:
    """Return a share of a whole that is less than it, given as a number or as text (``0.8``).

    Raises:
        SpecError: It is no such number.
    """
    try:
        result = float(value)
    except ValueError:
        result = -1.0
    if 0.0 <= result < 1.0:
        return result
    raise SpecError(f"{option}: expected a number from 0.0 to less than 1.0, got {value!r}")


def parse_readings(readings: str | Mapping[str, int] | None) -> dict[str, int]:
    """Return the readings of ``A-01=2,A-03=1``.

    Raises:
        SpecError: A part has another form.
    """
    if not isinstance(readings, str):
        return dict(readings or {})
    result = {}
    for part in filter(None, map(str.strip, readings.split(","))):
        name, equals, number = part.partition("=")
        if not equals:
            raise SpecError(f"readings: expected ID=NUMBER,..., got {part!r}")
        result[name] = integer(number, "readings")
    return result


def parse_faults(faults: str | Sequence[str] | None) -> list[str]:
    """Return the names or paths of ``a,b``."""
    parts = faults.split(",") if isinstance(faults, str) else faults or ()
    return [part.strip() for part in parts if part.strip()]


def build_devices(
    names: Sequence[NodeName],
    *,
    variant: str | None = None,
    readings: Mapping[str, int] | None = None,
    faults: Sequence[str] = (),
    seed: int = 0,
    serial_number: int = 1,
    device_bitrate: int | None = None,
) -> list[SimulatedDevice]:
    """Return devices, switched off.

    Args:
        names: What they are.
        variant: Of those whose name gives none.
        readings: Ambiguity id to reading number, for all.
        faults: Names or paths, for all.
        seed: Of everything random.
        serial_number: Of the first one; counted up for the others.
        device_bitrate: That somebody has set them to, in bit/s; the factory's when None.

    Raises:
        SpecError: A name, variant, node-ID, bit rate, reading or fault is wrong.
    """
    defects = load_faults(faults)
    specs = {name.spec: load_spec(find("device_specs", name.spec, "channel")) for name in names}
    return [
        SimulatedDevice(
            specs[name.spec],
            variant=name.variant or variant,
            node_id=name.node_id,
            readings=readings,
            faults=defects,
            seed=seed + place,
            serial_number=serial_number + place,
            bitrate=device_bitrate,
        )
        for place, name in enumerate(names)
    ]


def build_bus(
    channel: str,
    *,
    variant: str | None = None,
    node_id: int | None = None,
    readings: Mapping[str, int] | None = None,
    faults: Sequence[str] = (),
    seed: int = 0,
    serial_number: int = 1,
    device_bitrate: int | None = None,
    load: float = 0.0,
) -> SimulatedBus:
    """Return a bus with the nodes of a channel, switched on.

    Args:
        channel: Names of the nodes.
        variant: Of nodes whose name gives none.
        node_id: Of the node, when there is one and its name gives none.
        readings: Ambiguity id to reading number, for all nodes.
        faults: Names or paths, for all nodes.
        seed: Of everything random.
        serial_number: Of the first node; counted up for the others.
        device_bitrate: That somebody has set the nodes to, in bit/s; the factory's when None.
        load: Share of the bus that other nodes take, 0.0 to less than 1.0.

    Raises:
        SpecError: A name, variant, node-ID, bit rate, reading or fault is wrong.
    """
    names = parse_channel(channel)
    if node_id is not None and len(names) > 1:
        raise SpecError(f"node_id: expected @NODEID behind each name of {channel!r}, got {node_id}")
    if node_id is not None and names[0].node_id is None:
        names = [replace(names[0], node_id=node_id)]
    devices = build_devices(
        names,
        variant=variant,
        readings=readings,
        faults=faults,
        seed=seed,
        serial_number=serial_number,
        device_bitrate=device_bitrate,
    )
    bus = SimulatedBus(devices[0].bitrate)
    for device in devices:
        bus.add_node(device)
    if load:
        for neighbour in neighbours(devices[0].node_id, bus.bitrate, load, seed):
            bus.add_deaf(neighbour)
    return bus
