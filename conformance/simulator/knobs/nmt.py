"""Knobs of NMT, boot-up, heartbeat and guarding."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from conformance.simulator.knobs.base import Factor, Knobs, State

Command: TypeAlias = Literal[
    "start", "stop", "enter-pre-operational", "reset-node", "reset-communication"
]


class NmtFaults(Knobs):
    """Defects of NMT, boot-up, heartbeat and guarding."""

    boot_up: Literal["sent", "missing", "twice", "late", "as-state"] = "sent"
    boot_time_factor: Factor = Field(default=1.0, description="Stretches the time to boot-up.")
    starts_operational: bool = Field(
        default=False, description="Goes to Operational by itself after boot-up."
    )
    nmt_ignores: list[Command] = Field(default=[])
    nmt_ignores_broadcast: bool = False
    nmt_obeys_other_nodes: bool = False
    nmt_obeys_unknown_commands: bool = Field(
        default=False, description="Takes a command that the standard reserves for start."
    )
    nmt_obeys_wrong_length: bool = Field(
        default=False, description="Takes an NMT command from a frame of 3 to 8 bytes."
    )
    nmt_ignores_resets_in: list[State] = Field(
        default=[], description="NMT states in which no command restarts it."
    )
    nmt_resets_on_repetition: bool = Field(
        default=False, description="A command for the state it is in restarts it."
    )
    leaves_operational_after_ms: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="Goes back to Pre-operational by itself."
    )
    reset_communication_resets_all: bool = False
    start_object_ignored: bool = Field(
        default=False, description="The object for the automatic start has no effect."
    )
    heartbeat_period_factor: Factor = 1.0
    heartbeat_jitter_ms: Annotated[float, Field(ge=0)] = Field(
        default=0.0, description="Greatest random delay of a single heartbeat."
    )
    heartbeat_wrong_state: bool = Field(
        default=False, description="Tells the state before the last change."
    )
    heartbeat_never_stops: bool = Field(default=False, description="Ignores a period of 0.")
    heartbeat_starts_late: bool = Field(
        default=False, description="Starts with the next NMT command instead of at once."
    )
    heartbeat_factor_operational: Factor = Field(
        default=1.0, description="Stretches the period while Operational."
    )
    heartbeat_wraps_ms: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="What is left of a time divided by this is the period."
    )
    heartbeat_keeps_period: bool = Field(
        default=False, description="A running heartbeat takes no other period than off."
    )
    heartbeat_waits_after_start: bool = Field(
        default=False, description="Starts with a download only, whatever was stored."
    )
    heartbeat_ends_when_written_again: bool = Field(
        default=False, description="The time it has already, written again, switches it off."
    )
    heartbeat_octets: Annotated[int, Field(ge=0, le=8)] = 1
    heartbeat_under_load: Literal["comes", "pauses", "ends"] = Field(
        default="comes", description="What becomes of it while frames for others come in a row."
    )
    follows_other_heartbeats: bool = Field(
        default=False, description="A heartbeat of a stopped node stops it."
    )
    answers_guarding: bool = Field(
        default=False, description="Answers the guarding request, toggle bit and all."
    )
