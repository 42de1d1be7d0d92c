"""Knobs of node-ID, bit rate and LSS."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from conformance.simulator.knobs.base import Knobs, State

Moment: TypeAlias = Literal["documented", "never", "at-once", "without-store"]
_MOMENT = "When a new value takes effect; without a store: at the next reset."


class IdentityFaults(Knobs):
    """Defects of node-ID, bit rate and LSS."""

    node_id_change: Moment = Field(default="documented", description=_MOMENT)
    bitrate_change: Moment = Field(default="documented", description=_MOMENT)
    node_id_masked: bool = Field(
        default=False, description="Takes the lowest 7 bits of any value for the node-ID."
    )
    bitrate_takes_any: bool = Field(
        default=False, description="Takes a value beside the table for the table's first."
    )
    holds_useless_places: bool = Field(
        default=False, description="Confirms and holds what is no node-ID or no bit rate."
    )
    pair_needs_one: bool = Field(
        default=False, description="A new value in one object of a pair is enough."
    )
    own_cob_ids_stay: bool = Field(
        default=False, description="Stored COB-IDs of their own stay with a new node-ID."
    )
    boot_up_node_id: Annotated[int, Field(ge=1, le=127)] | None = Field(
        default=None, description="The node-ID in every boot-up message."
    )
    lss_silent: bool = False
    lss_wrong_identity: bool = Field(
        default=False, description="Answers inquiries with the serial number plus one."
    )
    lss_wrong_node_id: bool = Field(
        default=False, description="Answers inquiries with the node-ID plus one."
    )
    lss_states: list[State] | None = Field(
        default=None, description="NMT states in which LSS works, instead of the documented ones."
    )
    lss_in_wrong_state: bool = Field(
        default=False, description="Serves in both LSS states what is for one of them."
    )
    lss_starts_in_configuration: bool = False
    lss_never_waits: bool = Field(default=False, description="Ignores a global switch to waiting.")
    lss_ignores_serial: bool = Field(
        default=False, description="A selective switch does not compare the serial number."
    )
    lss_ignores_order: bool = Field(
        default=False, description="A selective switch takes the four numbers in any order."
    )
    lss_identifies: Literal["anything", "as-asked", "one-only"] = "as-asked"
    lss_outcome: Annotated[int, Field(ge=0, le=255)] | None = Field(
        default=None, description="Error code in every answer to a configuring service."
    )
    lss_fills_unused: bool = Field(
        default=False, description="The last three octets of an answer are FFh."
    )
    lss_node_id_at_once: bool = Field(
        default=False, description="A node-ID acts when configured, not at a reset."
    )
    lss_activates: Literal["as-configured", "nothing", "another"] = Field(
        default="as-configured", description="The bit rate that an activation leads to."
    )
    lss_stores_unasked: bool = Field(
        default=False, description="A node-ID is stored when configured."
    )
    lss_store_forgets: bool = Field(default=False, description="Confirms a store, stores nothing.")
    lss_store_write_ms: Annotated[int, Field(ge=0)] = Field(
        default=0, description="A store over LSS is confirmed so long before it is done."
    )
