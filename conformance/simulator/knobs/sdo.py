"""Knobs of the SDO server and the object dictionary."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from conformance.simulator.knobs.base import Address, Index, Knobs

SdoHabit: TypeAlias = Literal[
    "answers-client-abort",
    "confirms-unknown",
    "cuts-answers",
    "drops-segments",
    "echoes-data",
    "hangs-after-short",
    "hears-any-frame",
    "ignores-client-abort",
    "mixes-answers",
    "refuses-silently",
    "serves-idle-segments",
    "shifts-unsized",
    "sticks-to-transfer",
    "stores-interrupted",
    "swaps-octets",
    "takes-any-block-size",
    "takes-any-total",
    "tells-four-octets",
    "tells-next-index",
    "wrong-crc",
]


class SdoFaults(Knobs):
    """Defects of the SDO server and the object dictionary."""

    sdo_answer_delay_ms: Annotated[float, Field(ge=0)] = Field(
        default=0.0, description="Added to the time of every answer."
    )
    sdo_toggle_stuck: bool = Field(default=False, description="Toggle bit 0 in every segment.")
    sdo_wrong_abort_code: bool = Field(
        default=False, description="Every abort carries 0504 0005h, out of memory."
    )
    sdo_abort_all: bool = Field(default=False, description="Aborts every request.")
    sdo_abort_byte_order: bool = Field(
        default=False, description="Sends the abort code most significant byte first."
    )
    sdo_answers_in_stopped: bool = False
    sdo_answers_twice: bool = False
    sdo_answers_short_requests: bool = Field(
        default=False, description="Takes a request of fewer than 8 bytes as if filled with 0."
    )
    sdo_answers_wrong_sub: bool = Field(
        default=False, description="Answers tell a sub-index one too high."
    )
    sdo_delays_every: Annotated[int, Field(ge=2)] | None = Field(
        default=None, description="Every n-th answer comes a second late."
    )
    sdo_loses_every: Annotated[int, Field(ge=2)] | None = Field(
        default=None, description="Every n-th answer is not sent."
    )
    sdo_size_wrong: bool = Field(
        default=False, description="A segmented upload announces one byte too many."
    )
    sdo_never_ends: bool = Field(
        default=False, description="No segment of an upload is the last; empty ones follow."
    )
    sdo_ignores_toggle: bool = Field(
        default=False, description="Accepts segments whose toggle bit does not alternate."
    )
    sdo_hangs_after_abort: bool = Field(
        default=False, description="Answers nothing more once the client aborted a transfer."
    )
    sdo_serves_other_nodes: bool = Field(
        default=False, description="Answers requests to any node's SDO server."
    )
    sdo_unknown_command_ignored: bool = Field(
        default=False, description="No answer to an unknown command specifier."
    )
    sdo_block_ignored: bool = Field(
        default=False, description="Does not answer requests for a block transfer."
    )
    sdo_habits: list[SdoHabit] = Field(
        default=[], description="What the server does that no server may do."
    )
    od_readback_stale: Literal["everywhere"] | Index | None = Field(
        default=None, description="Confirms downloads (to one object) and keeps the old value."
    )
    accepts_out_of_range: bool = False
    accepts_out_of_range_at: list[Address] = Field(
        default=[], description="Entries whose range is not checked."
    )
    accepts_wrong_length: bool = False
    accepts_read_only: bool = Field(
        default=False, description="Confirms a download to a read-only object and ignores it."
    )
    accepts_in_any_state: bool = Field(
        default=False, description="Ignores that an object is writable in some states only."
    )
    reads_write_only: bool = False
    unknown_object_reads_zero: bool = False
    unknown_sub_reads_zero: bool = False
    optional_entries_abort: bool = Field(
        default=False,
        description="Entries that may be missing are listed, and an upload aborts with 0800 0022h.",
    )
    wrong_defaults: dict[Address, int] = Field(
        default={}, description="Integer entries and the value they have instead of the default."
    )
