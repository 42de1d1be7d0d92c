"""A lapse as data: some requests in one order, and what a defective device does wrong after them."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

EventName: TypeAlias = Literal[
    "start",
    "stop",
    "enter-pre-operational",
    "reset-node",
    "reset-communication",
    "sync",
    "upload",
    "download",
]
Service: TypeAlias = Literal["heartbeat", "tpdo", "emcy", "sdo"]
Place: TypeAlias = Annotated[str, Field(pattern=r"^0x[0-9A-Fa-f]{4}(:\d{1,3})?$")]


class Event(BaseModel):
    """A request that came: NMT command, SYNC, or an SDO transfer begun.

    ``object``: of the transfer; any when missing. ``value``: of a download; any when missing.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    does: EventName
    object: Place | None = None
    value: int | None = None


class Lapse(BaseModel):
    """What goes wrong after some requests that follow each other with no other between them.

    ``loses``: the next frame of a service is not sent.
    ``acts_as``: numbers that objects act as, whatever they read as.
    ``copies``: objects that take over the number of another one.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    after: Annotated[list[Event], Field(min_length=3)]
    loses: Service | None = None
    acts_as: dict[Place, int] = {}
    copies: dict[Place, Place] = {}
