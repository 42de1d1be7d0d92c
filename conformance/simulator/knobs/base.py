"""What all knobs have in common."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

Factor: TypeAlias = Annotated[float, Field(gt=0)]
State: TypeAlias = Literal["pre-operational", "operational", "stopped"]
Address: TypeAlias = Annotated[str, Field(pattern=r"^0x[0-9A-Fa-f]{4}(:\d{1,3})?$")]
Index: TypeAlias = Annotated[int, Field(ge=0, le=0xFFFF)]


class Knobs(BaseModel):
    """Knobs of one service; as they are without arguments, the device deviates in nothing."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
