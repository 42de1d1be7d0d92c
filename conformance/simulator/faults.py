"""Defects of a simulated device: named knobs."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from conformance.simulator.knobs.emcy import EmcyFaults
from conformance.simulator.knobs.identity import IdentityFaults
from conformance.simulator.knobs.nmt import NmtFaults
from conformance.simulator.knobs.pdo import PdoFaults
from conformance.simulator.knobs.sdo import SdoFaults
from conformance.simulator.knobs.sensor import SensorFaults
from conformance.simulator.knobs.store import StoreFaults
from conformance.simulator.lapse import Lapse


class Faults(
    NmtFaults, SdoFaults, PdoFaults, StoreFaults, IdentityFaults, EmcyFaults, SensorFaults
):
    """How a simulated device deviates from its spec; without arguments it does not."""

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
