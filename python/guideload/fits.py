"""Stationary fits of a sampled motion: one noise level and one intensity for all of it, by likelihood.

What `estimation` starts from: samples in tame units, a fit for each number of states, and the best of the fits.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from guideload import _core

Array = NDArray[np.float64]
Cells = NDArray[np.uint32]
# Of the kernels: steps, values, variances, mean and covariance at the start, cells; and the cells' intensities.
Arguments: TypeAlias = tuple[Array, Array, Array, Array, Array, Cells]

REPEATS, HEAVIEST = 10.0, 50.0  # equal samples in a row from which on their noise is raised; at most so much
CLIP = 8.0  # log likelihood that one stretch can say for an order: none decides alone
EXCERPT, STRETCHES = 20_000, 5  # samples on which order and levels are chosen, and in how many pieces


@dataclass(frozen=True, eq=False)
class Scaled:
    """Samples in units that keep numbers tame: the median step, and the quantum or a part of the range."""

    time: Array
    step: Array
    value: Array
    weight: Array  # (n,) noise variance in units of the level: more where samples repeat
    telling: Array  # (n,) share of each sample in the choice of the order
    floor: float  # of the noise level
    second: float  # s, the unit of time
    unit: float  # of the value
    origin: float

    @classmethod
    def of(cls, time: Array, value: Array, quantum: float) -> Scaled:
        second = float(np.median(np.diff(time)))
        span = float(np.ptp(value))
        unit = quantum if quantum > 0.0 else 1e-7 * span
        floor = max(quantum**2 / 12.0, (1e-13 * span) ** 2) / unit**2
        ends = np.concatenate([[0], np.flatnonzero(np.diff(value)) + 1, [value.size]])
        repeats = np.repeat(np.diff(ends), np.diff(ends)).astype(float)
        alone = (repeats == 1.0).astype(float)
        return cls(
            (time - time[0]) / second,
            np.diff(time) / second,
            (value - value[0]) / unit,
            np.clip(repeats / REPEATS, 1.0, HEAVIEST),
            alone if alone.mean() > 0.1 else 1.0 / repeats,
            floor,
            second,
            unit,
            float(value[0]),
        )

    def stretches(self) -> list[slice]:
        """Where order and levels are chosen: everywhere, or in a few pieces of a long trace."""
        count = self.value.size
        if count <= EXCERPT:
            return [slice(0, count)]
        length = EXCERPT // STRETCHES
        starts = np.linspace(0, count - length, STRETCHES).astype(int)
        return [slice(int(start), int(start) + length) for start in starts]


@dataclass(frozen=True)
class Fit:
    """A stationary fit: states, noise level and intensity by likelihood; scaled units."""

    states: int
    level: float
    constant: float  # time constant: (level/intensity)^(1/(2 states - 1))

    @property
    def intensity(self) -> float:
        return float(self.level * self.constant ** (1 - 2 * self.states))


class Model:
    """The arguments that all kernels share, for one stretch and one number of states."""

    def __init__(self, scaled: Scaled, part: slice, fit: Fit) -> None:
        # A gap is bridged as if it were shorter: beyond, the filter's variances leave the range of doubles.
        longest = max(1.0, fit.constant) * 10.0 ** (11.0 / (2 * fit.states - 1))
        self.step = np.minimum(scaled.step[part.start : part.stop - 1], longest)
        self.value = scaled.value[part]
        self.weight = scaled.weight[part]
        self.mean, self.covariance = _start(scaled.time[part], self.value, self.weight * fit.level, fit)

    def arguments(self, level: float, cell: Cells) -> Arguments:
        return self.step, self.value, level * self.weight, self.mean, self.covariance, cell


def _start(time: Array, value: Array, variance: Array, fit: Fit) -> tuple[Array, Array]:
    """State before the first sample: a polynomial through the first samples, its uncertainty times 100."""
    near = 2.0 * min(max(fit.constant, 0.5), 50.0)
    count = int(np.clip(np.searchsorted(time, time[0] + near), fit.states + 3, time.size))
    since = time[:count] - time[0]
    span = float(since[-1])
    powers = (since / span)[:, None] ** np.arange(fit.states)
    q, r = np.linalg.qr(powers)
    coefficients = np.linalg.solve(r, q.T @ value[:count])
    rest = value[:count] - powers @ coefficients
    spread = max(float(variance[:count].mean()), float(rest @ rest) / (count - fit.states))
    inverse = np.linalg.inv(r)
    units = np.array([factorial(i) / span**i for i in range(fit.states)])
    return coefficients * units, 1e4 * spread * (inverse @ inverse.T) * np.outer(units, units)


def fitted(scaled: Scaled, states: int) -> Fit:
    """The most likely level and time constant: a walk over the latter, the level found with it in closed form."""
    parts = scaled.stretches()
    known: dict[float, tuple[float, float]] = {}

    def at(place: float) -> tuple[float, float]:
        """Log likelihood and level for the time constant 10^place."""
        place = round(place, 4)
        if place not in known:
            unit = Fit(states, 1.0, 10.0**place)
            determinant = misfit = 0.0
            for part in parts:
                model = Model(scaled, part, unit)
                cell = np.zeros(model.step.size, np.uint32)
                found = _core.motion_likelihood(*model.arguments(1.0, cell), np.array([unit.intensity]))
                determinant, misfit = determinant + found[0], misfit + found[1]
            count = sum(part.stop - part.start for part in parts)
            # Rounding can make variances negative far from the maximum.
            if not (np.isfinite(determinant) and misfit > 0.0):
                return -np.inf, scaled.floor
            level = max(misfit / count, scaled.floor)
            known[place] = (-0.5 * (determinant + count * np.log(level) + misfit / level), level)
        return known[place]

    lowest = -12.0 / (2 * states - 1)
    highest = float(np.log10(max(scaled.value.size / 20.0, 4.0)))
    places = np.arange(lowest, min(highest, 3.5), 0.3)
    best = float(places[int(np.argmax([at(place)[0] for place in places]))])
    for stride in (0.15, 0.075, 0.0375):
        best = max((best - stride, best, best + stride), key=lambda place: at(place)[0])
    return Fit(states, at(best)[1], 10.0**best)


def best_of(scaled: Scaled, fits: list[Fit]) -> int:
    """Which fit foretells single samples best from all others; every stretch of the trace has a limited say."""
    scores = []
    for fit in fits:
        told = []
        for part in scaled.stretches():
            telling = scaled.telling[part]
            _, _, residual = smoothed(scaled, part, fit)
            share = np.cumsum(telling)
            blocks = int(np.clip(telling.size / 30, 4, 60))
            block = np.minimum((share / share[-1] * blocks).astype(int), blocks - 1)
            misfit = np.bincount(block, telling * residual[:, 0] ** 2 / residual[:, 1], blocks)
            if fit.level < 1.02 * scaled.floor:  # residuals below the rounding's follow its tone
                misfit = np.maximum(misfit, np.bincount(block, telling, blocks))
            told.append(0.5 * (np.bincount(block, telling * np.log(residual[:, 1]), blocks) - misfit))
        scores.append(np.concatenate(told))
    table = np.array(scores)
    gain = np.clip(table - np.median(table, axis=0), -CLIP, CLIP)
    return int(np.argmax(gain.sum(axis=1)))


def smoothed(scaled: Scaled, part: slice, fit: Fit) -> tuple[Array, Array, Array]:
    model = Model(scaled, part, fit)
    cell = np.zeros(model.step.size, np.uint32)
    return _core.smooth_motion(*model.arguments(fit.level, cell), np.array([fit.intensity]))
