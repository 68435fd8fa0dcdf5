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

An axis that rings after each change of its acceleration follows its drive as an oscillator does. If that is much more
likely, the orders (3 and 4) are those of the position of the drive, and frequency and damping of the oscillator are
estimated too (`oscillation`).

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

from guideload.base.arrays import Array, find_runs
from guideload.base.errors import TraceError
from guideload.base.warnings import WarningText
from guideload.motion.uncertainty import Uncertainty
from guideload.smoothing.adaptive import COLOUR, JUMP
from guideload.smoothing.kinematics import (
    UNIT,
    Kind,
    Kinematics,
    checked_samples,
    constant_motion,
    noise_warning,
    travel,
)
from guideload.smoothing.selection import ORDERS, MixtureComponent, weighted
from guideload.smoothing.stationary import Oscillator, ScaledSamples

# Limits within which powers of the step [s] and of the range of samples fit a double; largest range over quantum.
STEPS, RANGES, FINEST = (1e-15, 1e15), (1e-25, 1e25), 1e15


class Oscillation(NamedTuple):
    """Oscillator between the drive and the encoder."""

    natural_frequency: float  # undamped, Hz
    damping_ratio: float

    def __str__(self) -> str:
        return f"{self.natural_frequency:.3g} Hz with damping ratio {self.damping_ratio:.2g}"


@dataclass(frozen=True, eq=False)
class MotionEstimate(Kinematics):
    """Estimated motion with its uncertainty; `bandwidth` holds for a sudden change by the largest acceleration."""

    time: Array  # (n,) s
    # (n,) (m/s2)^2, of the error at a stamp; +-1.96 standard deviations are the 95 % credible band
    acceleration_variance: Array
    density: Array  # (n - 1,) process-noise density in each interval, (m/s^order)^2 s
    jumps: Array  # (k, 2) s, start and end of stretches whose density is at least 20 times the stationary one
    # of the white derivative of the position, or of the drive if the axis rings, with the largest weight
    order: int = ORDERS[0]
    # weight of each order in the mixture, the largest first; they sum to 1
    weights: dict[int, float] = field(default_factory=lambda: {ORDERS[0]: 1.0})
    noise: float = 0.0  # rms measurement noise, before rounding, in the unit of the samples
    # frequency and damping with which the axis rings; None if the samples show no ringing
    oscillation: Oscillation | None = None
    warning: str = ""  # if the trace is too noisy or too coarse, else ""
    # posterior of the acceleration over time, for loads, with at least this variance; None if all samples are equal
    uncertainty: Uncertainty | None = None

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, n) m/s2, draws of the acceleration from its posterior. Time and memory are O(count n)."""
        if self.uncertainty is None:
            return np.repeat(self.acceleration[None], count, axis=0)
        return self.acceleration + self.uncertainty.draws(count, rng)


def estimate(
    time: ArrayLike, value: ArrayLike, kind: Kind = "position", quantum: float = 0.0
) -> MotionEstimate:
    """Estimate the motion behind samples (module docstring).

    time: (n,) s, strictly increasing, n >= 8. value: (n,) m or m/s according to `kind`.
    quantum: step of the encoder in the unit of the samples; 0 if unknown.
    Raises TraceError for samples that `checked_samples` refuses, and for a quantum that does not fit them; MemoryError
    if there is too little memory.
    """
    stamps, samples = checked_samples(time, value, kind)
    spread = float(np.ptp(samples))
    if not (quantum == 0.0 or spread / FINEST <= quantum < np.inf):
        raise TraceError(
            f"smoothing: quantum: expected 0 (unknown) or at least {spread / FINEST:.3g}, for the samples spread over "
            f"{spread:.3g}; got {quantum!r}"
        )
    if spread == 0.0:
        still = constant_motion(stamps, samples, kind)
        variance, density, jumps = still.acceleration, np.zeros(stamps.size - 1), np.zeros((0, 2))
        return MotionEstimate(
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
        return _estimate(stamps, samples, kind, scaled, weighted(scaled, 0 if kind == "position" else 1))
    except MemoryError as error:
        if str(error):
            raise
        # Those of Python and NumPy may have no text.
        raise MemoryError(f"smoothing: not enough memory for {samples.size} samples") from error


def _estimate(
    time: Array, value: Array, kind: Kind, samples: ScaledSamples, candidates: list[MixtureComponent]
) -> MotionEstimate:
    """The estimate of a mixture of adapted models, in SI units."""
    shares = _shares(candidates)
    order = next(iter(shares))
    leading = next(i for i, each in enumerate(candidates) if each.order == order)
    model = candidates[leading].model
    at = model.smoother.fit.acceleration
    weights = np.array([each.weight for each in candidates])
    mean = np.asarray(sum(each.weight * each.mean for each in candidates))
    between = np.zeros(time.size)
    for each in candidates:
        between += each.weight * (each.mean[:, at] - mean[:, at]) ** 2
    variance = _harmonic_mean(np.array([each.error_variance for each in candidates]), weights) + between
    # The posterior of the best order describes the deviations over time, widened where the orders differ. It is not
    # narrowed to the error of the acceleration, which is small between the kinks of a move: those excite the modes.
    posterior = candidates[leading].variance
    ratio = np.divide(variance, posterior, out=np.ones_like(variance), where=posterior > 0.0)
    stationary = model.smoother.fit
    units = [samples.value_unit / samples.time_unit**power for power in range(3)]
    smoothed = mean[:, 0] * units[0] + samples.origin
    acceleration = mean[:, at] * units[at]
    if kind == "position":
        position, velocity = smoothed, mean[:, 1] * units[1]
    else:
        position, velocity = travel(time, smoothed, acceleration), smoothed
    density = model.fit.density[model.segment]
    density_unit = samples.value_unit**2 / samples.time_unit**stationary.power
    noise = float(np.sqrt(model.fit.noise)) * samples.value_unit
    quantum = samples.quantum * samples.value_unit
    # A change of acceleration within the time T is process noise of density change^2/T in the next derivative. The
    # smoother follows it up to (density/noise)^(1/(2 N)) = 1/T.
    change = float(np.abs(mean[:, at]).max())
    white = COLOUR * model.fit.noise + samples.rounding
    followed = (change**2 / white) ** (1.0 / (2 * at + 1)) / (2.0 * np.pi)
    bandwidth = (min(followed, 0.5) if change else 0.5) / samples.time_unit
    warning = noise_warning(noise, value, quantum, samples.time_unit)
    oscillation = _oscillation(samples, stationary.oscillator)
    ringing = f", which the axis follows as an oscillator of {oscillation}" if oscillation else ""
    return MotionEstimate(
        time=time,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        acceleration_variance=variance * units[at] ** 2,
        order=order,
        weights=shares,
        noise=noise,
        density=density * density_unit,
        jumps=np.column_stack([time[edge] for edge in find_runs(density >= JUMP * stationary.density)]),
        bandwidth=bandwidth,
        note=f"smoother with white derivative {_in_words(shares)} of the {'drive' if oscillation else 'position'}"
        f"{ringing}, adapted to jumps, by likelihood: "
        f"noise {noise:.2g} {UNIT[kind]} rms before rounding (quantum {quantum:.2g} {UNIT[kind]}), sudden changes "
        f"followed up to {bandwidth:.3g} Hz",
        oscillation=oscillation,
        warning=warning,
        uncertainty=Uncertainty(
            step=model.smoother.step,
            variance=model.coloured_sites[1],
            covariance=model.smoother.covariance,
            segment=model.segment,
            density=model.fit.density,
            derivative=at,
            unit=np.sqrt(np.maximum(ratio, 1.0)) * units[at],
            oscillator=stationary.oscillator,
        ),
    )


def noise_warnings(smoothed: Kinematics) -> list[WarningText]:
    """The warning of a trace that is too noisy or too coarse, if the smoothing estimates its noise."""
    text = smoothed.warning if isinstance(smoothed, MotionEstimate) else ""
    way_out = "Log a finer encoder, or at a higher rate."
    return [WarningText("noise", f"Warning: {text}. {way_out}")] if text else []


def _oscillation(samples: ScaledSamples, oscillator: Oscillator | None) -> Oscillation | None:
    """The oscillator in Hz."""
    if oscillator is None:
        return None
    frequency = oscillator.frequency / (2.0 * np.pi * samples.time_unit)
    return Oscillation(float(frequency), oscillator.damping)


def _harmonic_mean(values: Array, weights: Array) -> Array:
    """(n,) weighted harmonic mean over the first axis of values (k, n) >= 0."""
    return np.asarray(1.0 / (weights @ (1.0 / np.maximum(values, np.finfo(float).tiny))))


def _shares(candidates: list[MixtureComponent]) -> dict[int, float]:
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
