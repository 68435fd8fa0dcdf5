"""Estimates of the own unknowns of a data set: offset, friction, gain, delay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from guideload.identification.covariance import degrees_of_freedom
from guideload.identification.intervals import LEVEL
from guideload.identification.measured import Measured, OwnUnknown
from guideload.identification.result import Identification


@dataclass(frozen=True)
class OwnEstimate:
    """An own unknown of a data set, its most probable value, and the interval with a probability of 95 %, in SI."""

    unknown: OwnUnknown
    value: float
    low: float
    high: float


def own_estimates(found: Identification, data: Measured) -> tuple[OwnEstimate, ...]:
    """Those of one of the data sets of an identification."""
    objective, index = found.fit.objective, found.data.index(data)
    values = objective.own_of(found.fit.minimum.x)[index]
    first = objective.p + sum(len(each.own) for each in found.data[:index])
    here = slice(first, first + values.size)
    degrees = degrees_of_freedom(found.fit, found.covariance)[here]
    reach = (
        student.ppf(0.5 + 0.5 * LEVEL, degrees)
        * np.sqrt(np.diag(found.covariance)[here])
        * objective.units[here]
    )
    ends = np.clip([values - reach, values + reach], *np.array([one.bounds for one in data.own]).T)
    rows = zip(data.own, values.tolist(), *ends.tolist(), strict=True)
    return tuple(OwnEstimate(*row) for row in rows)
