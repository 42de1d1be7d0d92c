"""What every service of a spec has, and the kinds of figures in them."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from conformance.spec.fields import (
    StrictModel,
)

Word = Annotated[int, Field(ge=0, le=0xFFFF)]


Bit = Annotated[int, Field(ge=0, le=7)]


Milliseconds = Annotated[int, Field(ge=1, le=60_000)]


TiltAxis: TypeAlias = Literal["tilt-x", "tilt-y"]


class Service(StrictModel):
    """What every service but NMT has."""

    variants: list[str] | None = Field(default=None, description="Offered by these variants only.")
