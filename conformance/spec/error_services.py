"""The services of a spec that are about errors: EMCY, bus errors, supply (CiA 301 v4.2.0, 7.2.7)."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, model_validator

from conformance.spec.fields import (
    Address,
    Index,
    Number,
    PerVariant,
    Source,
    State,
    StrictModel,
)
from conformance.spec.service import Bit, Service, TiltAxis, Word


class ManufacturerCode(StrictModel):
    """The object that an EMCY carries in octet 0 to 4 of its manufacturer-specific field."""

    object: Index
    octet: Annotated[int, Field(ge=0, le=4)]


class ErrorCause(StrictModel):
    """An error that the simulated device finds by itself.

    ``limits``: lowest and highest angle in deg; the range of the slope when missing.
    ``stops``: the angle shown stops at the limit.
    ``bit``: of the manufacturer code.
    """

    cause: TiltAxis
    code: Word
    bit: Bit | None = None
    limits: PerVariant[Annotated[list[Number], Field(min_length=2, max_length=2)]] | None = None
    stops: bool = False
    source: Source


class OnError(StrictModel):
    """The NMT state an error leads to: ``state``, or the one for the object's value, if any.

    ``mild``: causes that lead nowhere.
    """

    state: State | None = None
    object: Index | None = None
    states: dict[int, State] = Field(default={})
    leaves: list[State] = Field(default=["operational"])
    mild: list[TiltAxis] = Field(default=[])
    source: Source


class EmcyProducer(Service):
    """EMCY producer: COB-ID object, error codes and the states in which it sends.

    ``restricted``: what becomes of a CAN-ID that CiA 301 keeps for other services.
    ``history_keeps``: whether 0000h enters the history too.
    ``history_takes``: what may be written to its sub-index 0, where that is writable.
    ``other_octets``: those of the manufacturer-specific field without a documented content.
    ``inhibit``: object of the inhibit time in multiples of 100 us.
    ``inhibited``: what happens to an EMCY within it.
    ``enabled_by``: bit of the COB-ID that must be set for EMCY to be sent, beside what CiA 301 has.
    ``sends``: at each change of the errors, or at the first and after the last one.
    ``cleared``: whether error code 0000h is sent.
    ``lasts``: how long an angle that was out of its limits is an error.
    """

    object: Index
    change_while_valid: Literal["refused", "accepted"] = "refused"
    restricted: Literal["refused", "accepted"] = "refused"
    enabled_by: Annotated[int, Field(ge=11, le=30)] | None = None
    error_register: Index | None = None
    history: Index | None = None
    history_keeps: Literal["errors", "errors-and-resets"] = "errors"
    history_takes: Literal["zero", "any"] = "zero"
    inhibit: Index | None = None
    inhibited: Literal["delayed", "lost"] = "delayed"
    states: list[State]
    codes: dict[Word, str]
    register_bits: dict[Bit, str]
    manufacturer_code: ManufacturerCode | None = None
    other_octets: Literal["zero", "any"] = "zero"
    causes: list[ErrorCause] = Field(default=[])
    sends: Literal["each-change", "first-and-last"] = "each-change"
    cleared: Literal["sent", "silent"] = "sent"
    lasts: Literal["while-present", "until-reset"] = "while-present"
    on_error: OnError | None = None
    source: Source


BusError: TypeAlias = Literal["warning-limit", "error-passive", "bus-off"]


class Recovery(StrictModel):
    """The object that lets the node leave bus-off by itself: when it holds ``value``."""

    object: Address
    value: int


class BusErrors(Service):
    """What the node tells of errors on the bus: EMCY codes, and bits of the error register.

    ``error_passive``: code while the CAN controller is error passive; none where it is not told.
    ``after_bus_off``: code once the node is back from bus-off; none where the manual has none.
    ``register_bits``: set while the CAN controller is error passive.
    """

    error_passive: Word | None = None
    after_bus_off: Word | None = None
    register_bits: list[Bit]
    recovery: Recovery | None = None
    source: Source


class Supply(Service):
    """The supply voltages at which the device works, in volts."""

    min_v: Annotated[float, Field(gt=0)]
    max_v: Annotated[float, Field(gt=0)]
    source: Source

    @model_validator(mode="after")
    def _is_a_range(self) -> Supply:
        if self.min_v > self.max_v:
            raise ValueError(f"expected min_v up to max_v ({self.max_v:g}), got {self.min_v:g}")
        return self
