"""Search for an oscillator between the drive and the encoder: an axis that rings after each change of its acceleration.

One density of the process noise for all samples cannot separate ringing from driving, because a drive acts only now
and then. The densities are therefore adapted at each frequency of a grid; the best frequency is then improved together
with its damping. At most 1500 samples are used.

Oscillators are compared by the likelihood of the adapted model, with rounding as normal noise. Each segment in which a
wrong oscillator must be driven costs likelihood; the leave-one-out predictive densities hardly differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array
from guideload.base.cores import Submit
from guideload.base.errors import RunError
from guideload.motion.uncertainty import Segments
from guideload.smoothing.adaptive import LENGTH, WEIGHT, results
from guideload.smoothing.stationary import (
    Adaptation,
    Oscillator,
    Partition,
    ScaledSamples,
    StateSpaceSmoother,
    StationaryFit,
)

SEARCHED, SAMPLES = 4, 1500  # most excerpts and samples of the search
PER_CONSTANT = 4.0  # samples per time constant of the stationary fit: more show no more of a ringing
# Measurement noise over that of rounding, as variances, up to which single samples are taken and not means.
ROUNDED_BELOW = 3.0
# Frequencies of the grid: least periods in an excerpt, most radians per time constant (faster ringing is lost in the
# noise) and per sample, and ratio of two neighbours.
PERIODS, FASTEST, LARGEST_ANGLE, RATIO = 5.0, 1.0, 1.6, 1.1
DAMPING, DAMPINGS = 0.07, (0.001, 0.35)  # damping ratio at the start of the search, and its limits
# Damping ratios of an axis that rings: with less the vibration is driven; with more a seventh of it is left after a
# period, which the drive may have done as well.
DECAYING = (0.006, 0.3)
# Rounds of adaptation: at each frequency of the grid, and after each improvement of the best.
GRID_ROUNDS, IMPROVED_ROUNDS = 4, (3, 3, 6)
# First strides of frequency and damping, as factors, and most moves between two adaptations.
STRIDES, MOVES = (1.05, 1.6), 6


@dataclass(frozen=True, eq=False)
class OscillatorTrial:
    """Adaptation with an oscillator; its likelihood is -inf if it failed."""

    oscillator: Oscillator | None
    likelihood: float  # logarithm
    parts: list[Adaptation]

    @property
    def predictive(self) -> float:
        """Sum of the leave-one-out log predictive densities."""
        return sum(float(part.predictive.sum()) for part in self.parts)


def find_oscillator(
    excerpts: list[ScaledSamples], fits: Sequence[StationaryFit], submit: Submit
) -> Oscillator | None:
    """The likeliest oscillator; None if the samples are as likely without one.

    fits: without an oscillator, one for each order of the drive, the highest last. submit: runs a task on a thread
    (`base/cores.py`).
    """
    fits = [fit for fit in fits if _slowest(excerpts) < _fastest(fit)]
    searches = [search for search in Search.of(excerpts, fits) if search.slowest < search.fastest]
    if not searches:
        return None
    without = results(submit, lambda search: search.adapted(None, sum(IMPROVED_ROUNDS)), searches)
    # In too low or too high an order a slow oscillator could be the likeliest, as it acts as another order does.
    search, alone = max(zip(searches, without, strict=True), key=lambda pair: pair[1].likelihood)
    grid = np.exp(np.arange(np.log(search.slowest), np.log(search.fastest), np.log(RATIO)))
    starts = [Oscillator(float(frequency), DAMPING, search.stationary.acceleration) for frequency in grid]
    points = results(submit, lambda start: search.adapted(start, GRID_ROUNDS), starts)
    best = search.improved(max(points, key=lambda point: point.likelihood))
    found = best.oscillator
    if found is None or best.likelihood <= alone.likelihood:
        return None
    # At the upper limit of the frequency it may only round off the corners of the drive.
    at_limit = found.frequency > search.fastest / STRIDES[0]
    if found.damping > DECAYING[1] or (at_limit and best.predictive <= alone.predictive):
        return None
    return found._replace(frequency=found.frequency / search.factor)


@dataclass(frozen=True, eq=False)
class Search:
    """Fewer samples, on which oscillators are compared; their unit of time is `factor` units of the samples."""

    parts: list[ScaledSamples]
    factor: int
    stationary: StationaryFit
    noise: float  # before rounding

    @classmethod
    def of(cls, excerpts: list[ScaledSamples], fits: Sequence[StationaryFit]) -> list[Search]:
        """One for each fit, all on the same samples: as many as the last fit needs."""
        if not fits:
            return []
        # Those with the longest travel, as an axis at rest does not ring.
        excerpts = sorted(excerpts, key=lambda part: -float(np.ptp(part.value)))[:SEARCHED]
        count = sum(part.value.size for part in excerpts)
        factor = max(1, int(fits[-1].time_constant / PER_CONSTANT), -(-count // SAMPLES))
        rounding = excerpts[0].rounding
        quiet = fits[-1].noise - rounding < ROUNDED_BELOW * rounding
        parts = [_every(part, factor) if quiet else _means(part, factor) for part in excerpts]
        searches = []
        for fit in fits:
            noise = fit.noise if quiet else fit.noise / factor
            density = fit.density * float(factor) ** fit.power
            scaled = replace(fit, noise=noise, time_constant=(noise / density) ** (1.0 / fit.power))
            before_rounding = max(noise - parts[0].rounding, parts[0].least_noise)
            searches.append(cls(parts, factor, scaled, before_rounding))
        return searches

    @property
    def slowest(self) -> float:
        """Lowest frequency of the search, in radians per unit of time."""
        return _slowest(self.parts)

    @property
    def fastest(self) -> float:
        """Highest frequency of the search, in radians per unit of time."""
        return _fastest(self.stationary)

    def adapted(
        self, oscillator: Oscillator | None, rounds: int, start: OscillatorTrial | None = None
    ) -> OscillatorTrial:
        """Densities, noise and sites adapted with this oscillator."""
        found, sums = [], 0.0
        for number, (alone, (segment, density)) in enumerate(self._smoothers):
            smoother = alone.with_oscillator(oscillator)
            noise, sites = self.noise, None
            if start is not None:
                before = start.parts[number]
                density, noise, sites = before.density, before.noise, before.sites
            try:
                weight = WEIGHT[smoother.fit.order]
                found.append(smoother.adapt((segment, density), noise, rounds, weight, sites))
            except RunError:  # beyond the range of numbers
                return OscillatorTrial(oscillator, -np.inf, [])
            samples, variance = smoother.samples, found[-1].noise + smoother.samples.rounding
            normal = samples.value, np.full(samples.value.size, variance)
            sums += sum(smoother.likelihood((segment, found[-1].density), normal))
        return OscillatorTrial(oscillator, -0.5 * sums if np.isfinite(sums) else -np.inf, found)

    def improved(self, point: OscillatorTrial) -> OscillatorTrial:
        """Frequency and damping improved: moves by likelihood and rounds of adaptation in turns."""
        strides = STRIDES
        for rounds in IMPROVED_ROUNDS:
            if point.oscillator is None or not point.parts:
                return point
            adapted = [
                (part, segment, found)
                for part, (_, (segment, _)), found in zip(
                    self.parts, self._smoothers, point.parts, strict=True
                )
            ]
            fit = replace(self.stationary, oscillator=point.oscillator)
            oscillator, strides = more_likely(fit, adapted, strides, MOVES, _fastest(fit))
            after = self.adapted(oscillator, rounds, point)
            if not after.parts:
                return point
            point = after
        return point

    @cached_property
    def _smoothers(self) -> list[tuple[StateSpaceSmoother, Partition]]:
        """A smoother for each part, without an oscillator, and its segments."""
        fit = self.stationary
        smoothers = [StateSpaceSmoother(part, fit) for part in self.parts]
        length = max(1.0, LENGTH[fit.order] * fit.time_constant)
        return [(smoother, smoother.segments(length, fit.density)) for smoother in smoothers]


def more_likely(
    fit: StationaryFit,
    adapted: Sequence[tuple[ScaledSamples, Segments, Adaptation]],
    strides: tuple[float, float],
    moves: int,
    fastest: float,
) -> tuple[Oscillator, tuple[float, float]]:
    """The fit's oscillator, moved to where the adapted samples are more likely, and the strides for further moves.

    A move tries one stride up and down in frequency and damping, and keeps what helps; if nothing helps, the strides
    are halved, as logarithms. fastest: limit of the frequency.
    """
    assert fit.oscillator is not None

    def oscillator(place: Array) -> Oscillator:
        frequency, damping = np.exp(place).tolist()
        return Oscillator(frequency, damping, fit.acceleration)

    def likelihood(place: Array) -> float:
        """Logarithm, but for a constant."""
        frequency, damping = np.exp(place)
        if not (DAMPINGS[0] <= damping <= DAMPINGS[1] and frequency <= fastest):
            return -np.inf
        sums = 0.0
        for smoother, (_, segment, found) in zip(smoothers, adapted, strict=True):
            moved = smoother.with_oscillator(oscillator(place))
            sums += sum(moved.likelihood((segment, found.density), found.sites))
        return -0.5 * sums if np.isfinite(sums) else -np.inf

    smoothers = [StateSpaceSmoother(samples, fit) for samples, _, _ in adapted]
    place, stride = np.log(fit.oscillator[:2]), np.log(strides)
    best = likelihood(place)
    for _ in range(moves):
        before = best
        for move in (*np.diag(stride), *np.diag(-stride)):
            here = likelihood(place + move)
            if here > best:
                best, place = here, place + move
        if best == before:
            stride = 0.5 * stride
    first, second = np.exp(stride)
    return oscillator(place), (float(first), float(second))


def _slowest(parts: list[ScaledSamples]) -> float:
    """The lowest frequency of which every part has enough periods, in radians per unit of time."""
    shortest = min(part.value.size for part in parts)
    return 2.0 * np.pi * PERIODS / shortest if shortest else np.inf


def _fastest(fit: StationaryFit) -> float:
    """The highest frequency that the samples show, in radians per unit of time."""
    return min(FASTEST / fit.time_constant, LARGEST_ANGLE)


def _every(samples: ScaledSamples, factor: int) -> ScaledSamples:
    """Every sample number 0, `factor`, ..: rounded samples remain rounded samples."""
    time, value = samples.time[::factor] / factor, np.ascontiguousarray(samples.value[::factor])
    return replace(samples, time=time, value=value, time_unit=factor * samples.time_unit)


def _means(samples: ScaledSamples, factor: int) -> ScaledSamples:
    """Means of `factor` samples, whose rounding is then normal noise. None reaches over a gap."""
    count = samples.value.size // factor * factor
    times, values = samples.time[:count].reshape(-1, factor), samples.value[:count].reshape(-1, factor)
    together = times[:, -1] - times[:, 0] < 2.0 * factor
    time, value = times[together].mean(axis=1) / factor, values[together].mean(axis=1)
    least = (samples.least_noise + samples.rounding) / factor
    unit = factor * samples.time_unit
    return replace(samples, time=time, value=value, quantum=0.0, least_noise=least, time_unit=unit)
