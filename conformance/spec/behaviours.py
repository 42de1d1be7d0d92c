"""The behaviours of a device spec file: rules between objects, each with a name and parameters."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from typing import Annotated, Literal, TypeAlias

from pydantic import Discriminator, Field

from conformance.spec.fields import Address, Bit, Number, PerVariant, Source, StrictModel

ResolutionChange: TypeAlias = Literal[
    "keeps-numbers", "keeps-angles", "deletes-all", "deletes-offset"
]


class _Behaviour(StrictModel):
    """What every behaviour has; it holds in the variants that have all objects it names."""

    holds: bool = Field(default=True, description="For a reading that does away with the rule.")
    source: Source


class SameValue(_Behaviour):
    """One value that several objects show: writing one writes all, each as far as its type goes."""

    rule: Literal["same-value"]
    objects: Annotated[list[Address], Field(min_length=2)]


class Paired(_Behaviour):
    """A setting that changes only once two objects have been given the same value.

    ``reads``: what the objects return while they disagree.
    """

    rule: Literal["paired"]
    objects: Annotated[list[Address], Field(min_length=2, max_length=2)]
    reads: Literal["written", "in-force"] = "written"


class Slope(_Behaviour):
    """A slope and its offsets (CiA 410): measured angle + offset + differential offset.

    All of them count in the resolution's unit where one is named, else each in its own.

    ``covers``: least and greatest angle in deg that it shows with no offset.
    ``inversion``, ``scaling``: bits of the operating parameter.
    ``inverts``: what changes its sign with the inversion bit set.
    ``unscaled``: what the slope shows while scaling is off; ``own-steps``: the measured angle in
    steps that the resolution does not change.
    ``preset_subtracts``: what is taken from a preset to get the offset.
    ``preset_unscaled``: what a preset does while scaling is off.
    ``preset_reads``: what the preset returns after a download.
    ``resolution_change``: what a new resolution does to preset, offset and differential offset.
    ``offset_is``: whether the offset is added or subtracted.
    """

    rule: Literal["slope"]
    value: Address
    covers: PerVariant[Annotated[list[Number], Field(min_length=2, max_length=2)]] | None = None
    resolution: Address | None = None
    operating_parameter: Address | None = None
    inversion: Bit | None = None
    scaling: Bit | None = None
    preset: Address | None = None
    offset: Address | None = None
    differential_offset: Address | None = None
    inverts: Literal["measured", "sum"] = "measured"
    unscaled: Literal["measured", "with-offsets", "own-steps"] = "measured"
    preset_subtracts: Literal["measured", "measured-and-differential"] = "measured"
    preset_unscaled: Literal["calculated", "refused"] = "calculated"
    preset_reads: Literal["preset", "zero"] = "preset"
    resolution_change: ResolutionChange = "keeps-numbers"
    offset_is: Literal["added", "subtracted"] = "added"


class Zeroing(_Behaviour):
    """A command that zeroes slopes, each by a bit; ``slopes`` has the names of their behaviours."""

    rule: Literal["zeroing"]
    command: Address
    slopes: Annotated[dict[Bit, str], Field(min_length=1)]


class ResetCommand(_Behaviour):
    """A command that restarts the node after its response."""

    rule: Literal["reset-command"]
    command: Address
    value: int


class StatusBit(StrictModel):
    """What sets one bit: an object that holds a value, an error, or every setting as delivered."""

    object: Address | None = None
    value: int | None = None
    errors: list[int] = Field(default=[])
    factory_settings: bool = False


class StatusBits(_Behaviour):
    """A status object and what sets each of its bits."""

    rule: Literal["status-bits"]
    object: Address
    bits: Annotated[dict[Bit, StatusBit], Field(min_length=1)]


FilterKind: TypeAlias = Literal[
    "off", "critically-damped", "butterworth", "without-overshoot", "any"
]


class Fusion(StrictModel):
    """What forms the angle without the filter, at once, while an object holds a value.

    ``otherwise``: the object's value with the filter.
    ``parameters``: values of its own settings, none of which changes how fast it is.
    """

    object: Address
    value: int
    otherwise: int
    parameters: dict[Address, list[int]] = Field(default={})
    source: Source


class LowPassFilter(_Behaviour):
    """A low-pass filter that a measured angle passes.

    ``selector``: the object that chooses the filter.
    ``kinds``: what each of its values chooses; ``any``: the manual names no kind.
    ``cut_off``: the object that holds the cut-off frequency, where there is one.
    ``response``: how long a critically damped filter takes to respond.
    ``slowest_first``: values of the selector in the order of their speed, where the manual has one.
    ``fusion``: a fusion of sensors that can take its place.
    """

    rule: Literal["low-pass-filter"]
    value: Address
    selector: Address
    kinds: Annotated[dict[int, FilterKind], Field(min_length=1)]
    order: Annotated[int, Field(ge=1, le=16)]
    cut_off: Address | None = None
    response: Literal["inverse-of-cut-off"] | None = None
    slowest_first: list[int] = Field(default=[])
    fusion: Fusion | None = None


Behaviour = Annotated[
    SameValue | Paired | Slope | Zeroing | ResetCommand | StatusBits | LowPassFilter,
    Discriminator("rule"),
]

_OBJECTS: dict[type[_Behaviour], tuple[str, ...]] = {
    Slope: (
        "value",
        "resolution",
        "operating_parameter",
        "preset",
        "offset",
        "differential_offset",
    ),
    LowPassFilter: ("value", "selector", "cut_off"),
    Zeroing: ("command",),
    ResetCommand: ("command",),
    StatusBits: ("object",),
}
"""The attributes by which behaviours name single objects."""


def named_objects(behaviour: Behaviour) -> Iterator[tuple[tuple[Hashable, ...], int | str]]:
    """Return every object that a behaviour names, with its place in it."""
    for attribute in _OBJECTS.get(type(behaviour), ()):
        named = getattr(behaviour, attribute)
        if named is not None:
            yield (attribute,), named
    match behaviour:
        case SameValue() | Paired():
            yield from ((("objects", n), it) for n, it in enumerate(behaviour.objects))
        case LowPassFilter(fusion=Fusion() as fusion):
            yield ("fusion", "object"), fusion.object
            yield from ((("fusion", "parameters", it), it) for it in fusion.parameters)
        case StatusBits():
            for bit, meaning in behaviour.bits.items():
                if meaning.object is not None:
                    yield ("bits", bit, "object"), meaning.object
