"""The services of a device spec file: one block per CANopen service the device offers."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, model_validator

from conformance.spec.fields import (
    Address,
    Index,
    Interval,
    Number,
    PerVariant,
    Signature,
    Source,
    State,
    StrictModel,
    Sub,
)

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
Word = Annotated[int, Field(ge=0, le=0xFFFF)]
Bit = Annotated[int, Field(ge=0, le=7)]
Milliseconds = Annotated[int, Field(ge=1, le=60_000)]
TiltAxis: TypeAlias = Literal["tilt-x", "tilt-y"]
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


class Service(StrictModel):
    """What every service but NMT has."""

    variants: list[str] | None = Field(default=None, description="Offered by these variants only.")


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


class ManufacturerCode(StrictModel):
    """The object that an EMCY carries in octet 0 to 4 of its manufacturer-specific field."""

    object: Index
    octet: Annotated[int, Field(ge=0, le=4)]


class ErrorCause(StrictModel):
    """An error that the simulated device finds by itself.

    ``limits``: lowest and highest angle in deg; the range of the slope when missing.
    ``stops``: the angle shown stops at the limit.
    ``bit``: of the manufacturer code.
    """

    cause: TiltAxis
    code: Word
    bit: Bit | None = None
    limits: PerVariant[Annotated[list[Number], Field(min_length=2, max_length=2)]] | None = None
    stops: bool = False
    source: Source


class OnError(StrictModel):
    """The NMT state an error leads to: ``state``, or the one for the object's value, if any.

    ``mild``: causes that lead nowhere.
    """

    state: State | None = None
    object: Index | None = None
    states: dict[int, State] = Field(default={})
    leaves: list[State] = Field(default=["operational"])
    mild: list[TiltAxis] = Field(default=[])
    source: Source


class EmcyProducer(Service):
    """EMCY producer: COB-ID object, error codes and the states in which it sends.

    ``restricted``: what becomes of a CAN-ID that CiA 301 keeps for other services.
    ``history_keeps``: whether 0000h enters the history too.
    ``history_takes``: what may be written to its sub-index 0, where that is writable.
    ``other_octets``: those of the manufacturer-specific field without a documented content.
    ``inhibit``: object of the inhibit time in multiples of 100 us.
    ``inhibited``: what happens to an EMCY within it.
    ``enabled_by``: bit of the COB-ID that must be set for EMCY to be sent, beside what CiA 301 has.
    ``sends``: at each change of the errors, or at the first and after the last one.
    ``cleared``: whether error code 0000h is sent.
    ``lasts``: how long an angle that was out of its limits is an error.
    """

    object: Index
    change_while_valid: Literal["refused", "accepted"] = "refused"
    restricted: Literal["refused", "accepted"] = "refused"
    enabled_by: Annotated[int, Field(ge=11, le=30)] | None = None
    error_register: Index | None = None
    history: Index | None = None
    history_keeps: Literal["errors", "errors-and-resets"] = "errors"
    history_takes: Literal["zero", "any"] = "zero"
    inhibit: Index | None = None
    inhibited: Literal["delayed", "lost"] = "delayed"
    states: list[State]
    codes: dict[Word, str]
    register_bits: dict[Bit, str]
    manufacturer_code: ManufacturerCode | None = None
    other_octets: Literal["zero", "any"] = "zero"
    causes: list[ErrorCause] = Field(default=[])
    sends: Literal["each-change", "first-and-last"] = "each-change"
    cleared: Literal["sent", "silent"] = "sent"
    lasts: Literal["while-present", "until-reset"] = "while-present"
    on_error: OnError | None = None
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


BusError: TypeAlias = Literal["warning-limit", "error-passive", "bus-off"]


class Recovery(StrictModel):
    """The object that lets the node leave bus-off by itself: when it holds ``value``."""

    object: Address
    value: int


class BusErrors(Service):
    """What the node tells of errors on the bus: EMCY codes, and bits of the error register.

    ``error_passive``: code while the CAN controller is error passive; none where it is not told.
    ``after_bus_off``: code once the node is back from bus-off; none where the manual has none.
    ``register_bits``: set while the CAN controller is error passive.
    """

    error_passive: Word | None = None
    after_bus_off: Word | None = None
    register_bits: list[Bit]
    recovery: Recovery | None = None
    source: Source


class Supply(Service):
    """The supply voltages at which the device works, in volts."""

    min_v: Annotated[float, Field(gt=0)]
    max_v: Annotated[float, Field(gt=0)]
    source: Source

    @model_validator(mode="after")
    def _is_a_range(self) -> Supply:
        if self.min_v > self.max_v:
            raise ValueError(f"expected min_v up to max_v ({self.max_v:g}), got {self.min_v:g}")
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
