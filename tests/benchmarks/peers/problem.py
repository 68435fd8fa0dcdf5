"""The job that all peers get: matrices, laws, motion; assembled here and not by guideload's core, so that agreement
of the loads checks assembly and static start as well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray
from rider_reference import cross

from guideload import Machine, Motion
from peers.laws import Law, force, tangent

Array = NDArray[np.float64]
At = Callable[[float], Array]  # the loads with this tolerance, or this step in ms; some have neither
DOFS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class Problem:
    """x' = a x + b u - by [F(d) - F(at_rest)], load = rest + c x + onto F(d), d = at_rest + rows x, from x = 0 on.

    x is (q - q_rest, q') of the n free dofs; u is the acceleration of L along the rails, linear between its
    samples. F is the links' law; where it is linear (law None), it stands in a and c, and by, rows and onto
    have no links.
    """

    a: Array  # (2n, 2n)
    b: Array  # (2n,)
    c: Array  # (carriage, 6, 2n)
    rest: Array  # (carriage, 6)
    size: Array  # (2n,) states of the size of the sag
    time: Array
    u: Array
    law: Law | None
    rows: Array  # (link, 2n)
    at_rest: Array  # (link,) m
    by: Array  # (2n, link)
    onto: Array  # (2 carriages, link)

    @property
    def c_yz(self) -> Array:
        """(2 carriages, 2n) y and z forces only."""
        return self.c[:, 1:3].reshape(-1, self.b.size)

    @property
    def rest_yz(self) -> Array:
        """(2 carriages,)"""
        return self.rest[:, 1:3].ravel()

    @property
    def step(self) -> float:
        """The uniform sample interval in s."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    @property
    def constant(self) -> Array:
        """(2n,) by F(at_rest)."""
        return self.by @ force(self.law)(self.at_rest) if self.law else np.zeros(self.b.size)

    def loads_yz(self, states: Array) -> Array:
        """(time, carriage, 2) from states (2n, time)."""
        loads = self.rest_yz + states.T @ self.c_yz.T
        if self.law is not None:
            loads += force(self.law)(self.at_rest + states.T @ self.rows.T) @ self.onto.T
        return loads.reshape(self.time.size, -1, 2)

    def jacobian(self, x: Array) -> Array:
        """(2n, 2n) of x' at a state."""
        if self.law is None:
            return self.a
        return self.a - self.by * tangent(self.law)(self.at_rest + self.rows @ x) @ self.rows

    @cached_property
    def scaled(self) -> Problem:
        """The same in states of order one, for solvers with a single absolute tolerance."""
        s = self.size
        return replace(
            self,
            a=self.a * s / s[:, None],
            b=self.b / s,
            c=self.c * s,
            size=np.ones(s.size),
            rows=self.rows * s,
            by=self.by / s[:, None],
        )

    def exponential(self) -> tuple[Array, Array, Array]:
        """p, g0, g1 of x(t + h) = p x + g0 u(t) + g1 u(t + h), without the links' laws."""
        return exponential(self.a, self.b, self.step)


def exponential(a: Array, b: Array, step: float) -> tuple[Array, Array, Array]:
    """That of `Problem.exponential`, also of many systems, with an axis over them in front."""
    n = b.shape[-1]
    m = np.zeros((*b.shape[:-1], n + 2, n + 2))
    m[..., :n, :n], m[..., :n, n], m[..., n, n + 1] = a * step, b * step, 1.0
    e = scipy.linalg.expm(m)[..., :n, :]
    return np.ascontiguousarray(e[..., :n]), e[..., n] - e[..., n + 1], e[..., n + 1].copy()


def free_rows(machine: Machine) -> tuple[list[int], Array]:
    """Indices of the free dofs, and the links' deflections over them, (link, n)."""
    links, free = machine.link_table(), [DOFS.index(dof) for dof in machine.free]
    return free, np.hstack([links.directions, np.cross(links.points, links.directions)])[:, free]


def weight_of(machine: Machine) -> Array:
    """(n,) force and moment about L of the free dofs."""
    r, gravity = np.array(machine.body.center_of_mass), np.array(machine.gravity)
    weight = machine.body.mass * np.concatenate([gravity, np.cross(r, gravity)])
    return weight[[DOFS.index(dof) for dof in machine.free]]


def problem(machine: Machine, motion: Motion, law: Law | None = None) -> Problem:
    """The problem of a machine whose links are linear, or all have one law."""
    links = machine.link_table()
    free, rows = free_rows(machine)
    mass, r = machine.body.mass, np.array(machine.body.center_of_mass)
    s = cross(r)
    inertia = machine.body.central_inertia() - mass * s @ s
    inertia6 = np.block([[mass * np.eye(3), -mass * s], [mass * s, inertia]])
    n, ff = len(free), np.ix_(free, free)
    inverse = np.linalg.inv(inertia6[ff])
    stiffness, damping = rows.T * links.stiffness @ rows, rows.T * links.damping @ rows
    sag = np.linalg.solve(stiffness, weight_of(machine))

    def carriages(factor: Array) -> Array:
        """(carriage, 6, link) force and moment of each carriage from its links' deflections times `factor`."""
        parts = np.zeros((len(machine.carriages), 6, factor.size))
        for i, center in enumerate(machine.carriage_centers):
            of = links.carriage == i
            arms = np.cross(links.points[of] - center, links.directions[of])
            parts[i][:, of] = np.hstack([links.directions[of], arms]).T * factor[of]
        return parts

    elastic = stiffness if law is None else np.zeros((n, n))
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ elastic, -inverse @ damping]])
    c = carriages(links.damping) @ np.hstack([np.zeros(rows.shape), rows])
    if law is None:
        c += carriages(links.stiffness) @ np.hstack([rows, np.zeros(rows.shape)])
    moves = np.array([dof in "xyz" for dof in machine.free])
    size = np.where(moves, np.abs(sag[moves]).max(), np.abs(sag[~moves]).max())
    slowest = np.sqrt(scipy.linalg.eigh(stiffness, inertia6[ff], eigvals_only=True)[0])
    count = len(rows) if law else 0
    return Problem(
        a=a,
        b=np.concatenate([np.zeros(n), -inverse @ inertia6[free, 0]]),
        c=c,
        rest=c[:, :, :n] @ sag,
        size=np.concatenate([size, slowest * size]),
        time=motion.time,
        u=np.ascontiguousarray(motion.acceleration[:, 0]),
        law=law,
        rows=np.hstack([rows, np.zeros(rows.shape)])[:count],
        at_rest=rows[:count] @ rest_position(machine, law),
        by=np.vstack([np.zeros((n, count)), (inverse @ rows.T)[:, :count]]),
        onto=carriages(np.ones(len(rows)))[:, 1:3, :count].reshape(2 * len(machine.carriages), count),
    )


def rest_position(machine: Machine, law: Law | None) -> Array:
    """(n,) position of static equilibrium, by Newton from that of linear links.

    Where the body is free within its clearance, the position that springs eps k d in all links choose for eps
    -> 0: with a small eps Newton finds which links touch, then of all positions that satisfy them the one
    with the least sum k d^2.
    """
    rows, weight, nominal = free_rows(machine)[1], weight_of(machine), machine.link_table().stiffness
    grid = rows.T * nominal @ rows
    q = np.linalg.solve(grid, weight)
    if law is None:
        return q
    pull, slope = force(law), tangent(law)
    for eps in (1e-2, 1e-4, 1e-6, 1e-8):
        for _ in range(100):
            d = rows @ q
            residual = rows.T @ (pull(d) + eps * nominal * d) - weight
            change = np.linalg.solve(rows.T * (slope(d) + eps * nominal) @ rows, residual)
            change *= min(1.0, 1e-4 / np.abs(rows @ change).max())  # at most 0.1 mm
            q = q - change
            if np.abs(rows @ change).max() < 1e-15 * np.abs(d).max():
                break
    for _ in range(20):
        strain, shapes = scipy.linalg.eigh(rows.T * slope(rows @ q) @ rows, grid)  # shapes^T grid shapes = 1
        held, loose = shapes[:, strain >= 1e-9], shapes[:, strain < 1e-9]
        residual = rows.T @ pull(rows @ q) - weight
        q = q - held @ ((held.T @ residual) / strain[strain >= 1e-9])
        q = q - loose @ (loose.T @ (grid @ q))
    return q
