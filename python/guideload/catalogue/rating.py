"""A dynamic load rating: value, base distance and exponent. Makers use bases of 50 km and 100 km."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, PlainValidator

from guideload.base.arguments import checked, real_array
from guideload.base.arrays import Array
from guideload.base.config import ConfigModel, in_range, not_required, number
from guideload.base.errors import ArgumentError, ValueRefused
from guideload.base.ranges import EXPONENT, RATED_TRAVEL, RATING

LIFE_EXPONENT = {"ball": 3.0, "roller": 10.0 / 3.0}  # ISO 14728-1
WEIBULL_SLOPE = 1.5  # of rolling fatigue, behind the reliability factors of ISO 14728-1


def life_exponent(value: object) -> float:
    """A number, or a fraction as text: "10/3"."""
    try:
        if isinstance(value, str) and re.fullmatch(r"[\d./]{1,20}", value):
            value = float(Fraction(value))
        return number(value, "1", above=0.0, within=EXPONENT)
    except (ValueError, ZeroDivisionError):
        raise ValueRefused(EXPONENT.words, value, '3 for balls, "10/3" for rollers') from None


class Rating(ConfigModel):
    """A dynamic load rating: under the load `value`, 90 % of the carriages reach the travel `base`.

    The life under the mean load P is base (value/P)^exponent.
    """

    model_config = not_required("exponent")

    value: Annotated[float, in_range(RATING, above=0.0)] = Field(
        description='dynamic load rating C, e.g. "34.9 kN"'
    )
    base: Annotated[float, in_range(RATED_TRAVEL, above=0.0)] = Field(
        description='travel to which C refers, "50 km" or "100 km", from the same catalogue'
    )
    exponent: Annotated[float, PlainValidator(life_exponent)] = Field(
        description='exponent of the life, 3 for balls, "10/3" for rollers; by default from the type'
    )

    @checked
    def life(self, mean_load: ArrayLike) -> Array:
        """Travel [m] that 90 % of the carriages reach under a mean load [N], >= 0; infinite without load."""
        loads = real_array("mean_load", mean_load)
        if not np.all(loads >= 0.0):
            wrong = loads[~(loads >= 0.0)][0]
            raise ArgumentError(f"mean_load: expected loads >= 0 N, got {wrong:g}; a load is a magnitude")
        return travel_under(self, loads)

    @checked
    def with_base(self, base: float) -> Rating:
        """The same rating for another base [m], > 0: the life is the same."""
        if not base > 0.0:
            raise ArgumentError(f"base: expected > 0 m, got {base:g}; makers use 50 km and 100 km")
        value = self.value * (self.base / base) ** (1.0 / self.exponent)
        return Rating(value=value, base=base, exponent=self.exponent)


def travel_under(rating: Rating, mean_load: Array) -> Array:
    """Travel [m] that 90 % of the carriages reach under a mean load [N] >= 0; nan where the load is unknown."""
    with np.errstate(divide="ignore"):
        return np.asarray(rating.base * (rating.value / mean_load) ** rating.exponent)


def reliability_factor(reliability: float) -> float:
    """a1 of ISO 14728-1: the life that a carriage reaches with this probability, over that of 90 %.

    (ln(1/R) / ln(1/0.9))^(1/1.5), a Weibull distribution of slope 1.5, gives the printed table: 1, 0.62, 0.53, 0.44,
    0.33, 0.21 for 90, 95, 96, 97, 98, 99 %.
    """
    return float((np.log(reliability) / np.log(0.9)) ** (1.0 / WEIBULL_SLOPE))
