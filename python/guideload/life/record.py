"""A record: the result of a run, and what life needs of it, computed once for all carriages."""

from __future__ import annotations

from typing import NamedTuple

from guideload.base.arrays import Array
from guideload.base.errors import LifeError
from guideload.life.causes import phases
from guideload.life.load_parts import LoadParts, load_parts
from guideload.life.mean_load import Travel
from guideload.simulation.result import Result


class Record(NamedTuple):
    """The result of a run, the travel of the cart, the loads in parts, and the phase of the cycle in each interval."""

    result: Result
    travel: Travel
    parts: LoadParts
    phase: Array

    @classmethod
    def of(cls, result: Result) -> Record:
        """Raises LifeError if the velocity of the cart is unknown or always zero."""
        travel = travel_of(result)
        return cls(result, travel, load_parts(result), phases(travel))


def travel_of(result: Result) -> Travel:
    """The travel of the cart along x. Raises LifeError if its velocity is unknown or always zero."""
    data = result.quantities
    if "cart_velocity" not in data:
        raise LifeError(
            "the velocity of the cart is unknown, and the mean load is a mean over distance: give the motion a "
            "velocity (Motion.along_x(..., velocity=...)), and report all its samples (no times=)"
        )
    travel = Travel(data["time"], data["cart_velocity"][:, 0], data["cart_acceleration"][:, 0])
    if not travel.velocity.any():
        raise LifeError("the cart does not move along x, so there is no mean load over distance")
    return travel
