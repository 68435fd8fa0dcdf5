"""From samples of position or velocity to position, velocity and acceleration at the same time stamps.

One function, `smooth`, with four methods:

``auto``            smoother that adapts to jumps, all by likelihood, with the acceleration's variance (`estimation`);
                    for any time stamps
``spline``          for comparison: penalised spline, its strength chosen by likelihood (`spline`)
``savitzky_golay``  for comparison: local cubics in a window that the user gives; for uniform stamps
``differences``     for comparison: plain differences of the samples; the quantum comes out as noise
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arrays import Array
from guideload.base.errors import TraceError
from guideload.smoothing.estimation import Estimate, Kind, checked, estimate
from guideload.smoothing.spline import smoothing_spline

__all__ = ["Kind", "Kinematics", "Method", "quantum_of", "smooth"]

Method = Literal["auto", "spline", "savitzky_golay", "differences"]

UNIFORM = 0.01  # of the step: deviation of stamps up to which a filter for uniform ones is right


@dataclass(frozen=True, eq=False)
class Kinematics:
    """position (n,) m, velocity (n,) m/s, acceleration (n,) m/s2 at the time stamps given, and what was done.

    bandwidth: frequency in Hz above which the samples were taken for noise (half amplitude); inf if not
        known.
    estimate: the whole of what `auto` found, with the acceleration's variance and draws; None for other methods.
    """

    position: Array
    velocity: Array
    acceleration: Array
    bandwidth: float
    note: str
    estimate: Estimate | None = None


def smooth(
    time: ArrayLike,
    value: ArrayLike,
    kind: Kind,
    method: Method = "auto",
    *,
    quantum: float = 0.0,
    window: float | None = None,
) -> Kinematics:
    """Estimate the motion behind samples (module docstring).

    time: (n,) s, strictly increasing, n >= 8; value: (n,) m or m/s according to `kind`.
    quantum: step of the encoder in the value's unit; 0 if unknown; `auto` then looks for it (see `quantum_of`).
    window: s, for `savitzky_golay` only. For velocity samples the position starts at 0.
    Raises TraceError for an unknown method, for what a method cannot do, and for samples that
    `estimation.checked` refuses.
    """
    stamps, samples = checked(time, value, kind)
    if method not in get_args(Method):
        raise TraceError(f'smoothing: expected one of {", ".join(get_args(Method))}, got "{method}"')
    if window is not None and method != "savitzky_golay":
        raise TraceError(f'smoothing: "{method}" takes no window, got {window:g} s')
    if method == "savitzky_golay":
        return _savitzky_golay(stamps, samples, kind, window)
    if method == "differences":
        return _differences(stamps, samples, kind)
    if method == "spline":
        return Kinematics(*smoothing_spline(stamps, samples, kind, quantum))
    found = estimate(stamps, samples, kind, quantum or quantum_of(samples))
    return Kinematics(
        found.position, found.velocity, found.acceleration, found.bandwidth, found.note, estimate=found
    )


def quantum_of(value: ArrayLike, resolution: float = 0.0) -> float:
    """The step in which the samples change, in their unit; 0 if there is none to be seen.

    The smallest change that occurs, if at least 90 % of all changes are whole multiples of it: within 2 %, and the
    `resolution` to which the values are written (at most 10 %), for a chance step fits a few changes within that.
    Rounding of doubles and logs whose number of decimals changes give 0.
    """
    samples = np.asarray(value, float)
    steps = np.abs(np.diff(samples))
    steps = steps[steps > 1e-9 * np.ptp(samples)]  # smaller ones are rounding of decimals to doubles
    if steps.size == 0:
        return 0.0
    smallest = float(steps.min())
    # Refined over multiples up to 8, so that rounding of the smallest alone does not spoil the larger
    # multiples.
    small = steps[steps < 8.5 * smallest]
    step = float(np.sum(small) / np.sum(np.round(small / smallest)))
    # Of changes over 1000 steps the error of `step` itself blurs the multiple.
    ratio = steps[steps < 1000.0 * step] / step
    near = min(0.1, 0.02 + resolution / step)
    if ratio.size < min(8, steps.size) or np.mean(np.abs(ratio - np.round(ratio)) < near) < 0.9:
        return 0.0
    return step


def _savitzky_golay(time: Array, value: Array, kind: Kind, window: float | None) -> Kinematics:
    """Savitzky and Golay 1964: a cubic per window; position of velocity samples by the trapezoidal rule."""
    step = float(time[-1] - time[0]) / (time.size - 1)
    if np.abs(np.diff(time) - step).max() > UNIFORM * step:
        worst = float(np.abs(np.diff(time) - step).max()) / step
        raise TraceError(
            f'smoothing: "savitzky_golay" needs uniform time stamps, their steps vary by '
            f'{100 * worst:.2g} %; use smoothing="auto"'
        )
    if window is None:
        raise TraceError(
            'smoothing: "savitzky_golay" needs its window in seconds: window=0.05 (--window 0.05)'
        )
    length = 2 * round(0.5 * (window / step - 1.0)) + 1
    if not 5 <= length <= time.size:
        raise TraceError(
            f"smoothing: window {window:g} s is {length} samples of {step:.3g} s; expected 5 to {time.size}"
        )
    from scipy.signal import savgol_filter  # a slow import, needed here only

    orders = (0, 1, 2) if kind == "position" else (0, 1)
    parts: list[Array] = [savgol_filter(value, length, 3, deriv=order, delta=step) for order in orders]
    note = f"Savitzky-Golay, cubic, {length} samples ({length * step:.3g} s)"
    bandwidth = _half_amplitude(length, orders[-1], step)
    if kind == "position":
        return Kinematics(parts[0], parts[1], parts[2], bandwidth, note)
    return Kinematics(_travel(time, parts[0]), parts[0], parts[1], bandwidth, note)


def _half_amplitude(length: int, order: int, step: float) -> float:
    """Frequency [Hz] at which a Savitzky-Golay derivative has half the amplitude of the true one; inf if nowhere."""
    from scipy.signal import savgol_coeffs

    count = 16 * length
    gain = np.abs(np.fft.rfft(savgol_coeffs(length, 3, deriv=order, delta=step), count))[1:]
    frequency = np.arange(1, gain.size + 1) / (count * step)
    passed = gain / (2.0 * np.pi * frequency) ** order
    below = int(np.argmax(passed < 0.5))
    if not below:  # at the lowest frequency all is passed
        return np.inf
    place = (passed[below - 1] - 0.5) / (passed[below - 1] - passed[below])
    return float(frequency[below - 1] + place * (frequency[below] - frequency[below - 1]))


def _differences(time: Array, value: Array, kind: Kind) -> Kinematics:
    """Central differences: of neighbours for the first derivative, of the three samples for the second."""
    slope: Array = np.gradient(value, time)
    note = "plain differences: the quantum is not smoothed away"
    if kind == "velocity":
        return Kinematics(_travel(time, value), value.copy(), slope, np.inf, note)
    steps = np.diff(time)
    inner = np.diff(np.diff(value) / steps) / (0.5 * (steps[1:] + steps[:-1]))
    return Kinematics(value.copy(), slope, np.pad(inner, 1, mode="edge"), np.inf, note)


def _travel(time: Array, velocity: Array) -> Array:
    """Integral of the velocity by the trapezoidal rule, 0 at the first stamp."""
    parts = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(parts)])
