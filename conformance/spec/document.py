"""The content of a device spec file, field by field; generates the JSON Schema for editors."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Any, Literal, TypeAlias, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    WithJsonSchema,
)

from conformance.wire.datatypes import DataType

T = TypeVar("T")

Access: TypeAlias = Literal["ro", "rw", "wo", "const"]
Kind: TypeAlias = Literal["identity", "constant", "config", "live", "counter", "command"]
State: TypeAlias = Literal["pre-operational", "operational", "stopped"]
Follows: TypeAlias = Literal[
    "tilt-x",
    "tilt-y",
    "acceleration-x",
    "acceleration-y",
    "acceleration-z",
    "rate-x",
    "rate-y",
    "rate-z",
    "temperature",
    "supply-voltage",
    "serial-number",
    "error-register",
]
Effective: TypeAlias = Literal["at-once", "after-reset", "after-store-and-reset"]


def _known_type(name: str) -> str:
    if name not in DataType.__members__:
        raise ValueError(f"expected a CiA 301 data type such as UNSIGNED16, got {name!r}")
    return name


def _integers_only(value: object) -> object:
    """YAML's true and 1.0 are no integers."""
    if isinstance(value, bool | float):
        raise ValueError(f"expected an integer, got {value!r}")  # noqa: TRY004 - pydantic's protocol
    return value


def shape(value: object) -> str:
    """Tell a value from a mapping of variant names to values."""
    by_variant = isinstance(value, dict) and value and all(isinstance(k, str) for k in value)
    return "by_variant" if by_variant else "plain"


TypeName = Annotated[
    str, AfterValidator(_known_type), WithJsonSchema({"enum": sorted(DataType.__members__)})
]
Integer = Annotated[int, BeforeValidator(_integers_only)]
IntegerOrExpression = Annotated[int | str, BeforeValidator(_integers_only)]
Range = Annotated[list[IntegerOrExpression], Field(min_length=2, max_length=2)]
PerVariant = Annotated[
    Annotated[T, Tag("plain")] | Annotated[dict[str, T], Tag("by_variant")],
    Discriminator(shape),
]
Source: TypeAlias = Annotated[str, Field(min_length=1)]
NodeId = Annotated[Integer, Field(ge=1, le=127)]
Index = Annotated[Integer, Field(ge=0, le=0xFFFF)]
Sub = Annotated[Integer, Field(ge=0, le=0xFF)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class DeviceInfo(_Model):
    """Who made the device and which profile it claims."""

    vendor: str
    name: str
    profile: Integer | None = None


class ManualInfo(_Model):
    """The manual every ``source`` refers to."""

    title: str
    revision: str
    date: Annotated[date, Field(strict=False)]


class Factory(_Model):
    """How the device leaves the factory. Bit rate in bit/s."""

    node_id: NodeId
    bitrate: Integer
    source: Source


class Variant(_Model):
    """One model of the device; entries say themselves what differs."""

    title: str
    source: Source


class LimitsBy(_Model):
    """Ranges that depend on the value of another object."""

    object: str
    ranges: dict[Integer, list[Range]]
    source: Source


class EntryDoc(_Model):
    """One object dictionary entry: an object without sub-indices, or one sub-index."""

    name: str
    type: TypeName
    access: Access
    kind: Kind
    default: PerVariant[IntegerOrExpression] | None = None
    ranges: PerVariant[list[Range]] | None = None
    values: PerVariant[dict[Integer, str]] | None = None
    limits_by: LimitsBy | None = None
    octets: Annotated[list[Integer], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="Least and greatest length of a string, in octets."
    )
    unit: str | None = None
    scale: float | Integer | None = Field(
        default=None, description="Physical value of one bit, in `unit`."
    )
    bits: dict[Integer, str] | None = Field(default=None, description="Meaning of each bit.")
    mappable: bool | None = None
    persistent: bool | None = None
    reserved: bool = Field(
        default=False, description="Listed, but every access must be answered with an abort."
    )
    optional: bool = Field(
        default=False, description="The manual leaves open whether the entry exists."
    )
    writable_in: list[State] | None = None
    affects: list[Index] = Field(
        default=[], description="Objects that a download to this command changes."
    )
    follows: Follows | None = Field(
        default=None, description="What the value shows; understood by the simulated device."
    )
    variants: list[str] | None = Field(default=None, description="Present in these variants only.")
    source: Source | None = None
    sources: dict[str, Source] = Field(default={}, description="Source per attribute.")


class VariableDoc(EntryDoc):
    """An object without sub-indices."""

    source: Source


class RecordDoc(_Model):
    """An object with sub-indices; each inherits the object's source unless it has its own."""

    name: str
    source: Source
    subs: Annotated[dict[Sub, EntryDoc], Field(min_length=1)]
    variants: list[str] | None = None


def _object_shape(value: object) -> str:
    return "record" if isinstance(value, dict) and "subs" in value else "variable"


ObjectDoc = Annotated[
    Annotated[VariableDoc, Tag("variable")] | Annotated[RecordDoc, Tag("record")],
    Discriminator(_object_shape),
]


class Nmt(_Model):
    """NMT slave: boot-up message and what follows it."""

    automatic_start: bool = False
    source: Source


class HeartbeatProducer(_Model):
    """Heartbeat producer; times in milliseconds, ``off`` is the value that switches it off."""

    object: Index
    off: Integer = 0
    min_ms: Annotated[Integer, Field(ge=1)]
    max_ms: Annotated[Integer, Field(ge=1)]
    below_minimum: Literal["refused", "clamped", "accepted"] = "refused"
    states: list[State]
    source: Source


class SyncConsumer(_Model):
    """SYNC consumer and the object that holds its COB-ID."""

    object: Index
    source: Source


class EmcyProducer(_Model):
    """EMCY producer: COB-ID object, error codes and the states in which it sends."""

    object: Index
    error_register: Index | None = None
    history: Index | None = None
    states: list[State]
    codes: dict[Integer, str]
    register_bits: dict[Integer, str]
    source: Source


class Tpdo(_Model):
    """TPDO producer; one pair of communication and mapping object per TPDO.

    ``map_only_while``: what must hold before a mapping entry may be written.
    """

    count: Annotated[Integer, Field(ge=1, le=512)]
    communication: Index = 0x1800
    mapping: Index = 0x1A00
    max_mapped: Annotated[Integer, Field(ge=1, le=64)]
    transmission_types: list[Range]
    other_types: Literal["refused", "accepted"] = "refused"
    map_only_while: list[Literal["disabled", "count-zero"]]
    min_cycle_ms: Integer | None = None
    inhibit_unit_us: Integer = 100
    source: Source


class Store(_Model):
    """Store or restore parameters: signature and, per sub-index, the ranges of indices it covers."""

    object: Index
    signature: Annotated[str, Field(min_length=4, max_length=4)]
    groups: dict[Sub, list[Range]]
    effective: Effective = "at-once"
    source: Source


class Changeable(_Model):
    """An object that changes how the node is reached, and when the change takes effect."""

    object: Index
    effective: Effective
    source: Source


class Lss(_Model):
    """LSS slave: the services allowed in the two states."""

    waiting: list[str]
    configuration: list[str]
    source: Source


class Services(_Model):
    """One block per CANopen service the device offers."""

    nmt: Nmt
    heartbeat_producer: HeartbeatProducer | None = None
    sync_consumer: SyncConsumer | None = None
    emcy_producer: EmcyProducer | None = None
    tpdo: Tpdo | None = None
    store: Store | None = None
    restore: Store | None = None
    node_id: Changeable | None = None
    bitrate: Changeable | None = None
    lss: Lss | None = None


class Reading(_Model):
    """One way to read an ambiguous place.

    Args:
        says: What the device does under this reading.
        changes: Path in this file (``objects/0x1003/subs/0/default``) to the value it then has.
    """

    says: str
    changes: dict[str, Any] = {}


class Ambiguity(_Model):
    """A place where the manual contradicts itself or can be read in several ways."""

    id: Annotated[str, Field(pattern=r"^[A-Z0-9]+-\d{2,3}$")]
    source: Annotated[list[Source], Field(min_length=1)]
    what: str
    readings: Annotated[list[Reading], Field(min_length=1)]
    judged_by: Literal["either"] | Integer
    why: str | None = None


class SpecDocument(_Model):
    """A device spec file."""

    format: Literal[1]
    device: DeviceInfo
    manual: ManualInfo
    factory: Factory
    variants: Annotated[dict[str, Variant], Field(min_length=1)]
    services: Services
    objects: Annotated[dict[Index, ObjectDoc], Field(min_length=1)]
    ambiguities: list[Ambiguity] = []
