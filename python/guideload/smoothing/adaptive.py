"""Adaptive fit of the state-space model: a process-noise density for each segment of a few time constants.

The densities maximise the likelihood under an inverse gamma prior around the stationary density (empirical Bayes), so
that the process noise has a heavy tail (Student's t): dwells get a low density and jumps a high one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from guideload.base.arrays import Array, Flags
from guideload.base.cores import Submit, cores, threads
from guideload.motion.uncertainty import Segments
from guideload.smoothing.stationary import (
    Adaptation,
    Partition,
    ScaledSamples,
    Sites,
    StateSpaceSmoother,
    StationaryFit,
)

# By the order of the white derivative: weight of the prior, in squared process noises of a segment (a small weight is a
# heavy tail), and length of a segment, in time constants.
WEIGHT = {3: 3e-4, 4: 1e-3, 5: 0.02, 6: 0.1}
LENGTH = {3: 3.0, 4: 3.0, 5: 10.0, 6: 10.0}
# Orders whose motion jumps: if such a motion follows single samples, it would take noise for jumps.
JUMPING = (3, 4)
ORDER_OF_JUMPS = 3  # the order whose acceleration jumps
# Rounds of adaptation: before and after segments are divided, and after those of jumps are divided once more.
ROUNDS, MORE_ROUNDS, LAST_ROUNDS = 7, 4, 7
DIVIDED, PARTS = 3.0, 6  # segments over DIVIDED times the stationary density are divided into PARTS segments
JUMP = 20.0  # times the stationary density: a segment with at least this density is a jump
START_CONSTANT, START_NOISE = 2.0, 2.0  # over the stationary fit: adaptation starts with a smoother motion
COLOUR = 12.0  # factor on the variance of the measurement noise: vibration is stronger at frequencies of the motion
PIECE = 100_000  # samples in a piece of a long trace; pieces are adapted independently
AVERAGED = 9  # segments whose normalised innovation variance is averaged
NUDGE = 1e-2  # relative change of densities and noise for a difference quotient, far above rounding
LEAST = 1e-2  # least variance of the error, over that of the model
Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class AdaptedModel:
    """Samples with a process-noise density for each segment; scaled units."""

    smoother: StateSpaceSmoother
    segment: Segments  # (n - 1,) segment of each interval
    fit: Adaptation  # densities, noise and sites
    weight: float  # of the prior

    def with_jumps_located(self) -> AdaptedModel:
        """The model with the segments of jumps divided once more, and all densities adapted for longer.

        Only with order 3 without an oscillator, whose acceleration jumps; all others give the same model. (With order 4
        the error is smaller, too, but peaks overshoot.)
        """
        stationary = self.smoother.fit
        if stationary.order != ORDER_OF_JUMPS or stationary.oscillator is not None:
            return self
        segments = _divided(self.segment, self.fit.density, self.fit.density >= JUMP * stationary.density)
        fit = self.smoother.adapt(segments, self.fit.noise, LAST_ROUNDS, self.weight, self.fit.sites)
        return replace(self, segment=segments[0], fit=fit)

    @property
    def coloured_sites(self) -> Sites:
        """The sites, with an allowance for coloured noise in their variance."""
        return self.fit.value, self.fit.variance + (COLOUR - 1.0) * self.fit.noise

    def error_share(self, variance: Array) -> Array:
        """(n,) variance of the estimate's error over the model's `variance` (n,), of the acceleration.

        The gain of the smoother minimises the variance, so the derivative of the variance with respect to a density or
        noise is the share of that process in the error (envelope theorem). Subtracted are the process noise that the
        samples do not have, by the normalised innovation variances, and the allowance for coloured measurement noise.
        """
        # White noise alone has a normalised innovation variance of 1/(2 N).
        least = 0.5 / self.smoother.fit.states
        present = (self.fit.innovation - least) / (1.0 - least)
        # Averaged over segments of similar density, as the value of one segment is too uncertain.
        similar = np.argsort(self.fit.density)
        window = np.ones(min(AVERAGED, present.size))
        sums = (np.convolve(values, window, "same") for values in (present[similar], np.ones(present.size)))
        present[similar] = np.divide(*sums)
        density = self.fit.density * (1.0 - NUDGE * (1.0 - np.clip(present, 0.0, 1.0)))
        value, noise = self.coloured_sites
        sites = value, noise + NUDGE * (self.fit.variance - noise)
        _, nudged = self.smoother.smooth((self.segment, density), sites)
        nudged = nudged[:, self.smoother.fit.acceleration]
        ratio = np.divide(nudged, variance, out=np.ones_like(variance), where=variance > 0.0)
        return np.asarray(np.clip(1.0 + (ratio - 1.0) / NUDGE, LEAST, 1.0))


def adapted(samples: ScaledSamples, stationary: StationaryFit, weight: float | None = None) -> AdaptedModel:
    """Adapt the densities to the samples, starting from the stationary fit.

    weight: of the prior; by default it depends on the samples. Segments with a high density are divided, so that a jump
    is located, and adapted once more.
    """
    order = stationary.order
    if order in JUMPING and stationary.time_constant < 1.0 and stationary.oscillator is None:
        least = max(samples.least_noise, samples.noise_where_smooth())
        samples = replace(samples, least_noise=least)
    smoother = StateSpaceSmoother(samples, stationary)
    length = max(1.0, LENGTH[order] * stationary.time_constant)
    noise = max(stationary.noise - samples.rounding, samples.least_noise)
    if weight is None:
        innovation = smoother.adapt(smoother.segments(length, stationary.density), noise, 1).innovation
        weight = max(WEIGHT[order], _evenness(innovation))
    time_constant = START_CONSTANT * stationary.time_constant
    start = replace(stationary, noise=START_NOISE * stationary.noise, time_constant=time_constant)
    segments = smoother.segments(length, start.density)
    fit = smoother.adapt(segments, START_NOISE * noise, ROUNDS, weight)
    segments = _divided(segments[0], fit.density, fit.density > DIVIDED * stationary.density)
    fit = smoother.adapt(segments, fit.noise, MORE_ROUNDS, weight, fit.sites)
    return AdaptedModel(smoother, segments[0], fit, weight)


def adapted_in_pieces(samples: ScaledSamples, stationary: StationaryFit, weight: float) -> AdaptedModel:
    """Adapt to a long trace and locate its jumps, in pieces and in parallel.

    The result does not depend on the number of threads.
    """
    count = samples.value.size
    edges = np.linspace(0, count, max(1, count // PIECE) + 1).astype(int)
    slices = [slice(int(first), int(last)) for first, last in pairwise(edges)]

    def adapted_piece(part: slice) -> AdaptedModel:
        return adapted(samples.part(part), stationary, weight).with_jumps_located()

    with threads(cores()) as submit:
        pieces = results(submit, adapted_piece, slices)
    numbers, last = [], -1
    for piece in pieces:
        # The interval between two pieces belongs to the last segment of the first one.
        numbers.append(np.append(piece.segment, piece.segment[-1]).astype(np.uint32) + np.uint32(last + 1))
        last = int(numbers[-1][-1])
    columns = zip(*(piece.fit for piece in pieces), strict=True)
    fit: list[Any] = [
        np.mean(column) if np.isscalar(column[0]) else np.concatenate(column) for column in columns
    ]
    smoother = StateSpaceSmoother(samples, stationary)
    return AdaptedModel(smoother, np.concatenate(numbers)[:-1], Adaptation(*fit), weight)


def results(submit: Submit, task: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """The results of a task for each of the items, each on a thread."""
    return [future.result() for future in [submit(task, item) for item in items]]


def _divided(segment: Segments, density: Array, chosen: Flags) -> Partition:
    """The segments, with the `chosen` ones (segments,) divided into `PARTS`, and their densities."""
    first = np.searchsorted(segment, np.arange(density.size))
    place = (np.arange(segment.size) - first[segment]) / np.bincount(segment)[segment]
    number = segment.astype(np.int64) * PARTS + np.where(chosen[segment], (PARTS * place).astype(np.int64), 0)
    numbers, divided = np.unique(number, return_inverse=True)
    return divided.astype(np.uint32), density[numbers // PARTS]


def _evenness(innovation: Array) -> float:
    """Weight of the prior: 1 if the process noise is the same in all segments, near 0 for a few jumps.

    The inverse cube of the kurtosis of the process noise over the segments.
    """
    if not innovation.any():
        return 0.0
    return float((innovation.mean() ** 2 / np.mean(innovation**2)) ** 3)
