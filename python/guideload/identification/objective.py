"""The function that a fit minimises: residuals of all data, and of what was known before, with exact derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from guideload.base.arrays import Array
from guideload.base.errors import SceneError
from guideload.identification.measured import Measured, OwnUnknown
from guideload.identification.model import Model
from guideload.identification.unknowns import Unknown

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

    Its coordinates x (p + q,): z of the machine's p unknowns, then the q own unknowns of the data in their scales.

    factors   (groups,) on the stated noise of each group of values
    set_of    (n,) index of the data set of each value of the data; noise_of: of its group of noise
    expected  (p + q,) before the data; weights: 1 over the standard deviations before the data
    """

    def __init__(self, model: Model, data: Sequence[Measured], factors: Array) -> None:
        self.model, self.data, self.factors = model, tuple(data), factors
        own = [one for each in data for one in each.own]
        self.p = len(model.unknowns)
        self.units = np.concatenate([np.ones(self.p), [one.scale for one in own]])
        known: list[Unknown | OwnUnknown] = [*model.unknowns, *own]
        self.bounds = np.array([one.bounds for one in known]).T / self.units
        self.expected = np.array([one.expected for one in known]) / self.units
        self.weights = self.units / np.array([one.spread for one in known])
        first = np.cumsum([0, *(len(each.noise) for each in data)])[:-1]
        groups = [each.noise_of + start for each, start in zip(data, first, strict=True)]
        self.noise_of = np.concatenate(groups)
        self.set_of = np.repeat(np.arange(len(data)), [group.size for group in groups])
        self._last: tuple[Array, Array, Array] | None = None

    def own_of(self, x: Array) -> list[Array]:
        """The own unknowns of each data set, in SI."""
        counts = np.cumsum([len(each.own) for each in self.data])[:-1]
        return list(np.split((x * self.units)[self.p :], counts))

    def of_data(self, x: Array) -> tuple[Array, Array]:
        """Residuals (n,) of the data alone, and their derivatives (n, p + q) by x."""
        if self._last is None or not np.array_equal(self._last[0], x):
            self._last = x.copy(), *self._computed(x)
        return self._last[1], self._last[2]

    def _computed(self, x: Array) -> tuple[Array, Array]:
        values, slopes = np.full(self.noise_of.size, FAR), np.zeros((self.noise_of.size, x.size))
        try:
            model = self.model.at(x[: self.p])
        except SceneError:  # a machine that nobody measured: the search turns back
            return values, slopes
        row, column = 0, self.p
        for each, own in zip(self.data, self.own_of(x), strict=True):
            part = each.residuals(model, own)
            rows, columns = slice(row, row + part.values.size), slice(column, column + own.size)
            values[rows], slopes[rows, : self.p] = part.values, part.by_unknowns
            slopes[rows, columns] = part.by_own * self.units[columns]
            row, column = rows.stop, columns.stop
        scale = self.factors[self.noise_of]
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
