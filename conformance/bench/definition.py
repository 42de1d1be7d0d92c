"""Bench definition: the interface, how the node is reached, and what the checks may do to it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, model_validator

from conformance.bench.bus.stamps import Stamps, stamper_of, usual_jitter_ms
from conformance.bench.who import MachineBy, Power, Stimulus
from conformance.effects import Effect, Need
from conformance.errors import Problem, SpecError
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import read_yaml

Exposed: TypeAlias = Literal["temperature", "supply"]
Quantity: TypeAlias = Literal["tilt"] | Exposed


_SET_UP_BY_OTHERS = ("socketcan", "socketcand", "remote", "udp_multicast", "virtual")
"""Interfaces of python-can that do not set the bit rate."""

_WITHOUT_REMOTE_FRAMES = ("socketcand",)
"""Interfaces of python-can that cannot send remote frames, nor tell of any."""


_SIMULATOR = "canopen_simulator"

TELLING: frozenset[str] = frozenset(
    {_SIMULATOR, "virtual", "socketcan", "pcan", "kvaser", "vector", "ixxat"}
)
"""Interfaces of python-can that tell of errors on the bus, or on which there are none."""

MOST_WRITES = 500
"""More than a whole run of any device in this package takes, and little beside what its memory endures."""


_SHARED = ("socketcan", "socketcand")
"""Interfaces of which several processes can have a channel open, each seeing what the others send."""


class BenchDefinition(BaseModel):
    """A bench file.

    Args:
        what: What this bench is, in a sentence.
        interface: A python-can interface.
        channel: Its channel; the simulated device's spec when the bench is the simulator.
        bitrate: Bit rate in bit/s; the device's factory bit rate when absent.
        node_id: Node-ID of the device under test; the factory's when absent.
        options: Further arguments of the interface, as python-can takes them.
        control: ``HOST:PORT`` of a simulated device in another process, for what ``simulator`` does.
        power: Who switches the device's supply.
        stimulus: What can be changed around the device, and by whom; a person or a machine tilts alone.
        tolerance_deg: By how much a tilt may be off that the simulator does not make, about each axis.
        tolerance_k: By how much a temperature may be off that the simulator does not make.
        tolerance_v: By how much a supply voltage may be off that the simulator does not make.
        operator: Who answers questions about what only eyes can see.
        second_node: Who adds another node of the same kind to the bus.
        bus_errors: Who destroys frames, so that the device counts errors.
        allow: Effects that checks may have on the device.
        non_volatile_writes: No check that writes the non-volatile memory begins after so many writes of it;
            500 where absent, any number on the simulator.
        markers: CAN-ID of frames that mark where each item begins and ends; none when absent.
        sdo_timeout_s: Longest wait for an SDO response.
        timestamp_jitter_ms: By how much the adapter's timestamps may be off; the usual when absent.
        boot_up_timeout_s: Longest wait for a boot-up message after a reset.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    format: Literal[1]
    what: str
    interface: str
    channel: str | int | None = None
    bitrate: int | None = None
    node_id: Annotated[int, Field(ge=1, le=127)] | None = None
    options: dict[str, Any] = {}
    control: Annotated[str, Field(pattern=r"^.+:\d+$")] | None = None
    power: Power = "none"
    stimulus: dict[Quantity, Stimulus] = {}
    tolerance_deg: Annotated[float, Field(ge=0, le=10)] = 2.0
    tolerance_k: Annotated[float, Field(ge=0, le=10)] = 1.0
    tolerance_v: Annotated[float, Field(ge=0, le=10)] = 0.2
    operator: Literal["none", "simulator", "terminal"] = "none"
    second_node: Literal["none", "simulator"] = "none"
    bus_errors: Literal["none", "simulator"] = "none"
    allow: list[Effect] = ["reads", "writes", "resets"]
    non_volatile_writes: Annotated[int, Field(ge=0)] | None = None
    markers: Annotated[int, Field(ge=1, le=0x7FF)] | None = None
    timestamp_jitter_ms: Annotated[float, Field(ge=0, le=1000)] | None = None
    sdo_timeout_s: Annotated[float, Field(gt=0, le=60)] = 1.0
    boot_up_timeout_s: Annotated[float, Field(gt=0, le=60)] = 5.0

    @model_validator(mode="after")
    def _people(self) -> Self:
        asked = self._by_operator()
        if asked and self.operator == "none":
            raise ValueError(f"expected an operator for {' and '.join(asked)}, got none")
        for quantity, by in self.stimulus.items():
            if quantity != "tilt" and isinstance(by, MachineBy) and by.sudden:
                raise ValueError(f"expected sudden for stimulus.tilt alone, got it for {quantity}")
        return self

    def _by_operator(self) -> list[str]:
        by = {"power": self.power, **{f"stimulus.{it}": by for it, by in self.stimulus.items()}}
        return [name for name, who in by.items() if who == "operator"]

    @property
    def waits_long(self) -> bool:
        """Checks wait until a person has done something, or the device has another temperature."""
        return bool(self._by_operator()) or self._by_others("temperature")

    def _by_others(self, quantity: Quantity) -> bool:
        return self.stimulus.get(quantity, "simulator") != "simulator"

    def off(self, quantity: Quantity) -> float:
        """Return by how much a quantity may be off from what it is to be; 0 where the simulator sets it."""
        tolerances: dict[Quantity, float] = {
            "tilt": self.tolerance_deg,
            "temperature": self.tolerance_k,
            "supply": self.tolerance_v,
        }
        return tolerances[quantity] if self._by_others(quantity) else 0.0

    @property
    def simulated(self) -> bool:
        """The bus is simulated in this process."""
        return self.interface == _SIMULATOR

    @property
    def tells_of_errors(self) -> bool:
        """The adapter tells of errors on the bus, such as a frame that nobody acknowledges."""
        return self.interface in TELLING

    @property
    def sets_bitrate(self) -> bool:
        """The bit rate is that of our adapter, not of an interface that others set up."""
        return self.interface not in _SET_UP_BY_OTHERS

    @property
    def shared(self) -> bool:
        """Several processes can be on its bus at once."""
        if self.simulated:
            return self.options in ({}, {"clock": "virtual"})
        return self.interface in _SHARED

    def allows(self, effects: Iterable[Effect]) -> bool:
        """Tell whether checks may have some effects on the device."""
        return set(effects) <= set(self.allow)

    @property
    def most_writes(self) -> int | None:
        """After how many writes of the non-volatile memory no check begins that writes it."""
        if self.non_volatile_writes is None and not self.simulated:
            return MOST_WRITES
        return self.non_volatile_writes

    def stamps(self) -> Stamps:
        """Return what is known about the times of frames before any came."""
        stamper = stamper_of(self.interface)
        jitter_ms = self.timestamp_jitter_ms
        return Stamps(stamper, usual_jitter_ms(stamper) if jitter_ms is None else jitter_ms)

    @property
    def switches_supply(self) -> bool:
        """Checks may switch the device's supply, and the bench can."""
        return self.power != "none" and self.allows(["power"])

    def has(self, need: Need) -> bool:
        """Tell whether the bench has what a check needs beside a bus."""
        if need == "operator":
            return self.operator != "none"
        if need == "second-node":
            return self.second_node != "none"
        if need == "remote-frames":
            return self.interface not in _WITHOUT_REMOTE_FRAMES
        if need == "bus-errors":
            return self.bus_errors != "none"
        if need == "sudden-tilt":
            by = self.stimulus.get("tilt")
            return by.sudden if isinstance(by, MachineBy) else by == "simulator"
        return need in self.stimulus


def load_bench(path: Path) -> BenchDefinition:
    """Return the bench in a file.

    Raises:
        SpecError: With every problem of the file.
    """
    yaml = read_yaml(path)
    if yaml.data is None:
        raise SpecError(Problem(path, 0, "", "expected a bench definition, got an empty file"))
    definition, problems = validate(BenchDefinition, yaml)
    if definition is None or yaml.problems:
        raise SpecError(*yaml.problems, *problems)
    return definition
