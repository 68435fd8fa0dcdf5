"""Uncertainty of the unknowns: covariance, intervals, and combinations that the data cannot determine.

Intervals are from the covariance where the fit is nearly linear, else from the likelihood profile.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t as student

from guideload.base.arrays import Array
from guideload.base.number_text import joined
from guideload.identification.fit import COARSE, STATED_VALUES, Fit, Minimum
from guideload.identification.records import Record, score_root
from guideload.identification.unknowns import Unknown, grouped_names, usual_unit

# ---- covariance


def covariance(fit: Fit) -> Array:
    """(p + q, p + q) of the coordinates after the data.

    H^-1 with H = J'J + W^2, W^2 from what was known before; with records in time H^-1 B H^-1, where B has the long-run
    covariance of their scores in place of their part of J'J.
    """
    objective = fit.objective
    if not any(isinstance(each, Record) for each in objective.data):
        return fit.covariance
    rows = [np.diag(objective.weights)]
    for each, place in zip(objective.data, objective.rows, strict=True):
        values, slopes = fit.residuals[place], fit.jacobian[place]
        level = objective.factors[objective.noise_index[place]]
        rows.append(score_root(each, values, slopes, level) if isinstance(each, Record) else slopes)
    spread = np.vstack(rows) @ fit.covariance
    return np.asarray(spread.T @ spread)


def marginal_information(by_unknowns: Array, by_nuisance: Array, weights: Array) -> Array:
    """Information (p, p) of data on the unknowns, whatever their nuisance parameters are.

    Parameters
    ----------
    by_unknowns : (n, p) derivatives of the residuals by the unknowns
    by_nuisance : (n, q) derivatives by the nuisance parameters
    weights : (q,) 1 over the standard deviations of the nuisance parameters before the data
    """
    found = by_unknowns.T @ by_unknowns
    if by_nuisance.shape[1]:
        known = by_nuisance.T @ by_nuisance + np.diag(weights**2)
        mixed = by_unknowns.T @ by_nuisance
        found = found - mixed @ np.linalg.pinv(known) @ mixed.T
    return np.asarray(0.5 * (found + found.T))


def degrees_of_freedom(fit: Fit, covariance: Array) -> Array:
    """(p + q) of the t distribution of each coordinate; inf where all noise is known (Satterthwaite's formula)."""
    noises = fit.objective.noise
    shares = np.zeros((len(noises), covariance.shape[0]))
    for i, noise in enumerate(noises):
        if not noise.known:
            rows = fit.jacobian[fit.objective.noise_index == i] @ covariance
            shares[i] = (rows**2).sum(axis=0)
    certain = fit.free_values + STATED_VALUES
    with np.errstate(divide="ignore"):
        return np.asarray(np.diag(covariance) ** 2 / (shares**2 / certain[:, None]).sum(axis=0))


# ---- intervals


LEVEL = 0.95
# Standard deviations of a normal distribution to either side that have this probability.
NORMAL_QUANTILE = 1.959964
CURVED = 0.15  # relative difference of the profile from a parabola's width above which the profile gives the interval
IDENTIFIED = 0.5  # spread after the data over the one before, above which the data do not determine a number
FURTHEST = 4.0  # of the linear half-widths at which the search for the end of a profile interval ends


@dataclass(frozen=True, eq=False)
class Interval:
    """The interval of one coordinate with a probability of 95 %.

    low, high  its ends; the coordinate may reach its bounds
    narrowed   standard deviation after the data over that before: 1 if they say nothing about it
    profile    whether it is from the likelihood profile, as the fit is not nearly linear
    """

    low: float
    high: float
    narrowed: float
    profile: bool

    @property
    def is_identified(self) -> bool:
        """Whether the data determine this coordinate: its spread is at most half of the one before."""
        return self.narrowed <= IDENTIFIED


def student_quantile(degrees: float | Array) -> Array:
    """Standard deviations to either side that hold 95 % of t distributions."""
    return np.asarray(student.ppf(0.5 + 0.5 * LEVEL, degrees))


def intervals(fit: Fit, covariance: Array) -> tuple[Interval, ...]:
    """The intervals of the unknowns of the machine."""
    sigma, degrees = np.sqrt(np.diag(covariance)), degrees_of_freedom(fit, covariance)
    inflation = sigma / np.sqrt(np.diag(fit.covariance))
    each = zip(sigma.tolist(), degrees.tolist(), inflation.tolist(), strict=True)
    return tuple(interval(fit, i, *one) for i, one in enumerate(islice(each, fit.objective.p)))


def interval(fit: Fit, index: int, sigma: float, degrees: float, inflation: float = 1.0) -> Interval:
    """The interval of a coordinate whose standard deviation is sigma.

    inflation: sigma over that of independent errors: serial errors of records widen the profile as well. The interval
    holds those around all minima that explain the data about as well. A value at a bound of its search is not
    identified.
    """
    best, objective = fit.minimum, fit.objective
    center, quantile = float(best.x[index]), float(student_quantile(degrees))
    bounds = objective.bounds[:, index]
    before = 1.0 / float(objective.weights[index])
    if objective.at_bound(best.x)[index]:  # the data ask for a value beyond it
        low, high = np.clip([center - quantile * before, center + quantile * before], *bounds).tolist()
        return Interval(low, high, 1.0, False)
    if sigma > IDENTIFIED * before:  # unless the profile is far steeper than the covariance says
        least = IDENTIFIED * quantile * before
        if not all(_ProfileT(fit, best, index, side, inflation)(least) > quantile for side in (-1.0, 1.0)):
            low, high = np.clip([center - quantile * sigma, center + quantile * sigma], *bounds).tolist()
            return Interval(low, high, sigma / before, False)
    low, high, profile = _ends(fit, best, index, sigma, quantile, inflation)
    for other in fit.others:
        if other.squares - best.squares < (quantile * inflation) ** 2:
            here = inflation * float(np.sqrt(objective.covariance(other.x)[index, index]))
            ends = _ends(fit, other, index, here, quantile, inflation)
            low, high, profile = min(low, ends[0]), max(high, ends[1]), True
    spread = 0.5 * (high - low) / quantile if profile else sigma
    return Interval(low, high, spread / before, profile)


def _ends(
    fit: Fit, minimum: Minimum, index: int, sigma: float, quantile: float, inflation: float
) -> tuple[float, float, bool]:
    """Ends of the interval around a minimum, and whether one of them is from the profile.

    They are where the sum of squares exceeds that of the best fit by the square of the quantile.
    """
    center, bounds = float(minimum.x[index]), fit.objective.bounds[:, index]
    excess = (minimum.squares - fit.minimum.squares) / inflation**2
    linear = sigma * float(np.sqrt(quantile**2 - excess))
    ends, profile = [center - linear, center + linear], False
    for i, side in enumerate((-1.0, 1.0)):
        root = _ProfileT(fit, minimum, index, side, inflation)
        reach = abs(float(np.clip(ends[i], *bounds)) - center)
        if reach == 0.0 or abs(root(reach) / np.hypot(reach / sigma, np.sqrt(excess)) - 1.0) <= CURVED:
            continue
        profile = True
        furthest = min(abs(bounds[i] - center), FURTHEST * quantile * sigma)
        if root(furthest) <= quantile:
            ends[i] = center + side * furthest
        else:
            crossing = brentq(lambda d, root=root: root(d) - quantile, 0.0, furthest, xtol=0.01 * sigma)
            ends[i] = center + side * float(crossing)
    low, high = np.clip(ends, *bounds).tolist()
    return low, high, profile


class _ProfileT:
    """Profile t at a distance from a minimum: the signed root of the likelihood ratio, with one coordinate held there.

    That is the root of the sum of squares less that of the best fit, over the inflation by serial errors.
    """

    def __init__(self, fit: Fit, minimum: Minimum, index: int, side: float, inflation: float) -> None:
        self.fit, self.index, self.side, self.inflation = fit, index, side, inflation
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
        return float(np.sqrt(max(squares - self.fit.minimum.squares, 0.0))) / self.inflation


# ---- directions that the data cannot determine, in words such as "k_y of 1 and 2: only their sum"


LEAST_INFORMATION = 3.0  # of a determined direction: it halves what was uncertain before
LINKED = 0.1  # share of an undetermined direction from which on unknowns belong together
SUM = "only their sum"
EQUAL = 0.1  # relative difference of coefficients that are called equal


@dataclass(frozen=True)
class Undetermined:
    """Unknowns of which the data determine fewer combinations than there are."""

    names: tuple[str, ...]  # of the unknowns
    combinations: int  # how many the data determine
    words: str  # in words


def undetermined(fit: Fit, covariance: Array) -> tuple[Undetermined, ...]:
    """The groups of unknowns, and of nuisance parameters of one data set, that the data do not separate.

    covariance: (p + q, p + q) of the coordinates. Of the one combination that is determined the words give the value.
    """
    return (*_undetermined_unknowns(fit, covariance), *_undetermined_nuisance(fit, covariance))


def _undetermined_unknowns(fit: Fit, covariance: Array) -> Iterator[Undetermined]:
    """Groups of unknowns of the machine."""
    unknowns, z, weights = fit.objective.model.unknowns, fit.minimum.x, fit.objective.weights
    p = len(unknowns)
    by_unknowns = fit.jacobian[:, :p] / weights[:p]
    information = marginal_information(by_unknowns, fit.jacobian[:, p:], weights[p:])
    for group, determined, direction in _undetermined_groups(information):
        words = _words(unknowns, z, group, determined, direction)
        if words.endswith(SUM):
            value = sum(unknowns[i].value(z[i]) for i in group)
            slopes = np.array([unknowns[i].slope(z[i]) for i in group])
            words += _sum(value, slopes, covariance[np.ix_(group, group)], unknowns[group[0]].unit)
        yield Undetermined(tuple(unknowns[i].name for i in group), determined, words)


def _undetermined_nuisance(fit: Fit, covariance: Array) -> Iterator[Undetermined]:
    """Groups of nuisance parameters, as friction and offset."""
    objective = fit.objective
    weights, values = objective.weights, fit.minimum.x * objective.units
    for data, own in zip(objective.data, objective.columns, strict=True):
        others = np.delete(np.arange(values.size), own)
        by_own = fit.jacobian[:, own] / weights[own]
        information = marginal_information(by_own, fit.jacobian[:, others], weights[others])
        for group, determined, direction in _undetermined_groups(information):
            members, at = [data.nuisance[i] for i in group], own[group]
            names = [one.name for one in members]
            words = _none_or_several(joined(names), len(group), determined)
            if determined == 1 and len(group) > 1:
                factors = direction * weights[at] / objective.units[at]
                factors /= factors[-1]  # the others as the last one is measured
                value, slopes = float(factors @ values[at]), factors * objective.units[at]
                sum_in_words = _sum(value, slopes, covariance[np.ix_(at, at)], members[-1].unit)
                terms = " ".join(f"{f:+.3g} {name}" for f, name in zip(factors[:-1], names, strict=False))
                are_equal = np.allclose(factors, 1.0, rtol=EQUAL)
                total = SUM if are_equal else f"only {terms.removeprefix('+')} + {names[-1]}"
                words = f"{joined(names)}: {total}{sum_in_words}"
            yield Undetermined(tuple(names), determined, words)


def _undetermined_groups(information: Array) -> Iterator[tuple[list[int], int, Array]]:
    """Groups of unknowns, how many combinations of each are determined, and the direction of the one that is.

    information: in units of what was known before, and so are the directions.
    """
    from scipy.sparse.csgraph import connected_components

    if not information.size:
        return
    sizes, vectors = np.linalg.eigh(information)
    weak = vectors[:, sizes < LEAST_INFORMATION]
    shares = weak @ weak.T
    label = connected_components(abs(shares) > LINKED, directed=False)[1]
    for i in range(label.max() + 1):
        group = np.flatnonzero(label == i).tolist()
        if shares[group, group].max() > LINKED:
            inside, directions = np.linalg.eigh(shares[np.ix_(group, group)])
            yield group, int((inside <= 0.5).sum()), directions[:, 0]


def _none_or_several(names: str, count: int, determined: int) -> str:
    """What is said of numbers of which the data determine no combination, or several."""
    if determined == 0:
        return f"{names}: these data say nothing about {'it' if count == 1 else 'them'}"
    return f"{names}: only {determined} combinations of these {count} numbers"


def _words(unknowns: Sequence[Unknown], z: Array, group: list[int], determined: int, direction: Array) -> str:
    names = grouped_names([unknowns[i].name for i in group])
    if determined != 1:
        return _none_or_several(names, len(group), determined)
    along = direction / [unknowns[i].spread for i in group]  # of the coordinates z
    by_value = along / [unknowns[i].slope(z[i]) for i in group]
    one_unit = len({unknowns[i].unit for i in group}) == 1
    if one_unit and _equal(by_value):
        return f"{names}: {SUM}"
    if len(group) == 2 and one_unit and _equal(by_value * [1.0, -1.0]):
        return f"{names}: only their difference"
    if _equal(along):
        return f"{names}: only their product"
    if len(group) == 2 and _equal(along * [1.0, -1.0]):
        return f"{names}: only their ratio"
    if one_unit:
        factors = by_value / by_value[np.argmax(abs(by_value))]
        terms = (f"{f:+.2g} {grouped_names([unknowns[i].name])}" for f, i in zip(factors, group, strict=True))
        return f"{names}: only {' '.join(terms).removeprefix('+')}"
    return f"{names}: only one combination of these {len(group)} numbers"


def _sum(value: float, slopes: Array, covariance: Array, unit: str) -> str:
    """Value of a sum and its 95 % interval, by its derivatives by the coordinates."""
    half = NORMAL_QUANTILE * float(np.sqrt(slopes @ covariance @ slopes))
    unit, scale = usual_unit(unit)
    return f", {scale * value:.4g} {unit} ({scale * (value - half):.4g} to {scale * (value + half):.4g})"


def _equal(numbers: Array) -> bool:
    return bool(np.ptp(numbers) <= EQUAL * abs(numbers).max())
