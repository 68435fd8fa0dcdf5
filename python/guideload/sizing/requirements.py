"""What a machine must fulfil, and by how much it does: life, static safety, limits of products and drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.catalogue.conditions import LifeConditions
from guideload.drive.requirements import DriveRequirements, drive_requirements
from guideload.life.life import Life


@dataclass(frozen=True)
class Margins:
    """Figure over requirement of each criterion: 1 or more meets it. Criteria without requirement are missing.

    ratios  by criterion: "life" (of the machine), "static safety" (of the weakest carriage), "speed", "acceleration"
            (limit of the product over the largest of the motion), limits of the drive (`DriveRequirements.margins`)
    """

    ratios: dict[str, float]

    @property
    def first_to_fail(self) -> str:
        """The criterion with the smallest margin."""
        return min(self.ratios, key=lambda name: self.ratios[name])

    @property
    def smallest(self) -> float:
        """The smallest margin."""
        return min(self.ratios.values())

    @property
    def hold(self) -> bool:
        """Whether every requirement is met."""
        return self.smallest >= 1.0


def margins_of(life: Life, needed: DriveRequirements | None = None) -> Margins:
    """The margins of a life against its conditions and the limits of products and drive.

    needed: what its run asks of the drive, if that is known.
    """
    conditions: LifeConditions = life.conditions
    ratios = {"static safety": life.weakest.static.safety / conditions.least_safety}
    if life.wanted is not None:
        ratios["life"] = life.machine / life.wanted
    travel = life.record.travel
    for name, key, history in (
        ("speed", "max_speed", travel.velocity),
        ("acceleration", "max_acceleration", travel.acceleration),
    ):
        limits = [limit for one in life.carriages if (limit := getattr(one.product, key)) is not None]
        reached = float(np.abs(history).max())
        if limits and reached > 0.0:
            ratios[name] = min(limits) / reached
    ratios |= (needed or drive_requirements(life.record.result)).margins
    return Margins(ratios)
