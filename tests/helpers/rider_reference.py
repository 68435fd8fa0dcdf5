"""Equations of a body with riders by themselves: for the tests, and as the right-hand side of other solvers.

They share no code with guideload: the accelerations of the main body and of each rider's centre of mass are written
out, and the loads follow from the stiffness and damping of the links.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload import Machine

Array = NDArray[np.float64]
DOFS = ("x", "y", "z", "rx", "ry", "rz")
# Travel, speed and acceleration of a rider at a time [s].
Travel = Callable[[float], tuple[float, float, float]]


def cross(r: Array) -> Array:
    """The matrix of r x, eq. 5 of the paper."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


@dataclass
class Riding:
    """A machine with linear links, whose riders move as `travels` say, under an acceleration of the cart."""

    machine: Machine
    travels: Sequence[Travel]
    acceleration: Callable[[float], Array]

    def __post_init__(self) -> None:
        table = self.machine.link_table()
        self.rows = np.hstack([table.directions, np.cross(table.points, table.directions)])
        self.free = [DOFS.index(dof) for dof in self.machine.free]
        self.stiffness = (self.rows.T * table.stiffness) @ self.rows
        self.damping = (self.rows.T * table.damping) @ self.rows
        self.spring, self.damper = table.stiffness, table.damping
        body, self.gravity = self.machine.body, np.array(self.machine.gravity)
        self.main = self._matrix(body.mass, np.array(body.center_of_mass), np.array(body.central_inertia()))
        self.weight = self._at(np.array(body.center_of_mass)).T @ (body.mass * self.gravity)
        # Of each rider: mass, inertia, centre of mass where s = 0, direction, and turn of the direction per (u, phi).
        self.riders = []
        for rider in self.machine.riders:
            along = np.array(rider.direction) / np.linalg.norm(rider.direction)
            inertia, turn = np.array(rider.central_inertia()), np.hstack([np.zeros((3, 3)), -cross(along)])
            self.riders.append((rider.mass, inertia, np.array(rider.center_of_mass), along, turn))

    @staticmethod
    def _at(point: Array) -> Array:
        """G: motion of a point of the body per unit of (u, phi)."""
        return np.concatenate([np.eye(3), -cross(point)], axis=1)

    def _matrix(self, mass: float, center: Array, inertia: Array) -> Array:
        g = self._at(center)
        matrix = mass * g.T @ g
        matrix[3:, 3:] += inertia
        return matrix

    def matrices(self, t: float) -> tuple[Array, Array, Array, Array]:
        """M, C, K and the force, each of all six dofs."""
        a = self.acceleration(t)
        mass, damping, stiffness = self.main.copy(), self.damping.copy(), self.stiffness.copy()
        force = self.weight - self.main[:, :3] @ a
        for (m, inertia, center, along, turn), travel in zip(self.riders, self.travels, strict=True):
            s, v, acceleration = travel(t)
            point = center + s * along
            g = self._at(point)
            mass += self._matrix(m, point, inertia)
            turning = m * g.T @ turn
            damping += 2.0 * v * turning
            stiffness += acceleration * turning
            force += m * g.T @ (self.gravity - a - acceleration * along)
        return mass, damping, stiffness, force

    def start(self) -> Array:
        """Position and velocity of the free dofs at rest, with the riders where they start and without acceleration."""
        n, at_rest = len(self.free), self.weight.copy()
        for (m, _, center, along, _), travel in zip(self.riders, self.travels, strict=True):
            at_rest += m * self._at(center + travel(0.0)[0] * along).T @ self.gravity
        q = np.linalg.solve(self.stiffness[np.ix_(self.free, self.free)], at_rest[self.free])
        return np.concatenate([q, np.zeros(n)])

    def rate(self, t: float, y: Array) -> Array:
        """Right-hand side for a solver, of the free dofs."""
        mass, damping, stiffness, force = self.matrices(t)
        free, n = np.ix_(self.free, self.free), len(self.free)
        right = force[self.free] - damping[free] @ y[n:] - stiffness[free] @ y[:n]
        return np.concatenate([y[n:], np.linalg.solve(mass[free], right)])

    def link_loads(self, states: Array) -> Array:
        """Loads (time, link) [N] of states (time, 2 n)."""
        rows, n = self.rows[:, self.free], len(self.free)
        return np.asarray(states[:, :n] @ rows.T * self.spring + states[:, n:] @ rows.T * self.damper)

    def reaction(self, t: float, y: Array) -> Array:
        """Reaction (6,) of the held dofs [N, N m]."""
        mass, damping, stiffness, force = self.matrices(t)
        n = len(self.free)
        q, speed, acceleration = np.zeros(6), np.zeros(6), np.zeros(6)
        q[self.free], speed[self.free], acceleration[self.free] = y[:n], y[n:], self.rate(t, y)[n:]
        reaction = mass @ acceleration + damping @ speed + stiffness @ q - force
        reaction[self.free] = 0.0
        return np.asarray(reaction)
