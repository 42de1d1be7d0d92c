"""Knobs of EMCY, its history, and what the bus and the supply lead to."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from conformance.simulator.knobs.base import Knobs, State


class EmcyFaults(Knobs):
    """Defects of EMCY, its history, and what the bus and the supply lead to."""

    emcy_missing: bool = False
    emcy_repeats: bool = Field(default=False, description="Sends an EMCY twice per event.")
    emcy_at_boot: bool = Field(default=False, description="Sends an EMCY 0000h after boot-up.")
    emcy_never_clears: bool = Field(
        default=False, description="Sends nothing when the error has gone."
    )
    emcy_states: list[State] = Field(default=[], description="Sends EMCY in these NMT states too.")
    manufacturer_code_bits: Annotated[int, Field(ge=0, le=0xFF)] = Field(
        default=0, description="Bits of the manufacturer's error code that are always set."
    )
    emcy_short: bool = Field(default=False, description="An EMCY ends after the error register.")
    emcy_code_plus_one: bool = False
    emcy_code_swapped: bool = Field(
        default=False, description="The error code has its most significant octet first."
    )
    emcy_every_ms: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="While there is an error it is told again at this period."
    )
    emcy_wrong_register: bool = Field(
        default=False, description="The error register in an EMCY is not 1001h."
    )
    emcy_without_manufacturer_code: bool = False
    emcy_off_by_bit_30: bool = Field(
        default=False, description="Sends no EMCY while bit 30 of its COB-ID is set."
    )
    emcy_ignores_bit_31: bool = False
    emcy_keeps_cob_id: bool = Field(
        default=False, description="Goes on with the CAN-ID it had at the start."
    )
    emcy_ignores_inhibit_time: bool = False
    emcy_first_error_only: bool = Field(
        default=False, description="Tells the first error and the end of the last one."
    )
    error_register_stuck: bool = Field(default=False, description="Bit 0 of 1001h is always set.")
    error_register_latched: bool = Field(
        default=False, description="Bits of 1001h stay set when the error has gone."
    )
    error_register_without_bit_0: bool = False
    error_state: State | None = Field(
        default=None, description="NMT state that every error leads to."
    )
    history_stays_empty: bool = False
    history_oldest_first: bool = False
    history_depth: Annotated[int, Field(ge=1)] | None = None
    history_never_clears: bool = Field(
        default=False, description="Confirms 0 in 1003h:00, clears nothing."
    )
    history_takes_any: bool = Field(
        default=False, description="Confirms any value for 1003h:00, clears by 0 alone."
    )
    history_codes_lost: bool = Field(
        default=False, description="A start leaves the number of the errors and no codes."
    )
    history_unused_erased: bool = Field(
        default=False, description="Unused places of the history read as FFFF FFFFh."
    )
    bus_errors_untold: list[Literal["error-passive", "after-bus-off"]] = Field(
        default=[], description="What of errors on the bus is not told by EMCY."
    )
    bus_off_recovery: bool | None = Field(
        default=None, description="Whether the node leaves bus-off by itself, whatever is set."
    )
    supply_too_low_early: Literal["told", "restarts"] | None = Field(
        default=None, description="What a supply voltage leads to that is low, but documented."
    )
    overrun: Literal["told", "restarts", "deaf"] | None = Field(
        default=None, description="What comes of more frames than it handles in time."
    )
