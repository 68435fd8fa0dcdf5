"""Stationary fit of the state-space model: one process-noise density and one measurement noise for all samples.

The value and its first N - 1 derivatives are the state; the N-th derivative is white process noise. With an oscillator
these are the value and derivatives of the drive, and the state has two numbers more. The samples have white measurement
noise and are rounded to the quantum.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import factorial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from guideload._core import adapt_motion, motion_likelihood, smooth_motion
from guideload.base.arrays import Array
from guideload.base.errors import RunError
from guideload.motion.uncertainty import Segments

if TYPE_CHECKING:
    from guideload._core import SampledModel

Sites = tuple[Array, Array]  # (n,) values and variances of normal samples that approximate the rounded ones
Partition = tuple[Segments, Array]  # (n - 1,) segment of each interval; (segments,) their densities

# Number of samples on which order and noise are chosen; number of excerpts that a longer trace is reduced to.
EXCERPT, EXCERPTS = 16_000, 8
EVEN = 1e-8  # largest relative difference from the median step that counts as rounding
MOVES = 0.03  # least residual of an excerpt, over the largest
ROUNDS = 10  # of the iteration over sites, measurement noise and density, until it converges
GAP_DENSITY = 1e3  # of the process-noise density, where samples are missing for many time constants
MOST_DECADES = 12.0  # of density over noise, per median step: above, rounding breaks the filter down
LONGEST_CONSTANT = 100.0  # time constant in lengths of the trace; longer ones give the same polynomial
LEAST_NOISE = 1e-3  # squared quanta: least variance before rounding, an allowance for errors of the model
# Order of the differences that show the noise where the motion is smooth, number of them in a stretch, and share of the
# stretches that are taken for smooth.
DIFFERENCES, STRETCH, SMOOTH = 4, 12, 0.1


@dataclass(frozen=True, eq=False)
class ScaledSamples:
    """Samples scaled to order 1: time by its median step, values by the quantum or 1e-7 of the range."""

    time: Array
    value: Array
    quantum: float  # 1, or 0 if unknown
    least_noise: float  # variance
    time_unit: float  # s
    value_unit: float
    origin: float

    @classmethod
    def of(cls, time: Array, value: Array, quantum: float) -> ScaledSamples:
        time_unit = float(np.median(np.diff(time)))
        value_unit = quantum if quantum > 0.0 else 1e-7 * float(np.ptp(value))
        scaled = (time - time[0]) / time_unit, (value - value[0]) / value_unit
        least_noise = LEAST_NOISE if quantum > 0.0 else 1e-12
        return cls(*scaled, float(quantum > 0.0), least_noise, time_unit, value_unit, float(value[0]))

    @cached_property
    def step(self) -> Array:
        """(n - 1,) time between samples.

        Steps that equal the median but for rounding are exactly 1: the core is faster on equal steps.
        """
        step = np.diff(self.time)
        step[np.abs(step - 1.0) < EVEN] = 1.0
        return step

    @property
    def rounding(self) -> float:
        """Variance of rounding if many samples differ by less than a quantum."""
        return self.quantum / 12.0

    def noise_where_smooth(self) -> float:
        """Lower bound on the variance of the measurement noise: that of divided differences in the smoothest stretches.

        A cubic has no fourth differences, and a smooth motion nearly none, so noise remains.
        """
        count = self.value.size - DIFFERENCES
        if count < STRETCH:
            return 0.0
        time = np.stack([self.time[i : i + count] for i in range(DIFFERENCES + 1)])
        value = np.stack([self.value[i : i + count] for i in range(DIFFERENCES + 1)])
        apart = time[:, None] - time[None]
        apart[np.diag_indices(DIFFERENCES + 1)] = 1.0
        weight = 1.0 / np.prod(apart, axis=1)
        square = np.sum(weight * (value - value[0]), axis=0) ** 2 / np.sum(weight**2, axis=0)
        stretches = square[: count // STRETCH * STRETCH].reshape(-1, STRETCH).mean(axis=1)
        return float(np.quantile(stretches, SMOOTH)) - self.rounding

    def part(self, samples: slice) -> ScaledSamples:
        return replace(self, time=self.time[samples], value=self.value[samples])

    def excerpts(self, degree: int) -> list[ScaledSamples]:
        """The samples on which order and noise are chosen: all, or a few excerpts of a long trace.

        Excerpts are ranked by the residual of a polynomial of `degree` (constant acceleration) and taken at even
        distances up to the largest residual. Those with less than `MOVES` of it, as at rest, show no order and would
        outvote the others.
        """
        count = self.value.size
        if count <= EXCERPT:
            return [self]
        length = EXCERPT // EXCERPTS
        starts = np.linspace(0, count - length, count // length).astype(int)
        grid = np.linspace(-1.0, 1.0, length)
        basis, _ = np.linalg.qr(grid[:, None] ** np.arange(degree + 1))
        values = self.value[starts[:, None] + np.arange(length)]
        residual = values - (values @ basis) @ basis.T
        size = np.sqrt(np.square(residual).sum(axis=1))
        ranked = starts[np.argsort(size)][np.count_nonzero(size < MOVES * size.max()) :]
        chosen = np.unique(ranked[np.linspace(0, ranked.size - 1, EXCERPTS).astype(int)])
        return [self.part(slice(int(start), int(start) + length)) for start in chosen]


class Oscillator(NamedTuple):
    """Oscillator between the drive and the encoder; scaled units."""

    frequency: float  # undamped, rad per unit of time
    damping: float
    acceleration: int  # its index in the state


@dataclass(frozen=True)
class StationaryFit:
    """Model with one process-noise density; scaled units."""

    order: int  # of the derivative of the position, or of the drive's, that is white noise
    taken: int  # order of the derivative that was sampled: 0 position, 1 velocity
    noise: float = 1.0  # variance of measurement noise plus rounding
    time_constant: float = 1.0  # (noise/density)^(1/(2 N - 1))
    oscillator: Oscillator | None = None

    @property
    def states(self) -> int:
        """N: numbers of the state without those of the oscillator."""
        return self.order - self.taken

    @property
    def acceleration(self) -> int:
        """Its index in the state."""
        return 2 - self.taken

    @property
    def power(self) -> int:
        """Power of the time constant in noise over density: 2 N - 1."""
        return 2 * self.states - 1

    @property
    def density(self) -> float:
        """Process-noise density."""
        return float(self.noise * self.time_constant**-self.power)


class Adaptation(NamedTuple):
    """Result of `_core.adapt_motion`; scaled units."""

    density: Array  # (segments,) process-noise density
    noise: float  # variance of the measurement noise before rounding
    value: Array  # (n,) of the sites
    variance: Array  # (n,) of the sites
    predictive: Array  # (n,) leave-one-out log predictive densities of the samples
    # (segments,) normalised innovation variance: squared process noise over its expectation
    innovation: Array

    @property
    def sites(self) -> Sites:
        """Site approximations (expectation propagation)."""
        return self.value, self.variance


class StateSpaceSmoother:
    """State-space smoother for samples and a stationary fit."""

    def __init__(self, samples: ScaledSamples, fit: StationaryFit) -> None:
        # A long gap is shortened, as the variances would leave the range of doubles, and gets a higher density: the
        # samples before it carry almost no information on those after it.
        longest = max(1.0, fit.time_constant) * 10.0 ** (9.0 / fit.power)
        self.samples, self.fit = samples, fit
        self.step, self.gap = np.minimum(samples.step, longest), samples.step > longest
        self.normal_sites = samples.value, np.full(samples.value.size, fit.noise)
        time = np.concatenate([[0.0], np.cumsum(self.step)])
        self._drive = _initial_state(time, samples.value, fit)
        self.mean, self.covariance = _following(fit, *self._drive)

    def with_oscillator(self, oscillator: Oscillator | None) -> StateSpaceSmoother:
        """The same with another oscillator."""
        other = copy(self)
        other.fit = replace(self.fit, oscillator=oscillator)
        other.mean, other.covariance = _following(other.fit, *self._drive)
        return other

    def likelihood(
        self, segments: Partition | None = None, sites: Sites | None = None
    ) -> tuple[float, float]:
        """(sum of ln F, sum of v^2/F) over the innovations v and their variances F, of the sites.

        By default with the stationary density, and for normal samples.

        nan where the filter breaks down in rounding, as it can far from the maximum.
        """
        try:
            segments = segments or self.uniform(self.fit.density)
            return motion_likelihood(self._model(sites or self.normal_sites, segments))
        except RunError:  # beyond the range of numbers
            return np.nan, np.nan

    def uniform(self, density: float) -> Partition:
        """One segment with this density, and one for all gaps."""
        return self.gap.astype(np.uint32), density * np.array([1.0, GAP_DENSITY])

    def segments(self, length: float, density: float) -> Partition:
        """Segments of this length and their densities; each gap is a separate segment."""
        number = (self.samples.time[:-1] / length).astype(np.int64)
        new = np.concatenate([[False], (np.diff(number) > 0) | self.gap[1:] | self.gap[:-1]])
        segment = np.cumsum(new).astype(np.uint32)
        return segment, density * np.where(np.bincount(segment, self.gap) > 0.0, GAP_DENSITY, 1.0)

    def adapt(
        self, segments: Partition, noise: float, rounds: int, weight: float = 0.0, sites: Sites | None = None
    ) -> Adaptation:
        """Adapt densities, measurement noise and sites for some rounds; initial sites None: the samples.

        weight: of the prior, whose mode is the stationary density.
        """
        model = self._model(sites or self.normal_sites, segments)
        rule = rounds, self.fit.density, weight, self.samples.least_noise
        return Adaptation(*adapt_motion(model, self.samples.value, self.samples.quantum, noise, rule))

    def smooth(self, segments: Partition, sites: Sites) -> tuple[Array, Array]:
        """(n, 3) means of the first three numbers of the state, and their variances."""
        mean, variance, _ = smooth_motion(self._model(sites, segments))
        return mean, variance

    def _model(self, sites: Sites, segments: Partition) -> SampledModel:
        return self.step, *sites, self.mean, self.covariance, *segments, self.fit.oscillator


def _initial_state(time: Array, value: Array, fit: StationaryFit) -> tuple[Array, Array]:
    """State before the first sample, without an oscillator, and its covariance.

    A polynomial through the first samples, with 100 times its standard error.
    """
    near = 2.0 * min(max(fit.time_constant, 0.5), 50.0)
    count = int(np.clip(np.searchsorted(time, time[0] + near), fit.states + 3, time.size))
    since = time[:count] - time[0]
    span = float(since[-1])
    powers = (since / span)[:, None] ** np.arange(fit.states)
    q, r = np.linalg.qr(powers)
    coefficients = np.linalg.solve(r, q.T @ value[:count])
    residual = value[:count] - powers @ coefficients
    noise = max(fit.noise, float(residual @ residual) / (count - fit.states))
    inverse = np.linalg.inv(r)
    units = np.array([factorial(i) / span**i for i in range(fit.states)])
    return coefficients * units, 1e4 * noise * (inverse @ inverse.T) * np.outer(units, units)


def _following(fit: StationaryFit, mean: Array, covariance: Array) -> tuple[Array, Array]:
    """State with the oscillator of the fit, if it has one. mean, covariance: those of the drive.

    It follows the drive, a = c and y = c', with the variance of the acceleration as that of the difference a - c.
    """
    if fit.oscillator is None:
        return mean, covariance
    frequency, _, at = fit.oscillator
    states = fit.states + 2
    follows = np.zeros((states, fit.states))
    follows[np.arange(at + 1), np.arange(at + 1)] = 1.0
    follows[np.arange(at + 2, states), np.arange(at, fit.states)] = 1.0
    follows[at + 1, at + 1 : at + 2] = 1.0
    ringing = np.zeros(states)
    ringing[[at, at + 1]] = covariance[at, at] * np.array([1.0, frequency**2])
    return follows @ mean, follows @ covariance @ follows.T + np.diag(ringing)


def _with_normal_noise(excerpts: list[ScaledSamples], model: StationaryFit) -> StationaryFit:
    """The maximum-likelihood fit if rounding is normal noise: search over the time constant, noise in closed form."""
    count = sum(part.value.size for part in excerpts)
    least = excerpts[0].least_noise + excerpts[0].rounding

    @cache
    def at(place: float) -> tuple[float, float]:
        """Log likelihood and noise for the time constant 10^place."""
        unit = replace(model, noise=1.0, time_constant=10.0**place)
        sums = np.array([StateSpaceSmoother(part, unit).likelihood() for part in excerpts]).sum(axis=0)
        determinant, misfit = float(sums[0]), float(sums[1])
        if not (np.isfinite(sums).all() and misfit > 0.0):
            return -np.inf, least
        noise = max(misfit / count, least)
        return -0.5 * (determinant + count * np.log(noise) + misfit / noise), noise

    def likelihood(place: float) -> float:
        return at(round(place, 4))[0]

    lowest = -MOST_DECADES / model.power
    highest = float(np.log10(max(count / 20.0, 4.0)))
    best = float(max(np.arange(lowest, min(highest, 3.5), 0.3), key=likelihood))
    for stride in (0.15, 0.075, 0.0375):
        best = max((best - stride, best, best + stride), key=likelihood)
    return replace(model, noise=at(round(best, 4))[1], time_constant=10.0**best)


def fitted(excerpts: list[ScaledSamples], model: StationaryFit) -> tuple[StationaryFit, float]:
    """The maximum-likelihood fit, and the sum of its leave-one-out log predictive densities.

    model: its order and oscillator. First with rounding as normal noise, then with site approximations of the rounded
    samples, in rounds over all excerpts, which share noise and density.
    """
    fit = _with_normal_noise(excerpts, model)
    smoothers = [StateSpaceSmoother(part, fit) for part in excerpts]
    rounding = excerpts[0].rounding
    noise, density = max(fit.noise - rounding, 0.02 * excerpts[0].quantum), fit.density
    longest = LONGEST_CONSTANT * max(float(part.step.sum()) for part in excerpts)
    bounds = np.array([longest**-fit.power, 10.0**MOST_DECADES])
    sites: list[Sites | None] = [None] * len(smoothers)
    predictive = 0.0
    for _ in range(ROUNDS):
        found = [
            smoother.adapt(smoother.uniform(density), noise, 1, sites=previous)
            for smoother, previous in zip(smoothers, sites, strict=True)
        ]
        sites = [each.sites for each in found]
        noise = float(np.mean([each.noise for each in found]))
        density *= float(np.sqrt(np.mean([each.innovation[0] for each in found])))
        density = float(np.clip(density, *((noise + rounding) * bounds)))
        predictive = sum(float(each.predictive.sum()) for each in found)
    noise += rounding
    time_constant = float(noise / density) ** (1.0 / fit.power)
    return replace(fit, noise=noise, time_constant=time_constant), predictive
