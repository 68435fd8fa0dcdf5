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
motion is smoother than the adapted model has it, and the model's own variance would be too wide (`_calibrated`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from guideload.errors import TraceError
from guideload.fits import Adapted, Cells, Fit, Model, Scaled, best_of, fitted
from guideload.uncertainty import Uncertainty

Array = NDArray[np.float64]
Kind = Literal["position", "velocity"]

ORDERS = (3, 4, 5, 6)  # of the white derivative of the position
# Weight of the usual intensity, in squared noises of a cell: the smaller, the heavier the tail.
WEIGHT = {3: 3e-4, 4: 1e-3, 5: 0.02, 6: 0.1}
CELL = {3: 3.0, 4: 3.0, 5: 10.0, 6: 10.0}  # time constants: length of a cell
# Of the standard deviations, fitted to tests/benchmarks/encoder.py: what `_calibrated` leaves, and less where rounding
# is all the noise there is, for its errors are bounded.
SCALE = {3: 0.82, 4: 0.89, 5: 0.84, 6: 1.14}
QUIET, ROUNDED = 0.1, 0.88  # quanta of noise up to which that is so; factor
ROUNDS = 8  # of adapting; more gain nothing
START_CONSTANT, START_NOISE = 2.0, 2.0  # times the stationary fit's: adapting starts on the smooth side
ALIKE = 9  # cells whose liveliness is averaged
NUDGE = 1e-2  # of intensities and noise: differences of variances stay far above rounding
LEAST = 1e-2  # of the model's variance
COLOUR = 5.0  # of the noise level: what vibrates is not white, but stronger at the motion's own frequencies
JUMP = 20.0  # of the usual intensity: from here on a cell counts as a jump
SUSPICIOUS = 0.01  # noise over range: encoders and their speed signals stay below 0.5 %
FEWEST = 8


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
    bandwidth              Hz, above which samples are taken for noise (half amplitude) where the acceleration changes
    note                   what was chosen, as text
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
    Raises TraceError for too few samples and for times that do not increase.
    """
    stamps, samples = np.asarray(time, float), np.asarray(value, float)
    if stamps.size < FEWEST:
        raise TraceError(f"smoothing: expected at least {FEWEST} samples, got {stamps.size}")
    steps = np.diff(stamps)
    if steps.min() <= 0.0:
        at = int(np.argmin(steps > 0.0)) + 1
        before, here = float(stamps[at - 1]), float(stamps[at])
        raise TraceError(f"smoothing: time[{at}]: expected more than {before!r} s, got {here!r}")
    if np.ptp(samples) == 0.0:
        return _still(stamps, samples, kind)
    scaled = Scaled.of(stamps, samples, quantum)
    lower = 0 if kind == "position" else 1  # derivatives that the samples have taken already
    fits, told = zip(*(fitted(scaled, order - lower) for order in ORDERS), strict=True)
    chosen = best_of(list(told))
    return _adapted(stamps, samples, kind, scaled, fits[chosen], ORDERS[chosen])


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
        None,
    )


def _adapted(time: Array, value: Array, kind: Kind, scaled: Scaled, fit: Fit, order: int) -> Estimate:
    length = max(1.0, CELL[order] * fit.constant)
    cell = _cells(scaled.time, length)
    weight = max(WEIGHT[order], _evenness(scaled, fit, length))
    smooth = Fit(fit.states, START_NOISE * fit.noise, START_CONSTANT * fit.constant)
    model = Model(scaled, slice(0, value.size), fit)
    level = max(fit.noise - scaled.rounding, scaled.floor)
    start = np.full(int(cell[-1]) + 1, smooth.intensity)
    found = model.adapted(cell, start, START_NOISE * level, ROUNDS, weight)
    sites = (found.value, found.variance + (COLOUR - 1.0) * found.level)
    mean, variance = model.smoothed(cell, found.intensity, sites)
    lower = 0 if kind == "position" else 1
    scale = SCALE[order] * (ROUNDED if found.level < QUIET**2 * scaled.quantum else 1.0)
    sharpness = np.sqrt(_calibrated(model, cell, found, sites, variance)[:, 2 - lower]) * scale
    per = [scaled.unit / scaled.second**power for power in range(3)]
    if kind == "position":
        position, velocity = mean[:, 0] * per[0] + scaled.origin, mean[:, 1] * per[1]
    else:
        velocity = mean[:, 0] * per[0] + scaled.origin
        position = _travel(time, velocity, mean[:, 1] * per[1])
    acceleration = mean[:, 2 - lower] * per[2 - lower]
    intensity = found.intensity[cell]
    density = scaled.unit**2 / scaled.second ** (2 * fit.states - 1)
    jump = intensity >= JUMP * fit.intensity
    noise = float(np.sqrt(found.level)) * scaled.unit
    follows = (intensity / (found.level + scaled.rounding)) ** (0.5 / fit.states) / (
        2.0 * np.pi * scaled.second
    )
    bandwidth = _median(follows, np.diff(acceleration) ** 2)
    return Estimate(
        time,
        position,
        velocity,
        acceleration,
        variance[:, 2 - lower] * (sharpness * per[2 - lower]) ** 2,
        order,
        noise,
        intensity * density,
        fit.intensity * density,
        _stretches_of(time, jump),
        bandwidth,
        _note(kind, order, noise, value, scaled, bandwidth),
        Uncertainty(
            model.step,
            sites[1],
            model.covariance,
            cell,
            found.intensity,
            2 - lower,
            sharpness * per[2 - lower],
        ),
    )


def _cells(time: Array, length: float) -> Cells:
    """(n - 1,) number of the cell of each interval; cells without samples have none."""
    _, cell = np.unique((time[:-1] / length).astype(np.int64), return_inverse=True)
    return cell.astype(np.uint32)


def _evenness(scaled: Scaled, fit: Fit, length: float) -> float:
    """Weight of the usual intensity that the stationary fit suggests: 1 where all cells move alike, 0 for few jumps.

    The inverse cube of the kurtosis of the noise over the cells.
    """
    part = scaled.stretches()[len(scaled.stretches()) // 2]
    model = Model(scaled, part, fit)
    cell = _cells(scaled.time[part], length)
    found = _liveliness(model, cell, np.full(int(cell[-1]) + 1, fit.intensity), fit.noise - scaled.rounding)
    return float((found.mean() ** 2 / np.mean(found**2)) ** 3)


def _liveliness(
    model: Model, cell: Cells, intensity: Array, level: float, sites: tuple[Array, Array] | None = None
) -> Array:
    """(cells,) squares of the noise found in each cell over those that its intensity makes expect."""
    # One round multiplies by the square root of found over expected.
    ratio: Array = (model.adapted(cell, intensity, level, 1, sites=sites).intensity / intensity) ** 2
    return ratio


def _calibrated(
    model: Model, cell: Cells, found: Adapted, sites: tuple[Array, Array], variance: Array
) -> Array:
    """(n, 3) variance of the error over that of the adapted model.

    The model's variance is least for its own intensities and noise, so that its derivative by one of them is what
    that one adds to the error of the estimate as it stands (envelope theorem): what the true ones lack is taken off.
    """
    states = model.fit.states
    alive = _liveliness(model, cell, found.intensity, found.level, (found.value, found.variance))
    # Noiseless motion shows 1/(2 N) of what is expected: the share of the noise alone, for white noise.
    share = (alive - 0.5 / states) / (1.0 - 0.5 / states)
    alike = np.argsort(found.intensity)  # cells of like intensity are judged together: one alone says little
    share[alike] = _mean_of_neighbours(share[alike], ALIKE)
    share = np.clip(share, 0.0, 1.0)
    less = found.intensity * (1.0 - NUDGE * (1.0 - share))
    quieter = sites[1] + NUDGE * (found.variance - sites[1])
    _, nudged = model.smoothed(cell, less, (sites[0], quieter))
    return np.clip(1.0 + (nudged / np.maximum(variance, np.finfo(float).tiny) - 1.0) / NUDGE, LEAST, 1.0)


def _mean_of_neighbours(values: Array, count: int) -> Array:
    window = np.ones(min(count, values.size))
    sums = np.convolve(values, window, "same"), np.convolve(np.ones(values.size), window, "same")
    return np.asarray(sums[0] / sums[1])


def _median(values: Array, weights: Array) -> float:
    """The weighted median; the plain one if all weights are nought."""
    if not weights.any():
        return float(np.median(values))
    order = np.argsort(values)
    share = np.cumsum(weights[order])
    return float(values[order[int(np.searchsorted(share, 0.5 * share[-1]))]])


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


def _note(kind: Kind, order: int, noise: float, value: Array, scaled: Scaled, bandwidth: float) -> str:
    unit = "m" if kind == "position" else "m/s"
    quantum = scaled.quantum * scaled.unit
    note = (
        f"smoother with white derivative {order} of the position, adapted to jumps, by likelihood: noise "
        f"{noise:.2g} {unit} rms before rounding (quantum {quantum:.2g} {unit}), acceleration followed up to "
        f"{bandwidth:.3g} Hz where it changes"
    )
    share = noise / float(np.ptp(value))
    if share > SUSPICIOUS and noise > quantum:
        note += (
            f"; warning: that noise is {100 * share:.2g} % of the signal's range, so the trace is very noisy or "
            f"too coarse for its moves (a sample every {scaled.second:.3g} s): the acceleration is cut"
        )
    return note
