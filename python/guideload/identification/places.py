"""Places of sensors: a point of the machine and a direction, "tool y", or a load, "1a Fy" or the name of a link."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ValueRefused
from guideload.base.number_text import joined
from guideload.machine.machine import Machine
from guideload.machine.response import AXES
from guideload.sensitivity.instants import History, Instants
from guideload.sensitivity.linearised import Linearised

COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")  # of the load of a carriage; Fx is the drive's


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


@dataclass(frozen=True)
class LoadPlace:
    """A load that a cell or a strain gauge measures.

    name       "1a Fy", or that of a link
    unit       N or N m
    part       index of the carriage or of the link
    component  of the load of the carriage, an index into `COMPONENTS`; None for a link
    """

    name: str
    unit: str
    part: int
    component: int | None

    def shown(self, at: Instants, rest: Linearised) -> History:
        """The change of the load from that at rest."""
        if self.component is None:
            quantity, still, by = "link_loads", rest.static_link_loads, rest.d_static_link_loads
            place: tuple[int, ...] = (self.part,)
        else:
            quantity, still, by = "carriage_loads", rest.static_carriage_loads, rest.d_static_carriage_loads
            place = self.part, self.component
        one = np.zeros(still.shape)
        one[place] = 1.0
        return at.history(quantity, one).from_rest(float(still[place]), by.reshape(len(by), -1) @ one.ravel())


def load_place_of(text: str, machine: Machine) -> LoadPlace:
    """A component of the load of a carriage, "1a Fy" or "1a Mz", or the name of a link. Raises ValueRefused."""
    names = [one.name for one in machine.links]
    if text.strip() in names:
        first = len(machine.link_table().names) - len(names)  # the extra links come last
        return LoadPlace(text.strip(), "N", first + names.index(text.strip()), None)
    name, _, component = text.strip().rpartition(" ")
    carriages = [one.name for one in machine.carriages]
    if name.strip() not in carriages or component not in COMPONENTS[1:]:
        loads = [f"{one} {component}" for one in carriages[:1] for component in COMPONENTS[1:]]
        known = joined([f'"{one}"' for one in (*carriages, *names)])
        expected = "a carriage and a component of its load, or a link"
        raise ValueRefused(expected, text, f"as {joined(loads)}; carriages and links are {known}")
    unit = "N" if component.startswith("F") else "N m"
    return LoadPlace(
        f"{name.strip()} {component}", unit, carriages.index(name.strip()), COMPONENTS.index(component)
    )
