"""Defects of a simulated device: named knobs."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from conformance.simulator.lapse import Lapse
from conformance.spec.services import LightCondition

Factor: TypeAlias = Annotated[float, Field(gt=0)]
Command: TypeAlias = Literal[
    "start", "stop", "enter-pre-operational", "reset-node", "reset-communication"
]
State: TypeAlias = Literal["pre-operational", "operational", "stopped"]
Address: TypeAlias = Annotated[str, Field(pattern=r"^0x[0-9A-Fa-f]{4}(:\d{1,3})?$")]
Index: TypeAlias = Annotated[int, Field(ge=0, le=0xFFFF)]


SdoHabit: TypeAlias = Literal[
    "answers-client-abort",
    "confirms-unknown",
    "drops-segments",
    "echoes-data",
    "hangs-after-short",
    "hears-any-frame",
    "ignores-client-abort",
    "mixes-answers",
    "serves-idle-segments",
    "shifts-unsized",
    "sticks-to-transfer",
    "stores-interrupted",
    "takes-any-block-size",
    "takes-any-total",
    "tells-four-octets",
    "wrong-crc",
]
Moment: TypeAlias = Literal["documented", "never", "at-once", "without-store"]
_MOMENT = "When a new value takes effect; without a store: at the next reset."


class Faults(BaseModel):
    """How a simulated device deviates from its spec; without arguments it does not."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    # what its manual says
    changes: dict[str, Any] = Field(
        default={}, description="Paths in the device's spec and the values it has there instead."
    )

    # the whole device
    silent: bool = Field(default=False, description="Sends nothing at all, not even boot-up.")
    garbage: bool = Field(
        default=False, description="Answers every frame with random frames on 580h + node-ID."
    )
    dies_after_frames: Annotated[int, Field(ge=0)] | None = Field(
        default=None, description="Sends so many frames after power-on, then none."
    )

    lapses: list[Lapse] = Field(
        default=[], description="What it does wrong after some requests in one order."
    )

    # NMT and boot-up
    boot_up: Literal["sent", "missing", "twice", "late"] = "sent"
    boot_time_factor: Factor = Field(default=1.0, description="Stretches the time to boot-up.")
    starts_operational: bool = Field(
        default=False, description="Goes to Operational by itself after boot-up."
    )
    nmt_ignores: list[Command] = []
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

    # heartbeat producer
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
    follows_other_heartbeats: bool = Field(
        default=False, description="A heartbeat of a stopped node stops it."
    )
    answers_guarding: bool = Field(
        default=False, description="Answers the guarding request, toggle bit and all."
    )

    # SDO server
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

    # object dictionary
    od_readback_stale: Literal["everywhere"] | Index | None = Field(
        default=None, description="Confirms downloads (to one object) and keeps the old value."
    )
    accepts_out_of_range: bool = False
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

    # TPDO
    tpdo_states: list[State] = ["operational"]
    tpdo_swaps_mapped_entries: bool = Field(
        default=False, description="The first two mapped objects change places."
    )
    tpdo_short: bool = Field(default=False, description="The last byte is missing.")
    tpdo_sync_off_by_one: bool = Field(
        default=False, description="Sends after one SYNC more than set."
    )
    tpdo_ignores_sync: bool = False
    tpdo_event_timer_factor: Factor = 1.0
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
    tpdo_blanks: Address | None = Field(
        default=None, description="An object that is 0 in every TPDO."
    )
    tpdo_keeps_cob_id: bool = Field(
        default=False, description="Goes on with the CAN-ID it had as delivered."
    )
    cob_id_ignores_bit_29: bool = Field(
        default=False, description="Takes a 29-bit identifier and sends its lowest 11 bits."
    )
    cob_id_accepts_restricted: bool = False
    cob_id_changes_while_valid: bool = False

    # SYNC
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

    # store and restore
    store_any_signature: bool = False
    store_forgets: bool = Field(default=False, description="Confirms 'save' and stores nothing.")
    restore_forgets: bool = Field(default=False, description="Confirms 'load', restores nothing.")
    reset_keeps_values: bool = Field(
        default=False, description="A reset leaves what was written and never stored."
    )

    store_refused: bool = Field(default=False, description="Aborts 'save'.")
    restore_refused: bool = Field(default=False, description="Aborts 'load'.")
    store_spoils: bool = Field(
        default=False,
        description="The last bit of a number that is stored and no default is turned round.",
    )
    stored_values_never_act: bool = Field(
        default=False, description="A setting that waits for a store is kept and has no effect."
    )
    stores_at_once: bool = Field(default=False, description="Keeps every download for good.")
    store_lost_at_power_off: bool = Field(
        default=False, description="What was stored lasts until the supply is switched off."
    )
    store_skips_defaults: bool = Field(
        default=False, description="Storing a default leaves what was stored before."
    )
    restore_acts_at_once: bool = Field(
        default=False, description="Restored defaults are in force without a restart."
    )
    restore_acts_on_all: bool = Field(
        default=False, description="Every sub-index of restore restores everything."
    )
    fusion_lags: bool = Field(
        default=False, description="Angles of the sensor fusion pass the low-pass filter too."
    )
    store_keeps_signature: bool = Field(
        default=False, description="A restart leaves the signatures in what stores and restores."
    )
    restore_lasts: bool = Field(default=False, description="A restore forgets what was stored.")
    restore_lost_at_power_off: bool = Field(
        default=False, description="A restore is forgotten when the supply is switched off."
    )

    # node-ID and bit rate
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

    # measurement
    live_frozen: bool = Field(default=False, description="Measured values keep their first value.")
    live_swaps_axes: bool = Field(default=False, description="X shows Y, and Y shows X.")
    live_negated: bool = Field(default=False, description="Tilt has the wrong sign.")
    live_bias_deg: float = Field(default=0.0, description="Added to every angle.")
    live_most_deg: Factor | None = Field(
        default=None, description="The greatest angle that is measured to either side."
    )
    live_counts_turns: bool = Field(
        default=False, description="After a whole turn the angle goes on instead of beginning anew."
    )
    zero_command_ignored: bool = Field(
        default=False, description="Confirms a zero command, zeroes nothing."
    )

    zeroes_all_axes: bool = Field(
        default=False, description="A zero command acts on every axis, whatever its bits."
    )
    live_factors: dict[Address, float] = Field(
        default={}, description="Measured entries and what their value is multiplied with."
    )
    slope_ignores: list[
        Literal[
            "inversion",
            "scaling",
            "preset",
            "preset-differential",
            "differential-offset",
            "resolution-change",
        ]
    ] = Field(default=[], description="What a slope confirms, but does not act on.")
    resolution_reversed: bool = Field(
        default=False,
        description="A finer resolution makes coarser steps, and the other way round.",
    )
    twins_apart: bool = Field(
        default=False, description="Objects documented to show one value keep one each."
    )
    preset_reads: int | None = Field(
        default=None, description="What every preset returns after a download."
    )
    limit_conflict_clears: bool = Field(
        default=False, description="A value that a new setting does not allow becomes 0."
    )
    status_bits_set: bool = Field(default=False, description="Every bit of a status byte is 1.")
    reset_command_ignored: bool = Field(
        default=False, description="Confirms the command to restart, goes on."
    )

    filter_kind: Literal["butterworth", "critically-damped"] | None = Field(
        default=None, description="Kind of the low-pass filter, whatever is chosen."
    )
    filter_cut_off_hz: Factor | None = Field(
        default=None, description="Cut-off frequency of the low-pass filter, whatever is set."
    )
    filter_order_reversed: bool = Field(
        default=False, description="Named filters are the faster, the slower they should be."
    )
    filter_acts_unsaved: bool = Field(
        default=False, description="A filter acts when it is written, not when it is stored."
    )

    # EMCY and LSS
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

    # bus errors
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

    # lights
    lights_show: dict[LightCondition, dict[str, str]] = Field(
        default={}, description="Under a condition, the pattern that a light shows instead."
    )
