"""A preload class of a product: the elastic law of its carriages, and the preload that the catalogue prints."""

from __future__ import annotations

from functools import partial
from typing import Annotated, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, StrictStr, model_validator

from guideload.base.config import ConfigModel, in_range, interval, number, optional
from guideload.base.errors import ValueRefused
from guideload.base.ranges import CLEARANCE, PRELOAD, PRELOAD_SHARE, STIFFNESS
from guideload.catalogue.curve import CurvePoint, from_zero

Text = Annotated[StrictStr, Field(min_length=1)]
Preload = Annotated[float, in_range(PRELOAD, above=0.0)]
Stiffness = Annotated[float, in_range(STIFFNESS, above=0.0)]
PRINTED_PRELOAD = ("preload", "share_of_C", "share_of_C0", "radial_clearance")


Curve = Annotated[tuple[CurvePoint, ...], AfterValidator(from_zero)]
Model = TypeVar("Model", bound=ConfigModel)


def stiffness_or(model: type[Model], value: object) -> float | Model:
    """A stiffness [N/m], or a table with one for each direction. Raises ValueRefused; ValidationError for the table."""
    if isinstance(value, (dict, model)):
        return model.model_validate(value)
    return number(value, "N/m", above=0.0, within=STIFFNESS)


class Directions(ConfigModel):
    """A stiffness for each direction of the load."""

    press: Stiffness = Field(
        description='under a load that presses the carriage on its rail, e.g. "539 N/um"'
    )
    lift: Stiffness = Field(description='under a load that lifts the carriage off its rail, e.g. "420 N/um"')
    side: Stiffness = Field(description='under a load across the rail, e.g. "380 N/um"')


class Curves(ConfigModel):
    """A load-deflection curve for each direction of the load."""

    press: Curve = Field(description='points from [0, 0] on, e.g. [["0 um", "0 N"], ["20 um", "9 kN"]]')
    lift: Curve = Field(description="points from [0, 0] on, deflection and force > 0")
    side: Curve = Field(description="points from [0, 0] on, deflection and force > 0")


def _ascending(ends: tuple[float, float]) -> tuple[float, float]:
    if ends[0] > ends[1]:
        raise ValueRefused("[least, largest]", list(ends))
    return ends


Share = Annotated[float, in_range(PRELOAD_SHARE, least=0.0)]
Clearance = Annotated[float, in_range(CLEARANCE)]
Shares = Annotated[tuple[Share, Share], BeforeValidator(interval), AfterValidator(_ascending)]
Clearances = Annotated[tuple[Clearance, Clearance], BeforeValidator(interval), AfterValidator(_ascending)]


class PreloadClass(ConfigModel):
    """A preload class of a carriage: its elastic law, and the preload that the catalogue prints.

    A stiffness alone is a linear law. A stiffness with a preload is the law of two preloaded rows, whose stiffness at
    no load it is. A curve is the whole law; a preload beside it is used for life and friction only. Without stiffness
    and curve, the stiffness is estimated from the preload. A preload given as a share of C or C0, or by the radial
    clearance, leaves the law linear.
    """

    name: Text = Field(description='a name that is unique in the product, e.g. "ZA"')
    stiffness: Annotated[float | Directions, BeforeValidator(partial(stiffness_or, Directions))] | None = (
        optional('stiffness, e.g. "539 N/um", or { press = ..., lift = ..., side = ... }')
    )
    curve: Curves | None = optional("load-deflection curves instead of the stiffness")
    preload: Preload | None = optional(
        'preload of each row, e.g. "2.09 kN", which makes the law that of preloaded rows'
    )
    share_of_C: Shares | None = optional(
        "printed preload over C, a number or [least, largest], e.g. [0.05, 0.07]"
    )
    share_of_C0: Shares | None = optional("printed preload over C0, a number or [least, largest], e.g. 0.02")
    radial_clearance: Clearances | None = optional(
        'printed radial clearance, negative with preload, e.g. ["-12 um", "-5 um"]'
    )

    @model_validator(mode="after")
    def _one_law(self) -> PreloadClass:
        if self.stiffness is not None and self.curve is not None:
            raise ValueRefused("at most one of stiffness and curve", self.model_dump(exclude_unset=True))
        given = [key for key in PRINTED_PRELOAD if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueRefused("one preload", given, "keep the one that the catalogue prints")
        sided = isinstance(self.stiffness, Directions) and self.stiffness.press != self.stiffness.lift
        if sided and self.preload is not None:
            way_out = "the stiffness of preloaded rows at no load is the same both ways: give it, or a curve"
            raise ValueRefused("no preload beside a stiffness that differs by side", self.preload, way_out)
        return self

    @property
    def has_law(self) -> bool:
        """Whether its stiffness or curve is given."""
        return self.stiffness is not None or self.curve is not None
