"""A lot file: what was delivered, how it is sampled and on which bench it is judged."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from conformance.errors import Problem, SpecError
from conformance.lots.tables import Level, Severity, tables
from conformance.numbers import node_ids
from conformance.spec.fields import Number
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import read_yaml, shown

MOST_PERCENT = 10.0
"""Greater AQLs count deviations per hundred units, not units (ISO 2859-1:1999, 5.2)."""

MOST_UNITS = 1_000_000

_Text = Annotated[str, Field(min_length=1)]
Serial = Annotated[int, Field(ge=0, le=0xFFFF_FFFF)]


def _aql(value: float) -> float:
    known = [it for it in tables().aqls if it <= MOST_PERCENT]
    if value not in known:
        text = ", ".join(f"{it:g}" for it in known)
        raise ValueError(f"expected an AQL of the table that counts units: {text}; got {value:g}")
    return float(value)


def _node_ids(text: str) -> str:
    try:
        node_ids("node_ids", text)
    except SpecError:
        raise ValueError(
            f"expected node-IDs from 1 to 127, each once, as 10-17, got {shown(text)}"
        ) from None
    return text


def _is_name(path: Path) -> bool:
    """Tell whether this is no file's name but that of something known otherwise."""
    return len(path.parts) == 1 and not path.suffix and not path.is_absolute()


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Simulation(_Part):
    """What is peculiar to units of a simulated lot, each named by its serial number, or place.

    Args:
        faults: Faults of a unit, as ``--fault`` takes them.
        serials: Serial number that a unit tells instead of its own.
    """

    faults: dict[int, list[_Text]] = {}
    serials: dict[int, Serial] = {}


class LotFile(_Part):
    """A lot file.

    Args:
        part: What was delivered.
        order: Under which order, and which part of it.
        device: Built-in name or path of its spec.
        variant: Of the device; the spec's first one when absent.
        serials: Of all units, as the device tells them.
        size: How many units there are; may be absent beside ``serials``.
        level: Of inspection; ``all`` inspects every unit, without a sampling plan.
        aql: Acceptance quality limit, in percent nonconforming.
        severity: Of inspection, where no ``series`` tells it.
        series: What became of the lots before, made when it is not there: a file, or by a name without
            a dot or slash what the history keeps for several stations.
        reduced: Reduced inspection is allowed: production is steady, and who is responsible wants it.
        resumed: The supplier has acted since sampling was discontinued.
        resubmitted: The lot was inspected before, so that the switching rules leave it out.
        bench: Built-in name or path.
        node_ids: Of several units that are on the bus at a time; all have the bench's where absent.
        commission: Units are fresh from the box: they get those node-IDs while they are judged.
        select: Items to judge, as ``run --select``; all when absent.
        strict: Deviations from a *should* count as well.
        seed: Of the drawing; thrown once and kept when absent.
        retests: How often a unit that could not be decided is judged again at once.
        simulation: What is peculiar to simulated units.
    """

    format: Literal[1]
    part: _Text
    order: _Text
    device: _Text
    variant: str | None = None
    serials: Annotated[list[Serial], Field(min_length=1)] | None = None
    size: Annotated[int, Field(ge=1, le=MOST_UNITS)] | None = None
    level: Level | Literal["all"] = "II"
    aql: Annotated[Number, AfterValidator(_aql)] | None = None
    severity: Severity | None = None
    series: _Text | None = None
    reduced: bool = False
    resumed: bool = False
    resubmitted: bool = False
    bench: _Text = "simulator"
    node_ids: Annotated[str, AfterValidator(_node_ids)] | None = None
    commission: bool = False
    select: str = ""
    strict: bool = False
    seed: int | None = None
    retests: Annotated[int, Field(ge=0, le=10)] = 1
    simulation: Simulation = Simulation()

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        for text in self._mistakes():
            raise ValueError(text)
        return self

    def _mistakes(self) -> Iterator[str]:
        if self.serials is None and self.size is None:
            yield "expected serials or size, got neither"
        if self.serials is not None and self.size not in (None, len(self.serials)):
            yield f"expected a size of {len(self.serials)}, as there are serials, got {self.size}"
        if self.serials is not None and len(set(self.serials)) < len(self.serials):
            twice = next(it for it in self.serials if self.serials.count(it) > 1)
            yield f"expected each serial number once, got {twice} again"
        yield from self._wrong_sampling()
        if self.commission and not self.node_ids:
            yield "expected node_ids to give beside commission, got none"
        known = set(self.names)
        for unit in (*self.simulation.faults, *self.simulation.serials):
            if unit not in known:
                yield f"expected a unit of the lot under simulation, got {unit}"

    def _wrong_sampling(self) -> Iterator[str]:
        if self.level == "all" and (self.aql is not None or self.severity or self.series):
            yield "expected no aql, severity or series where all units are inspected, got one"
        if self.level != "all" and self.aql is None:
            yield "expected an aql beside the level, got none"
        if self.level != "all" and self.units == 1:
            yield "expected at least 2 units to sample from, or level: all, got 1"
        if self.severity and self.series:
            yield "expected severity or series, for the series tells the severity, got both"

    @property
    def units(self) -> int:
        """How many units there are."""
        return self.size if self.serials is None else len(self.serials)  # type: ignore[return-value]  # one of them is given

    @property
    def names(self) -> list[int]:
        """The units, by serial number, or by place from 1 on where no list tells those."""
        return list(range(1, self.units + 1)) if self.serials is None else self.serials

    @property
    def series_shared(self) -> bool:
        """Its series is kept in the history, not in a file."""
        return self.series is not None and _is_name(Path(self.series))

    @property
    def name(self) -> str:
        """The lot in a few words."""
        return f"{self.part}, {self.order}"


@dataclass(frozen=True, slots=True)
class Lot:
    """A lot file that was read.

    Args:
        path: Where it is.
        sha256: Of its text.
        content: What it says.
    """

    path: Path
    sha256: str
    content: LotFile

    def beside(self, name: str) -> str:
        """Return a file's name as seen from here, where the lot file gives it as seen from itself."""
        path = Path(name)
        if path.is_absolute() or _is_name(path):
            return name
        return str(self.path.parent / path)


def load_lot(path: Path) -> Lot:
    """Return the lot in a file.

    Raises:
        SpecError: With every problem of the file.
    """
    yaml = read_yaml(path)
    if yaml.data is None:
        raise SpecError(Problem(path, 0, "", "expected a lot, got an empty file"))
    content, problems = validate(LotFile, yaml)
    if content is None or yaml.problems:
        raise SpecError(*yaml.problems, *problems)
    return Lot(path, hashlib.sha256(yaml.text).hexdigest(), content)
