"""The services of a device spec file: one block per CANopen service the device offers."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from conformance.spec.fields import (
    Index,
    Interval,
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
    "inquire-node-id",
    "identify-remote-slave",
]
Effective: TypeAlias = Literal["at-once", "after-reset", "after-store-and-reset"]
Word = Annotated[int, Field(ge=0, le=0xFFFF)]
Bit = Annotated[int, Field(ge=0, le=7)]


class Nmt(StrictModel):
    """NMT slave: boot-up message and what follows it."""

    automatic_start: bool = False
    source: Source


class HeartbeatProducer(StrictModel):
    """Heartbeat producer; times in milliseconds, ``off`` is the value that switches it off."""

    object: Index
    off: int = 0
    min_ms: Annotated[int, Field(ge=1, le=0xFFFF)]
    max_ms: Annotated[int, Field(ge=1, le=0xFFFF)]
    below_minimum: Literal["refused", "clamped", "accepted"] = "refused"
    states: list[State]
    source: Source


class SyncConsumer(StrictModel):
    """SYNC consumer and the object that holds its COB-ID."""

    object: Index
    source: Source


class EmcyProducer(StrictModel):
    """EMCY producer: COB-ID object, error codes and the states in which it sends."""

    object: Index
    error_register: Index | None = None
    history: Index | None = None
    states: list[State]
    codes: dict[Word, str]
    register_bits: dict[Bit, str]
    source: Source


class Tpdo(StrictModel):
    """TPDO producer; one pair of communication and mapping object per TPDO.

    ``map_only_while``: what must hold before a mapping entry may be written.
    """

    count: Annotated[int, Field(ge=1, le=512)]
    communication: Index = 0x1800
    mapping: Index = 0x1A00
    max_mapped: Annotated[int, Field(ge=1, le=64)]
    transmission_types: Annotated[list[Interval], Field(min_length=1)]
    other_types: Literal["refused", "accepted"] = "refused"
    map_only_while: list[Literal["disabled", "count-zero"]]
    min_cycle_ms: int | None = None
    inhibit_unit_us: Annotated[int, Field(ge=1)] = 100
    source: Source


class Store(StrictModel):
    """Store or restore parameters: signature and, per sub-index, the ranges of indices it covers."""

    object: Index
    signature: Signature
    groups: Annotated[dict[Sub, list[Interval]], Field(min_length=1)]
    effective: Effective = "at-once"
    source: Source


class Changeable(StrictModel):
    """An object that changes how the node is reached, and when the change takes effect."""

    object: Index
    effective: Effective
    source: Source


class Lss(StrictModel):
    """LSS slave: the services allowed in the two states."""

    waiting: list[LssService]
    configuration: list[LssService]
    source: Source


class Services(StrictModel):
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
