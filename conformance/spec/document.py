"""The content of a device spec file, field by field; generates the JSON Schema for editors."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag

from conformance.spec.behaviours import Behaviour
from conformance.spec.error_services import BusErrors, EmcyProducer
from conformance.spec.fields import (
    Address,
    AmbiguityId,
    Date,
    EitherOrInteger,
    Index,
    IntegerOrText,
    Interval,
    NodeId,
    Number,
    PerVariant,
    Range,
    Source,
    State,
    StrictModel,
    Sub,
    TypeName,
)
from conformance.spec.services import (
    Changeable,
    HeartbeatProducer,
    Leds,
    Lss,
    Nmt,
    SdoServer,
    Services,
    Store,
    SyncConsumer,
    Tpdo,
)

__all__ = [
    "Access",
    "Ambiguity",
    "BusErrors",
    "Changeable",
    "DeviceInfo",
    "EmcyProducer",
    "EntryDoc",
    "Follows",
    "HeartbeatProducer",
    "Kind",
    "Leds",
    "Lss",
    "ManualInfo",
    "Nmt",
    "ObjectDoc",
    "Reading",
    "RecordDoc",
    "SdoServer",
    "Services",
    "SpecDocument",
    "State",
    "Store",
    "SyncConsumer",
    "Tpdo",
    "VariableDoc",
]

Access: TypeAlias = Literal["ro", "rw", "wo", "const"]
Kind: TypeAlias = Literal["identity", "constant", "config", "live", "counter", "command"]
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


class DeviceInfo(StrictModel):
    """Who made the device and which profile it claims."""

    vendor: str
    name: str
    profile: int | None = None


class ManualInfo(StrictModel):
    """The manual every ``source`` refers to; some print neither revision nor date."""

    title: str
    revision: str | None = None
    date: Date | None = None

    @property
    def name(self) -> str:
        """Title, and revision where one is printed."""
        return self.title if self.revision is None else f"{self.title} {self.revision}"


class Factory(StrictModel):
    """How the device leaves the factory. Bit rate in bit/s."""

    node_id: NodeId
    bitrate: Annotated[int, Field(ge=1, le=1_000_000)]
    source: Source


class Variant(StrictModel):
    """One model of the device; entries say themselves what differs."""

    title: str
    source: Source


Ranges = Annotated[list[Range], Field(min_length=1)]
Values = Annotated[dict[int, str], Field(min_length=1)]


class LimitsBy(StrictModel):
    """Ranges that depend on the value of another object.

    ``conflict``: what becomes of a value that the other object's new value no longer allows.
    """

    object: Address
    ranges: Annotated[dict[int, Ranges], Field(min_length=1)]
    conflict: Literal["kept", "lowered", "refused"] = "kept"
    source: Source


class While(StrictModel):
    """What another object must hold: its masked value."""

    object: Address
    mask: Annotated[int, Field(ge=1, le=0xFFFF_FFFF)]
    value: int


class EntryDoc(StrictModel):
    """One object dictionary entry: an object without sub-indices, or one sub-index."""

    name: str
    type: TypeName
    access: Access
    kind: Kind
    default: PerVariant[IntegerOrText] | None = None
    ranges: PerVariant[Ranges] | None = None
    values: PerVariant[Values] | None = None
    limits_by: LimitsBy | None = None
    octets: Interval | None = Field(
        default=None, description="Least and greatest length of a string, in octets."
    )
    unit: str | None = None
    scale: Number | None = Field(default=None, description="Physical value of one bit, in `unit`.")
    bits: dict[int, str] | None = Field(default=None, description="Meaning of each bit.")
    mappable: bool | None = None
    persistent: bool | None = None
    reserved: bool = Field(
        default=False, description="Listed, but every access must be answered with an abort."
    )
    optional: bool = Field(
        default=False, description="The manual leaves open whether the entry exists."
    )
    writable_in: list[State] | None = None
    writable_while: list[While] = Field(
        default=[], description="What must hold before a new value is accepted."
    )
    otherwise: Literal["refused", "ignored"] = Field(
        default="refused", description="What becomes of a new value while that does not hold."
    )
    effective: Literal["at-once", "after-store", "after-store-and-reset"] = Field(
        default="at-once", description="When the device acts on a new value."
    )
    reads: Literal["written", "in-force"] = Field(
        default="written", description="What an upload returns until a new value takes effect."
    )
    leaves_canopen: list[int] = Field(
        default=[], description="Values that take the node off CANopen once they act."
    )
    on_label: bool = Field(
        default=False, description="The device has a label with what this entry holds."
    )
    after_node_id_change: Literal["kept", "difference-kept", "default"] = Field(
        default="kept", description="What a new node-ID makes of a stored value of its own."
    )
    affects: list[Index] = Field(
        default=[], description="Objects that a download to this command changes."
    )
    follows: PerVariant[Follows] | None = Field(
        default=None,
        description="What the value shows, in the variants named; understood by the simulated device.",
    )
    variants: list[str] | None = Field(default=None, description="Present in these variants only.")
    source: Source | None = None
    sources: dict[str, Source] = Field(default={}, description="Source per attribute.")


class VariableDoc(EntryDoc):
    """An object without sub-indices."""

    source: Source


class RecordDoc(StrictModel):
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


class Reading(StrictModel):
    """One way to read an ambiguous place.

    Args:
        says: What the device does under this reading.
        changes: Path in this file (``objects/0x1003/subs/0/default``) to the value it then has.
    """

    says: str
    changes: dict[str, Any] = Field(default={})


class Ambiguity(StrictModel):
    """A place where the manual contradicts itself or can be read in several ways."""

    id: AmbiguityId
    source: Annotated[list[Source], Field(min_length=1)]
    what: str
    readings: Annotated[list[Reading], Field(min_length=1)]
    judged_by: EitherOrInteger
    why: str | None = None


class SpecDocument(StrictModel):
    """A device spec file."""

    format: Literal[1]
    device: DeviceInfo
    manual: ManualInfo
    factory: Factory
    variants: Annotated[dict[str, Variant], Field(min_length=1)]
    services: Services
    objects: Annotated[dict[Index, ObjectDoc], Field(min_length=1)]
    behaviours: dict[str, Behaviour] = Field(
        default={}, description="Rules between objects, each under a name of its own."
    )
    ambiguities: list[Ambiguity] = Field(default=[])
