"""The fit: the most probable machine under all measured data, from several starts.

It minimises the residuals of all data and of what was known before, with exact derivatives. The stiffness of a
nonlinear machine jumps where a contact opens or a row carries no load, so the sum of squares has several valleys,
some narrower than the distance of the starts. A walk from a minimum holds one unknown at growing distances and fits
the others; where the sum of squares falls, or grows much less than that of a linear fit, another valley is near.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, SceneError
from guideload.base.number_text import counted
from guideload.identification.measured import Measured, Noise, NuisanceParameter
from guideload.identification.model import Model
from guideload.identification.records import inflation, score_root
from guideload.identification.unknowns import Unknown

# ---- the function that a fit minimises


FINE = 1e-10  # relative change of the sum of squares and of the coordinates at which a search ends
COARSE = 1e-4  # the same of a search that only finds which minimum a start leads to
FEW_STEPS = 25  # of such a search
MOST_STEPS = 100
FAR = 1e6  # residual of an impossible machine: far beyond any noise


class End(NamedTuple):
    """Where a search ended, the sum of squares there, and whether it had converged."""

    x: Array
    squares: float
    converged: bool


class Objective:
    """Half the sum of squares is minus the logarithm of the posterior density, but for a constant.

    Its coordinates x (p + q,): z of the p unknowns, then the q nuisance parameters of the data in their scales.

    factors   (groups,) on the stated noise of each group of values
    set_of    (n,) index of the data set of each value of the data; noise_index: of its group of noise
    expected  (p + q,) before the data; weights: 1 over the standard deviations before the data
    """

    def __init__(self, model: Model, data: Sequence[Measured], factors: Array) -> None:
        self.model, self.data, self.factors = model, tuple(data), factors
        nuisance = [one for each in data for one in each.nuisance]
        self.p = len(model.unknowns)
        self.units = np.concatenate([np.ones(self.p), [one.scale for one in nuisance]])
        known: list[Unknown | NuisanceParameter] = [*model.unknowns, *nuisance]
        self.bounds = np.array([one.bounds for one in known]).T / self.units
        self.expected = np.array([one.expected for one in known]) / self.units
        self.weights = self.units / np.array([one.spread for one in known])
        first = np.cumsum([0, *(len(each.noise) for each in data)])[:-1]
        groups = [each.noise_index + start for each, start in zip(data, first, strict=True)]
        self.noise_index = np.concatenate(groups)
        self.set_of = np.repeat(np.arange(len(data)), [group.size for group in groups])
        self._last: tuple[Array, Array, Array] | None = None

    def nuisance_values(self, x: Array) -> list[Array]:
        """The nuisance parameters of each data set, in SI."""
        counts = np.cumsum([len(each.nuisance) for each in self.data])[:-1]
        return list(np.split((x * self.units)[self.p :], counts))

    def of_data(self, x: Array) -> tuple[Array, Array]:
        """Residuals (n,) of the data alone, and their derivatives (n, p + q) by x."""
        if self._last is None or not np.array_equal(self._last[0], x):
            self._last = x.copy(), *self._computed(x)
        return self._last[1], self._last[2]

    def _computed(self, x: Array) -> tuple[Array, Array]:
        values, slopes = np.full(self.noise_index.size, FAR), np.zeros((self.noise_index.size, x.size))
        try:
            model = self.model.at(x[: self.p])
        except SceneError:  # a machine that nobody measured: the search turns back
            return values, slopes
        row, column = 0, self.p
        for each, nuisance in zip(self.data, self.nuisance_values(x), strict=True):
            part = each.residuals(model, nuisance)
            rows, columns = slice(row, row + part.values.size), slice(column, column + nuisance.size)
            values[rows], slopes[rows, : self.p] = part.values, part.by_unknowns
            slopes[rows, columns] = part.by_nuisance * self.units[columns]
            row, column = rows.stop, columns.stop
        scale = self.factors[self.noise_index]
        return values / scale, slopes / scale[:, None]

    def search(self, start: Array, held: Sequence[int] = (), tolerance: float = FINE) -> End:
        """The minimum that a search from `start` reaches; coordinates with an index in `held` keep their value.

        SciPy takes its first step and its tolerance from the size of what it varies: so that they do not depend on the
        zero of a clock, the moving coordinates are counted from a point one unit below the start.
        """
        moving = np.setdiff1d(np.arange(start.size), held)
        x: Array = np.clip(start, *self.bounds)
        unit = 1.0 / np.maximum(self.weights, 1.0)[moving]
        origin = x[moving] - unit
        low, high = self.bounds[:, moving] - origin

        def placed(part: Array) -> Array:
            x[moving] = origin + part
            return x

        def residuals(part: Array) -> Array:
            x = placed(part)
            before: Array = self.weights * (x - self.expected)
            return np.concatenate([self.of_data(x)[0], before])

        def jacobian(part: Array) -> Array:
            return np.asarray(np.vstack([self.of_data(placed(part))[1], np.diag(self.weights)])[:, moving])

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
        return End(placed(found.x).copy(), 2.0 * float(found.cost), bool(found.status > 0))


# ---- walks into other valleys


STEPS = (1.0, 2.0, *(3.0 * 1.5**k for k in range(16)))  # standard deviations of the linear fit
FURTHEST = 1.0  # spreads before the data at which a walk ends; at a kink the standard deviation says little
LOWER = 0.5  # of the increase of a linear fit, below which the walk is in another valley


def other_valleys(objective: Objective, best: Array, squares: float) -> Iterator[Array]:
    """Starts of searches in other valleys, around a minimum with this sum of squares."""
    slopes = np.vstack([objective.of_data(best)[1], np.diag(objective.weights)])
    covariance = np.linalg.inv(slopes.T @ slopes)
    for index in range(objective.p):
        sigma = float(np.sqrt(covariance[index, index]))
        furthest = FURTHEST / float(objective.weights[index])
        for side in (-1.0, 1.0):
            x, before, last = best, squares, 0.0
            for step in STEPS:
                held = best[index] + side * step * sigma
                inside = objective.bounds[0, index] < held < objective.bounds[1, index]
                if not inside or step * sigma > furthest:
                    break
                start = x + side * (step - last) / sigma * covariance[:, index]
                start[index] = held
                end = objective.search(start, held=[index], tolerance=COARSE)
                if step > 1.0 and (end.squares < before or end.squares - squares < LOWER * step**2):
                    yield end.x
                x, before, last = end.x, end.squares, step


# ---- the fit


STARTS = 8
MORE = 4  # times as many for a nonlinear machine: its stiffness jumps where a contact opens, which stops a search
REACH = 1.5  # spreads around the expected values within which the other starts are taken
ROUNDS = 20  # of noise levels, and of pairing
SETTLED = 1e-3  # relative change of a noise level that ends the rounds
STATED_VALUES = 3.0  # values that a stated but not known level of noise is worth
APART = 0.2  # standard deviations by which different minima differ at least
NEAR = 100.0  # excess of the sum of squares above which the exact place of a minimum does not matter
ALIKE = 1.0  # standard deviations between the ends of coarse searches that go on to one minimum
AS_GOOD = (
    4.0  # excess of the sum of squares, two standard deviations: such a minimum explains the data as well
)


@dataclass(frozen=True, eq=False)
class Minimum:
    """A minimum of the sum of squares: coordinates x (p + q,) as in `Objective`, the sum, and starts that led to it."""

    x: Array
    squares: float
    starts: int


@dataclass(frozen=True, eq=False)
class Fit:
    """The best fit, and the residuals linearised there: n values of data, p unknowns of the machine, q of the data.

    minimum      the best one; others: further ones that explain the data about as well
    residuals    (n,) in standard deviations of the noise, as stated or as estimated
    jacobian     (n, p + q) their derivatives by the coordinates
    free_values  (groups,) values of each group of noise, less the unknowns that they determine
    searches     number of starts
    messages     in words, what may be wrong with the search
    """

    objective: Objective
    minimum: Minimum
    others: tuple[Minimum, ...]
    residuals: Array
    jacobian: Array
    free_values: Array
    searches: int
    messages: tuple[str, ...]

    @property
    def stated_values(self) -> Array:
        """(groups,) values that the stated level of each estimated noise is worth."""
        return np.full(len(self.noise), STATED_VALUES)

    @property
    def noise(self) -> tuple[Noise, ...]:
        """All groups of noise."""
        return tuple(one for each in self.objective.data for one in each.noise)


def fit(model: Model, data: Sequence[Measured], starts: int = STARTS) -> Fit:
    """The fit of a model to measured data.

    Raises ArgumentError without data, and SceneError for a machine that its links do not support.
    """
    if not data:
        raise ArgumentError("identify: expected measured data, got none")
    starts *= 1 if model.machine.model_level == "linear" else MORE
    expected = model.at(np.array([one.expected for one in model.unknowns]))
    data = [each.settled(expected, np.array([one.expected for one in each.nuisance])) for each in data]
    messages: list[str] = []
    objective = Objective(model, data, np.ones(sum(len(each.noise) for each in data)))
    begin = [(start, 1) for start in _starts(objective, starts)]
    for _ in range(ROUNDS):
        messages.clear()
        objective, minima = _searched(model, data, begin, messages)
        if model.machine.model_level != "linear":
            minima = _with_valleys(objective, minima, messages)
        x = minima[0].x
        owns = objective.nuisance_values(x)
        settled = [
            each.settled(model.at(x[: objective.p]), nuisance)
            for each, nuisance in zip(data, owns, strict=True)
        ]
        if all(new is old for new, old in zip(settled, data, strict=True)):
            break
        data, begin = settled, [(one.x, one.starts) for one in minima]
    else:
        messages.append(f"the data as they are used had not settled after {ROUNDS} rounds")
    values, slopes = objective.of_data(x)
    others = tuple(one for one in minima[1:] if one.squares < minima[0].squares + AS_GOOD)
    if others:
        messages.append(
            f"{counted(len(others), 'other machine')} would explain the data about as well: fix what you know, or "
            "measure more"
        )
    if np.any(abs(values) >= FAR):
        raise ArgumentError("identify: no possible machine was found near the expected values")
    return Fit(
        objective, minima[0], others, values, slopes, _free_values(objective, x), starts, tuple(messages)
    )


def _searched(
    model: Model, data: Sequence[Measured], starts: Sequence[tuple[Array, int]], messages: list[str]
) -> tuple[Objective, list[Minimum]]:
    """All minima that were found, the best first, with noise levels that agree with the best one.

    starts: of the searches, each with its weight.
    """
    noise = [one for each in data for one in each.noise]
    objective = Objective(model, data, np.ones(len(noise)))
    minima = _minima(objective, starts, messages)
    if all(one.known for one in noise) and all(each.instants is None for each in data):
        return objective, minima
    for _ in range(ROUNDS):
        factors = _noise(objective, minima[0].x, noise)
        if np.all(abs(factors / objective.factors - 1.0) < SETTLED):
            break
        objective = Objective(model, data, factors)
        minima = _minima(objective, [(one.x, one.starts) for one in minima], messages)
    else:
        messages.append(f"the estimated noise had not settled after {ROUNDS} rounds")
    return objective, minima


def _with_valleys(objective: Objective, minima: list[Minimum], messages: list[str]) -> list[Minimum]:
    """The minima with those in other valleys around them."""
    walked: list[Minimum] = []
    for _ in range(ROUNDS):
        good = [one for one in minima if one.squares < minima[0].squares + AS_GOOD]
        new = [one for one in good if all(abs(one.squares - other.squares) > SETTLED for other in walked)]
        if not new:
            break
        walked += new
        beside = [(start, 0) for one in new for start in other_valleys(objective, one.x, one.squares)]
        minima = _minima(objective, [*((one.x, one.starts) for one in minima), *beside], messages)
    return minima


def _starts(objective: Objective, count: int) -> Array:
    """(count, p + q) the expected values, then points around them that cover the space evenly."""
    p = objective.p
    power = int(np.ceil(np.log2(count + 1)))
    points = 2.0 * qmc.Sobol(p, scramble=False).random_base2(power)[1:count] - 1.0
    around = np.tile(objective.expected, (count, 1))
    around[1:, :p] += REACH * points / objective.weights[:p]
    return around


def _minima(objective: Objective, starts: Sequence[tuple[Array, int]], messages: list[str]) -> list[Minimum]:
    """The different minima that searches from these starts reach, the best first; each start with its weight."""
    coarse = [(objective.search(start, tolerance=COARSE), weight) for start, weight in starts]
    distinct = _distinct(objective, coarse, ALIKE)
    near = distinct[0][0].squares + NEAR
    fine = [(objective.search(end.x) if end.squares < near else end, weight) for end, weight in distinct]
    distinct = _distinct(objective, fine, APART)
    if not distinct[0][0].converged:
        messages.append("the search had not converged: the numbers are not those of the best fit")
    return [Minimum(end.x, end.squares, count) for end, count in distinct]


def _distinct(objective: Objective, ends: Sequence[tuple[End, int]], apart: float) -> list[tuple[End, int]]:
    """The ends, the best first, with those nearer than `apart` [standard deviations] merged and their weights added."""
    distinct: list[tuple[End, int]] = []
    for end, weight in sorted(ends, key=lambda one: one[0].squares):
        slopes = np.vstack([objective.of_data(end.x)[1], np.diag(objective.weights)])
        like = [i for i, (one, _) in enumerate(distinct) if np.linalg.norm(slopes @ (end.x - one.x)) < apart]
        if like:
            distinct[like[0]] = distinct[like[0]][0], distinct[like[0]][1] + weight
        else:
            distinct.append((end, weight))
    return distinct


def _free_values(objective: Objective, x: Array) -> Array:
    """(groups,) number of values less the unknowns that they determine: the trace of 1 - J (J'J + W^2)^-1 J'."""
    slopes = objective.of_data(x)[1]
    root = np.linalg.qr(np.vstack([slopes, np.diag(objective.weights)]))[0][: len(slopes)]
    left = 1.0 - (root**2).sum(axis=1)
    return np.bincount(objective.noise_index, left, minlength=objective.factors.size).astype(np.float64)


def _noise(objective: Objective, x: Array, noise: Sequence[Noise]) -> Array:
    """(groups,) factors on the stated noise that agree with the residuals.

    A stated level that is not known counts as much as `STATED_VALUES` values, so that few residuals that happen to be
    small do not make all intervals small. The level of a record in time is raised as much as its serial errors raise
    the variance of what it determines, so that it has the right weight beside other data.
    """
    values, free = objective.of_data(x)[0], _free_values(objective, x)
    squares = np.bincount(
        objective.noise_index, (objective.factors[objective.noise_index] * values) ** 2, minlength=free.size
    )
    estimated = np.sqrt((STATED_VALUES + squares) / (STATED_VALUES + free))
    factors = np.where([one.known for one in noise], 1.0, estimated)
    slopes = objective.of_data(x)[1]
    scale = objective.factors[objective.noise_index] / factors[objective.noise_index]
    for i, each in enumerate(objective.data):
        if each.instants is not None:
            here = objective.set_of == i
            of_set, by = values[here] * scale[here], slopes[here] * scale[here, None]
            raised = inflation(by.T @ by, score_root(each, of_set, by, factors[objective.noise_index[here]]))
            factors[np.unique(objective.noise_index[here])] *= np.sqrt(max(1.0, raised))
    return factors
