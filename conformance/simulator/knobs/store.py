"""Knobs of store and restore."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from conformance.simulator.knobs.base import Knobs


class StoreFaults(Knobs):
    """Defects of store and restore."""

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
    store_keeps_signature: bool = Field(
        default=False, description="A restart leaves the signatures in what stores and restores."
    )
    restore_lasts: bool = Field(default=False, description="A restore forgets what was stored.")
    restore_lost_at_power_off: bool = Field(
        default=False, description="A restore is forgotten when the supply is switched off."
    )
    store_write_ms: Annotated[int, Field(ge=0)] = Field(
        default=0, description="How much longer than documented a write of the memory takes."
    )
