"""Riders: bodies that move along a direction of the main body, such as the cross slide of a gantry."""

from __future__ import annotations

import numpy as np
from pydantic import Field, field_validator

from guideload.base.config import optional
from guideload.machine.components import Body, Length, Name, Vector, unit_vector

MOST_RIDERS = 8


class Rider(Body):
    """A body that rides on the main body: mass, centre of mass and inertia where its travel is zero."""

    name: Name = Field(description="unique name; results refer to it")
    direction: Vector = Field(
        description="its travel in the axes of the machine, of any length, e.g. [0, 0, 1]"
    )
    position: Length = optional(
        "travel at which it stands where it does not move: for static loads and modes, "
        "and in runs that give it no motion",
        0.0,
    )
    motion: Name | None = optional(
        'trace or motion file of its travel, relative to the machine file, e.g. "slide.toml"'
    )

    @field_validator("direction")
    @classmethod
    def _unit(cls, direction: Vector) -> Vector:
        return unit_vector(direction, "e.g. [0, 0, 1] for a slide across the rails")

    def at(self, travel: float) -> Body:
        """The rider as a body at a travel [m], with its inertia about its centre of mass."""
        there = np.array(self.center_of_mass) + travel * np.array(self.direction)
        return Body(mass=self.mass, center_of_mass=there.tolist(), inertia=self.central_inertia().tolist())

    def for_core(self) -> tuple[float, tuple[float, float, float], list[list[float]], Vector]:
        """Mass, centre of mass at its position, inertia about it and direction, as `Scene` takes them."""
        there = self.at(self.position)
        return there.mass, there.center_of_mass, there.central_inertia().tolist(), self.direction
