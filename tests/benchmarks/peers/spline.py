"""Smoothing spline: one strength for the whole trace, chosen by likelihood. A peer of the estimation.

The snap of the axis (fourth derivative of its position) is white noise of unknown density, the samples have white
noise of unknown variance. The posterior mean is the curve s that minimises, with q the ratio of the two,

    sum (s(t_i) - y_i)^2 + q * integral (d^4 s / dt^4)^2 dt        (position; third derivative for velocity)

(Whittaker 1923, Reinsch 1967, Wahba 1978 for the equivalence; Eilers and Marx 1996 for the B-spline form). s is a
spline of degree 4 (velocity: 3) whose penalised derivative is piecewise constant, so the integral is exact for uneven
time stamps too. All matrices are banded: time is O(n).

q maximises the restricted likelihood (REML; Wahba 1985, Anderssen and Bloomfield 1974) with the noise profiled out,
which is bounded. Not below quantum^2/12: at slow constant speed the rounding error is a tone that follows the signal,
and the likelihood would take it for motion. Not above 4 times the noise in the fourth differences of neighbouring
samples (`_noise_between_neighbours`): where an axis starts and stops within a few samples, as in 10 Hz logs, the
likelihood would take moves for noise. On 130 synthetic and measured traces that are sampled finely enough the ratio
is 0.3 to 2; on the others it is 4 to 200.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.smoothing.kinematics import UNIT, Kind, Kinematics, constant_motion, noise_warning

# Order of the penalised derivative and degree of the spline: white snap in both cases.
ORDER = {"position": 4, "velocity": 3}
# Bounds of log10 lambda (lambda: the strength, for time in knot distances). Below 1e-3 the spline passes through the
# samples. Above 1e4 it bends over more than 3 knots: a mesh twice as coarse is as good, and rounding of the order of
# lambda * 2^(2 order) * 1e-16 must stay far below the quantum over the travel (1e-7 in the finest logs known).
LOWEST, HIGHEST = -3.0, 4.0
NOISE_RATIO = 4.0  # most noise over noise between neighbours: twice the largest where moves are resolved
FEWEST_INTERVALS = 8  # of a mesh: fewer cannot follow one move of an axis


def smoothing_spline(time: Array, value: Array, kind: Kind, quantum: float) -> Kinematics:
    """Smooth samples (n,) m or m/s at `time` (n,) s, n >= 8, rounded to the quantum (0 if unknown)."""
    order = ORDER[kind]
    middle = float(value.mean())
    size = float(np.abs(value - middle).max())
    if np.ptp(value) == 0.0:
        return constant_motion(time, value, kind)
    # Unit scale and unit sampling step, for conditioning.
    samples = (value - middle) / size
    step = float(np.median(np.diff(time)))
    stamps = (time - time[0]) / step
    lowest = max(quantum / size, 1e-13) / np.sqrt(12.0)  # 1e-13: rounding of doubles
    bounds = (lowest, max(lowest, NOISE_RATIO * _noise_between_neighbours(samples)))
    factor = 1
    fit = _Fit(stamps, samples, order, bounds)
    while fit.needs_coarser_mesh() and stamps[-1] / (2 * factor) >= FEWEST_INTERVALS:
        factor *= 2
        fit = _Fit(stamps / factor, samples, order, bounds)
    strength = fit.best()
    _, coefficients, noise = fit.at(strength)
    curve = _Spline(fit.knots, order, coefficients)
    unit = step * factor
    first = fit.first
    values = [curve.at(fit.stamps, first)]
    for power in (1, 2):
        curve = curve.derivative()
        values.append(curve.at(fit.stamps, first) / unit**power)
    bandwidth = (factor / 10.0**strength) ** (0.5 / order) / (2.0 * np.pi * unit)
    note = (
        f"penalised spline (white snap), strength by restricted likelihood: noise {noise * size:.2g} "
        f"{UNIT[kind]} rms (quantum {quantum:.2g} {UNIT[kind]}), motion followed up to {bandwidth:.3g} Hz"
    )
    if warning := noise_warning(noise * size, value, quantum, step):
        note += f"; warning: {warning}"
    if kind == "position":
        return Kinematics(values[0] * size + middle, values[1] * size, values[2] * size, bandwidth, note)
    travel = _Spline(fit.knots, order, coefficients).integral().at(fit.stamps, first) * unit
    position = travel * size + middle * (time - time[0])
    return Kinematics(position, values[0] * size + middle, values[1] * size, bandwidth, note)


def _noise_between_neighbours(samples: Array) -> float:
    """Robust estimate of the noise (rms) from fourth differences, in which smooth motion cancels.

    White noise of rms 1 has fourth differences of rms sqrt(70); rms is 1.4826 times the median for a Gaussian.
    """
    differences = np.abs(np.diff(samples, 4))
    differences = differences[differences > 1e-13]  # without those of equal samples at standstill
    return float(1.4826 * np.median(differences) / np.sqrt(70.0)) if differences.size else 0.0


class _Fit:
    """The penalised least-squares system of one mesh: a knot near each sample, at most one per unit of time."""

    def __init__(self, stamps: Array, samples: Array, order: int, bounds: tuple[float, float]) -> None:
        breaks = np.unique(np.round(stamps))
        breaks[-1] = stamps[-1]
        if breaks.size > 2 and breaks[-1] - breaks[-2] < 0.5:  # a short last interval would be a stiff one
            breaks = np.delete(breaks, -2)
        self.stamps, self.samples, self.order = stamps, samples, order
        self.lowest, self.highest = bounds
        self.knots = np.concatenate([np.repeat(breaks[0], order), breaks, np.repeat(breaks[-1], order)])
        self.first = np.clip(np.searchsorted(breaks, stamps, side="right") - 1, 0, breaks.size - 2)
        self.count = self.knots.size - order - 1
        self.rows = _basis(self.knots, order, stamps, self.first)
        self.roughness = _roughness(self.knots, order)
        self.normal = _gram(self.rows, self.first, self.count)
        self.penalty = _gram(self.roughness, np.arange(self.count - order), self.count)
        self.right = np.zeros(self.count)
        for column in range(order + 1):
            self.right += np.bincount(self.first + column, self.rows[:, column] * samples, self.count)

    def at(self, strength: float) -> tuple[float, Array, float]:
        """-2 log restricted likelihood (up to a constant), coefficients, and noise for lambda = 10^strength."""
        from scipy.linalg import cho_solve_banded, cholesky_banded  # 0.2 s of import, needed here only

        weight = 10.0**strength
        lower = cholesky_banded(self.normal + weight * self.penalty, lower=True, check_finite=False)
        coefficients: Array = cho_solve_banded((lower, True), self.right, check_finite=False)
        residual = self.samples - _rows_times(self.rows, self.first, coefficients)
        rough = _rows_times(self.roughness, np.arange(self.count - self.order), coefficients)
        square = float(residual @ residual + weight * (rough @ rough))
        freedom = self.samples.size - self.order
        variance = min(max(square / freedom, self.lowest**2), self.highest**2)
        deviance = freedom * np.log(variance) + square / variance
        deviance += 2.0 * float(np.log(lower[0]).sum()) - (self.count - self.order) * np.log(weight)
        return float(deviance), coefficients, float(np.sqrt(variance))

    def needs_coarser_mesh(self) -> bool:
        """Whether the likelihood grows up to the largest strength, so that a coarser mesh is needed."""
        return self.at(HIGHEST)[0] < self.at(HIGHEST - 1.5)[0]

    def best(self, stride: float = 0.5) -> float:
        """log10 lambda of the first maximum of the likelihood below the largest strength: a walk, then a parabola.

        A stride of half a decade changes the bandwidth by 15 % (power 1/8), much less than the maximum is wide.
        """
        here = HIGHEST - 1.5
        above, value = self.at(here + stride)[0], self.at(here)[0]
        while above < value and here + stride < HIGHEST:
            here, value = here + stride, above
            above = self.at(here + stride)[0]
        below = self.at(here - stride)[0]
        while below < value and here - stride > LOWEST:
            here, above, value = here - stride, value, below
            below = self.at(here - stride)[0]
        curvature = above - 2.0 * value + below
        if curvature <= 0.0:
            return here
        return here + float(np.clip(0.5 * stride * (below - above) / curvature, -stride, stride))


@dataclass(frozen=True)
class _Spline:
    """B-spline whose end knots are repeated `degree` + 1 times (de Boor 1978)."""

    knots: Array
    degree: int
    coefficients: Array

    def at(self, stamps: Array, first: NDArray[np.intp]) -> Array:
        """Values at `stamps`, the i-th in knot interval first[i]."""
        return _rows_times(_basis(self.knots, self.degree, stamps, first), first, self.coefficients)

    def derivative(self) -> _Spline:
        count, degree = self.coefficients.size, self.degree
        widths = self.knots[degree + 1 : degree + count] - self.knots[1:count]
        return _Spline(self.knots[1:-1], degree - 1, np.diff(self.coefficients) * degree / widths)

    def integral(self) -> _Spline:
        """The integral from the first knot."""
        count, degree = self.coefficients.size, self.degree
        widths = (self.knots[degree + 1 : degree + 1 + count] - self.knots[:count]) / (degree + 1)
        knots = np.concatenate([self.knots[:1], self.knots, self.knots[-1:]])
        return _Spline(knots, degree + 1, np.concatenate([[0.0], np.cumsum(self.coefficients * widths)]))


def _basis(knots: Array, degree: int, stamps: Array, first: NDArray[np.intp]) -> Array:
    """(n, degree + 1) values of the B-splines first[i] ... first[i] + degree (Cox-de Boor recursion)."""
    rows = np.ones((stamps.size, degree + 1), order="F")
    for d in range(1, degree + 1):
        carried = np.zeros(stamps.size)
        for r in range(d):
            left, right = knots[first + degree + 1 + r - d], knots[first + degree + 1 + r]
            share = rows[:, r] / (right - left)
            rows[:, r] = carried + (right - stamps) * share
            carried = (stamps - left) * share
        rows[:, d] = carried
    return rows


def _roughness(knots: Array, order: int) -> Array:
    """(intervals, order + 1) rows D: |D c|^2 is the integral of the squared order-th derivative of the spline c."""
    count = knots.size - order - 1
    rows = np.ones((count, 1))
    for degree in range(order, 0, -1):
        inner = knots[order - degree : knots.size - order + degree]
        size = rows.shape[0]
        widths = inner[degree + 1 : degree + size] - inner[1:size]
        wider = np.zeros((size - 1, rows.shape[1] + 1))
        wider[:, :-1] -= rows[:-1]
        wider[:, 1:] += rows[1:]
        rows = wider * (degree / widths)[:, None]
    scaled: Array = rows * np.sqrt(np.diff(knots[order : knots.size - order]))[:, None]
    return scaled


def _gram(rows: Array, first: NDArray[np.intp], count: int) -> Array:
    """Lower bands (order + 1, count) of A^T A, where row i of A is rows[i] from column first[i] on."""
    width = rows.shape[1]
    bands = np.zeros((width, count))
    for a in range(width):
        for b in range(a + 1):
            bands[a - b] += np.bincount(first + b, rows[:, a] * rows[:, b], count)
    return bands


def _rows_times(rows: Array, first: NDArray[np.intp], coefficients: Array) -> Array:
    total = np.zeros(rows.shape[0])
    for column in range(rows.shape[1]):
        total += rows[:, column] * coefficients[first + column]
    return total
