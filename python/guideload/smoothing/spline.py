"""Smoothing spline: one strength for the whole trace.

The axis's snap (fourth derivative of position) is taken as white noise of unknown level, the samples as the true value
plus white noise of unknown level: with q = strength ratio that is the curve s which minimises

    sum (s(t_i) - y_i)^2 + q * integral (d^4 s / dt^4)^2 dt        (position; third derivative for velocity)

(Whittaker 1923, Reinsch 1967, Wahba 1978 for the equivalence; Eilers and Marx 1996 for the B-spline form.) s
is a spline of degree 4 (velocity: 3), whose penalised derivative is piecewise constant, so the integral is
exact; velocity and acceleration are its derivatives and the penalty keeps the true, possibly uneven time
stamps. Time is O(n): all matrices are banded. q maximises the restricted likelihood (REML; Wahba 1985,
Anderssen and Bloomfield 1974) with the noise level profiled out, but held between two bounds. Never below
quantum^2/12: at slow constant speed the rounding error is a tone that follows the signal, and a likelihood
without that floor takes it for motion. Never above 4 times what the fourth differences of neighbouring
samples show (`_noise_between_neighbours`): where an axis starts and stops within a few samples, as in 10 Hz
logs, the moves are no white snap and the likelihood takes them for noise. On 130 made and measured traces
that are sampled finely enough the ratio is 0.3 to 2; on those that are not, 4 to 200.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.smoothing.kinematics import UNIT, Kind, Kinematics, noise_warning, of_equal_samples

# Order of the penalised derivative, which is the spline's degree too: white snap in both cases.
ORDER = {"position": 4, "velocity": 3}
# lambda (the strength, for time in knot distances) searched. Below 1e-3 the spline passes through the
# samples. Above 1e4 the curve bends over more than 3 knots: a mesh twice as coarse carries it as well, and
# rounding grows with lambda * 2^(2 order) * 1e-16, which must stay far below the quantum over the travel
# (1e-7 in the finest logs known).
LOWEST, HIGHEST = -3.0, 4.0
NOISE_RATIO = 4.0  # to the noise between neighbours: twice the largest seen where moves are resolved
FEWEST_INTERVALS = 8  # of a coarser mesh: fewer cannot follow one move of an axis


def smoothing_spline(time: Array, value: Array, kind: Kind, quantum: float) -> Kinematics:
    """Fit samples of the kind, rounded to the quantum (0 if unknown); n >= 8, units m and s."""
    order = ORDER[kind]
    middle = float(value.mean())
    size = float(np.abs(value - middle).max())
    if np.ptp(value) == 0.0:
        return of_equal_samples(time, value, kind)
    # Unit scale and unit sampling step, for conditioning.
    samples = (value - middle) / size
    step = float(np.median(np.diff(time)))
    stamps = (time - time[0]) / step
    lowest = max(quantum / size, 1e-13) / np.sqrt(12.0)  # 1e-13: rounding of doubles
    bounds = (lowest, max(lowest, NOISE_RATIO * _noise_between_neighbours(samples)))
    factor = 1
    fit = _Fit(stamps, samples, order, bounds)
    while fit.wants_more() and stamps[-1] / (2 * factor) >= FEWEST_INTERVALS:
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
    """Noise rms told by fourth differences, in which smooth motion cancels: robust, of those that are not
    zero.

    White noise of rms 1 has fourth differences of rms sqrt(70); the median carries over to rms as for a
    Gaussian.
    """
    bends = np.abs(np.diff(samples, 4))
    bends = bends[bends > 1e-13]  # a standstill of equal counts tells nothing
    return float(1.4826 * np.median(bends) / np.sqrt(70.0)) if bends.size else 0.0


class _Fit:
    """The least-squares system of one knot mesh: a knot beside each sample, one per unit of time at most."""

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
        """-2 log restricted likelihood (up to a constant), coefficients, noise level at lambda =
        10^strength."""
        from scipy.linalg import cho_solve_banded, cholesky_banded  # 0.2 s of import, needed here only

        weight = 10.0**strength
        lower = cholesky_banded(self.normal + weight * self.penalty, lower=True, check_finite=False)
        coefficients: Array = cho_solve_banded((lower, True), self.right, check_finite=False)
        rest = self.samples - _rows_times(self.rows, self.first, coefficients)
        bent = _rows_times(self.roughness, np.arange(self.count - self.order), coefficients)
        square = float(rest @ rest + weight * (bent @ bent))
        freedom = self.samples.size - self.order
        variance = min(max(square / freedom, self.lowest**2), self.highest**2)
        deviance = freedom * np.log(variance) + square / variance
        deviance += 2.0 * float(np.log(lower[0]).sum()) - (self.count - self.order) * np.log(weight)
        return float(deviance), coefficients, float(np.sqrt(variance))

    def wants_more(self) -> bool:
        """Whether the likelihood still grows towards the smoothest curve that this mesh is for."""
        return self.at(HIGHEST)[0] < self.at(HIGHEST - 1.5)[0]

    def best(self, stride: float = 0.5) -> float:
        """log10 lambda of the first maximum of the likelihood below the smoothest curve: a walk, then a
        parabola.

        A stride of half a decade is a twentieth of the bandwidth (power 1/8), far finer than the maximum is
        wide.
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
        bend = above - 2.0 * value + below
        return (
            here + float(np.clip(0.5 * stride * (below - above) / bend, -stride, stride))
            if bend > 0
            else here
        )


@dataclass(frozen=True)
class _Spline:
    """B-spline on knots whose ends are repeated `degree` + 1 times (de Boor 1978)."""

    knots: Array
    degree: int
    coefficients: Array

    def at(self, stamps: Array, first: NDArray[np.intp]) -> Array:
        """Values at stamps, the i-th in the knot interval number first[i]."""
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
    """(n, degree + 1) values of the B-splines number first[i] ... first[i] + degree (Cox-de Boor
    recursion)."""
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
    """(intervals, order + 1): rows D with |D c|^2 = integral of the squared order-th derivative of the spline
    c."""
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
    """A^T A as lower bands (order + 1, count), A holding rows[i] from column first[i] on."""
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
