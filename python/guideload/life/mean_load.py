"""The mean load over distance: P_m = (int P^p |v| dt / int |v| dt)^(1/p), an integral of the history.

Between two instants the speed is quadratic, because the acceleration is linear, and a load is the line that has its
mean in the interval. The core cuts an interval where the speed or a component of the load changes its sign, and where
the rule changes branch. On each piece P is a power of a linear load, and its integral is in closed form. Where a load
bows by b from the line between its ends, this has an error of order b^2; with that line it would be of order b.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from guideload._core import equivalent_load_integrals
from guideload.base.arrays import Array
from guideload.base.errors import LifeError
from guideload.life.equivalent_load import PLAIN_SUM, EquivalentLoad
from guideload.motion.motion import Motion
from guideload.simulation.result import Result
from guideload.simulation.run import Run


class Travel(NamedTuple):
    """The travel of the cart along x at n instants: time [s], velocity [m/s] and acceleration [m/s2]."""

    time: Array
    velocity: Array
    acceleration: Array

    @classmethod
    def of(cls, motion: Motion) -> Travel:
        """The travel of a motion. Raises LifeError if it has no velocity."""
        if motion.velocity is None:
            raise LifeError("the motion has no velocity, and the mean load is a mean over distance")
        speed = np.ascontiguousarray(motion.velocity[:, 0])
        return cls(motion.time, speed, np.ascontiguousarray(motion.acceleration[:, 0]))

    @property
    def distance(self) -> float:
        """Length of the way [m], forth and back."""
        unloaded = np.zeros((self.time.size, 6))
        return float(integrals(self, unloaded, PLAIN_SUM, 1.0)[1].sum())


def integrals(
    travel: Travel, loads: Array, rule: EquivalentLoad, exponent: float, bows: Array | None = None
) -> tuple[Array, Array]:
    """int P^p |v| dt [N^p m] and int |v| dt [m] of the n - 1 intervals.

    loads: (n, 6) of one carriage, force [N] and moment [N m] at the instants. bows: (n - 1, 6) of `load_bows`; None:
    the loads are linear between the instants.
    """
    time, velocity, acceleration, load = (np.ascontiguousarray(history) for history in (*travel, loads))
    shift = None if bows is None else np.ascontiguousarray(bows)
    return equivalent_load_integrals(time, velocity, acceleration, load, rule.of_core, exponent, shift)


def load_bows(run: Result | Run) -> Array:
    """Mean load of each interval less that of the line between its ends, (n - 1, carriage, 6) [N, N m]."""
    machine, names = run.machine, ("time", "displacement", "velocity", "acceleration")
    known = (each for each in map(run.history, names) if each is not None)
    time, position, velocity, acceleration = known
    groups, places = machine.links_of_carriages, machine.carriage_places
    return machine.scene.group_load_bows(time, position, velocity, acceleration, groups, places)


def mean_load(load: Array, path: Array, exponent: float) -> float:
    """The mean load [N] of the integrals of `integrals`; nan without travel."""
    distance = float(path.sum())
    return float((load.sum() / distance) ** (1.0 / exponent)) if distance > 0.0 else math.nan
