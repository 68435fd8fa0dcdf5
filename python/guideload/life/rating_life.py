"""Rating life (ISO 14728-1) of a carriage, and of several: the life that all reach with the same probability."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.rating import WEIBULL_SLOPE, Rating, reliability_factor, travel_under


def rating_life(
    rating: Rating, mean_load: ArrayLike, conditions: LifeConditions, contact_factor: float = 1.0
) -> Array:
    """The life [m] under a mean load [N]: a1 base (f_H f_T f_C C / (f_W P_m))^p; infinite without load."""
    factors = conditions.hardness_factor * conditions.temperature_factor * contact_factor
    rated = rating.model_copy(update={"value": factors * rating.value / conditions.load_factor})
    return np.asarray(reliability_factor(conditions.reliability) * travel_under(rated, np.asarray(mean_load)))


def failure_probability(travel: ArrayLike, life: ArrayLike, reliability: float) -> Array:
    """Probability of a failure before a travel [m]: Weibull distribution whose `life` [m] has this reliability.

    Raises ArgumentError for a negative travel and for nan.
    """
    if not np.all(np.asarray(travel) >= 0.0):
        raise ArgumentError(f"travel: expected at least 0 m, got {travel!r:.80}")
    with np.errstate(over="ignore"):  # far beyond the life the probability is 1
        ratio = np.asarray(travel) / np.asarray(life)
        return np.asarray(-np.expm1(ratio**WEIBULL_SLOPE * math.log(reliability)))


def system_life(lives: ArrayLike) -> Array:
    """The life [m] that all carriages reach, with the probability with which each alone reaches its own of `lives`.

    lives: (carriages, ...). Weibull distributions of slope e = 1.5 (that of the reliability factor a1), independent of
    each other: the probabilities multiply, so L = (sum L_i^-e)^(-1/e).
    """
    values = np.asarray(lives, dtype=np.float64)
    shortest = values.min(axis=0)
    with np.errstate(invalid="ignore"):  # all lives may be infinite
        sums = np.sum((shortest / values) ** WEIBULL_SLOPE, axis=0)
    return np.asarray(np.where(np.isfinite(shortest), shortest * sums ** (-1.0 / WEIBULL_SLOPE), shortest))
