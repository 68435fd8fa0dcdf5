"""The mean load over distance: P_m = (int P^p |v| dt / int |v| dt)^(1/p), an exact integral of the history.

Between two instants the loads are linear in time and the speed is quadratic, because the acceleration is linear. The
core cuts an interval where the speed or a component of the load changes its sign, and where the rule changes branch. On
each piece P is a power of a linear load, and its integral is in closed form.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from guideload._core import equivalent_load_integrals
from guideload.base.arrays import Array
from guideload.life.equivalent_load import EquivalentLoad


class Travel(NamedTuple):
    """The travel of the cart along x at n instants: time [s], velocity [m/s] and acceleration [m/s2]."""

    time: Array
    velocity: Array
    acceleration: Array


def integrals(travel: Travel, loads: Array, rule: EquivalentLoad, exponent: float) -> tuple[Array, Array]:
    """int P^p |v| dt [N^p m] and int |v| dt [m] of the n - 1 intervals.

    loads: (n, 6) of one carriage, force [N] and moment [N m] at the instants, linear between them.
    """
    time, velocity, acceleration, load = (np.ascontiguousarray(history) for history in (*travel, loads))
    return equivalent_load_integrals(time, velocity, acceleration, load, rule.of_core, exponent)


def mean_load(load: Array, path: Array, exponent: float) -> float:
    """The mean load [N] of the integrals of `integrals`; nan without travel."""
    distance = float(path.sum())
    return float((load.sum() / distance) ** (1.0 / exponent)) if distance > 0.0 else math.nan
