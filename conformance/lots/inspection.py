"""The state of an inspection, `lot.json`: what was drawn, what was judged, and what came of it."""

from __future__ import annotations

import json
import random
from collections.abc import Container
from pathlib import Path
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from conformance.bench.given_back.safe_file import write_safely
from conformance.errors import Problem, SpecError

NAME: Final = "lot.json"

Word: TypeAlias = Literal["conforming", "nonconforming", "undecided"]


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=True)


class Numbers(_Part):
    """What a run measured of one quantity, over all its values.

    Args:
        item: Item that measured it, without the device's name.
        quantity: What.
        unit: Of the numbers.
        mean: Of the values.
        lowest: Of the values.
        highest: Of the values.
        least: They may not be below it; None without such a limit.
        most: They may not be above it; None without such a limit.
    """

    item: str
    quantity: str
    unit: str
    mean: float
    lowest: float
    highest: float
    least: float | None = None
    most: float | None = None


class Try(_Part):
    """One run of a unit, with a record of its own.

    Args:
        folder: Of the record, below that of the lot.
        verdict: What it came to.
        reason: Why it was not decided; empty if it was.
        deviations: Ids of the items that failed and count, without the device's name.
        serial: Number that the device told, as text; empty where it told none.
        other: The sensor on the bus was not this unit, by its serial number.
        reached: Some item was run.
        node_id: At which it was judged.
        bus_s: Time on the bus, simulated or real.
        wall_s: Time taken.
        report: There is a report beside the record.
        numbers: What was measured that has limits.
    """

    folder: str
    verdict: Word
    reason: str = ""
    deviations: list[str] = []
    serial: str = ""
    other: bool = False
    reached: bool = True
    node_id: int
    bus_s: float = 0.0
    wall_s: float = 0.0
    report: bool = False
    numbers: list[Numbers] = []

    def doubt_twice(self, told: Container[str]) -> None:
        """Decide nothing of a sensor that was judged as another unit already.

        Args:
            told: Serial numbers of other units.
        """
        if not self.other and self.serial not in ("", "0") and self.serial in told:
            self.verdict, self.other = "undecided", True
            self.reason = f"the sensor on the bus is {self.serial}, as that of another unit was"


class Declared(_Part):
    """A person's word that a unit does not conform, which was not measured.

    Args:
        by: Who said so.
        reason: Why.
        when: In ISO 8601, UTC.
        after: So many runs of the unit there were by then.
    """

    by: str
    reason: str
    when: str
    after: Annotated[int, Field(ge=0)]


class Unit(_Part):
    """A unit that was drawn.

    Args:
        unit: Its serial number in the list, or its place.
        tries: Its runs; all are kept.
        declared: What people said of it; all is kept.
    """

    unit: int
    tries: list[Try] = []
    declared: list[Declared] = []

    @property
    def verdict(self) -> Word | None:
        """What its runs say: a deviation once seen stays; None before the first.

        Else the last run counts, so that one that could not decide is made good by one that could. Where
        none has decided, a person's word counts.
        """
        if any(it.verdict == "nonconforming" for it in self.tries) or self.declared_so:
            return "nonconforming"
        return self.tries[-1].verdict if self.tries else None

    @property
    def declared_so(self) -> Declared | None:
        """What a person said of it, as long as no run has decided since."""
        last = self.declared[-1] if self.declared else None
        if last is None or any(it.verdict == "nonconforming" for it in self.tries):
            return None
        since = self.tries[last.after :]
        return None if any(it.verdict == "conforming" for it in since) else last

    @property
    def telling(self) -> Try | None:
        """The run that its verdict comes from."""
        return next((it for it in reversed(self.tries) if it.verdict == self.verdict), None)


class Sampling(_Part):
    """How many units are drawn; see `conformance.lots.plans.Plan`."""

    sample: Annotated[int, Field(ge=1)]
    accept: Annotated[int, Field(ge=0)]
    size: Annotated[int, Field(ge=1)]
    words: str
    severity: Literal["normal", "tightened", "reduced"] | None = None
    letter: str = ""
    accept_tighter: int | None = None

    @property
    def reject(self) -> int:
        """The lot is not accepted with so many nonconforming units (Re)."""
        return self.accept + 1


class Running(_Part):
    """A run that has begun."""

    unit: int
    folder: str


class Inspection(_Part):
    """The state of an inspection.

    Args:
        format: Of this file.
        lot: What the lot file says.
        sha256: Of the lot file.
        plan: How many units are drawn.
        seed: Of the drawing.
        units: Those drawn, in the order in which they are judged.
        running: The runs that have begun and not ended.
        concluded: It was decided once, whatever was judged again since.
    """

    format: Literal[1] = 1
    lot: dict[str, Any]
    sha256: str
    plan: Sampling
    seed: int
    units: list[Unit]
    running: list[Running] = []
    concluded: bool = False

    def count(self, word: Word | None) -> int:
        """Return how many of the units drawn have a verdict; None for those not judged."""
        return sum(it.verdict == word for it in self.units)

    def keep(self, folder: Path, **more: Any) -> None:
        """Write the state so that it outlives this process and the computer.

        Args:
            folder: Of the inspection.
            more: Further keys, made from the state.

        Raises:
            BenchError: It cannot be written.
        """
        content = {**self.model_dump(mode="json", exclude={"units"}), **more}
        units = [{**it.model_dump(mode="json"), "verdict": it.verdict} for it in self.units]
        parts = {name: json.dumps(value, indent=1) for name, value in content.items()}
        parts["units"] = "[\n" + ",\n".join(json.dumps(it) for it in units) + "\n]"
        text = ",\n".join(f'"{name}": {part}' for name, part in parts.items())
        write_safely(folder / NAME, f"{{\n{text}\n}}\n")


def draw(names: list[int], sample: int, seed: int) -> list[int]:
    """Return the units to judge, drawn at random, in the order of the list."""
    chosen = set(random.Random(seed).sample(range(len(names)), sample))  # noqa: S311 - it must be repeatable
    return [name for place, name in enumerate(names) if place in chosen]


def load_inspection(folder: Path) -> Inspection | None:
    """Return the state of an inspection, None where there is none yet.

    Raises:
        SpecError: It is damaged.
    """
    path = folder / NAME
    if not path.exists():
        return None
    try:
        return Inspection.model_validate_json(path.read_text("ascii"))
    except OSError as error:
        raise SpecError(f"{path}: expected a readable file, got: {error.strerror}") from error
    except (ValidationError, UnicodeDecodeError) as error:
        where = ".".join(map(str, _first(error)))
        raise SpecError(
            Problem(path, 0, where, "expected the state of an inspection, got what is none")
        ) from error


def _first(error: ValidationError | UnicodeDecodeError) -> tuple[int | str, ...]:
    return error.errors()[0]["loc"] if isinstance(error, ValidationError) else ()
