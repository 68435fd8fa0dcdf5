"""Motion and its uncertainty from samples on true time stamps: a state-space smoother that adapts to jumps.

The derivative of some order of the position is white noise; the order, the usual intensity of that noise, and the
level of the measurement's noise are chosen by likelihood. Moves of drives are piecewise smooth, so that one
intensity fits nowhere: it is then adapted in cells of a few time constants, by likelihood too, under a prior with a
heavy tail (inverse gamma, that is Student's t for the noise), so that dwells get little and jumps get much.

order 3   acceleration that jumps (trapezoids of velocity)
order 4   jerk that jumps (jerk-limited moves)
order 5   smooth moves (sine squared)
order 6   moves that ring

The quantum is the floor of the measurement's noise, quantum^2/12, and no more than its floor, for axes vibrate.
Rounding is no white noise where the axis creeps: equal samples in a row repeat one error, so their noise is raised,
and orders are compared on samples that differ from their neighbours. At constant speed it can be a slow tone; an
order that follows it, so that its residuals fall below the floor, earns nothing by that.

The band was checked on made moves, on which the Gaussian band of the adapted model is too wide where few jumps make
the motion, and too narrow where all cells move: `_scale` takes that out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from guideload import _core
from guideload.errors import TraceError
from guideload.fits import Cells, Fit, Model, Scaled, best_of, fitted
from guideload.uncertainty import Uncertainty

Array = NDArray[np.float64]
Kind = Literal["position", "velocity"]

ORDERS = (3, 4, 5, 6)  # of the white derivative of the position
# Weight of the usual intensity, in squared noises of a cell: the smaller, the heavier the tail.
WEIGHT = {3: 3e-4, 4: 1e-3, 5: 0.02, 6: 0.1}
CELL = {3: 3.0, 4: 3.0, 5: 10.0, 6: 10.0}  # time constants: length of a cell
# Of the standard deviations: for one cell in 10^4, the change per decade, and the least below a quarter step of time
# constant, where no sample lies in a jump (fitted to tests/benchmarks/encoder.py).
SCALE = {3: 0.44, 4: 0.65, 5: 0.71, 6: 0.89}
SCALE_PER_DECADE, SCALE_BETWEEN = 0.07, 0.85
ROUNDS = 10  # of adapting; more gain nothing
START_CONSTANT, START_LEVEL = 2.0, 2.0  # times the stationary fit's: adapting starts on the smooth side
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
    bandwidth              Hz, above which samples are taken for noise (half amplitude) at the usual intensity
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
    candidates = [fitted(scaled, order - lower) for order in ORDERS]
    order = ORDERS[best_of(scaled, candidates)]
    return _adapted(stamps, samples, kind, scaled, candidates[ORDERS.index(order)], order)


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
    everywhere = slice(0, value.size)
    even = _evenness(scaled, fit, length)
    weight = max(WEIGHT[order], even)
    model = Model(scaled, everywhere, fit)
    first = START_LEVEL * fit.level
    slow = Fit(fit.states, first, START_CONSTANT * fit.constant)
    intensity = np.full(int(cell[-1]) + 1, slow.intensity)
    intensity, level = _core.adapt_motion(
        *model.arguments(1.0, cell), intensity, first, ROUNDS, fit.intensity, weight, scaled.floor
    )
    arguments = model.arguments(level, cell)
    mean, variance, _ = _core.smooth_motion(*arguments, intensity)
    lower = 0 if kind == "position" else 1
    per = [scaled.unit / scaled.second**power for power in range(3)]
    if kind == "position":
        position, velocity = mean[:, 0] * per[0] + scaled.origin, mean[:, 1] * per[1]
    else:
        velocity = mean[:, 0] * per[0] + scaled.origin
        position = _travel(time, velocity, mean[:, 1] * per[1])
    scale, unit = _scale(order, fit, even), per[2 - lower]
    jump = intensity >= JUMP * fit.intensity
    density = scaled.unit**2 / scaled.second ** (2 * fit.states - 1)
    step, _, noises, _, covariance, _ = arguments
    left_open = Uncertainty(step, noises, covariance, cell, intensity, 2 - lower, scale * unit)
    noise = float(np.sqrt(level)) * scaled.unit
    bandwidth = (fit.intensity / level) ** (0.5 / fit.states) / (2.0 * np.pi * scaled.second)
    return Estimate(
        time,
        position,
        velocity,
        mean[:, 2 - lower] * unit,
        variance[:, 2 - lower] * (scale * unit) ** 2,
        order,
        noise,
        intensity[cell] * density,
        fit.intensity * density,
        _stretches_of(time, jump[cell]),
        bandwidth,
        _note(kind, order, noise, value, scaled, bandwidth),
        left_open,
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
    flat = np.full(int(cell[-1]) + 1, fit.intensity)
    # One round multiplies by the square root of found over expected.
    once, _ = _core.adapt_motion(
        *model.arguments(1.0, cell), flat, fit.level, 1, fit.intensity, 0.0, scaled.floor
    )
    found = (once / fit.intensity) ** 2
    return float((found.mean() ** 2 / np.mean(found**2)) ** 3)


def _scale(order: int, fit: Fit, even: float) -> float:
    """Standard deviations to claim, over those of the adapted model."""
    scale = SCALE[order] + SCALE_PER_DECADE * float(np.clip(np.log10(even) + 4.0, 0.0, 4.0))
    return max(scale, SCALE_BETWEEN) if fit.constant < 0.25 else scale


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
    quantum = np.sqrt(12.0 * scaled.floor) * scaled.unit
    note = (
        f"smoother with white derivative {order} of the position, adapted to jumps, by likelihood: noise "
        f"{noise:.2g} {unit} rms (quantum {quantum:.2g} {unit}), motion followed up to {bandwidth:.3g} Hz, "
        "beyond where it jumps"
    )
    share = noise / float(np.ptp(value))
    if share > SUSPICIOUS and noise > quantum:
        note += (
            f"; warning: that noise is {100 * share:.2g} % of the signal's range, so the trace is very noisy or "
            f"too coarse for its moves (a sample every {scaled.second:.3g} s): the acceleration is cut"
        )
    return note
