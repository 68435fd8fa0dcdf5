"""Builders of machines for tests."""

from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from guideload.machine.components import Body, Carriage, Link, Rail
from guideload.machine.machine import Machine

INERTIA = np.array([[420.0, 15.0, -8.0], [15.0, 310.0, 22.0], [-8.0, 22.0, 380.0]])
CENTER = np.array([0.12, -0.65, 0.18])
Part = TypeVar("Part", bound=BaseModel)


def carriage_ends(center: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and directions (4, 3) of the links of a carriage: along y and z at its end -x, then at its end +x."""
    points = np.asarray(center) + [[side * length / 2.0, 0.0, 0.0] for side in (-1, -1, 1, 1)]
    return points, np.tile(np.eye(3)[1:], (2, 1))


def body(**changes: Any) -> Body:
    return Body(**({"mass": 1250.0, "center_of_mass": CENTER, "inertia": INERTIA} | changes))


def carriage(name: str = "1", **changes: Any) -> Carriage:
    values: dict[str, Any] = {"name": name, "rail": "1", "x": 0.0, "length": 0.6}
    values |= {"stiffness_y": 4e8, "stiffness_z": 3e8, "damping_y": 2e5, "damping_z": 1e5}
    return Carriage(**(values | changes))


def link(name: str = "rack", **changes: Any) -> Link:
    values = {"name": name, "point": (0, 0, 0), "direction": (1, 0, 0), "damping": 1e4}
    return Link(**(values | changes))


def machine(*carriages: Carriage, **changes: Any) -> Machine:
    rails = [Rail(name="1", position=(0.05, -0.35))]
    values = {"body": body(), "rails": rails, "carriages": carriages or [carriage()]}
    return Machine(**(values | changes))


def table(body: Body, spacing: float, gauge: float, middle: Any = (0.0, 0.0, 0.0), **changes: Any) -> Machine:
    """A body on two rails `gauge` [m] apart, each with two stiff short carriages `spacing` [m] apart.

    middle: m from L, of the four carriages. changes: of all carriages, or of the machine.
    """
    x, y, z = middle
    keys: dict[str, Any] = {"length": 0.05, "stiffness_y": 1e9, "stiffness_z": 1e9}
    keys |= {"damping_y": 1e5, "damping_z": 1e5}
    keys |= {key: changes.pop(key) for key in keys.keys() & changes.keys()}
    rails = [Rail(name=side, position=(y, z + 0.5 * sign * gauge)) for side, sign in (("l", -1), ("r", 1))]
    carriages = [
        Carriage(name=f"{rail.name}{end}", rail=rail.name, x=x + 0.5 * sign * spacing, **keys)
        for rail in rails
        for end, sign in (("-", -1), ("+", 1))
    ]
    return Machine(body=body, rails=rails, carriages=carriages, **changes)


def bouncing(mass: float, stiffness: float, damping: float, **changes: Any) -> Machine:
    """A mass that moves along y alone, on one carriage; changes: of the carriage."""
    keys = {"stiffness_y": stiffness, "stiffness_z": stiffness, "damping_y": damping, "damping_z": damping}
    block = body(mass=mass, center_of_mass=(0, 0, 0), inertia=np.eye(3))
    rails = [Rail(name="1", position=(0.0, 0.0))]
    return machine(carriage(**(keys | changes)), body=block, rails=rails, free=("y",))


def one_mass(mass: float, gravity: float = 9.80665, **law: Any) -> Machine:
    """A mass that moves along y alone, on the link "spring" through its centre; law: of the link."""
    block = body(mass=mass, center_of_mass=(0, 0, 0), inertia=np.eye(3))
    spring = link("spring", direction=(0, 1, 0), **law)
    return Machine(body=block, links=[spring], free=("y",), gravity=(0, -gravity, 0))


# ---- changed copies


def having(part: Part, **changes: Any) -> Part:
    """A machine or a part of one with these values."""
    return part.model_copy(update=changes)


def with_carriages(machine: Machine, *names: str, **changes: Any) -> Machine:
    """With these values of the carriages of these names, or of all."""
    changed = (having(one, **changes) if one.name in names or not names else one for one in machine.carriages)
    return having(machine, carriages=tuple(changed))


def with_mass(machine: Machine, mass: Any) -> Machine:
    return having(machine, body=having(machine.body, mass=mass))
