"""Intervals of the unknowns: from the covariance where the fit is nearly linear, else from the likelihood profile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t as student

from guideload.base.arrays import Array
from guideload.identification.fit import Fit, Minimum
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


def quantile_of(degrees: float) -> float:
    """Standard deviations to either side that hold 95 % of a t distribution."""
    return float(student.ppf(0.5 + 0.5 * LEVEL, degrees))


def interval(fit: Fit, index: int, sigma: float, degrees: float, widening: float = 1.0) -> Interval:
    """The interval of a coordinate whose standard deviation is sigma.

    widening: sigma over that of independent errors, by which serial errors of records widen the profile as well.
    Around every other minimum that explains the data as well it holds what the sum of squares there allows.
    """
    best, objective = fit.minimum, fit.objective
    center, quantile = float(best.x[index]), quantile_of(degrees)
    bounds = objective.bounds[:, index]
    before = 1.0 / float(objective.weights[index])
    if sigma > IDENTIFIED * before:  # unless the profile is far steeper than the covariance says
        least = IDENTIFIED * quantile * before
        if not all(_Root(fit, best, index, side, widening)(least) > quantile for side in (-1.0, 1.0)):
            low, high = np.clip([center - quantile * sigma, center + quantile * sigma], *bounds).tolist()
            return Interval(low, high, sigma / before, False, degrees)
    low, high, profile = _ends(fit, best, index, sigma, quantile, widening)
    for other in fit.others:
        if other.squares - best.squares < (quantile * widening) ** 2:
            here = widening * _independent_sigma(fit, other, index)
            ends = _ends(fit, other, index, here, quantile, widening)
            low, high, profile = min(low, ends[0]), max(high, ends[1]), True
    spread = 0.5 * (high - low) / quantile if profile else sigma
    return Interval(low, high, spread / before, profile, degrees)


def _ends(
    fit: Fit, minimum: Minimum, index: int, sigma: float, quantile: float, widening: float
) -> tuple[float, float, bool]:
    """Ends of the interval around a minimum, and whether one of them is from the profile.

    They are where the sum of squares exceeds that of the best fit by the square of the quantile.
    """
    center, bounds = float(minimum.x[index]), fit.objective.bounds[:, index]
    excess = (minimum.squares - fit.minimum.squares) / widening**2
    linear = sigma * float(np.sqrt(quantile**2 - excess))
    ends, profile = [center - linear, center + linear], False
    for i, side in enumerate((-1.0, 1.0)):
        root = _Root(fit, minimum, index, side, widening)
        reach = abs(float(np.clip(ends[i], *bounds)) - center)
        if reach == 0.0 or abs(root(reach) / np.hypot(reach / sigma, np.sqrt(excess)) - 1.0) <= CURVED:
            continue
        profile = True
        furthest = min(abs(bounds[i] - center), FURTHEST * quantile * sigma)
        if root(furthest) <= quantile:
            ends[i] = center + side * furthest
        else:
            ends[i] = center + side * _crossing(root, quantile, furthest, sigma)
    low, high = np.clip(ends, *bounds).tolist()
    return low, high, profile


def _independent_sigma(fit: Fit, minimum: Minimum, index: int) -> float:
    """Standard deviation of a coordinate at a minimum, for independent errors."""
    slopes = np.vstack([fit.objective.of_data(minimum.x)[1], np.diag(fit.objective.weights)])
    return float(np.sqrt(np.linalg.inv(slopes.T @ slopes)[index, index]))


def _crossing(root: _Root, quantile: float, furthest: float, sigma: float) -> float:
    """The distance at which the root reaches the quantile, to a hundredth of sigma."""
    return float(brentq(lambda distance: root(distance) - quantile, 0.0, furthest, xtol=0.01 * sigma))


class _Root:
    """Square root of the excess of the sum of squares over the best fit's, at a distance from one of the minima.

    One coordinate is held there, and the others are fitted. Divided by what serial errors widen.
    """

    def __init__(self, fit: Fit, minimum: Minimum, index: int, side: float, widening: float) -> None:
        self.fit, self.index, self.side, self.widening = fit, index, side, widening
        self.center = float(minimum.x[index])
        self.known: dict[float, tuple[float, Array]] = {0.0: (self._root(minimum.squares), minimum.x)}

    def __call__(self, distance: float) -> float:
        if distance not in self.known:
            near = min(self.known, key=lambda d: abs(d - distance))
            start = self.known[near][1].copy()
            start[self.index] = self.center + self.side * distance
            end = self.fit.objective.search(start, held=[self.index], tolerance=COARSE)
            self.known[distance] = self._root(end.squares), end.x
        return self.known[distance][0]

    def _root(self, squares: float) -> float:
        return float(np.sqrt(max(squares - self.fit.minimum.squares, 0.0))) / self.widening
