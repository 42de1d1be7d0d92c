"""Knobs of measurement and lights."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from conformance.simulator.knobs.base import Address, Factor, Knobs
from conformance.spec.services import LightCondition


class SensorFaults(Knobs):
    """Defects of measurement and lights."""

    fusion_lags: bool = Field(
        default=False, description="Angles of the sensor fusion pass the low-pass filter too."
    )
    live_frozen: bool = Field(default=False, description="Measured values keep their first value.")
    live_swaps_axes: bool = Field(default=False, description="X shows Y, and Y shows X.")
    live_sign_lost: bool = Field(
        default=False, description="What is negative is shown without its sign."
    )
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
    lights_show: dict[LightCondition, dict[str, str]] = Field(
        default={}, description="Under a condition, the pattern that a light shows instead."
    )
