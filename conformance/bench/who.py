"""What a bench file says of who switches the supply, and who tilts the device or exposes it otherwise."""

from __future__ import annotations

from typing import Annotated, Literal, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

Seconds: TypeAlias = Annotated[float, Field(gt=0, le=600)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class SwitchCommand(_Part):
    """Command lines that switch the supply, of a relay board or a smart plug; no shell reads them.

    Args:
        off: Takes the supply away.
        on: Gives it back.
        timeout_s: Longest time either may take.
    """

    off: Annotated[str, Field(min_length=1)]
    on: Annotated[str, Field(min_length=1)]
    timeout_s: Seconds = 10.0


class ScpiSupply(_Part):
    """A power supply that takes SCPI.

    Args:
        resource: Its VISA address, such as ``TCPIP::192.168.0.7::INSTR``.
        off: Takes the supply away.
        on: Gives it back.
        backend: Which VISA library PyVISA uses; ``@py`` needs none of a vendor.
        timeout_s: Longest time that the supply may take.
    """

    resource: Annotated[str, Field(min_length=1)]
    off: Annotated[str, Field(min_length=1)] = "OUTP OFF"
    on: Annotated[str, Field(min_length=1)] = "OUTP ON"
    backend: str = "@py"
    timeout_s: Seconds = 5.0


class PowerBy(_Part):
    """Who switches the supply, neither a person nor the simulator.

    Args:
        command: Command lines.
        scpi: A power supply.
        entry_point: Name in the entry point group ``canopen_conformance.power``.
        off_s: How long the supply stays off, so that the device loses it for certain.
    """

    command: SwitchCommand | None = None
    scpi: ScpiSupply | None = None
    entry_point: Annotated[str, Field(min_length=1)] | None = None
    off_s: Annotated[float, Field(ge=0, le=600)] = 1.0

    @model_validator(mode="after")
    def _one(self) -> Self:
        if sum(it is not None for it in (self.command, self.scpi, self.entry_point)) != 1:
            raise ValueError("expected exactly one of command, scpi and entry_point")
        return self


class MachineBy(_Part):
    """A machine that tilts the device, or brings it to a temperature or a supply voltage.

    Args:
        entry_point: Name in the entry point group ``canopen_conformance.tilt``, ``.temperature`` or ``.supply``.
        sudden: It tilts at once, so that the device's filters can be seen.
    """

    entry_point: Annotated[str, Field(min_length=1)]
    sudden: bool = False


def _form(given: object) -> str:
    return "described" if isinstance(given, (dict, _Part)) else "named"


Power: TypeAlias = Annotated[
    Annotated[Literal["none", "simulator", "operator"], Tag("named")]
    | Annotated[PowerBy, Tag("described")],
    Discriminator(_form),
]
Stimulus: TypeAlias = Annotated[
    Annotated[Literal["simulator", "operator"], Tag("named")]
    | Annotated[MachineBy, Tag("described")],
    Discriminator(_form),
]
