"""Places of sensors: a point of the machine and a direction, written as "tool y"."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ValueRefused
from guideload.base.number_text import joined
from guideload.machine.machine import Machine
from guideload.machine.response import AXES


@dataclass(frozen=True, eq=False)
class Place:
    """A point of the machine and a direction.

    name  "tool y"
    row   (6,) its displacement along the direction is row @ q, for q = (u, phi) of L [m, rad]; a force F along the
          direction acts on q as row F
    """

    name: str
    row: Array


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
    row = np.concatenate([direction, np.cross(points[name.strip()].at, direction)])
    return Place(f"{name.strip()} {axis}", row)
