"""Knobs of TPDO, SYNC and COB-IDs."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from conformance.simulator.knobs.base import Address, Factor, Knobs, State


class PdoFaults(Knobs):
    """Defects of TPDO, SYNC and COB-IDs."""

    tpdo_states: list[State] = Field(default=["operational"])
    tpdo_swaps_mapped_entries: bool = Field(
        default=False, description="The first two mapped objects change places."
    )
    tpdo_short: bool = Field(default=False, description="The last byte is missing.")
    tpdo_sync_off_by_one: bool = Field(
        default=False, description="Sends after one SYNC more than set."
    )
    tpdo_ignores_sync: bool = False
    tpdo_event_timer_factor: Factor = 1.0
    tpdo_jitter_ms: Annotated[float, Field(ge=0)] = Field(
        default=0.0, description="Greatest random delay of what the event timer sends."
    )
    tpdo_swaps_octets: bool = Field(
        default=False, description="Each mapped number has its most significant octet first."
    )
    tpdo_maps_one_less: bool = Field(
        default=False, description="The last of several mapped objects is missing."
    )
    tpdo_ignores_inhibit_time: bool = False
    tpdo_ignores_bit31: bool = Field(default=False, description="Sends although not valid.")
    tpdo_timer_never_stops: bool = Field(
        default=False, description="An event time of 0 is confirmed, and the timer goes on."
    )
    tpdo_new_event_time_stops: bool = Field(
        default=False, description="An event time written while the timer runs stops it."
    )
    tpdo_timer_always_acts: bool = Field(
        default=False, description="The event timer sends synchronous TPDOs too."
    )
    tpdo_first_late: bool = Field(
        default=False, description="On entering Operational a period passes before the first TPDO."
    )
    tpdo_frozen: bool = Field(
        default=False, description="Carries what it did when it entered Operational."
    )
    tpdo_fills_up: bool = Field(
        default=False, description="Frames are filled up to eight octets with FFh."
    )
    tpdo_drops_inhibit_time: bool = Field(
        default=False, description="Confirms an inhibit time while valid, keeps the old one."
    )
    tpdo_sends_unasked: bool = Field(
        default=False, description="With type 252 a SYNC sends the TPDO."
    )
    tpdo_ignores_rtr: bool = False
    tpdo_answers_forbidden_rtr: bool = Field(
        default=False, description="Answers a remote frame although bit 30 forbids it."
    )
    tpdo_maps_anything: bool = Field(
        default=False, description="Accepts mapping words that name no mappable object."
    )
    tpdo_maps_while_valid: bool = Field(
        default=False, description="Accepts a new mapping while the PDO is valid."
    )
    tpdo_byte_order_ignored: bool = Field(
        default=False, description="The setting of the byte order changes nothing."
    )
    tpdo_maps_too_much: bool = Field(
        default=False, description="Accepts any number of mapped objects, whatever their length."
    )
    tpdo_ignores_count: bool = Field(
        default=False, description="Sends what every mapping entry names, not the first ones alone."
    )
    tpdo_blanks: list[Address] = Field(
        default=[], description="The first of these that the node has is 0 in every TPDO."
    )
    tpdo_keeps_cob_id: bool = Field(
        default=False, description="Goes on with the CAN-ID it had as delivered."
    )
    cob_id_ignores_bit_29: bool = Field(
        default=False, description="Takes a 29-bit identifier and sends its lowest 11 bits."
    )
    cob_id_accepts_restricted: bool = False
    cob_id_changes_while_valid: bool = False
    sync_keeps_cob_id: bool = Field(
        default=False, description="Listens to 80h, whatever its COB-ID says."
    )
    sync_ends_after_data: bool = Field(
        default=False, description="A SYNC with data is the last that is heard until a reset."
    )
    sync_takes_extended: bool = Field(
        default=False, description="Takes a frame with a 29-bit identifier for SYNC."
    )
    sync_generated: bool = Field(
        default=False, description="Sends SYNC itself, although its COB-ID says no."
    )
