"""The mean load over distance: P_m = (int P^p |v| dt / int |v| dt)^(1/p), an exact integral of the history.

Between two instants the loads are linear in time and the speed is quadratic, because the acceleration is linear. The
interval is cut where the speed or a component of the load changes its sign, and where the rule changes its branch. On
each piece P is linear. For a whole p the integrand is a polynomial, and Gauss' rule is exact; for 10/3 the integral is
in closed form where P varies much, and by Gauss' rule, to rounding, where it varies little.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.life.equivalent_load import EquivalentLoad

# For a p that is not whole: Gauss nodes of a piece, and the ratio of its ends' loads below which the closed form is
# used. At this ratio the error of Gauss' rule is (3 + 8^0.5)^-24, rounding; the closed form loses one digit.
NODES, CLOSED_FORM = 12, 0.5


class Travel(NamedTuple):
    """The travel of the cart along x at n instants: time [s], velocity [m/s] and acceleration [m/s2]."""

    time: Array
    velocity: Array
    acceleration: Array

    def speeds(self, index: NDArray[np.intp], s: Array) -> Array:
        """Velocity [m/s] in the intervals `index` at the fractions `s` of their lengths; quadratic in time."""
        start, change, bend = (part[index] for part in self._quadratic())
        return np.asarray(start + s * (change + bend * (s - 1.0)))

    def _quadratic(self) -> tuple[Array, Array, Array]:
        bend = 0.5 * np.diff(self.time) * np.diff(self.acceleration)
        return self.velocity[:-1], np.diff(self.velocity), bend

    def turns(self) -> Array:
        """Fractions (2, n - 1) of the intervals at which the velocity is zero; nan for none."""
        start, change, bend = self._quadratic()
        linear = change - bend
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(linear * linear - 4.0 * bend * start)
            large = -0.5 * (linear + np.copysign(root, linear))
            return np.stack([large / bend, start / large])


class Pieces(NamedTuple):
    """Parts of intervals: index of the interval, start and end as fractions of its length."""

    interval: NDArray[np.intp]
    start: Array
    end: Array

    def cut(self, at: Array) -> Pieces:
        """Each piece cut at a fraction; nan, or a fraction outside the piece: not cut."""
        inside = np.flatnonzero((at > self.start) & (at < self.end))
        if not inside.size:
            return self
        end = self.end.copy()
        end[inside] = at[inside]
        return Pieces(
            np.append(self.interval, self.interval[inside]),
            np.append(self.start, at[inside]),
            np.append(end, self.end[inside]),
        )

    def cut_at_zero(self, at_start: Array, at_end: Array) -> Pieces:
        """Each piece cut where a linear function with these values at its ends is zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            share = at_start / (at_start - at_end)
            return self.cut(self.start + share * (self.end - self.start))


def integrals(travel: Travel, loads: Array, rule: EquivalentLoad, exponent: float) -> tuple[Array, Array]:
    """int P^p |v| dt [N^p m] and int |v| dt [m] of the n - 1 intervals.

    loads: (n, 6) of one carriage, force [N] and moment [N m] at the instants, linear between them.
    """
    pieces = _pieces(travel, loads, rule)
    first, last = (rule.without_preload(_at(loads, pieces.interval, s)) for s in (pieces.start, pieces.end))
    length = (pieces.end - pieces.start) * np.diff(travel.time)[pieces.interval]
    speed = _speed_coefficients(travel, pieces)
    path = np.abs(speed @ (1.0, 1.0 / 2.0, 1.0 / 3.0)) * length
    scale = float(max(first.max(initial=0.0), last.max(initial=0.0), rule.preload)) or 1.0  # against overflow
    power = np.abs(_weighted_power(first, last, speed, rule, exponent, scale)) * length
    count = travel.time.size - 1
    of_load: Array = np.bincount(pieces.interval, power, count) * scale**exponent
    return of_load, np.bincount(pieces.interval, path, count).astype(np.float64)


def mean_load(load: Array, path: Array, exponent: float) -> float:
    """The mean load [N] of the integrals of `integrals`; nan without travel."""
    distance = float(path.sum())
    return float((load.sum() / distance) ** (1.0 / exponent)) if distance > 0.0 else math.nan


def _pieces(travel: Travel, loads: Array, rule: EquivalentLoad) -> Pieces:
    """The pieces on which neither speed nor a component of the load changes its sign, and P is linear."""
    steps = np.flatnonzero(np.diff(travel.time) > 0.0)
    pieces = Pieces(steps, np.zeros(steps.size), np.ones(steps.size))
    for turn in travel.turns():
        pieces = pieces.cut(turn[pieces.interval])
    for component in 1 + np.flatnonzero(rule.weights.any(axis=(0, 2))):
        values = loads[:, component]
        with np.errstate(divide="ignore", invalid="ignore"):
            zero = values[:-1] / (values[:-1] - values[1:])
        pieces = pieces.cut(zero[pieces.interval])
    if rule.minor != 1.0:
        first, last = (rule.groups(_at(loads, pieces.interval, s)) for s in (pieces.start, pieces.end))
        pieces = pieces.cut_at_zero(first[0] - first[1], last[0] - last[1])
    if rule.preload:
        ends = (rule.without_preload(_at(loads, pieces.interval, s)) for s in (pieces.start, pieces.end))
        pieces = pieces.cut_at_zero(*(end - rule.opening for end in ends))
    return pieces


def _at(loads: Array, index: NDArray[np.intp], s: Array) -> Array:
    """Loads (k, 6) in the intervals `index` at the fractions `s` of their lengths."""
    share = s[:, None]
    return np.asarray((1.0 - share) * loads[index] + share * loads[index + 1])


def _speed_coefficients(travel: Travel, pieces: Pieces) -> Array:
    """Velocity on the pieces as a polynomial of the fraction of the piece: coefficients (k, 3) of 1, s, s^2 [m/s]."""
    ends = pieces.start, 0.5 * (pieces.start + pieces.end), pieces.end
    first, middle, last = (travel.speeds(pieces.interval, s) for s in ends)
    return np.stack([first, -3.0 * first + 4.0 * middle - last, 2.0 * (first - 2.0 * middle + last)], axis=1)


def _weighted_power(
    first: Array, last: Array, speed: Array, rule: EquivalentLoad, exponent: float, scale: float
) -> Array:
    """Integral of (P/scale)^p v over each piece of unit length; P is linear from `first` to `last`, before preload."""
    whole = exponent == round(exponent) and not rule.preload
    s, weights = np.polynomial.legendre.leggauss(math.ceil((exponent + 3.0) / 2.0) if whole else NODES)
    s, weights = 0.5 * (s + 1.0), 0.5 * weights
    loads = rule.with_preload(first[:, None] + (last - first)[:, None] * s) / scale
    result = np.einsum("ks,ks,s->k", loads**exponent, speed @ np.stack([s**0, s, s * s]), weights)
    small, large = np.minimum(first, last), np.maximum(first, last)
    if not whole:
        varying = (small < CLOSED_FORM * large) & ((large > rule.opening) | (rule.preload == 0.0))
        ends = first[varying] / scale, last[varying] / scale
        result[varying] = _closed_form(*ends, speed[varying], exponent)
    return np.asarray(result)


def _closed_form(first: Array, last: Array, speed: Array, exponent: float) -> Array:
    """Integral of P^p v over pieces of unit length, P linear from `first` to `last`; substituted s = (P - first)/d."""
    d = last - first
    raised = [
        (last ** (exponent + k) - first ** (exponent + k)) / (exponent + k) / d for k in (1.0, 2.0, 3.0)
    ]
    of_one = raised[0]
    of_s = (raised[1] - first * raised[0]) / d
    of_square = (raised[2] - 2.0 * first * raised[1] + first * first * raised[0]) / (d * d)
    return np.asarray(speed[:, 0] * of_one + speed[:, 1] * of_s + speed[:, 2] * of_square)
