"""The job that the batch peers get: one machine and motion, and draws of what varies; set up in NumPy, many scenes at
once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from guideload import Machine, Motion
from peers.laws import Sided
from peers.problem import Array, Problem, exponential, free_rows, problem

Peaks = Array  # (scene, 2 carriages) N: of each carriage the largest |Fy| and |Fz| at the samples
Run = Callable[["Scatter"], Peaks]


@dataclass(frozen=True, eq=False)
class Scatter:
    """Scenes that differ in the body, and in the carriages' stiffness and damping; an axis over scenes comes first."""

    machine: Machine  # with linear links; what does not vary
    motion: Motion
    nominal: Problem  # the scene where nothing varies
    geometry: Geometry
    clearance: float  # m to either side in each link, 0 where the links are linear
    mass: Array  # (scene,) kg
    center: Array  # (scene, 3) m, centre of mass
    stiffness: Array  # (scene, carriage) times the machine's
    damping: Array

    def __len__(self) -> int:
        return self.mass.size

    def first(self, count: int) -> Scatter:
        """The first scenes."""
        names = ("mass", "center", "stiffness", "damping")
        return replace(self, **{name: getattr(self, name)[:count].copy() for name in names})

    def machine_of(self, scene: int) -> Machine:
        """One scene, as a description of its own."""
        body = self.machine.body.model_dump() | {
            "mass": self.mass[scene],
            "center_of_mass": self.center[scene],
        }
        factors = {"stiffness": self.stiffness[scene], "damping": self.damping[scene]}
        carriages = []
        for i, carriage in enumerate(self.machine.carriages):
            given = carriage.model_dump(exclude_defaults=True)
            for axis in "yz":
                given |= {f"{name}_{axis}": given[f"{name}_{axis}"] * by[i] for name, by in factors.items()}
                given[f"clearance_{axis}"] = self.clearance
            carriages.append(given)
        rails, free, gravity = self.machine.rails, self.machine.free, self.machine.gravity
        return Machine(body=body, rails=rails, carriages=carriages, free=free, gravity=gravity)

    def problem_of(self, scene: int) -> Problem:
        """One scene as `problem` assembles it, sharing nothing with `systems`; for the truth, and for clearance."""
        if not self.clearance:
            return problem(self.machine_of(scene), self.motion)
        machine = replace(self, clearance=0.0).machine_of(scene)
        k = machine.link_table().stiffness
        given = problem(machine, self.motion, Sided(k, k, self.clearance))
        # The same with links of 1 N/m, whose stiffness stands in what their forces are multiplied with.
        law = Sided(1.0, 1.0, self.clearance)
        return replace(given, law=law, by=given.by * k, onto=given.onto * k)


@dataclass(frozen=True, eq=False)
class Geometry:
    """What no draw changes."""

    free: list[int]
    inertia: Array  # (3, 3) kg m2 about the centre of mass
    gravity: Array  # (3,) m/s2
    elastic: Array  # (2 carriages, n) the carriages' y and z forces over the free dofs
    damped: Array
    stiff: Array  # (carriage, n, n) the stiffness matrix of each carriage's links
    damp: Array


def scatter(
    machine: Machine,
    motion: Motion,
    clearance: float,
    mass: Array,
    center: Array,
    stiffness: Array,
    damping: Array,
) -> Scatter:
    """Draws of a machine whose links are all of its carriages."""
    draws = (np.ascontiguousarray(values) for values in (mass, center, stiffness, damping))
    return Scatter(machine, motion, problem(machine, motion), _geometry(machine), clearance, *draws)


def _geometry(machine: Machine) -> Geometry:
    links = machine.link_table()
    free, rows = free_rows(machine)
    of = links.carriage == np.arange(len(machine.carriages))[:, None]  # (carriage, link)
    sides = (of[:, None, :] * links.directions.T[1:3]).reshape(-1, len(rows))

    def grids(factor: Array) -> Array:
        return np.einsum("cl,l,li,lj->cij", of, factor, rows, rows)

    return Geometry(
        free=free,
        inertia=machine.body.central_inertia(),
        gravity=np.array(machine.gravity),
        elastic=sides * links.stiffness @ rows,
        damped=sides * links.damping @ rows,
        stiff=grids(links.stiffness),
        damp=grids(links.damping),
    )


@dataclass(frozen=True, eq=False)
class Systems:
    """x' = a x + b u, as in `Problem`, of each scene, whose links are linear."""

    scatter: Scatter
    a: Array  # (scene, 2n, 2n)
    b: Array  # (scene, 2n)
    c: Array  # (scene, 2 carriages, 2n)
    rest: Array  # (scene, 2 carriages) N

    def propagators(self) -> tuple[Array, Array, Array]:
        """p, g0, g1 of `Problem.exponential`, with an axis over scenes."""
        return exponential(self.a, self.b, self.scatter.nominal.step)

    def problem(self, scene: int) -> Problem:
        """One of them for the peers that run one at a time; of the loads only those along y and z."""
        nominal = self.scatter.nominal
        c, rest = np.zeros_like(nominal.c), np.zeros_like(nominal.rest)
        c[:, 1:3] = self.c[scene].reshape(len(c), 2, -1)
        rest[:, 1:3] = self.rest[scene].reshape(-1, 2)
        return replace(nominal, a=self.a[scene], b=self.b[scene], c=c, rest=rest)


def systems(of: Scatter) -> Systems:
    """Assembly and rest of all scenes at once."""
    known, (count, n) = of.geometry, (len(of), of.nominal.b.size // 2)
    mass, free = of.mass[:, None, None], known.free
    s = np.zeros((count, 3, 3))  # s @ v is center x v
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        s[:, i, j], s[:, j, i] = -of.center[:, k], of.center[:, k]
    inertia = np.empty((count, 6, 6))
    inertia[:, :3, :3], inertia[:, :3, 3:], inertia[:, 3:, :3] = mass * np.eye(3), -mass * s, mass * s
    inertia[:, 3:, 3:] = known.inertia - mass * (s @ s)
    inverse = np.linalg.inv(inertia[:, free][:, :, free])
    weight = (inertia[:, free, :3] @ known.gravity)[:, :, None]
    stiffness, damping = (
        np.einsum("sc,cij->sij", factors, grids)
        for factors, grids in ((of.stiffness, known.stiff), (of.damping, known.damp))
    )
    a, b = np.zeros((count, 2 * n, 2 * n)), np.zeros((count, 2 * n))
    a[:, :n, n:], a[:, n:, :n], a[:, n:, n:] = np.eye(n), -inverse @ stiffness, -inverse @ damping
    b[:, n:] = -(inverse @ inertia[:, free, :1])[:, :, 0]
    elastic, damped = (
        factors.repeat(2, axis=1)[:, :, None] * forces
        for factors, forces in ((of.stiffness, known.elastic), (of.damping, known.damped))
    )
    rest = (elastic @ np.linalg.solve(stiffness, weight))[:, :, 0]
    return Systems(of, a, b, np.concatenate([elastic, damped], axis=2), rest)
