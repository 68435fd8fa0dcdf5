"""Stationary fits of a sampled motion: one noise level and one intensity for all of it, by likelihood.

What `adapting` starts from: samples in tame units, and a fit for a number of states.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import factorial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from guideload._core import adapt_motion, motion_likelihood, smooth_motion
from guideload.base.arrays import Array

if TYPE_CHECKING:
    from guideload._core import Sampled

Cells = NDArray[np.uint32]

EXCERPT, STRETCHES = 16_000, 8  # samples on which order and levels are chosen, and in how many pieces
ROUNDS = 10  # in which sites, level and intensity of a stationary fit find each other
GAP = 1e3  # of the intensity, where samples are missing for many time constants
QUICKEST = 12.0  # decades of intensity over noise per median step: beyond, the filter breaks down in rounding
SLOWEST = 100.0  # lengths of the trace: a time constant beyond it tells a polynomial, as this one does
QUIETEST = 1e-3  # squared quanta: the least noise before rounding, for what the model itself leaves out


@dataclass(frozen=True, eq=False)
class Scaled:
    """Samples in units that keep numbers tame: the median step, and the quantum or a part of the range."""

    time: Array
    step: Array
    value: Array
    quantum: float  # 1, or 0 if unknown
    floor: float  # of the noise level
    second: float  # s, the unit of time
    unit: float  # of the value
    origin: float

    @classmethod
    def of(cls, time: Array, value: Array, quantum: float) -> Scaled:
        second = float(np.median(np.diff(time)))
        unit = quantum if quantum > 0.0 else 1e-7 * float(np.ptp(value))
        return cls(
            (time - time[0]) / second,
            np.diff(time) / second,
            (value - value[0]) / unit,
            float(quantum > 0.0),
            QUIETEST if quantum > 0.0 else 1e-12,
            second,
            unit,
            float(value[0]),
        )

    @property
    def rounding(self) -> float:
        """Variance of rounding where a quantum holds few samples."""
        return self.quantum / 12.0

    def part(self, samples: slice) -> Scaled:
        """Some of the samples, at their own times."""
        time = self.time[samples]
        return replace(self, time=time, step=np.diff(time), value=self.value[samples])

    def stretches(self, power: int) -> list[Scaled]:
        """What order and levels are chosen on: all samples, or a few stretches of a long trace.

        The stretches are spread evenly from the quietest to the liveliest, as measured by what is left of a polynomial
        of degree `power` (that of constant acceleration), so that neither dwells nor jumps are missed.
        """
        count = self.value.size
        if count <= EXCERPT:
            return [self]
        length = EXCERPT // STRETCHES
        starts = np.linspace(0, count - length, count // length).astype(int)
        grid = np.linspace(-1.0, 1.0, length)
        basis, _ = np.linalg.qr(grid[:, None] ** np.arange(power + 1))
        values = self.value[starts[:, None] + np.arange(length)]
        rest = values - (values @ basis) @ basis.T
        ranked = starts[np.argsort(np.square(rest).sum(axis=1))]
        chosen = ranked[np.linspace(0, ranked.size - 1, STRETCHES).astype(int)]
        return [self.part(slice(int(start), int(start) + length)) for start in np.sort(chosen)]


@dataclass(frozen=True)
class Fit:
    """A stationary fit: states, variance of the noise with that of rounding, and time constant; scaled units."""

    states: int
    noise: float
    constant: float  # time constant: (noise/intensity)^(1/(2 states - 1))

    @property
    def intensity(self) -> float:
        return float(self.noise * self.constant ** (1 - 2 * self.states))


class Found(NamedTuple):
    """What `_core.adapt_motion` finds.

    Intensities, level of the noise before rounding, sites, log densities of the samples given all others, and squares
    of the noise in each cell over those that its intensity makes expect.
    """

    intensity: Array
    level: float
    value: Array
    variance: Array
    told: Array
    alive: Array


class Model:
    """What the kernels take for samples and a number of states."""

    def __init__(self, scaled: Scaled, fit: Fit) -> None:
        # A gap is bridged as if it were shorter, for the filter's variances would leave the range of doubles, and as if
        # more had happened in it: what was before then says next to nothing of what comes after.
        longest = max(1.0, fit.constant) * 10.0 ** (9.0 / (2 * fit.states - 1))
        self.scaled, self.fit = scaled, fit
        self.step, self.gap = np.minimum(scaled.step, longest), scaled.step > longest
        self.value = scaled.value
        bridged = np.concatenate([[0.0], np.cumsum(self.step)])
        self.mean, self.covariance = _start(bridged, scaled.value, fit)

    def likelihood(self) -> tuple[float, float]:
        """(sum of ln F, sum of v^2/F) over the innovations v and their variances F, as normal samples."""
        return motion_likelihood(self._given(self.value, self._noises(), *self.even(self.fit.intensity)))

    def even(self, intensity: float) -> tuple[Cells, Array]:
        """One cell with an intensity, and one for all gaps."""
        return self.gap.astype(np.uint32), intensity * np.array([1.0, GAP])

    def cells(self, length: float, intensity: float) -> tuple[Cells, Array]:
        """Cells of a length, each gap in one of its own, and their intensities: even but for the gaps.

        Cells without samples have no number.
        """
        number = (self.scaled.time[:-1] / length).astype(np.int64)
        new = np.concatenate([[False], (np.diff(number) > 0) | self.gap[1:] | self.gap[:-1]])
        cell = np.cumsum(new).astype(np.uint32)
        return cell, intensity * np.where(np.bincount(cell, self.gap) > 0.0, GAP, 1.0)

    def adapted(
        self,
        cell: Cells,
        intensity: Array,
        level: float,
        rounds: int,
        weight: float = 0.0,
        sites: tuple[Array, Array] | None = None,
    ) -> Found:
        """`rounds` of adapting from these intensities, level and sites; without sites from the samples."""
        value, variance = sites or (self.value, self._noises())
        rule = rounds, self.fit.intensity, weight, self.scaled.floor
        given = self._given(value, variance, cell, intensity)
        return Found(*adapt_motion(given, self.value, self.scaled.quantum, level, rule))

    def smoothed(self, cell: Cells, intensity: Array, sites: tuple[Array, Array]) -> tuple[Array, Array]:
        """(n, 3) the first three numbers of the state, and their variances."""
        mean, variance, _ = smooth_motion(self._given(*sites, cell, intensity))
        return mean, variance

    def _given(self, value: Array, variance: Array, cell: Cells, intensity: Array) -> Sampled:
        return self.step, value, variance, self.mean, self.covariance, cell, intensity

    def _noises(self) -> Array:
        return np.full(self.value.size, self.fit.noise)


def _start(time: Array, value: Array, fit: Fit) -> tuple[Array, Array]:
    """State before the first sample: a polynomial through the first samples, its uncertainty times 100."""
    near = 2.0 * min(max(fit.constant, 0.5), 50.0)
    count = int(np.clip(np.searchsorted(time, time[0] + near), fit.states + 3, time.size))
    since = time[:count] - time[0]
    span = float(since[-1])
    powers = (since / span)[:, None] ** np.arange(fit.states)
    q, r = np.linalg.qr(powers)
    coefficients = np.linalg.solve(r, q.T @ value[:count])
    rest = value[:count] - powers @ coefficients
    spread = max(fit.noise, float(rest @ rest) / (count - fit.states))
    inverse = np.linalg.inv(r)
    units = np.array([factorial(i) / span**i for i in range(fit.states)])
    return coefficients * units, 1e4 * spread * (inverse @ inverse.T) * np.outer(units, units)


def fitted(stretches: list[Scaled], states: int) -> tuple[Fit, float]:
    """The most likely noise and time constant, and the log density of the samples given all others.

    First as if rounding were normal noise: a walk over the time constant, the noise found with it in closed form.
    Then with sites.
    """
    return _with_sites(stretches, _as_normal(stretches, states))


def _as_normal(stretches: list[Scaled], states: int) -> Fit:
    count = sum(part.value.size for part in stretches)
    least = stretches[0].floor + stretches[0].rounding
    known: dict[float, tuple[float, float]] = {}

    def at(place: float) -> tuple[float, float]:
        """Log likelihood and noise for the time constant 10^place."""
        place = round(place, 4)
        if place not in known:
            unit = Fit(states, 1.0, 10.0**place)
            sums = np.array([Model(part, unit).likelihood() for part in stretches]).sum(axis=0)
            determinant, misfit = float(sums[0]), float(sums[1])
            # Far from the maximum the filter can break down in rounding.
            if not (np.isfinite(sums).all() and misfit > 0.0):
                return -np.inf, least
            noise = max(misfit / count, least)
            known[place] = (-0.5 * (determinant + count * np.log(noise) + misfit / noise), noise)
        return known[place]

    lowest = -QUICKEST / (2 * states - 1)
    highest = float(np.log10(max(count / 20.0, 4.0)))
    places = np.arange(lowest, min(highest, 3.5), 0.3)
    best = float(places[int(np.argmax([at(place)[0] for place in places]))])
    for stride in (0.15, 0.075, 0.0375):
        best = max((best - stride, best, best + stride), key=lambda place: at(place)[0])
    return Fit(states, at(best)[1], 10.0**best)


def _with_sites(stretches: list[Scaled], fit: Fit) -> tuple[Fit, float]:
    """Rounds over all stretches, which share level and intensity."""
    models = [Model(part, fit) for part in stretches]
    rounding = stretches[0].rounding
    level, intensity = max(fit.noise - rounding, 0.02 * stretches[0].quantum), fit.intensity
    longest = SLOWEST * max(float(part.step.sum()) for part in stretches)
    slow, quick = longest ** (1 - 2 * fit.states), 10.0**QUICKEST
    sites: list[tuple[Array, Array] | None] = [None] * len(models)
    told = 0.0
    for _ in range(ROUNDS):
        found = [
            model.adapted(*model.even(intensity), level, 1, sites=site)
            for model, site in zip(models, sites, strict=True)
        ]
        sites = [(each.value, each.variance) for each in found]
        level = float(np.mean([each.level for each in found]))
        intensity *= float(np.sqrt(np.mean([each.alive[0] for each in found])))  # the same is expected of all
        intensity = float(np.clip(intensity, *((level + rounding) * np.array([slow, quick]))))
        told = sum(float(each.told.sum()) for each in found)
    noise = level + rounding
    return Fit(fit.states, noise, float(noise / intensity) ** (1.0 / (2 * fit.states - 1))), told
