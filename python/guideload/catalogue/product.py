"""A product of a catalogue: one carriage type with its ratings, stiffness, friction, limits and source."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, StrictInt, StrictStr, ValidationInfo, field_validator, model_validator

from guideload.base.config import ConfigModel, in_range, optional
from guideload.base.errors import ValueRefused, did_you_mean
from guideload.base.ranges import (
    ACCELERATION,
    FACTOR,
    FORCE,
    FRICTION,
    LENGTH,
    MASS,
    RATED_MOMENT,
    RATING,
    SPEED,
)
from guideload.catalogue.preload_class import PRINTED_PRELOAD, Directions, PreloadClass, Text
from guideload.catalogue.rating import LIFE_EXPONENT, Rating
from guideload.catalogue.stiffness import (
    StiffnessEstimate,
    estimated_stiffness,
    preload_of_interference,
    row_length_of_moment,
)

Force = Annotated[float, in_range(RATING, above=0.0)]
Moment = Annotated[float, in_range(RATED_MOMENT, above=0.0)]
Length = Annotated[float, in_range(LENGTH, above=0.0)]
Factor = Annotated[float, in_range(FACTOR, above=0.0)]
# Two ends at +-length/2 with half the stiffness each tilt like a row of this length over length.
ROW_OVER_LENGTH = 3.0**0.5
PRINTED = "by catalogue"  # source of a stiffness


class Moments(ConfigModel):
    """Rated moments about the carriage's axes."""

    roll: Moment | None = optional('about x, along the rail, e.g. "0.42 kN m"')
    pitch: Moment | None = optional('about z, the side direction, e.g. "0.33 kN m"')
    yaw: Moment | None = optional('about y, the lift direction, e.g. "0.33 kN m"')


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
    page: StrictStr = optional("page or table of the catalogue; empty if it is not known", "")
    unverified: tuple[Text, ...] = optional(
        "keys whose values were not compared with the cited page; reports tell them", ()
    )
    series: StrictStr = optional('series of the maker, e.g. "HG"', "")
    size: StrictInt | StrictStr = optional('nominal size, a number or text, e.g. 25 or "55/85"', "")
    type: Literal["ball", "roller"] = Field(description='rolling elements: "ball" or "roller"')
    dynamic: Rating | None = optional('dynamic load rating, e.g. { value = "34.9 kN", base = "50 km" }')
    static: Force | None = optional('static load rating C0, e.g. "52.8 kN"')
    static_moments: Moments = optional("static moments M0", Moments())
    dynamic_moments: Moments = optional("dynamic moments M", Moments())
    lift_factor: Factor = optional(
        "factor on lifting loads in the equivalent load (k_r of IKO, Y of THK)", 1.0
    )
    side_factor: Factor = optional("factor on side loads in the equivalent load (k_a of IKO, Y of THK)", 1.0)
    preload_classes: tuple[PreloadClass, ...] = optional(
        'elastic laws, e.g. [{ name = "ZA", stiffness = "539 N/um" }]', ()
    )
    row_spacing: Length | None = optional("distance of the rows across the rail, the `width` of a carriage")
    row_length: Length | None = optional("length of the loaded rows along the rail")
    body_length: Length | None = optional(
        "length of the steel body without end caps, which the rows nearly have"
    )
    carriage_length: Length | None = optional("length of the carriage with end caps")
    mass: Annotated[float, in_range(MASS, above=0.0)] | None = optional("mass of the carriage")
    seal_force: SealForce | None = optional('e.g. { value = "1.96 N", per = "end seal" }')
    friction_coefficient: Annotated[float, in_range(FRICTION, above=0.0)] | None = optional(
        "of the rolling contacts, without seals; [friction] of the machine file may replace it"
    )
    max_speed: Annotated[float, in_range(SPEED, above=0.0)] | None = optional('largest speed, e.g. "5 m/s"')
    max_acceleration: Annotated[float, in_range(ACCELERATION, above=0.0)] | None = optional(
        'largest acceleration, e.g. "50 m/s^2"'
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
        page = f"page {self.page}" if self.page[:1].isdigit() else self.page
        return f"{self.maker}, {self.edition}, {page or 'page not known'}"

    @property
    def rating_for_100_km(self) -> float:
        """The dynamic load rating for 100 km of travel [N], to compare products; infinite without one."""
        return math.inf if self.dynamic is None else self.dynamic.with_base(1e5).value

    def class_named(self, name: str | None) -> PreloadClass | None:
        """The preload class of this name, or the only one; None if there is none. Raises ValueRefused."""
        classes = {one.name: one for one in self.preload_classes}
        if name is None and len(classes) <= 1:
            return next(iter(classes.values()), None)
        if not isinstance(name, str) or name not in classes:
            known = ", ".join(classes) or "it has none"
            hint = 'add the key "preload_class"' if name is None else did_you_mean(str(name), classes)
            raise ValueRefused(f"a preload class of {self.name} ({known})", name, hint)
        return classes[name]

    def preload_range(self, preload_class: str | None) -> tuple[float, float] | None:
        """Least and largest preload of a class [N]; None if its record has none. Raises ValueRefused.

        A radial clearance gives it by the mechanics of the contacts, if C0 and the length of the rows are known.
        """
        found = self.class_named(preload_class)
        if found is None:
            return None
        if found.preload is not None:
            return found.preload, found.preload
        for shares, rating in (
            (found.share_of_C, None if self.dynamic is None else self.dynamic.value),
            (found.share_of_C0, self.static),
        ):
            if shares is not None and rating is not None:
                return shares[0] * rating, shares[1] * rating
        length = self.loaded_length
        if found.radial_clearance is None or self.static is None or length is None:
            return None
        most, least = (
            preload_of_interference(self.type, self.static, length, -clearance)
            for clearance in found.radial_clearance
        )
        return least, most

    def stiffness_estimate(self, preload_class: str | None) -> StiffnessEstimate | None:
        """The estimated stiffness of a class without stiffness and curve.

        None if the catalogue prints the stiffness, or if too little is known to estimate it. Raises ValueRefused for an
        unknown class.
        """
        found, preload = self.class_named(preload_class), self.preload_range(preload_class)
        length = self.loaded_length
        if found is None or found.has_law or preload is None or self.static is None or length is None:
            return None
        return estimated_stiffness(self.type, self.static, length, preload)

    def stiffness_source(self, preload_class: str | None) -> str:
        """`PRINTED`, the words of the estimate, such as `estimated, within 30 %`, or "" if there is neither.

        Raises ValueRefused for an unknown class.
        """
        found, estimate = self.class_named(preload_class), self.stiffness_estimate(preload_class)
        if estimate is not None:
            return estimate.words
        return PRINTED if found is not None and found.has_law else ""

    def missing_for_estimate(self, preload_class: str | None) -> tuple[str, ...]:
        """Keys to add to the record so that the stiffness of a class can be estimated. Raises ValueRefused."""
        found = self.class_named(preload_class)
        if found is None:
            return ("preload_classes",)
        lacks = {
            "static": self.static is None,
            "body_length": self.loaded_length is None,
            "dynamic": found.share_of_C is not None and self.dynamic is None,
            f"share_of_C of {found.name}": all(getattr(found, key) is None for key in PRINTED_PRELOAD),
        }
        return tuple(key for key, missing in lacks.items() if missing)

    def law_keys(self, preload_class: str | None) -> dict[str, dict[str, Any]]:
        """Keys of a carriage with the elastic laws along y (lift positive) and z, by axis.

        Empty if the product has no preload classes, or no stiffness that is printed or can be estimated. Raises
        ValueRefused for an unknown class.
        """
        found = self.class_named(preload_class)
        if found is None:
            return {}
        if found.curve is not None:
            press, lift, side = found.curve.press, found.curve.lift, found.curve.side
            along_y = (*((-d, -f) for d, f in press[:0:-1]), *lift)
            return {"y": {"curve_y": along_y}, "z": {"curve_z": side}}
        estimate = self.stiffness_estimate(preload_class)
        stiffness = found.stiffness if estimate is None else estimate.stiffness
        if stiffness is None:
            return {}
        if not isinstance(stiffness, Directions):
            along: dict[str, Any] = {"y": stiffness, "z": stiffness}
        elif stiffness.press == stiffness.lift:
            along = {"y": stiffness.press, "z": stiffness.side}
        else:
            along = {"y": {"positive": stiffness.lift, "negative": stiffness.press}, "z": stiffness.side}
        laws = {axis: {f"stiffness_{axis}": value} for axis, value in along.items()}
        if found.preload is not None:
            for axis, keys in laws.items():
                keys |= {"rolling": self.type, f"preload_{axis}": found.preload}
        return laws

    @property
    def loaded_length(self) -> float | None:
        """Length of the loaded rows [m], or of the body, or the length that the static moment needs."""
        known = self.row_length or self.body_length
        if known is None and self.static is not None and self.static_moments.pitch is not None:
            return row_length_of_moment(self.type, self.static, self.static_moments.pitch)
        return known

    def model_distances(self) -> dict[str, float]:
        """`length` and `width` [m] of a carriage of the model, as far as the record gives them or the numbers for them.

        length  its two ends tilt like the loaded rows
        width   spacing of the rows, or that of the static moment: with rows at 45 degrees, roll stiffness over
                stiffness is (M0/C0)^2
        """
        length, width = self.loaded_length, self.row_spacing
        if width is None and self.static is not None and self.static_moments.roll is not None:
            width = 2.0 * self.static_moments.roll / self.static
        found = {"length": None if length is None else length / ROW_OVER_LENGTH, "width": width}
        return {key: distance for key, distance in found.items() if distance is not None}
