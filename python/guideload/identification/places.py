"""Places of sensors: a point of the machine and a direction, written as "tool y"."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ValueRefused
from guideload.base.number_text import joined
from guideload.machine.machine import Machine
from guideload.machine.response import AXES


@dataclass(frozen=True, eq=False)
class Place:
    """A point of the machine and a direction.

    name       "tool y"
    at         (3,) m from L
    direction  (3,) unit vector
    """

    name: str
    at: Array
    direction: Array

    @cached_property
    def row(self) -> Array:
        """(6,) the displacement along the direction is row @ q, for q = (u, phi) of L; a force F acts on q as F row."""
        return np.concatenate([self.direction, np.cross(self.at, self.direction)])


def place_of(text: str, machine: Machine) -> Place:
    """The place "tool y" or "tool -y": a point of [[points]], and x, y or z of the machine. Raises ValueRefused."""
    name, _, axis = text.strip().rpartition(" ")
    points = {point.name: point for point in machine.points}
    if axis.lstrip("+-") not in AXES or name.strip() not in points:
        known = (
            joined([f'"{one}"' for one in points])
            if points
            else "none: add [[points]] tables to the machine file"
        )
        raise ValueRefused('a point and an axis, as "tool y"', text, f"the points of the machine are {known}")
    direction = np.array(AXES[axis.lstrip("+-")]) * (-1.0 if axis.startswith("-") else 1.0)
    return Place(f"{name.strip()} {axis}", np.array(points[name.strip()].at), direction)
