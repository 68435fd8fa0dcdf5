"""Smoothing of samples of position or velocity, by one of three methods.

``auto``            state-space smoother that adapts to jumps, with the variance of the acceleration (`estimation`); for
                    any time stamps
``savitzky_golay``  for comparison: local cubics in a window; for uniform stamps
``differences``     for comparison: finite differences of the samples; the quantum appears as noise
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arrays import Array
from guideload.base.errors import TraceError
from guideload.base.ranges import PERIOD
from guideload.smoothing.estimation import estimate
from guideload.smoothing.kinematics import Kind, Kinematics, checked_samples, travel

__all__ = ["Kind", "Kinematics", "Method", "find_quantum", "smooth"]

Method = Literal["auto", "savitzky_golay", "differences"]

UNIFORM = 0.01  # of the step: largest deviation of stamps for filters that need uniform ones


def smooth(
    time: ArrayLike,
    value: ArrayLike,
    kind: Kind,
    method: Method = "auto",
    *,
    quantum: float = 0.0,
    window: float | None = None,
) -> Kinematics:
    """Estimate the motion behind samples; `auto` returns a `MotionEstimate`.

    Parameters
    ----------
    time : (n,) s, strictly increasing, n >= 8
    value : (n,) m or m/s according to `kind`
    quantum
        Step of the encoder in the unit of the samples; 0 if unknown: `auto` then uses `find_quantum`.
    window
        s, for `savitzky_golay` only.

    Raises
    ------
    TraceError
        For samples that `checked_samples` refuses, and for a method that is unknown or does not suit them.
    """
    stamps, samples = checked_samples(time, value, kind)
    if method not in get_args(Method):
        raise TraceError(f'smoothing: expected one of {", ".join(get_args(Method))}, got "{method}"')
    if window is not None and not (window > 0.0 and PERIOD.holds(window)):
        raise TraceError(f"window: expected {PERIOD.words} s, got {window!r}")
    if window is not None and method != "savitzky_golay":
        raise TraceError(f'smoothing: "{method}" takes no window, got {window:g} s')
    if method == "savitzky_golay":
        return _savitzky_golay(stamps, samples, kind, window)
    if method == "differences":
        return _differences(stamps, samples, kind)
    return estimate(stamps, samples, kind, quantum or find_quantum(samples))


def find_quantum(value: ArrayLike, resolution: float = 0.0) -> float:
    """Quantum of the samples, in their unit; 0 if none is found.

    It is the smallest change, if at least 90 % of all changes are multiples of it, within 2 % plus the `resolution` of
    the written values, at most 10 % (a wider tolerance would accept accidental steps). Rounding of doubles, and logs
    whose number of decimals changes, give 0.
    """
    samples = np.asarray(value, float)
    steps = np.abs(np.diff(samples))
    steps = steps[steps > 1e-9 * np.ptp(samples)]  # smaller ones are rounding of decimals to doubles
    if steps.size == 0:
        return 0.0
    smallest = float(steps.min())
    # Mean over multiples up to 8: the smallest change alone has too large a rounding error.
    small = steps[steps < 8.5 * smallest]
    step = float(np.sum(small) / np.sum(np.round(small / smallest)))
    # The error of `step` is too large for multiples above 1000.
    ratio = steps[steps < 1000.0 * step] / step
    near = min(0.1, 0.02 + resolution / step)
    if ratio.size < min(8, steps.size) or np.mean(np.abs(ratio - np.round(ratio)) < near) < 0.9:
        return 0.0
    return step


def _savitzky_golay(time: Array, value: Array, kind: Kind, window: float | None) -> Kinematics:
    """Savitzky and Golay 1964: a cubic per window; for samples of velocity, position by the trapezoidal rule."""
    step = float(time[-1] - time[0]) / (time.size - 1)
    worst = float(np.abs(np.diff(time) - step).max()) / step
    if worst > UNIFORM:
        raise TraceError(
            f'smoothing: "savitzky_golay" needs uniform time stamps, their steps vary by '
            f'{100 * worst:.2g} %; use smoothing="auto"'
        )
    if window is None:
        raise TraceError('smoothing: "savitzky_golay" needs a window in seconds: window=0.05 (--window 0.05)')
    length = 2 * round(0.5 * (window / step - 1.0)) + 1
    if not 5 <= length <= time.size:
        size = f"{length} samples of {step:.3g} s"
        raise TraceError(f"smoothing: window {window:g} s is {size}; expected 5 to {time.size}")
    from scipy.signal import savgol_filter  # a slow import, needed here only

    orders = (0, 1, 2) if kind == "position" else (0, 1)
    fits: list[Array] = [savgol_filter(value, length, 3, deriv=order, delta=step) for order in orders]
    if kind == "velocity":
        fits.insert(0, travel(time, fits[0]))
    note = f"Savitzky-Golay, cubic, {length} samples ({length * step:.3g} s)"
    return Kinematics(fits[0], fits[1], fits[2], _half_amplitude(length, orders[-1], step), note)


def _half_amplitude(length: int, order: int, step: float) -> float:
    """Frequency [Hz] at which a Savitzky-Golay derivative has half the true amplitude; inf if there is none."""
    from scipy.signal import savgol_coeffs

    count = 16 * length
    gain = np.abs(np.fft.rfft(savgol_coeffs(length, 3, deriv=order, delta=step), count))[1:]
    frequency = np.arange(1, gain.size + 1) / (count * step)
    passed = gain / (2.0 * np.pi * frequency) ** order
    below = int(np.argmax(passed < 0.5))
    if not below:  # no frequency is damped
        return np.inf
    share = (passed[below - 1] - 0.5) / (passed[below - 1] - passed[below])
    return float(frequency[below - 1] + share * (frequency[below] - frequency[below - 1]))


def _differences(time: Array, value: Array, kind: Kind) -> Kinematics:
    """First derivative from both neighbours, second derivative from three samples (central differences)."""
    slope: Array = np.gradient(value, time)
    note = "plain differences: the quantum is not smoothed away"
    if kind == "velocity":
        return Kinematics(travel(time, value), value.copy(), slope, np.inf, note)
    steps = np.diff(time)
    inner = np.diff(np.diff(value) / steps) / (0.5 * (steps[1:] + steps[:-1]))
    return Kinematics(value.copy(), slope, np.pad(inner, 1, mode="edge"), np.inf, note)
