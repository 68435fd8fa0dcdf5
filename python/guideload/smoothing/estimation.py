"""Motion and its uncertainty from samples: a state-space smoother that adapts to jumps.

A derivative of the position is white process noise. Its density and the measurement noise maximise the likelihood. The
orders of the derivative are weighted by their leave-one-out predictive likelihood: the estimate is the mean of this
mixture, and its variance is the harmonic mean of their variances plus the variance between them. Moves of drives are
piecewise smooth, so that one density does not suit all of a trace: it is adapted in segments of a few time constants
(`adaptive`). How much the densities differ is uncertain too: each order takes part twice, with densities that differ as
the samples suggest, and with nearly even densities, as suits a motion that vibrates at all times.

order 3   acceleration that jumps (trapezoids of velocity)
order 4   jerk that jumps (jerk-limited moves)
order 5   smooth moves (sine squared)
order 6   moves that ring

A rounded sample means that position plus noise lies within half a quantum of it. At standstill and in creep this is not
white noise of variance quantum^2/12, so site approximations by expectation propagation replace the rounded samples
(rust/core/src/smoother/rounding.rs). The measurement noise before rounding is estimated, because axes vibrate.

Between jumps the motion is smoother than the adapted model, whose variance is too large there. The variance of the
estimate therefore contains only the process noise that the samples show (`AdaptedModel.error_share`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arrays import Array, runs_of
from guideload.base.cores import cores, threads
from guideload.base.errors import RunError, TraceError
from guideload.motion.uncertainty import Uncertainty
from guideload.smoothing.adaptive import COLOUR, AdaptedModel, adapted, adapted_in_pieces
from guideload.smoothing.kinematics import (
    UNIT,
    Kind,
    Kinematics,
    checked,
    noise_warning,
    of_equal_samples,
    travel,
)
from guideload.smoothing.stationary import ScaledSamples, StationaryFit, fitted

ORDERS = (3, 4, 5, 6)  # of the white derivative of the position
# Factors on the standard deviations, calibrated by tests/benchmarks/encoder.py, by order; times ROUNDED if rounding
# dominates the noise, because its errors are bounded.
SCALE = {3: 0.78, 4: 0.89, 5: 0.84, 6: 0.97}
QUIET, ROUNDED = 0.1, 0.86  # quanta of measurement noise up to which rounding dominates; factor
# Weight of the adapted models in the score of an order; below 1, as they have been fitted to the same samples.
ADAPTED_WEIGHT = 0.5
# Difference of two scores that makes an order e times as probable as another: above 1, as no order is the true model
# and the scores of neighbouring samples err together. Least weight of an order that takes part.
TEMPERATURE, LEAST_WEIGHT = 4.0, 0.01
# Weight of the prior for nearly even densities, and score below the best order's down to which it is tried.
EVEN, TRIED = 1.0, 30.0
# Log density subtracted from the score of an order: jumps of acceleration are rare, but fit coarse samples well.
HANDICAP = {3: 12.0, 4: 0.0, 5: 0.0, 6: 0.0}
JUMP = 20.0  # times the stationary density: a segment with at least this density is a jump
# Limits within which powers of the step [s] and of the range of samples fit a double; largest range over quantum.
STEPS, RANGES, FINEST = (1e-15, 1e15), (1e-25, 1e25), 1e15


@dataclass(frozen=True, eq=False)
class Estimate(Kinematics):
    """Estimated motion with its uncertainty; `bandwidth` holds for a sudden change by the largest acceleration.

    time                   (n,) s
    acceleration_variance  (n,) (m/s2)^2; +-1.96 standard deviations are the 95 % credible band
    order                  of the white derivative of the position (module docstring), the one with the largest weight
    weights                weight of each order in the mixture, the largest first; they sum to 1
    noise                  rms measurement noise, before rounding, in the unit of the samples
    density                (n - 1,) process-noise density in each interval, (m/s^order)^2 s
    stationary_density     density of the stationary fit, in the same unit
    jumps                  (k, 2) s, start and end of stretches whose density is at least 20 times the stationary one
    warning                if the trace is too noisy or too coarse, else ""
    uncertainty            posterior of the acceleration, for draws; None if all samples are equal
    """

    time: Array
    acceleration_variance: Array
    density: Array
    jumps: Array
    order: int = ORDERS[0]
    weights: dict[int, float] = field(default_factory=lambda: {ORDERS[0]: 1.0})
    noise: float = 0.0
    stationary_density: float = 0.0
    warning: str = ""
    uncertainty: Uncertainty | None = None

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, n) m/s2, draws of the acceleration from its posterior. Time and memory are O(count n)."""
        if self.uncertainty is None:
            return np.repeat(self.acceleration[None], count, axis=0)
        return self.acceleration + self.uncertainty.draws(count, rng)


def estimate(time: ArrayLike, value: ArrayLike, kind: Kind = "position", quantum: float = 0.0) -> Estimate:
    """Estimate the motion behind samples (module docstring).

    time: (n,) s, strictly increasing, n >= 8. value: (n,) m or m/s according to `kind`.
    quantum: step of the encoder in the unit of the samples; 0 if unknown.
    Raises TraceError for samples that `checked` refuses, and for a quantum that does not fit them; MemoryError
    if there is too little memory.
    """
    stamps, samples = checked(time, value, kind)
    spread = float(np.ptp(samples))
    if not (quantum == 0.0 or spread / FINEST <= quantum < np.inf):
        raise TraceError(
            f"smoothing: quantum: expected 0 (unknown) or at least {spread / FINEST:.3g}, for the samples spread over "
            f"{spread:.3g}; got {quantum!r}"
        )
    if spread == 0.0:
        still = of_equal_samples(stamps, samples, kind)
        variance, density, jumps = still.acceleration, np.zeros(stamps.size - 1), np.zeros((0, 2))
        return Estimate(
            **vars(still), time=stamps, acceleration_variance=variance, density=density, jumps=jumps
        )
    for name, size, (least, most) in (
        ("step of time [s]", float(np.median(np.diff(stamps))), STEPS),
        ("spread of the samples", spread, RANGES),
    ):
        if not least <= size <= most:
            raise TraceError(
                f"smoothing: {name}: expected {least:g} to {most:g}, got {size:.3g}; check the unit"
            )
    try:
        scaled = ScaledSamples.of(stamps, samples, quantum)
        return _estimate(stamps, samples, kind, scaled, _weighted(scaled, kind))
    except MemoryError as error:
        if str(error):
            raise
        # Those of Python and NumPy may have no text.
        raise MemoryError(f"smoothing: not enough memory for {samples.size} samples") from error


@dataclass(frozen=True, eq=False)
class Candidate:
    """An order of the white derivative, adapted to all samples, and its weight in the mixture."""

    order: int
    weight: float
    model: AdaptedModel

    def posterior(self, at: int) -> tuple[Array, Array, Array]:
        """(n, 3) means of the state; (n,) variance of its number `at`, and the same calibrated."""
        mean, variance = self.model.smoother.smooth(
            (self.model.segment, self.model.fit.density), self.model.coloured_sites
        )
        quiet = self.model.fit.noise < QUIET**2 * self.model.smoother.samples.quantum
        scale = SCALE[self.order] * (ROUNDED if quiet else 1.0)
        return mean, variance[:, at], scale**2 * variance[:, at] * self.model.error_share(variance[:, at], at)


class Trial(NamedTuple):
    """An order of the white derivative, adapted to the excerpts, and its score; -inf if it failed."""

    order: int
    score: float
    fit: StationaryFit
    predictive: float  # score of the stationary fit
    models: list[AdaptedModel]


def _tried(excerpts: list[ScaledSamples], order: int, states: int) -> Trial:
    """The stationary fit of an order, adapted with the weight of the prior that the samples suggest."""
    fit = StationaryFit(states, 1.0, 1.0)
    try:
        fit, predictive = fitted(excerpts, states)
        if np.isfinite(predictive) and 0.0 < fit.time_constant < np.inf:  # else long gaps, beyond doubles
            return _adapted_trial(excerpts, Trial(order, -np.inf, fit, predictive, []), None)
    except RunError:  # beyond the range of numbers
        pass
    return Trial(order, -np.inf, fit, -np.inf, [])


def _adapted_trial(excerpts: list[ScaledSamples], trial: Trial, weight: float | None) -> Trial:
    """The trial adapted with this weight of the prior."""
    try:
        models = [adapted(part, trial.fit, trial.order, weight) for part in excerpts]
    except RunError:  # beyond the range of numbers
        return trial._replace(score=-np.inf)
    after = sum(float(model.fit.predictive.sum()) for model in models)
    sound = np.isfinite(after) and all(np.isfinite(model.fit.density).all() for model in models)
    score = trial.predictive + ADAPTED_WEIGHT * after - HANDICAP[trial.order]
    return trial._replace(score=score if sound else -np.inf, models=models)


def _weighted(samples: ScaledSamples, kind: Kind) -> list[Candidate]:
    """The orders by their leave-one-out predictive likelihood before and after adapting, the best first."""
    taken = 0 if kind == "position" else 1  # order of the derivative of the position that was sampled
    excerpts = samples.excerpts(2 - taken)
    with threads(cores()) as submit:
        first = [submit(lambda order: _tried(excerpts, order, order - taken), order) for order in ORDERS]
        trials: list[Trial] = [future.result() for future in first]
        best = max(trial.score for trial in trials)
        near = [trial for trial in trials if trial.score > best - TRIED]
        even = [submit(lambda trial: _adapted_trial(excerpts, trial, EVEN), trial) for trial in near]
        trials += [future.result() for future in even]
    scores = np.array([trial.score for trial in trials])
    if not np.isfinite(scores.max()):
        steps = samples.step * samples.time_unit
        raise TraceError(
            f"smoothing: no order survives rounding on steps of time from {steps.min():.3g} to {steps.max():.3g} s; "
            "cut the trace at its longest gaps or leave out samples that lie very close together"
        )
    # The scores are those of the excerpts; that of all samples grows with their number.
    whole = samples.value.size / sum(part.value.size for part in excerpts)
    weights = np.exp((scores - scores.max()) * whole / TEMPERATURE)
    weights[weights < LEAST_WEIGHT] = 0.0
    weights /= weights.sum()

    def candidate(number: int) -> Candidate:
        order, _, fit, _, models = trials[number]
        if len(models) == 1:
            return Candidate(order, float(weights[number]), models[0])
        prior = float(np.mean([model.weight for model in models]))
        return Candidate(order, float(weights[number]), adapted_in_pieces(samples, fit, order, prior))

    return [candidate(int(number)) for number in np.argsort(-scores) if weights[number] > 0.0]


def _estimate(
    time: Array, value: Array, kind: Kind, samples: ScaledSamples, candidates: list[Candidate]
) -> Estimate:
    """The estimate of a mixture of adapted models, in SI units."""
    at = 2 if kind == "position" else 1  # index of the acceleration in the state
    shares = _shares(candidates)
    order = next(iter(shares))
    leading = next(i for i, each in enumerate(candidates) if each.order == order)
    model = candidates[leading].model
    weights = np.array([each.weight for each in candidates])
    posteriors = [each.posterior(at) for each in candidates]
    mean = np.asarray(sum(w * found for w, (found, _, _) in zip(weights, posteriors, strict=True)))
    between = np.zeros(time.size)
    for weight, (found, _, _) in zip(weights, posteriors, strict=True):
        between += weight * (found[:, at] - mean[:, at]) ** 2
    variance = _harmonic_mean(np.array([own for _, _, own in posteriors]), weights) + between
    # The chain of the best order carries the deviations of the mixture, scaled to its variance.
    chain = posteriors[leading][1]
    calibration = np.sqrt(np.divide(variance, chain, out=np.ones_like(chain), where=chain > 0.0))
    stationary = model.smoother.fit
    units = [samples.value_unit / samples.time_unit**power for power in range(3)]
    smoothed = mean[:, 0] * units[0] + samples.origin
    acceleration = mean[:, at] * units[at]
    if kind == "position":
        position, velocity = smoothed, mean[:, 1] * units[1]
    else:
        position, velocity = travel(time, smoothed, acceleration), smoothed
    density = model.fit.density[model.segment]
    density_unit = samples.value_unit**2 / samples.time_unit ** (2 * stationary.states - 1)
    noise = float(np.sqrt(model.fit.noise)) * samples.value_unit
    quantum = samples.quantum * samples.value_unit
    # A change of acceleration within the time T is process noise of density change^2/T in the next derivative. The
    # smoother follows it up to (density/noise)^(1/(2 N)) = 1/T.
    change = float(np.abs(mean[:, at]).max())
    white = COLOUR * model.fit.noise + samples.rounding
    followed = (change**2 / white) ** (1.0 / (2 * at + 1)) / (2.0 * np.pi)
    bandwidth = (min(followed, 0.5) if change else 0.5) / samples.time_unit
    warning = noise_warning(noise, value, quantum, samples.time_unit)
    unit = calibration * units[at]
    return Estimate(
        time=time,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        acceleration_variance=chain * unit**2,
        order=order,
        weights=shares,
        noise=noise,
        density=density * density_unit,
        stationary_density=stationary.density * density_unit,
        jumps=np.column_stack([time[edge] for edge in runs_of(density >= JUMP * stationary.density)]),
        bandwidth=bandwidth,
        note=f"smoother with white derivative {_in_words(shares)} of the position, adapted to jumps, by likelihood: "
        f"noise {noise:.2g} {UNIT[kind]} rms before rounding (quantum {quantum:.2g} {UNIT[kind]}), sudden changes "
        f"followed up to {bandwidth:.3g} Hz" + (f"; warning: {warning}" if warning else ""),
        warning=warning,
        uncertainty=Uncertainty(
            step=model.smoother.step,
            variance=model.coloured_sites[1],
            covariance=model.smoother.covariance,
            segment=model.segment,
            density=model.fit.density,
            derivative=at,
            unit=unit,
        ),
    )


def _harmonic_mean(values: Array, weights: Array) -> Array:
    """(n,) weighted harmonic mean over the first axis of values (k, n) >= 0."""
    return np.asarray(1.0 / (weights @ (1.0 / np.maximum(values, np.finfo(float).tiny))))


def _shares(candidates: list[Candidate]) -> dict[int, float]:
    """Weight of each order, the largest first."""
    shares: dict[int, float] = {}
    for each in candidates:
        shares[each.order] = shares.get(each.order, 0.0) + each.weight
    return dict(sorted(shares.items(), key=lambda share: -share[1]))


def _in_words(shares: dict[int, float]) -> str:
    """The orders in words: "4", or "4 (72 %) or 5 (28 %)"."""
    if len(shares) == 1:
        return str(next(iter(shares)))
    return " or ".join(f"{order} ({100 * share:.0f} %)" for order, share in shares.items())
