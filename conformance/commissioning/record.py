"""The record of a commissioning: who was found where, and was given what; safe on disk before anything changes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from conformance.bench.given_back.safe_file import write_safely
from conformance.bench.node.reach import Place
from conformance.errors import Problem, SpecError

NAME: Final = "commission.json"

State: TypeAlias = Literal["planned", "touched", "given", "undone"]
"""``touched``: it was told its new place, and was not yet seen there, or back."""

_Number = Annotated[int, Field(ge=0, le=0xFFFF_FFFF)]


class Spot(BaseModel):
    """A node-ID and a bit rate in bit/s."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    node_id: Annotated[int, Field(ge=1, le=127)]
    bitrate: Annotated[int, Field(gt=0)]

    @property
    def place(self) -> Place:
        """The same as the bench has it."""
        return Place(self.node_id, self.bitrate)

    @classmethod
    def of(cls, place: Place) -> Spot:
        """Return a place as the record has it."""
        return cls(node_id=place.node_id, bitrate=place.bitrate)


class Unit(BaseModel):
    """A sensor.

    Args:
        identity: Vendor-ID, product code, revision number and serial number, as far as it tells them.
        found: Where it was.
        given: Where it is to be.
        state: How far it came.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    identity: list[_Number]
    found: Spot
    given: Spot
    state: State = "planned"

    @property
    def between(self) -> Place:
        """Where it is with its new node-ID and the bit rate it had."""
        return Place(self.given.node_id, self.found.bitrate)

    @property
    def switches(self) -> bool:
        """It is to have another bit rate."""
        return self.given.bitrate != self.found.bitrate

    @property
    def serial(self) -> int | None:
        """The serial number, None where it tells none."""
        return self.identity[3] if len(self.identity) > 3 else None

    def __str__(self) -> str:
        return "a sensor without serial number" if self.serial is None else f"serial {self.serial}"


class Record(BaseModel):
    """A commissioning.

    Args:
        format: Of this file.
        device: Path of the spec.
        variant: Of the device.
        bench: Path of the bench's file.
        channel: Of the bench; None where it has none.
        units: In the order in which they were found.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    format: Literal[1] = 1
    device: str
    variant: str
    bench: str
    channel: str | int | None = None
    units: list[Unit] = []

    def keep(self, path: Path) -> None:
        """Write the record, so that it outlives this process and the computer.

        Raises:
            BenchError: It cannot be written.
        """
        write_safely(path, self.model_dump_json(indent=1, ensure_ascii=True))

    @property
    def in_force(self) -> list[Unit]:
        """The units that are not where they were found, or may not be."""
        return [unit for unit in self.units if unit.state in ("touched", "given")]


def load_record(path: Path) -> Record:
    """Return the record in a file.

    Raises:
        SpecError: There is none, or it is damaged.
    """
    try:
        return Record.model_validate_json(path.read_text("ascii"))
    except OSError as error:
        raise SpecError(
            f"--undo: expected the {NAME} of a commissioning, got {str(path)!r} ({error.strerror})"
        ) from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise SpecError(
            Problem(path, 0, where, f"expected a commissioning: {first['msg']}")
        ) from error
    except ValueError as error:
        raise SpecError(Problem(path, 0, "", f"expected a commissioning, got {error}")) from error
