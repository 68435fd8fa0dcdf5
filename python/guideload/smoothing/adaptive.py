"""Intensities that follow a motion: adapted in cells of a few time constants, and what the estimate's error then is."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.base.cores import cores
from guideload.smoothing.stationary import Cells, Fit, Model, Scaled

Sites = tuple[Array, Array]

# By the order of the white derivative. Weight of the usual intensity, in squared noises of a cell: the smaller, the
# heavier the tail; and time constants: length of a cell.
WEIGHT = {3: 3e-4, 4: 1e-3, 5: 0.02, 6: 0.1}
CELL = {3: 3.0, 4: 3.0, 5: 10.0, 6: 10.0}
ROUNDS, MORE_ROUNDS = 7, 4  # in all cells, and after dividing those that jump; more gain nothing
LIVELY, PARTS = 3.0, 6  # of the usual intensity: cells above it are divided; into how many
START_CONSTANT, START_NOISE = 2.0, 2.0  # times the stationary fit's: adapting starts on the smooth side
COLOUR = 12.0  # of the noise level: what vibrates is not white, but stronger at the motion's own frequencies
LIVE = 2.0  # log likelihood that an intensity above the usual one must bring
PIECE = 100_000  # samples of a long trace that are adapted by themselves
ALIKE = 9  # cells whose liveliness is averaged
NUDGE = 1e-2  # of intensities and noise: differences of variances stay far above rounding
LEAST = 1e-2  # of the model's variance


@dataclass(frozen=True, eq=False)
class Adapted:
    """Samples with intensities of their own in each cell; scaled units.

    intensity  (cells,), of interval k at cell[k]
    level      of the noise before rounding
    sites      (n,) values and variances of the normal samples that stand for the rounded ones
    alive      (cells,) squares of the noise found over those that the intensity makes expect
    weight     of the usual intensity
    gain       log density of the samples given all others, less `LIVE` for each cell above the usual intensity
    """

    model: Model
    cell: Cells
    intensity: Array
    level: float
    sites: Sites
    alive: Array
    weight: float
    gain: float

    def smoothed(self) -> tuple[Array, Array]:
        """(n, 3) the first three numbers of the state, and their variances."""
        return self.model.smoothed(self.cell, self.intensity, self.coloured)

    @property
    def coloured(self) -> Sites:
        """The sites with the noise that smoothing reckons with."""
        return self.sites[0], self.sites[1] + (COLOUR - 1.0) * self.level

    def share(self, variance: Array, derivative: int) -> Array:
        """(n,) variance of the estimate's error over that of the model, (n,) too, of one number of the state.

        The model's variance is least for its own intensities and noise, so that its derivative by one of them is what
        that one adds to the error of the estimate as it stands (envelope theorem): what the true ones lack is taken
        off.
        """
        # White noise alone shows 1/(2 N) of what is expected of noise and motion.
        least = 0.5 / self.model.fit.states
        true = (self.alive - least) / (1.0 - least)
        # Cells of like intensity are judged together: one alone says little.
        alike = np.argsort(self.intensity)
        true[alike] = _mean_of_neighbours(true[alike], ALIKE)
        intensity = self.intensity * (1.0 - NUDGE * (1.0 - np.clip(true, 0.0, 1.0)))
        value, noise = self.coloured
        _, nudged = self.model.smoothed(
            self.cell, intensity, (value, noise + NUDGE * (self.sites[1] - noise))
        )
        ratio = np.divide(nudged[:, derivative], variance, out=np.ones_like(variance), where=variance > 0.0)
        return np.asarray(np.clip(1.0 + (ratio - 1.0) / NUDGE, LEAST, 1.0))


def adapted(scaled: Scaled, fit: Fit, order: int, weight: float | None = None) -> Adapted:
    """Adapts the intensities, from the stationary fit on. order: of the position's white derivative.

    weight: of the usual intensity, if it is known already.

    First in cells of a few time constants; then those that jump are divided, so that the jump finds its place.
    """
    model = Model(scaled, fit)
    length = max(1.0, CELL[order] * fit.constant)
    level = max(fit.noise - scaled.rounding, scaled.floor)
    if weight is None:
        alive = model.adapted(*model.cells(length, fit.intensity), level, 1).alive
        weight = max(WEIGHT[order], _evenness(alive))
    smooth = Fit(fit.states, START_NOISE * fit.noise, START_CONSTANT * fit.constant)
    cell, intensity = model.cells(length, smooth.intensity)
    found = model.adapted(cell, intensity, START_NOISE * level, ROUNDS, weight)
    gain = float(found.told.sum()) - LIVE * np.count_nonzero(found.intensity > fit.intensity)
    cell, intensity = _divided(cell, found.intensity, found.intensity > LIVELY * fit.intensity)
    found = model.adapted(cell, intensity, found.level, MORE_ROUNDS, weight, (found.value, found.variance))
    sites = found.value, found.variance
    return Adapted(model, cell, found.intensity, found.level, sites, found.alive, weight, gain)


def adapted_in_pieces(scaled: Scaled, fit: Fit, order: int, weight: float) -> Adapted:
    """The whole of a long trace, in pieces that do not depend on the number of threads that share them."""
    count = scaled.value.size
    edges = np.linspace(0, count, max(1, count // PIECE) + 1).astype(int)
    parts = [slice(int(first), int(last)) for first, last in pairwise(edges)]
    with ThreadPoolExecutor(cores()) as pool:
        found = list(pool.map(lambda part: adapted(scaled.part(part), fit, order, weight), parts))
    numbers, last = [], -1
    for each in found:
        # The interval to the next piece is in the last cell.
        numbers.append(np.append(each.cell, each.cell[-1]).astype(np.uint32) + np.uint32(last + 1))
        last = int(numbers[-1][-1])
    return Adapted(
        Model(scaled, fit),
        np.concatenate(numbers)[:-1],
        np.concatenate([each.intensity for each in found]),
        float(np.mean([each.level for each in found])),
        (
            np.concatenate([each.sites[0] for each in found]),
            np.concatenate([each.sites[1] for each in found]),
        ),
        np.concatenate([each.alive for each in found]),
        weight,
        sum(each.gain for each in found),
    )


def _divided(cell: Cells, intensity: Array, these: NDArray[np.bool_]) -> tuple[Cells, Array]:
    """The cells with some of them divided into `PARTS`, and the intensities of all."""
    first = np.searchsorted(cell, np.arange(intensity.size))
    place = (np.arange(cell.size) - first[cell]) / np.bincount(cell)[cell]
    number = cell.astype(np.int64) * PARTS + np.where(these[cell], (PARTS * place).astype(np.int64), 0)
    numbers, divided = np.unique(number, return_inverse=True)
    return divided.astype(np.uint32), intensity[numbers // PARTS]


def _evenness(alive: Array) -> float:
    """Weight of the usual intensity that the stationary fit suggests: 1 where all cells move alike, 0 for few jumps.

    The inverse cube of the kurtosis of the noise over the cells.
    """
    return float((alive.mean() ** 2 / np.mean(alive**2)) ** 3) if alive.any() else 0.0


def _mean_of_neighbours(values: Array, count: int) -> Array:
    window = np.ones(min(count, values.size))
    sums = np.convolve(values, window, "same"), np.convolve(np.ones(values.size), window, "same")
    return np.asarray(sums[0] / sums[1])
