"""A record: the result of a run, and what life needs of it, computed when first used."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from guideload.base.arrays import Array
from guideload.base.errors import LifeError
from guideload.life.causes import phases
from guideload.life.load_parts import LoadParts, load_parts
from guideload.life.mean_load import Travel, load_bows
from guideload.simulation.result import Result


@dataclass(frozen=True, eq=False)
class Record:
    """The result of a run, and the travel of the cart."""

    result: Result
    travel: Travel

    @classmethod
    def of(cls, result: Result) -> Record:
        """Raises LifeError if the velocity of the cart is unknown or always zero."""
        return cls(result, travel_of(result))

    @cached_property
    def bows(self) -> Array:
        """Mean load of each interval less that of the line between its ends, (n - 1, carriage, 6) [N, N m]."""
        return load_bows(self.result)

    @cached_property
    def parts(self) -> LoadParts:
        """The loads of the carriages in parts."""
        return load_parts(self.result)

    @cached_property
    def phase(self) -> Array:
        """The phase of the cycle in each interval (n - 1,), as index into `PHASES`."""
        return phases(self.travel)


def travel_of(result: Result) -> Travel:
    """The travel of the cart along x. Raises LifeError if its velocity is unknown or always zero."""
    time, velocity, acceleration = (
        result.history(name) for name in ("time", "cart_velocity", "cart_acceleration")
    )
    if time is None or velocity is None or acceleration is None:
        raise LifeError(
            "the velocity of the cart is unknown, and the mean load is a mean over distance: give the motion a "
            "velocity (Motion.along_x(..., velocity=...)), and report all its samples (no times=)"
        )
    travel = Travel(time, velocity[:, 0].copy(), acceleration[:, 0].copy())
    if not travel.velocity.any():
        raise LifeError("the cart does not move along x, so there is no mean load over distance")
    return travel
