"""Intervals of the unknowns: from the covariance where the fit is nearly linear, else from the likelihood profile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t as student

from guideload.base.arrays import Array
from guideload.identification.fit import Fit
from guideload.identification.objective import COARSE

LEVEL = 0.95
NORMAL_QUANTILE = (
    1.959964  # standard deviations of a normal distribution to either side that have this probability
)
CURVED = 0.15  # relative difference of the profile from a parabola's width above which the profile gives the interval
IDENTIFIED = 0.5  # spread after the data over the one before, above which the data do not determine a number
FURTHEST = 4.0  # of the linear half-widths at which the search for the end of a profile interval ends


@dataclass(frozen=True, eq=False)
class Interval:
    """The interval of one coordinate with a probability of 95 %.

    low, high  its ends; the coordinate may reach its bounds
    narrowed   spread after the data over the one before: 1 if they say nothing about it
    profile    whether it is from the likelihood profile, because the one from the covariance is not good
    degrees    of freedom of its t distribution; inf where all noise is known
    """

    low: float
    high: float
    narrowed: float
    profile: bool
    degrees: float

    @property
    def is_identified(self) -> bool:
        """Whether the data determine this coordinate: its spread is at most half of the one before."""
        return self.narrowed <= IDENTIFIED


def quantile(degrees: float) -> float:
    """Standard deviations to either side that hold 95 % of a t distribution."""
    return float(student.ppf(0.5 + 0.5 * LEVEL, degrees))


def interval(fit: Fit, index: int, sigma: float, degrees: float, widening: float = 1.0) -> Interval:
    """The interval of a coordinate whose standard deviation is sigma.

    widening: sigma over that of independent errors, by which serial errors of records widen the profile as well.
    """
    best, objective = float(fit.minimum.x[index]), fit.objective
    quantile = float(student.ppf(0.5 + 0.5 * LEVEL, degrees))
    ends = [best - quantile * sigma, best + quantile * sigma]
    bounds = objective.bounds[:, index]
    before = 1.0 / float(objective.weights[index])
    if sigma > IDENTIFIED * before:  # unless the profile is far steeper than the covariance says
        least = IDENTIFIED * quantile * before
        if not all(_Root(fit, index, side, widening)(least) > quantile for side in (-1.0, 1.0)):
            low, high = np.clip(ends, *bounds).tolist()
            return Interval(low, high, sigma / before, False, degrees)
    profile = False
    for i, side in enumerate((-1.0, 1.0)):
        root = _Root(fit, index, side, widening)
        reach = abs(float(np.clip(ends[i], *bounds)) - best)
        if reach == 0.0 or abs(root(reach) * sigma / reach - 1.0) <= CURVED:
            continue
        profile = True
        furthest = min(abs(bounds[i] - best), FURTHEST * quantile * sigma)
        if root(furthest) <= quantile:
            ends[i] = best + side * furthest
        else:
            ends[i] = best + side * _crossing(root, quantile, furthest, sigma)
    low, high = np.clip(ends, *bounds).tolist()
    spread = 0.5 * (high - low) / quantile if profile else sigma
    return Interval(low, high, spread / before, profile, degrees)


def _crossing(root: _Root, quantile: float, furthest: float, sigma: float) -> float:
    """The distance at which the root reaches the quantile, to a hundredth of sigma."""
    return float(brentq(lambda distance: root(distance) - quantile, 0.0, furthest, xtol=0.01 * sigma))


class _Root:
    """Square root of the increase of the sum of squares when a coordinate is held at a distance from the best fit.

    Divided by what serial errors widen.
    """

    def __init__(self, fit: Fit, index: int, side: float, widening: float) -> None:
        self.fit, self.index, self.side, self.widening = fit, index, side, widening
        self.known: dict[float, tuple[float, Array]] = {0.0: (0.0, fit.minimum.x)}

    def __call__(self, distance: float) -> float:
        if distance not in self.known:
            near = min(self.known, key=lambda d: abs(d - distance))
            start = self.known[near][1].copy()
            start[self.index] = self.fit.minimum.x[self.index] + self.side * distance
            end = self.fit.objective.search(start, held=[self.index], tolerance=COARSE)
            root = float(np.sqrt(max(end.squares - self.fit.minimum.squares, 0.0)))
            self.known[distance] = root / self.widening, end.x
        return self.known[distance][0]
