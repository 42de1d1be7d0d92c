"""The services of a device spec file: one block per CANopen service the device offers."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, model_validator

from conformance.spec.error_services import BusErrors, EmcyProducer, Supply
from conformance.spec.fields import (
    Address,
    Index,
    Interval,
    Signature,
    Source,
    State,
    StrictModel,
    Sub,
)
from conformance.spec.service import Milliseconds, Service

LssService: TypeAlias = Literal[
    "switch-state-global",
    "switch-state-selective",
    "configure-node-id",
    "configure-bit-timing",
    "activate-bit-timing",
    "store-configuration",
    "inquire-identity",
    "inquire-serial-number",
    "inquire-node-id",
    "identify-remote-slave",
]


Effective: TypeAlias = Literal[
    "at-once",
    "after-reset",
    "after-power-cycle",
    "after-store-and-reset",
    "after-store-and-power-cycle",
]


LightCondition: TypeAlias = Literal[
    "supply-off",
    "pre-operational",
    "operational",
    "stopped",
    "no-error",
    "warning-limit",
    "guard-event",
    "bus-off",
    "angle-limit",
    "lss-configuration",
]


STEADY = ("off", "on")
"""The patterns of a light that need no times."""


class StartBy(StrictModel):
    """The object that lets the node start by itself: when its masked value is ``value``."""

    object: Address
    mask: Annotated[int, Field(ge=1, le=0xFFFF_FFFF)]
    value: int
    after: Literal["every-start", "power-on"] = "every-start"
    source: Source


class Nmt(StrictModel):
    """NMT slave: boot-up message and what follows it.

    ``reset_communication``: what NMT reset communication resets.
    ``boot_up_ms``: the longest time from a start to the boot-up message.
    """

    automatic_start: bool = False
    start_by: StartBy | None = None
    reset_communication: Literal["communication", "everything"] = "communication"
    boot_up_ms: Annotated[int, Field(ge=1)] | None = None
    source: Source


class SdoServer(Service):
    """SDO server.

    ``short_texts``: how a text of up to four octets is uploaded.
    ``short_numbers``: how a number of up to four octets is uploaded; the standard leaves it to the
    server.
    ``upload_size``: whether an expedited upload of a number says how many octets it has.
    ``unsized_download``: what becomes of an expedited download that does not say so.
    ``block``: whether block transfers are offered.
    """

    short_texts: Literal["expedited", "segmented"] = "expedited"
    short_numbers: Literal["expedited", "either"] = "either"
    segmented_download: bool = True
    upload_size: Literal["told", "untold"] = "told"
    unsized_download: Literal["accepted", "refused"] = "accepted"
    block: bool = False
    source: Source


class HeartbeatProducer(Service):
    """Heartbeat producer; times in milliseconds, ``off`` is the value that switches it off."""

    object: Index
    off: int = 0
    min_ms: Annotated[int, Field(ge=1, le=0xFFFF)]
    max_ms: Annotated[int, Field(ge=1, le=0xFFFF)]
    below_minimum: Literal["refused", "clamped", "ignored", "accepted"] = "refused"
    states: list[State]
    source: Source


class SyncConsumer(Service):
    """SYNC consumer and the object that holds its COB-ID; without one it is that of CiA 301.

    ``restricted``: what becomes of a CAN-ID that CiA 301 keeps for other services.
    """

    object: Index | None = None
    restricted: Literal["refused", "accepted"] = "refused"
    source: Source


class ByteOrder(StrictModel):
    """The object that turns octets of a PDO round when it is ``big_endian``.

    ``reverses``: the octets of each mapped object, or those of the whole PDO.
    """

    object: Index
    big_endian: int
    reverses: Literal["objects", "pdo"] = "objects"
    source: Source


class MappingExample(StrictModel):
    """A mapping that the manual shows: the words, and the event time in ms with which it is sent."""

    tpdo: Annotated[int, Field(ge=1, le=512)]
    words: Annotated[list[Annotated[int, Field(ge=0, le=0xFFFF_FFFF)]], Field(min_length=1)]
    event_ms: Annotated[int, Field(ge=1, le=0xFFFF)]
    source: Source


class Tpdo(Service):
    """TPDO producer; one pair of communication and mapping object per TPDO.

    ``map_only_while``: what must hold before a mapping entry may be written.
    ``map_otherwise``: ``waits``: it is confirmed, and in force once the TPDO is not valid.
    ``restricted``: what becomes of a CAN-ID that CiA 301 keeps for other services.
    ``below_min_cycle``: what becomes of an event time shorter than the least cycle; ``raised``: it
    is read back as written, but the TPDO comes at the least cycle.
    ``first``: whether a TPDO is sent on entering Operational: with an event time, or without one
    too; ``open``: the manual does not say.
    ``octets``: length of every frame; that of the mapped objects when missing.
    ``filler``: octets behind the mapped objects, where a frame is longer.
    ``new_event_time``: what an event time written while the timer runs counts from; ``open``: the
    manual does not say.
    ``event_time_acts``: with which transmission types a TPDO is sent by its event timer.
    ``inhibited``: the TPDOs that the inhibit time keeps apart: all but those asked for by SYNC or a
    remote frame, or only those sent on a change.
    ``remote``: bit 30 of a COB-ID whose remote requests are answered.
    """

    count: Annotated[int, Field(ge=1, le=512)]
    communication: Index = 0x1800
    mapping: Index = 0x1A00
    max_mapped: Annotated[int, Field(ge=1, le=64)]
    transmission_types: Annotated[list[Interval], Field(min_length=1)]
    other_types: Literal["refused", "accepted"] = "refused"
    map_only_while: list[Literal["disabled", "count-zero"]]
    map_otherwise: Literal["refused", "waits"] = "refused"
    examples: list[MappingExample] = Field(default=[])
    min_cycle_ms: int | None = None
    below_min_cycle: Literal["refused", "raised", "ignored"] = "refused"
    first: Literal["open", "with-event-time", "always"] = "open"
    octets: Annotated[int, Field(ge=1, le=8)] | None = None
    filler: Literal["any", "zero"] = "any"
    new_event_time: Literal["open", "next-run", "next-start"] = "open"
    event_time_acts: Literal["asynchronous", "always"] = "asynchronous"
    inhibited: Literal["all", "changes"] = "all"
    remote: Literal["bit-30-clear", "bit-30-set"] = "bit-30-clear"
    byte_order: ByteOrder | None = None
    change_while_valid: Literal["refused", "accepted"] = "refused"
    restricted: Literal["refused", "accepted"] = "refused"
    inhibit_unit_us: Annotated[int, Field(ge=1)] = 100
    source: Source


class Store(Service):
    """Store or restore parameters: signature and, per sub-index, the ranges of indices it covers.

    ``settle_ms``: how long the node must not be reset or switched off afterwards.
    ``wear_cycles``: how often the memory may be written.
    ``lasting``: defaults restored outlast the next start without a save; missing: the manual does
    not say.
    """

    object: Index
    signature: Signature
    groups: Annotated[dict[Sub, list[Interval]], Field(min_length=1)]
    effective: Literal["at-once", "after-reset", "after-store-and-reset"] = "at-once"
    settle_ms: Annotated[int, Field(ge=0, le=60_000)] = 0
    lasting: bool | None = None
    wear_cycles: Annotated[int, Field(ge=1)] | None = None
    source: Source

    @property
    def word(self) -> int:
        """The signature as a number, such as 6576 6173h for ``save``."""
        return int.from_bytes(self.signature.encode("ascii"), "little")

    def covers(self, sub: int, index: int) -> bool:
        """Tell whether a sub-index acts on an index."""
        return any(int(low) <= index <= int(high) for low, high in self.groups[sub])


class Changeable(Service):
    """An object that changes how the node is reached, and when the change takes effect."""

    object: Index
    effective: Effective
    source: Source


class Lss(Service):
    """LSS slave: the NMT states in which it works, the services allowed in its own two states.

    ``inquire-identity``: all four numbers; ``inquire-serial-number``: the last of them alone.
    """

    states: list[State] = Field(default=["pre-operational", "operational", "stopped"])
    tells_mode: bool = Field(
        default=False, description="The answer to a selective switch carries the new mode."
    )
    unused: Literal["zero", "any"] = Field(
        default="any", description="What the manual says of octets that an answer does not need."
    )
    acts: Literal["configured", "stored"] = Field(
        default="configured", description="What acts at a reset or an activation."
    )
    waiting: list[LssService]
    configuration: list[LssService]
    source: Source


class Leds(Service):
    """Lights and what they show.

    ``patterns``: by name, the ms lit and dark in turn; ``on`` and ``off`` need none.
    ``shows``: under a condition, the pattern of each light; a condition further down goes first.
    ``sources``: of single conditions.
    """

    patterns: dict[str, Annotated[list[Milliseconds], Field(min_length=2)]] = Field(default={})
    shows: Annotated[dict[LightCondition, dict[str, str]], Field(min_length=1)]
    sources: dict[LightCondition, Source] = Field(default={})
    source: Source

    @model_validator(mode="after")
    def _knows_its_patterns(self) -> Leds:
        known = (*STEADY, *self.patterns)
        for name in (name for lights in self.shows.values() for name in lights.values()):
            if name not in known:
                raise ValueError(f"expected one of the patterns {', '.join(known)}, got {name!r}")
        return self


class Services(StrictModel):
    """One block per CANopen service the device offers."""

    nmt: Nmt
    sdo_server: SdoServer | None = None
    heartbeat_producer: HeartbeatProducer | None = None
    sync_consumer: SyncConsumer | None = None
    emcy_producer: EmcyProducer | None = None
    tpdo: Tpdo | None = None
    store: Store | None = None
    restore: Store | None = None
    node_id: Changeable | None = None
    bitrate: Changeable | None = None
    lss: Lss | None = None
    leds: Leds | None = None
    bus_errors: BusErrors | None = None
    supply: Supply | None = None

    def of_variant(self, variant: str) -> Services:
        """Return the services that one variant offers."""
        named: dict[str, Service | None] = {
            name: getattr(self, name) for name in type(self).model_fields if name != "nmt"
        }
        lacking = [
            name
            for name, service in named.items()
            if service is not None
            and service.variants is not None
            and variant not in service.variants
        ]
        return self.model_copy(update=dict.fromkeys(lacking))
