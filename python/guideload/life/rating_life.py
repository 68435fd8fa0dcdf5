"""Rating life (ISO 14728-1) of a carriage, and of several: the life that all reach with the same probability."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.rating import WEIBULL_SLOPE, Rating, reliability_factor


def effective_rating(rating: Rating, conditions: LifeConditions, contact_factor: float) -> float:
    """f_H f_T f_C C / f_W [N], the rating that the whole formula puts over the mean load."""
    factors = conditions.hardness_factor * conditions.temperature_factor * contact_factor
    return factors * rating.value / conditions.load_factor


def rating_life(
    rating: Rating, mean_load: float, conditions: LifeConditions, contact_factor: float = 1.0
) -> float:
    """The life [m] under a mean load [N]: a1 base (f_H f_T f_C C / (f_W P_m))^p; infinite without load."""
    rated = Rating(
        value=effective_rating(rating, conditions, contact_factor), base=rating.base, exponent=rating.exponent
    )
    return reliability_factor(conditions.reliability) * float(rated.life(mean_load))


def failure_probability(travel: float, life: float, reliability: float) -> float:
    """Probability of a failure before a travel [m]: Weibull distribution whose `life` [m] has this reliability."""
    return -math.expm1((travel / life) ** WEIBULL_SLOPE * math.log(reliability))


def system_life(lives: ArrayLike) -> float:
    """The life [m] that several carriages all reach with the probability for which each of `lives` [m] holds.

    Weibull distributions of slope e = 1.5 (that of the reliability factor a1), independent of each other: the
    probabilities multiply, so L = (sum L_i^-e)^(-1/e).
    """
    values = np.asarray(lives, dtype=np.float64)
    shortest = float(values.min())
    if not np.isfinite(shortest):
        return shortest
    return float(shortest * np.sum((shortest / values) ** WEIBULL_SLOPE) ** (-1.0 / WEIBULL_SLOPE))
