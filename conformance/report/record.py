"""A record read back: `results.json` of this suite, an older or a newer one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, NonNegativeInt, ValidationError

from conformance.errors import Problem, SpecError
from conformance.report.results import VERDICTS, Item
from conformance.report.scanned import Scanned

NAME = "results.json"
TRACE = "trace.log"
_PositiveFloat = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class _Part(BaseModel):
    """A part of a record; keys that are not known here are of another version, and left out."""

    model_config = ConfigDict(extra="ignore", frozen=True)


class Statement(_Part):
    """What the manual says in one place; see `conformance.spec.statements`."""

    id: str
    source: str
    says: str
    objects: Sequence[str] = ()
    verified_by: Sequence[str] = ()
    needs: str = ""
    because: str = ""
    open: str = ""


class Ambiguity(_Part):
    """A place of the manual that can be read in several ways."""

    id: str
    source: Sequence[str]
    what: str
    readings: Sequence[str]


class Manual(_Part):
    """What the manual says and leaves open; empty in records that do not tell."""

    statements: Sequence[Statement] = ()
    statements_missing: str = "the record does not hold what the manual says"
    ambiguities: Sequence[Ambiguity] = ()


class Device(_Part):
    """What was judged."""

    spec: str
    vendor: str = ""
    name: str = ""
    variant: str = ""
    node_id: int
    serial: str = ""
    serial_told: str | None = None
    manual: str = ""
    identity: Mapping[str, str] = {}


class Summary(_Part):
    """What the run came to."""

    verdict: str
    complete: bool = True
    aborted: str = ""
    left_changed: str = ""
    illegal: str = ""


class Stamps(_Part):
    """Who made the timestamps."""

    by: str = ""
    late_ms: FiniteFloat = 0.0


class BusTime(_Part):
    """How long a run had to take, and took."""

    needed_s: FiniteFloat = 0.0
    taken_s: FiniteFloat = 0.0


class Difference(_Part):
    """An object that a run did not leave as it was."""

    object: str = ""


class AsFound(_Part):
    """How a run left the device; differences are None where nobody could tell."""

    objects: int = 0
    nmt_state: str = ""
    differences: Sequence[Difference] | None = None


class ResponseTimes(_Part):
    """How long the node took to answer; a step of the histogram is its upper limit and a count."""

    transfers: int = 0
    median_ms: FiniteFloat = 0.0
    p99_ms: FiniteFloat = 0.0
    max_ms: FiniteFloat = 0.0
    max_object: str = ""
    histogram: Sequence[tuple[_PositiveFloat, NonNegativeInt]] = ()


class Origin(_Part):
    """Where a record comes from, as far as the report tells it; see `conformance.provenance`."""

    suite: str = ""
    acceptance: bool | None = None
    spec: str = ""
    spec_sha256: str = ""
    eds: str = ""
    eds_sha256: str = ""
    bench: str = ""
    recording: str = ""
    recording_sha256: str = ""
    recording_format: str = ""
    recording_s: FiniteFloat | None = None
    recording_breaks: int | None = None
    recording_left_out: int | None = None
    disturbed_sdo_stretches: int | None = None
    interface: str = ""
    bitrate: int | None = None
    seed: int | None = None
    select: str = ""
    strict: bool = False
    arguments: Sequence[str] = ()
    markers: int | None = None
    python: str = ""
    python_can: str = ""
    canopen: str = ""
    system: str = ""
    started: str = ""
    finished: str = ""
    wall_s: FiniteFloat | None = None
    clock: str = ""
    bus_time: BusTime | None = None
    timestamps: Stamps | None = None
    frames: int | None = None
    as_found: AsFound | None = None
    non_volatile_writes: int | None = None
    wear_cycles: int | None = None
    unsolicited_sdo_responses: int | None = None
    improper_sdo_responses: int | None = None
    improper_heartbeats: int | None = None
    improper_lss_responses: int | None = None
    restarts: int | None = None
    unanswered_sdo_requests: int | None = None
    sdo_response_times: ResponseTimes = ResponseTimes()


class _Content(_Part):
    run: Mapping[str, Any]
    device: Device
    items: Sequence[Item]
    summary: Summary
    manual: Manual = Manual()
    scan: Scanned | None = None


@dataclass(frozen=True, slots=True)
class Record:
    """The record of a run.

    Args:
        path: The file it was read from.
        sha256: Of that file.
        run: Provenance, as it stands in the file.
        origin: What the report tells of it.
        device: What was judged.
        items: In the order in which they ran.
        summary: What the run came to, in its own words.
        manual: What the manual says and leaves open.
        scan: What a walk over the object dictionary found; None without one.
    """

    path: Path
    sha256: str
    run: Mapping[str, Any]
    origin: Origin
    device: Device
    items: Sequence[Item]
    summary: Summary
    manual: Manual
    scan: Scanned | None

    @property
    def strict(self) -> bool:
        """Deviations at level ``should`` count."""
        return self.origin.strict

    @property
    def trace(self) -> Path:
        """Where its trace would be."""
        return self.path.with_name(TRACE)

    def deviates(self, item: Item) -> bool:
        """Tell whether an item failed that decides the run."""
        return item.verdict == "fail" and (self.strict or item.level != "should")

    def counts(self) -> dict[str, int]:
        """Return how many items have each verdict."""
        return {word: sum(item.verdict == word for item in self.items) for word in VERDICTS}


def read_record(place: Path) -> Record:
    """Read the record of a run.

    Args:
        place: Its folder, or its file.

    Raises:
        SpecError: There is none, or it is no record.
    """
    path = place / NAME if place.is_dir() else place
    try:
        octets = path.read_bytes()
        content = _Content.model_validate(json.loads(octets))
    except OSError as error:
        got = error.strerror or str(error)
        raise SpecError(f"{path}: expected the folder of a run or its {NAME}, got {got}") from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise SpecError(
            Problem(path, 0, key, f"expected a record of a run, got: {first['msg']}")
        ) from error
    except (ValueError, RecursionError) as error:
        raise SpecError(f"{path}: expected JSON, got what is none: {error}") from error
    return Record(
        path=path,
        sha256=hashlib.sha256(octets).hexdigest(),
        origin=_origin(content.run),
        **{name: getattr(content, name) for name in _Content.model_fields},
    )


def _origin(run: Mapping[str, Any]) -> Origin:
    """Return where a record comes from; what is not of its kind counts as not told."""
    try:
        return Origin.model_validate(run)
    except ValidationError as error:
        wrong = {problem["loc"][0] for problem in error.errors(include_url=False)}
        return Origin.model_validate({key: it for key, it in run.items() if key not in wrong})
