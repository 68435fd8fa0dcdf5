"""The fit: the most probable machine under all measured data, from several starts.

It minimises the residuals of all data and of what was known before, with exact derivatives. The stiffness of a
nonlinear machine jumps where a contact opens or a row carries no load, so the sum of squares has several valleys,
some narrower than the distance of the starts. A walk from a minimum holds one unknown at growing distances and fits
the others; where the sum of squares falls, or grows much less than that of a linear fit, another valley is near.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2, qmc

from guideload.base.arrays import Array, Flags, Indices
from guideload.base.errors import ArgumentError, SceneError
from guideload.base.number_text import counted
from guideload.identification.measured import Measured, NuisanceParameter
from guideload.identification.model import Model
from guideload.identification.records import Record, inflation, score_root
from guideload.identification.unknowns import Unknown

# ---- the function that a fit minimises


FINE = 1e-10  # relative change of the sum of squares and of the coordinates at which a search ends
COARSE = 1e-4  # the same of a search that only finds which minimum a start leads to
FEW_STEPS = 25  # of such a search
MOST_STEPS = 100
FAR = 1e6  # residual of an impossible machine: far beyond any noise


@dataclass(frozen=True, eq=False)
class Minimum:
    """A minimum of the sum of squares, or the start of a search for one."""

    x: Array  # (p + q,) coordinates as in `Objective`
    squares: float = np.inf  # the sum of squares there
    converged: bool = False  # whether the search had converged
    starts: int = 1  # number of starts that led to it


class Objective:
    """Half the sum of squares is minus the logarithm of the posterior density, but for a constant.

    Its coordinates x (p + q,): z of the p unknowns, then the q nuisance parameters of the data in their scales.

    factors      (groups,) on the stated noise of each group of values
    noise        (groups,) the groups; noise_index: (n,) the one of each value of the data
    rows, groups, columns  of each data set: its values, its groups of noise, its nuisance parameters
    expected     (p + q,) before the data; weights: 1 over the standard deviations before the data
    """

    def __init__(self, model: Model, data: Sequence[Measured], factors: Array | None = None) -> None:
        """factors: by default 1."""
        self.model, self.data = model, tuple(data)
        self.p = len(model.unknowns)
        nuisance, self.columns = _nuisance(data, self.p)
        self.units = np.concatenate([np.ones(self.p), [one.scale for one in nuisance]])
        known: list[Unknown | NuisanceParameter] = [*model.unknowns, *nuisance]
        self.bounds = np.array([one.bounds for one in known]).T / self.units
        self.expected = np.array([one.expected for one in known]) / self.units
        self.weights = self.units / np.array([one.spread for one in known])
        self.noise = tuple(one for each in data for one in each.noise)
        self.factors = np.ones(len(self.noise)) if factors is None else factors
        self.rows = _slices(each.noise_index.size for each in data)
        self.groups = _slices(len(each.noise) for each in data)
        starts = (each.noise_index + group.start for each, group in zip(data, self.groups, strict=True))
        self.noise_index = np.concatenate(list(starts))
        self._last: tuple[Array, Array, Array] | None = None

    def at_bound(self, x: Array) -> Flags:
        """Which coordinates (p + q,) lie at a bound of their search."""
        low, high = self.bounds
        near = 1e-6 / self.weights  # of the spread before the data
        return np.asarray((x <= low + near) | (x >= high - near))

    def nuisance_values(self, x: Array) -> list[Array]:
        """The nuisance parameters of each data set, in SI."""
        return [(x * self.units)[columns] for columns in self.columns]

    def of_data(self, x: Array) -> tuple[Array, Array]:
        """Residuals (n,) of the data alone, and their derivatives (n, p + q) by x."""
        if self._last is None or not np.array_equal(self._last[0], x):
            self._last = x.copy(), *self._computed(x)
        return self._last[1], self._last[2]

    def slopes(self, x: Array) -> Array:
        """Derivatives (n + p + q, p + q) by x of all residuals: of the data, then of what was known before."""
        return np.vstack([self.of_data(x)[1], np.diag(self.weights)])

    def covariance(self, x: Array) -> Array:
        """(p + q, p + q) inverse of half the second derivative of the sum of squares: for independent errors."""
        inverse = np.linalg.inv(np.linalg.qr(self.slopes(x), mode="r"))
        return np.asarray(inverse @ inverse.T)

    def _computed(self, x: Array) -> tuple[Array, Array]:
        values, slopes = np.full(self.noise_index.size, FAR), np.zeros((self.noise_index.size, x.size))
        try:
            model = self.model.at(x[: self.p])
        except SceneError:  # a machine that nobody measured: the search turns back
            return values, slopes
        places = zip(self.data, self.nuisance_values(x), self.rows, self.columns, strict=True)
        for each, nuisance, rows, columns in places:
            part = each.residuals(model, nuisance)
            values[rows], slopes[rows, : self.p] = part.values, part.by_unknowns
            slopes[rows, columns] = part.by_nuisance * self.units[columns]
        scale = self.factors[self.noise_index]
        return values / scale, slopes / scale[:, None]

    def search(self, start: Array, held: Sequence[int] = (), tolerance: float = FINE) -> Minimum:
        """The minimum that a search from `start` reaches; coordinates with an index in `held` keep their value.

        SciPy takes its first step and its tolerance from the size of what it varies: so that they do not depend on the
        zero of a clock, the moving coordinates are counted from a point one unit below the start. It gets the
        triangular factor R of derivatives and residuals side by side, which has the same sums of products in few rows.
        The singular value decomposition of all rows takes seven times as long as all else.
        """
        moving = np.setdiff1d(np.arange(start.size), held)
        x: Array = np.clip(start, *self.bounds)
        unit = 1.0 / np.maximum(self.weights, 1.0)[moving]
        origin = x[moving] - unit
        low, high = self.bounds[:, moving] - origin
        point, factor = np.empty(0), np.empty((0, 0))  # the last point, and R there

        def placed(part: Array) -> Array:
            x[moving] = origin + part
            return x

        def triangle(part: Array) -> Array:
            nonlocal point, factor
            x = placed(part)
            if not np.array_equal(point, x):
                before: Array = self.weights * (x - self.expected)
                last = np.concatenate([self.of_data(x)[0], before])
                rows = np.column_stack([self.slopes(x)[:, moving], last])
                point, factor = x.copy(), np.asarray(np.linalg.qr(rows, mode="r"))
            return factor

        def residuals(part: Array) -> Array:
            return triangle(part)[:, -1]

        def jacobian(part: Array) -> Array:
            return triangle(part)[:, :-1]

        found = least_squares(
            residuals,
            np.clip(unit, low, high),  # by rounding a start at a bound may be beyond it
            jacobian,
            (low, high),
            x_scale="jac",
            ftol=tolerance,
            xtol=tolerance,
            gtol=tolerance,
            max_nfev=MOST_STEPS if tolerance < COARSE else FEW_STEPS,
        )
        return Minimum(placed(found.x).copy(), 2.0 * float(found.cost), bool(found.status > 0))


def _slices(counts: Iterable[int]) -> list[slice]:
    """Ranges of these sizes, one behind the other."""
    return [slice(start, end) for start, end in pairwise(accumulate(counts, initial=0))]


def _nuisance(data: Sequence[Measured], first: int) -> tuple[list[NuisanceParameter], list[Indices]]:
    """The nuisance parameters of all data, and of each data set the indices of its own, counted from `first`.

    A number of the machine, such as its friction, is one parameter of all data sets that show it.
    """
    found: dict[str, NuisanceParameter] = {}  # by key, else by data set and place in it
    columns: list[Indices] = []
    for i, each in enumerate(data):
        names = [one.key or f"{i} {k}" for k, one in enumerate(each.nuisance)]
        for name, one in zip(names, each.nuisance, strict=True):
            found.setdefault(name, one)
        places = list(found)
        columns.append(first + np.array([places.index(name) for name in names], dtype=np.intp))
    return list(found.values()), columns


# ---- walks into other valleys


STEPS = (1.0, 2.0, *(3.0 * 1.5**k for k in range(16)))  # standard deviations of the linear fit
FURTHEST = 1.0  # spreads before the data at which a walk ends; at a kink the standard deviation says little
LOWER = 0.5  # of the increase of a linear fit, below which the walk is in another valley


def other_valleys(objective: Objective, minimum: Minimum) -> Iterator[Array]:
    """Starts of searches in other valleys around a minimum."""
    best, covariance = minimum.x, objective.covariance(minimum.x)
    for index in range(objective.p):
        sigma = float(np.sqrt(covariance[index, index]))
        furthest = FURTHEST / float(objective.weights[index])
        for side in (-1.0, 1.0):
            x, before, last = best, minimum.squares, 0.0
            for step in STEPS:
                held = best[index] + side * step * sigma
                inside = objective.bounds[0, index] < held < objective.bounds[1, index]
                if not inside or step * sigma > furthest:
                    break
                start = x + side * (step - last) / sigma * covariance[:, index]
                start[index] = held
                end = objective.search(start, held=[index], tolerance=COARSE)
                if step > 1.0 and (end.squares < before or end.squares - minimum.squares < LOWER * step**2):
                    yield end.x
                x, before, last = end.x, end.squares, step


# ---- the fit


STARTS = 8
MORE = 4  # times as many for a nonlinear machine: its stiffness jumps where a contact opens, which stops a search
REACH = 1.5  # spreads around the expected values within which the other starts are taken
ROUNDS = 20  # of noise levels, and of pairing
SETTLED = 1e-3  # relative change of a noise level that ends the rounds
STATED_VALUES = 3.0  # values that a stated but not known level of noise is worth
LEAST = 1e-4  # estimated over stated noise: exact values, as of a simulation, would have none
APART = 0.2  # standard deviations by which different minima differ at least
NEAR = 100.0  # excess of the sum of squares above which the exact place of a minimum does not matter
ALIKE = 1.0  # standard deviations between the ends of coarse searches that go on to one minimum
# Excess of the sum of squares, two standard deviations, of a minimum that explains the data as well.
AS_GOOD = 4.0


@dataclass(frozen=True, eq=False)
class Fit:
    """The best fit of p unknowns of the machine and q nuisance parameters of the data."""

    objective: Objective
    minimum: Minimum  # the best one
    others: tuple[Minimum, ...]  # further ones that explain the data about as well
    searches: int  # number of starts
    messages: tuple[str, ...]  # in words, what may be wrong with the search
    residuals: Array  # (n,) of the data, in standard deviations of the noise, as stated or as estimated
    jacobian: Array  # (n, p + q) derivatives of the residuals by the coordinates

    @cached_property
    def covariance(self) -> Array:
        """(p + q, p + q) of the coordinates, for independent errors."""
        return self.objective.covariance(self.minimum.x)

    @cached_property
    def free_values(self) -> Array:
        """(groups,) values of each group of noise, less the unknowns that they determine."""
        return _free_values(self.objective, self.minimum.x)


def fit(model: Model, data: Sequence[Measured], starts: int = STARTS) -> Fit:
    """The fit of a model to measured data.

    Raises ArgumentError without data, and SceneError for a machine that its links do not support.
    """
    if not data:
        raise ArgumentError("identify: expected measured data, got none")
    is_linear = model.machine.model_level == "linear"
    starts *= 1 if is_linear else MORE
    expected = model.at(np.array([one.expected for one in model.unknowns]))
    data = [each.prepared_for(expected, np.array([one.expected for one in each.nuisance])) for each in data]
    minima = [Minimum(start) for start in _starts(Objective(model, data), starts)]
    for _ in range(ROUNDS):
        objective, minima, messages = _searched(model, data, minima)
        if not is_linear:
            minima = _with_valleys(objective, minima)
        best = minima[0]
        here = model.at(best.x[: objective.p])
        owns = objective.nuisance_values(best.x)
        prepared = [each.prepared_for(here, nuisance) for each, nuisance in zip(data, owns, strict=True)]
        if all(new is old for new, old in zip(prepared, data, strict=True)):
            break
        data = prepared
    else:
        messages.append(f"the data as they are used had not settled after {ROUNDS} rounds")
    if not best.converged:
        messages.append("the search had not converged: the numbers are not those of the best fit")
    others = tuple(one for one in minima[1:] if one.squares < best.squares + AS_GOOD)
    if others:
        messages.append(
            f"{counted(len(others), 'other machine')} would explain the data about as well: fix what you know, or "
            "measure more"
        )
    messages += [
        f"{one.name} lies at a bound of its search, so it is not identified: check the data, or widen at_least and "
        "at_most"
        for one, at_bound in zip(model.unknowns, objective.at_bound(best.x)[: objective.p], strict=True)
        if at_bound
    ]
    residuals, jacobian = objective.of_data(best.x)
    if np.any(abs(residuals) >= FAR):
        raise ArgumentError("identify: no possible machine was found near the expected values")
    return Fit(objective, best, others, starts, tuple(messages), residuals, jacobian)


def _searched(
    model: Model, data: Sequence[Measured], starts: Sequence[Minimum]
) -> tuple[Objective, list[Minimum], list[str]]:
    """All minima that were found, the best first, with noise levels that agree with the best one; and messages."""
    objective = Objective(model, data)
    minima = _minima(objective, starts)
    if all(one.known for one in objective.noise) and not any(isinstance(each, Record) for each in data):
        return objective, minima, []
    for _ in range(ROUNDS):
        factors = _noise(objective, minima[0].x)
        if np.all(abs(factors / objective.factors - 1.0) < SETTLED):
            return objective, minima, []
        objective = Objective(model, data, factors)
        minima = _minima(objective, minima)
    return objective, minima, [f"the estimated noise had not settled after {ROUNDS} rounds"]


def _with_valleys(objective: Objective, minima: list[Minimum]) -> list[Minimum]:
    """The minima with those in other valleys around them."""
    walked: list[Minimum] = []
    for _ in range(ROUNDS):
        good = [one for one in minima if one.squares < minima[0].squares + AS_GOOD]
        new = [one for one in good if all(abs(one.squares - other.squares) > SETTLED for other in walked)]
        if not new:
            break
        walked += new
        beside = [Minimum(start, starts=0) for one in new for start in other_valleys(objective, one)]
        minima = _minima(objective, [*minima, *beside])
    return minima


def _starts(objective: Objective, count: int) -> Array:
    """(count, p + q) the expected values, then points around them that cover the space evenly."""
    p = objective.p
    power = int(np.ceil(np.log2(count + 1)))
    points = 2.0 * qmc.Sobol(p, scramble=False).random_base2(power)[1:count] - 1.0
    around = np.tile(objective.expected, (count, 1))
    around[1:, :p] += REACH * points / objective.weights[:p]
    return around


def _minima(objective: Objective, starts: Sequence[Minimum]) -> list[Minimum]:
    """The different minima that searches from these starts reach, the best first."""
    coarse = [replace(objective.search(one.x, tolerance=COARSE), starts=one.starts) for one in starts]
    distinct = _distinct(objective, coarse, ALIKE)
    near = distinct[0].squares + NEAR
    fine = [
        replace(objective.search(one.x), starts=one.starts) if one.squares < near else one for one in distinct
    ]
    return _distinct(objective, fine, APART)


def _distinct(objective: Objective, minima: Sequence[Minimum], apart: float) -> list[Minimum]:
    """The minima, the best first, without those nearer than `apart` [standard deviations] to a better one."""
    distinct: list[Minimum] = []
    for one in sorted(minima, key=lambda one: one.squares):
        slopes = objective.slopes(one.x)
        for i, other in enumerate(distinct):
            if np.linalg.norm(slopes @ (one.x - other.x)) < apart:
                distinct[i] = replace(other, starts=other.starts + one.starts)
                break
        else:
            distinct.append(one)
    return distinct


def _free_values(objective: Objective, x: Array) -> Array:
    """(groups,) number of values less the unknowns that they determine: the trace of 1 - J (J'J + W^2)^-1 J'."""
    index = objective.noise_index
    root = np.linalg.qr(objective.slopes(x))[0][: index.size]
    left = 1.0 - (root**2).sum(axis=1)
    return np.bincount(index, left, minlength=objective.factors.size).astype(np.float64)


def _noise(objective: Objective, x: Array) -> Array:
    """(groups,) factors on the stated noise that agree with the residuals.

    A stated level that is not known counts as much as `STATED_VALUES` values, so that few residuals that happen to be
    small do not make all intervals small. If it is outside the 99 % interval that the residuals alone give, the nearer
    end of this counts instead. The level of a record in time is raised as much as its serial errors raise the variance
    of what it determines, so that it has the right weight beside other data.
    """
    (values, slopes), free, index = objective.of_data(x), _free_values(objective, x), objective.noise_index
    squares = np.bincount(index, (objective.factors[index] * values) ** 2, minlength=free.size)
    low, high = (squares / chi2.ppf(end, np.maximum(free, 1.0)) for end in (0.995, 0.005))
    stated = np.where(free < 1.0, 1.0, np.clip(1.0, low, high))
    variances = np.maximum((STATED_VALUES * stated + squares) / (STATED_VALUES + free), LEAST**2)
    factors = np.where([one.known for one in objective.noise], 1.0, np.sqrt(variances))
    scale = objective.factors[index] / factors[index]
    for each, rows, groups in zip(objective.data, objective.rows, objective.groups, strict=True):
        if isinstance(each, Record):
            of_set, by = values[rows] * scale[rows], slopes[rows] * scale[rows, None]
            raised = inflation(by.T @ by, score_root(each, of_set, by, factors[index[rows]]))
            factors[groups] *= np.sqrt(max(1.0, raised))
    return factors
