"""Motion and its uncertainty from samples on true time stamps: a state-space smoother that adapts to jumps.

The derivative of some order of the position is white noise; the order, the usual intensity of that noise, and the
level of the measurement's noise are chosen by likelihood. Moves of drives are piecewise smooth, so that one
intensity fits nowhere: it is then adapted in cells of a few time constants, by likelihood too, under a prior with a
heavy tail (inverse gamma, that is Student's t for the noise), so that dwells get little and jumps get much.

order 3   acceleration that jumps (trapezoids of velocity)
order 4   jerk that jumps (jerk-limited moves)
order 5   smooth moves (sine squared)
order 6   moves that ring

A rounded sample says that position and noise lie within half a quantum of it, no more and no less; at standstill and
creeping that is far from white noise of quantum^2/12 (rust/core/src/smoother/rounding.rs). The noise before rounding is
estimated, for axes vibrate.

The variance is that of the estimate's error where cells are as lively as the samples show them: between jumps the
motion is smoother than the adapted model has it, and the model's own variance would be too wide (`Adapted.share`).
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from guideload.base.arrays import Array
from guideload.base.cores import cores
from guideload.base.errors import TraceError
from guideload.motion.uncertainty import Uncertainty
from guideload.smoothing.adaptive import COLOUR, Adapted, adapted, adapted_in_pieces
from guideload.smoothing.stationary import Fit, Scaled, fitted

Kind = Literal["position", "velocity"]

ORDERS = (3, 4, 5, 6)  # of the white derivative of the position
# Of the standard deviations, fitted to tests/benchmarks/encoder.py: what `Adapted.share` leaves, and less where
# rounding is all the noise there is, for its errors are bounded.
SCALE = {3: 0.83, 4: 0.97, 5: 0.96, 6: 1.12}
QUIET, ROUNDED = 0.1, 0.86  # quanta of noise up to which that is so; factor
# Weight of the adapted models in the choice of the order, where adapting has gained: they fit what they adapted to.
AFTER = 0.5
# Log density by which a model must be better: accelerations that jump are rare, and fit what is coarse.
HANDICAP = {3: 15.0, 4: 0.0, 5: 0.0, 6: 0.0}
JUMP = 20.0  # of the usual intensity: from here on a cell counts as a jump
SUSPICIOUS = 0.01  # noise over range: encoders and their speed signals stay below 0.5 %
FEWEST = 8
# Steps in s and ranges in the value's unit whose powers stay in the range of doubles; and range over quantum.
STEPS, SIZES, FINEST = (1e-15, 1e15), (1e-25, 1e25), 1e15


@dataclass(frozen=True, eq=False)
class Estimate:
    """The motion behind samples, and how far to trust it.

    time                   (n,) s
    position, velocity, acceleration  (n,) m, m/s, m/s2; for velocity samples the position starts at 0
    acceleration_variance  (n,) (m/s2)^2; +-1.96 standard deviations are the 95 % band
    order                  of the white derivative of the position (module docstring)
    noise                  rms of the samples' noise, in their unit
    intensity              (n - 1,) of the white derivative in each interval, (m/s^order)^2 s
    usual                  the intensity before it was adapted
    jumps                  (k, 2) s: stretches whose intensity is 20 times the usual or more
    bandwidth              Hz, up to which a sudden change of the largest acceleration is followed (half amplitude), at
                           most half the samples' rate
    note                   what was chosen, as text
    warning                what that tells of a trace that is too noisy or too coarse, or ""
    uncertainty            the whole of what the samples leave open; None where all are equal
    """

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    acceleration_variance: Array
    order: int
    noise: float
    intensity: Array
    usual: float
    jumps: Array
    bandwidth: float
    note: str
    warning: str
    uncertainty: Uncertainty | None

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, n) accelerations m/s2, drawn from all that fit the samples: their covariance is the estimate's.

        Deviations are scaled as the band is. Time and memory are O(count n).
        """
        if self.uncertainty is None:
            return np.repeat(self.acceleration[None], count, axis=0)
        return self.acceleration + self.uncertainty.draws(count, rng)


def estimate(time: ArrayLike, value: ArrayLike, kind: Kind = "position", quantum: float = 0.0) -> Estimate:
    """Estimate the motion behind samples (module docstring).

    time: (n,) s, strictly increasing, n >= 8. value: (n,) m or m/s according to `kind`.
    quantum: step of the encoder in the value's unit; 0 if unknown.
    Raises TraceError for samples that `checked` refuses, and for a quantum that cannot be theirs.
    """
    stamps, samples = checked(time, value, kind)
    spread = float(np.ptp(samples))
    if not (quantum == 0.0 or spread / FINEST <= quantum < np.inf):
        raise TraceError(
            f"smoothing: quantum: expected 0 (unknown) or at least {spread / FINEST:.3g}, for the samples spread over "
            f"{spread:.3g}; got {quantum!r}"
        )
    if spread == 0.0:
        return _still(stamps, samples, kind)
    for name, size, (least, most) in (
        ("step of time [s]", float(np.median(np.diff(stamps))), STEPS),
        ("spread of the samples", spread, SIZES),
    ):
        if not least <= size <= most:
            raise TraceError(
                f"smoothing: {name}: expected {least:g} to {most:g}, got {size:.3g}; check the unit"
            )
    scaled = Scaled.of(stamps, samples, quantum)
    return _assembled(stamps, samples, kind, scaled, *_chosen(scaled, kind))


def checked(time: ArrayLike, value: ArrayLike, kind: Kind) -> tuple[Array, Array]:
    """Stamps and samples as numbers.

    Raises TraceError for too few samples, other than one value a stamp, numbers that are not finite, times that do not
    increase, and an unknown kind.
    """
    stamps, samples = np.asarray(time, float), np.asarray(value, float)
    if kind not in get_args(Kind):
        raise TraceError(f'smoothing: kind: expected one of {", ".join(get_args(Kind))}, got "{kind}"')
    if stamps.ndim != 1 or samples.shape != stamps.shape:
        raise TraceError(f"smoothing: expected one value a stamp, got {samples.shape} and {stamps.shape}")
    if stamps.size < FEWEST:
        raise TraceError(f"smoothing: expected at least {FEWEST} samples, got {stamps.size}")
    for name, numbers in (("time", stamps), ("value", samples)):
        bad = np.flatnonzero(~np.isfinite(numbers))
        if bad.size:
            raise TraceError(
                f"smoothing: {name}[{bad[0]}]: expected a finite number, got {numbers[bad[0]]} ({bad.size} such)"
            )
    steps = np.diff(stamps)
    if steps.min() <= 0.0:
        at = int(np.argmin(steps > 0.0)) + 1
        before, here = float(stamps[at - 1]), float(stamps[at])
        raise TraceError(f"smoothing: time[{at}]: expected more than {before!r} s, got {here!r}")
    return stamps, samples


def _chosen(scaled: Scaled, kind: Kind) -> tuple[int, Adapted]:
    """The order that foretells single samples best from all others, before and after adapting; its adapted model."""
    lower = 0 if kind == "position" else 1  # derivatives that the samples have taken already
    stretches = scaled.stretches(2 - lower)

    def tried(order: int) -> tuple[float, Fit, list[Adapted]]:
        fit, told = fitted(stretches, order - lower)
        if not (np.isfinite(told) and 0.0 < fit.constant < np.inf):  # long gaps: beyond the range of doubles
            return -np.inf, fit, []
        found = [adapted(part, fit, order) for part in stretches]
        sound = all(np.isfinite(each.gain) and np.isfinite(each.intensity).all() for each in found)
        after = sum(each.gain for each in found)
        gain = told + AFTER * max(told, after) - HANDICAP[order]
        return gain if sound else -np.inf, fit, found

    with ThreadPoolExecutor(cores()) as pool:
        trials = list(pool.map(tried, ORDERS))
    best = int(np.argmax([gain for gain, _, _ in trials]))
    order, (gain, fit, found) = ORDERS[best], trials[best]
    if gain == -np.inf:
        steps = scaled.step * scaled.second
        raise TraceError(
            f"smoothing: no order survives rounding on steps of time from {steps.min():.3g} to {steps.max():.3g} s; "
            "cut the trace at its longest gaps, leave out samples that lie very close together, or take "
            'smoothing="spline" (--smoothing spline)'
        )
    if len(found) == 1:
        return order, found[0]
    weight = float(np.mean([each.weight for each in found]))
    return order, adapted_in_pieces(scaled, fit, order, weight)


def _still(time: Array, value: Array, kind: Kind) -> Estimate:
    zero = np.zeros_like(value)
    position = value.copy() if kind == "position" else value * (time - time[0])
    note = "the axis stands still" if kind == "position" else "constant speed"
    return Estimate(
        time,
        position,
        zero if kind == "position" else value.copy(),
        zero,
        zero,
        ORDERS[0],
        0.0,
        np.zeros(time.size - 1),
        0.0,
        np.zeros((0, 2)),
        np.inf,
        f"{note}: all samples are equal",
        "",
        None,
    )


def _assembled(time: Array, value: Array, kind: Kind, scaled: Scaled, order: int, found: Adapted) -> Estimate:
    mean, variance = found.smoothed()
    fit = found.model.fit
    at = 2 if kind == "position" else 1  # of the acceleration in the state
    scale = SCALE[order] * (ROUNDED if found.level < QUIET**2 * scaled.quantum else 1.0)
    sharpness = scale * np.sqrt(found.share(variance[:, at], at))
    per = [scaled.unit / scaled.second**power for power in range(3)]
    first = mean[:, 0] * per[0] + scaled.origin
    acceleration = mean[:, at] * per[at]
    if kind == "position":
        position, velocity = first, mean[:, 1] * per[1]
    else:
        position, velocity = _travel(time, first, acceleration), first
    intensity = found.intensity[found.cell]
    density = scaled.unit**2 / scaled.second ** (2 * fit.states - 1)
    noise = float(np.sqrt(found.level)) * scaled.unit
    resolved = _resolved(float(np.abs(mean[:, at]).max()), found, at)
    bandwidth = min(resolved, 0.5) / scaled.second  # half the samples' rate at most
    warning = _warning(noise, value, scaled)
    unit = sharpness * per[at]
    return Estimate(
        time,
        position,
        velocity,
        acceleration,
        variance[:, at] * unit**2,
        order,
        noise,
        intensity * density,
        fit.intensity * density,
        _stretches_of(time, intensity >= JUMP * fit.intensity),
        bandwidth,
        _note(kind, order, noise, scaled, bandwidth) + (f"; warning: {warning}" if warning else ""),
        warning,
        Uncertainty(
            found.model.step,
            found.coloured[1],
            found.model.covariance,
            found.cell,
            found.intensity,
            at,
            unit,
        ),
    )


def _resolved(change: float, found: Adapted, derivative: int) -> float:
    """Frequency up to which a sudden change of the acceleration is followed; scaled units.

    The change brings intensity change^2/T to the next derivative for the time T that it takes to be seen, and white
    noise of that intensity is followed up to (intensity/noise)^(1/(2 N)) = 1/T.
    """
    if change == 0.0:
        return np.inf
    noise = COLOUR * found.level + found.model.scaled.rounding
    return float((change**2 / noise) ** (1.0 / (2 * derivative + 1))) / (2.0 * np.pi)


def _stretches_of(time: Array, inside: NDArray[np.bool_]) -> Array:
    """(k, 2) first and last stamp of each run of intervals."""
    edges = np.diff(np.concatenate([[0], inside.astype(int), [0]]))
    found: Array = np.column_stack([time[np.flatnonzero(edges == 1)], time[np.flatnonzero(edges == -1)]])
    return found


def _travel(time: Array, velocity: Array, acceleration: Array) -> Array:
    """Integral of the velocity, 0 at the first stamp: cubic between stamps."""
    step = np.diff(time)
    parts = (
        0.5 * (velocity[1:] + velocity[:-1]) * step + (acceleration[:-1] - acceleration[1:]) * step**2 / 12.0
    )
    return np.concatenate([[0.0], np.cumsum(parts)])


def _note(kind: Kind, order: int, noise: float, scaled: Scaled, bandwidth: float) -> str:
    unit = "m" if kind == "position" else "m/s"
    quantum = scaled.quantum * scaled.unit
    return (
        f"smoother with white derivative {order} of the position, adapted to jumps, by likelihood: noise "
        f"{noise:.2g} {unit} rms before rounding (quantum {quantum:.2g} {unit}), sudden changes followed up "
        f"to {bandwidth:.3g} Hz"
    )


def _warning(noise: float, value: Array, scaled: Scaled) -> str:
    share = noise / float(np.ptp(value))
    if share <= SUSPICIOUS or noise <= scaled.quantum * scaled.unit:
        return ""
    return (
        f"that noise is {100 * share:.2g} % of the signal's range, so the trace is very noisy or "
        f"too coarse for its moves (a sample every {scaled.second:.3g} s): the acceleration is cut"
    )
