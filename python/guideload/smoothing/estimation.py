"""Motion and its uncertainty from samples: a state-space smoother that adapts to jumps.

A derivative of the position is white process noise. Its density and the measurement noise maximise the likelihood, its
order maximises the leave-one-out predictive likelihood. Moves of drives are piecewise smooth, so that one density does
not suit all of a trace: it is adapted in segments of a few time constants (`adaptive`).

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

from dataclasses import dataclass

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
SCALE = {3: 0.83, 4: 0.97, 5: 0.96, 6: 1.12}
QUIET, ROUNDED = 0.1, 0.86  # quanta of measurement noise up to which rounding dominates; factor
# Weight of the adapted models in the choice of the order; below 1, as they have been fitted to the same samples.
ADAPTED_WEIGHT = 0.5
# Log density subtracted from the score of an order: jumps of acceleration are rare, but fit coarse samples well.
HANDICAP = {3: 15.0, 4: 0.0, 5: 0.0, 6: 0.0}
JUMP = 20.0  # times the stationary density: a segment with at least this density is a jump
# Limits within which powers of the step [s] and of the range of samples fit a double; largest range over quantum.
STEPS, RANGES, FINEST = (1e-15, 1e15), (1e-25, 1e25), 1e15


@dataclass(frozen=True, eq=False)
class Estimate(Kinematics):
    """Estimated motion with its uncertainty; `bandwidth` holds for a sudden change by the largest acceleration.

    time                   (n,) s
    acceleration_variance  (n,) (m/s2)^2; +-1.96 standard deviations are the 95 % credible band
    order                  of the white derivative of the position (module docstring)
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
    Raises TraceError for samples that `checked` refuses, and for a quantum that does not fit them.
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
    scaled = ScaledSamples.of(stamps, samples, quantum)
    return _estimate(stamps, samples, kind, scaled, *_selected(scaled, kind))


def _selected(samples: ScaledSamples, kind: Kind) -> tuple[int, AdaptedModel]:
    """The order with the highest leave-one-out predictive likelihood before and after adapting, and its model."""
    taken = 0 if kind == "position" else 1  # order of the derivative of the position that was sampled
    excerpts = samples.excerpts(2 - taken)

    def trial(order: int) -> tuple[float, StationaryFit, list[AdaptedModel]]:
        fit = StationaryFit(order - taken, 1.0, 1.0)
        try:
            fit, predictive = fitted(excerpts, order - taken)
            if not (
                np.isfinite(predictive) and 0.0 < fit.time_constant < np.inf
            ):  # long gaps, beyond doubles
                return -np.inf, fit, []
            models = [adapted(part, fit, order) for part in excerpts]
        except RunError:  # beyond the range of numbers
            return -np.inf, fit, []
        sound = all(np.isfinite(model.gain) and np.isfinite(model.fit.density).all() for model in models)
        after = sum(model.gain for model in models)
        score = predictive + ADAPTED_WEIGHT * max(predictive, after) - HANDICAP[order]
        return score if sound else -np.inf, fit, models

    with threads(cores()) as submit:
        trials = [future.result() for future in [submit(trial, order) for order in ORDERS]]
    best = int(np.argmax([score for score, _, _ in trials]))
    order, (score, fit, models) = ORDERS[best], trials[best]
    if score == -np.inf:
        steps = samples.step * samples.time_unit
        raise TraceError(
            f"smoothing: no order survives rounding on steps of time from {steps.min():.3g} to {steps.max():.3g} s; "
            "cut the trace at its longest gaps or leave out samples that lie very close together"
        )
    if len(models) == 1:
        return order, models[0]
    weight = float(np.mean([model.weight for model in models]))
    return order, adapted_in_pieces(samples, fit, order, weight)


def _estimate(
    time: Array, value: Array, kind: Kind, samples: ScaledSamples, order: int, model: AdaptedModel
) -> Estimate:
    """The estimate of an adapted model, in SI units."""
    mean, variance = model.smoother.smooth((model.segment, model.fit.density), model.coloured_sites)
    stationary = model.smoother.fit
    at = 2 if kind == "position" else 1  # index of the acceleration in the state
    scale = SCALE[order] * (ROUNDED if model.fit.noise < QUIET**2 * samples.quantum else 1.0)
    calibration = scale * np.sqrt(model.error_share(variance[:, at], at))
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
        acceleration_variance=variance[:, at] * unit**2,
        order=order,
        noise=noise,
        density=density * density_unit,
        stationary_density=stationary.density * density_unit,
        jumps=np.column_stack([time[edge] for edge in runs_of(density >= JUMP * stationary.density)]),
        bandwidth=bandwidth,
        note=f"smoother with white derivative {order} of the position, adapted to jumps, by likelihood: noise "
        f"{noise:.2g} {UNIT[kind]} rms before rounding (quantum {quantum:.2g} {UNIT[kind]}), sudden changes followed "
        f"up to {bandwidth:.3g} Hz" + (f"; warning: {warning}" if warning else ""),
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
