"""A product of a catalogue: one carriage type with its ratings, stiffness, friction, limits and source."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    StrictStr,
    ValidationInfo,
    field_validator,
    model_validator,
)

from guideload.base.config import ConfigModel, entries, in_range, number
from guideload.base.errors import ValueRefused, shown
from guideload.base.ranges import (
    ACCELERATION,
    DEFLECTION,
    FACTOR,
    FORCE,
    FRICTION,
    LENGTH,
    MASS,
    PRELOAD,
    RATED_MOMENT,
    RATING,
    SPEED,
    STIFFNESS,
)
from guideload.catalogue.rating import LIFE_EXPONENT, Rating

Text = Annotated[StrictStr, Field(min_length=1)]
Force = Annotated[float, in_range(RATING, above=0.0)]
Preload = Annotated[float, in_range(PRELOAD, above=0.0)]
Moment = Annotated[float, in_range(RATED_MOMENT, above=0.0)]
Length = Annotated[float, in_range(LENGTH, above=0.0)]
Stiffness = Annotated[float, in_range(STIFFNESS, above=0.0)]
Factor = Annotated[float, in_range(FACTOR, above=0.0)]
MOST_POINTS = 8  # of a curve of one direction: the core takes 16 for both
# Two ends at +-length/2 with half the stiffness each tilt like a row of this length over length.
ROW_OVER_LENGTH = 3.0**0.5


def _rising(points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Check that a curve starts at [0, 0], and that deflection and force rise."""
    if points[:1] != ((0.0, 0.0),) or not 2 <= len(points) <= MOST_POINTS:
        raise ValueRefused(f"2 to {MOST_POINTS} points from [0, 0] on", points, "deflection and force > 0")
    for i, (low, high) in enumerate(zip(points, points[1:], strict=False)):
        if not (high[0] > low[0] and high[1] >= low[1]) or points[-1][1] == 0.0:
            raise ValueRefused("rising deflections, and forces that do not fall", points, f"see [{i + 1}]")
    return points


CurvePoint = Annotated[
    tuple[
        Annotated[float, in_range(DEFLECTION)],
        Annotated[float, in_range(FORCE)],
    ],
    BeforeValidator(partial(entries, names=("deflection", "force"))),
]
Curve = Annotated[tuple[CurvePoint, ...], AfterValidator(_rising)]


class Moments(ConfigModel):
    """Rated moments about the carriage's axes."""

    roll: Moment | None = Field(default=None, description='about x, along the rail, e.g. "0.42 kN m"')
    pitch: Moment | None = Field(default=None, description='about z, the side direction, e.g. "0.33 kN m"')
    yaw: Moment | None = Field(default=None, description='about y, the lift direction, e.g. "0.33 kN m"')


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


def _stiffness(value: object) -> float | Directions:
    if isinstance(value, dict | Directions):
        return Directions.model_validate(value)
    return number(value, "N/m", above=0.0, within=STIFFNESS)


class PreloadClass(ConfigModel):
    """The elastic law of a carriage in one preload class.

    A stiffness alone is a linear law. A stiffness with a preload is the law of two preloaded rows, whose stiffness at
    no load it is. A curve is the whole law; a preload beside it is used for life and friction only.
    """

    name: Text = Field(description='a name that is unique in the product, e.g. "ZA"')
    stiffness: Annotated[float | Directions, BeforeValidator(_stiffness)] | None = Field(
        default=None, description='stiffness, e.g. "539 N/um", or { press = ..., lift = ..., side = ... }'
    )
    curve: Curves | None = Field(default=None, description="load-deflection curves instead of the stiffness")
    preload: Preload | None = Field(default=None, description='preload of each row, e.g. "2.09 kN"')

    @model_validator(mode="after")
    def _one_law(self) -> PreloadClass:
        if (self.stiffness is None) == (self.curve is None):
            raise ValueRefused("exactly one of stiffness and curve", self.model_dump(exclude_unset=True))
        sided = isinstance(self.stiffness, Directions) and self.stiffness.press != self.stiffness.lift
        if sided and self.preload is not None:
            way_out = "the stiffness of preloaded rows at no load is the same both ways: give it, or a curve"
            raise ValueRefused("no preload beside a stiffness that differs by side", self.preload, way_out)
        return self


class SealForce(ConfigModel):
    """Friction of the seals, and what it is counted by: makers print it per carriage or per end seal."""

    value: Annotated[float, in_range(FORCE, least=0.0)] = Field(description='friction force, e.g. "1.96 N"')
    per: Literal["carriage", "end seal"] = Field(description='"carriage" or "end seal" (two per carriage)')

    @property
    def per_carriage(self) -> float:
        """Friction of the seals of one carriage [N]."""
        return self.value * (2.0 if self.per == "end seal" else 1.0)


class Product(ConfigModel):
    """A carriage type of a maker. Loads act along lift and press (y) and side (z); moments are about the same axes."""

    name: Text = Field(description='a unique name, by which carriages select it, e.g. "HGH25CA"')
    maker: Text = Field(description='maker, e.g. "HIWIN"')
    edition: Text = Field(description="catalogue and edition: ratings of one product differ between editions")
    page: StrictStr = Field(
        default="", description="page or table of the catalogue; empty if it is not known"
    )
    unverified: tuple[Text, ...] = Field(
        default=(), description="keys whose values were not compared with the cited page; reports tell them"
    )
    type: Literal["ball", "roller"] = Field(description='rolling elements: "ball" or "roller"')
    dynamic: Rating | None = Field(
        default=None, description='dynamic load rating, e.g. { value = "34.9 kN", base = "50 km" }'
    )
    static: Force | None = Field(default=None, description='static load rating C0, e.g. "52.8 kN"')
    static_moments: Moments = Field(default=Moments(), description="static moments M0")
    dynamic_moments: Moments = Field(default=Moments(), description="dynamic moments M")
    lift_factor: Factor = Field(
        default=1.0, description="factor on lifting loads in the equivalent load (k_r of IKO, Y of THK)"
    )
    side_factor: Factor = Field(
        default=1.0, description="factor on side loads in the equivalent load (k_a of IKO, Y of THK)"
    )
    preload_classes: tuple[PreloadClass, ...] = Field(
        default=(), description='elastic laws, e.g. [{ name = "ZA", stiffness = "539 N/um" }]'
    )
    row_spacing: Length | None = Field(
        default=None, description="distance of the rows across the rail, the `width` of a carriage"
    )
    row_length: Length | None = Field(default=None, description="length of the loaded rows along the rail")
    carriage_length: Length | None = Field(default=None, description="length of the carriage with end caps")
    mass: Annotated[float, in_range(MASS, above=0.0)] | None = Field(
        default=None, description="mass of the carriage"
    )
    seal_force: SealForce | None = Field(
        default=None, description='e.g. { value = "1.96 N", per = "end seal" }'
    )
    friction_coefficient: Annotated[float, in_range(FRICTION, above=0.0)] | None = Field(
        default=None, description="of the rolling contacts, without seals"
    )
    max_speed: Annotated[float, in_range(SPEED, above=0.0)] | None = Field(
        default=None, description='largest speed, e.g. "5 m/s"'
    )
    max_acceleration: Annotated[float, in_range(ACCELERATION, above=0.0)] | None = Field(
        default=None, description='largest acceleration, e.g. "50 m/s^2"'
    )

    @model_validator(mode="before")
    @classmethod
    def _exponent_of_type(cls, values: Any) -> Any:
        """Give a rating without exponent that of the type."""
        if not isinstance(values, dict):
            return values
        rating, exponent = values.get("dynamic"), LIFE_EXPONENT.get(str(values.get("type")))
        if isinstance(rating, dict) and "exponent" not in rating and exponent is not None:
            return {**values, "dynamic": {**rating, "exponent": exponent}}
        return values

    @field_validator("preload_classes")
    @classmethod
    def _unique(cls, classes: tuple[PreloadClass, ...]) -> tuple[PreloadClass, ...]:
        names = [one.name for one in classes]
        if len(set(names)) < len(names):
            raise ValueRefused("a unique name of each preload class", names)
        return classes

    @field_validator("unverified")
    @classmethod
    def _known_keys(cls, keys: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        for key in keys:
            if key not in cls.model_fields:
                raise ValueRefused("keys of a product", list(keys), f'"{key}" is none')
        return keys

    @property
    def source(self) -> str:
        """Maker, edition and page; says so if the page is not known."""
        return f"{self.maker}, {self.edition}, {f'page {self.page}' if self.page else 'page not known'}"

    def class_named(self, name: str | None) -> PreloadClass | None:
        """The preload class of this name, or the only one; None if there is none. Raises ValueRefused."""
        classes = {one.name: one for one in self.preload_classes}
        if name is None and len(classes) <= 1:
            return next(iter(classes.values()), None)
        if not isinstance(name, str) or name not in classes:
            known = ", ".join(classes) or "it has none"
            raise ValueRefused(
                f"a preload class of {self.name} ({known})", name, 'add the key "preload_class"'
            )
        return classes[name]

    def law_keys(self, preload_class: str | None) -> dict[str, dict[str, Any]]:
        """Keys of a carriage with the elastic laws along y (lift positive) and z, by axis; empty without a class."""
        found = self.class_named(preload_class)
        if found is None:
            return {}
        if found.curve is not None:
            press, lift, side = found.curve.press, found.curve.lift, found.curve.side
            along_y = (*((-d, -f) for d, f in press[:0:-1]), *lift)
            return {"y": {"curve_y": along_y}, "z": {"curve_z": side}}
        stiffness = found.stiffness
        if not isinstance(stiffness, Directions):
            along: dict[str, Any] = {"y": stiffness, "z": stiffness}
        elif stiffness.press == stiffness.lift:
            along = {"y": stiffness.press, "z": stiffness.side}
        else:
            along = {"y": {"positive": stiffness.lift, "negative": stiffness.press}, "z": stiffness.side}
        preload = {} if found.preload is None else {"rolling": self.type}
        return {
            axis: {f"stiffness_{axis}": value, **preload}
            | ({} if found.preload is None else {f"preload_{axis}": found.preload})
            for axis, value in along.items()
        }

    @property
    def model_length(self) -> float | None:
        """`length` of a carriage of the model, whose two ends tilt like the loaded rows [m]."""
        return None if self.row_length is None else self.row_length / ROW_OVER_LENGTH


def product_by_name(products: Mapping[str, Product], name: str, where: str) -> Product:
    """The product of this name. Raises ValueRefused with the nearest names."""
    from difflib import get_close_matches

    if name in products:
        return products[name]
    near = get_close_matches(name, products, n=1)
    hint = f'did you mean "{near[0]}"?' if near else f"it has {shown(list(products)) if products else 'none'}"
    raise ValueRefused(f"a product of {where}", name, hint)
