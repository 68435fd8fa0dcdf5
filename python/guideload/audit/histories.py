"""The histories of a result that the audit needs: motion of L, excitation and links, as arrays."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from guideload._core import Scene
from guideload.base.arrays import Array, median_step
from guideload.base.quantities import Quantities
from guideload.machine.machine import DOFS, Machine


class Histories:
    """A machine and the arrays of a result; time is the first dimension, units are SI.

    `excitation` (time, 6): E - M_u a, force [N] and moment about L [N m] of process forces and inertia in the carriage
    frame. `rows` (link, 6): deflection of a link = row . position of L.
    """

    def __init__(self, machine: Machine, data: Quantities) -> None:
        self.machine = machine
        self.data = data
        self.links = machine.link_table()
        self.linear = machine.scene.model_level == "linear"
        points, directions = self.links.points, self.links.directions
        self.rows: Array = np.hstack([directions, np.cross(points, directions)])
        self.free = [DOFS.index(dof) for dof in machine.free]
        (self.mass, *_), self.weight = machine.scene.matrices()
        self.time: Array = data["time"]
        self.position: Array = data["displacement"]
        self.velocity: Array = data["velocity"]
        self.acceleration: Array = data["acceleration"]
        self.cart_acceleration: Array = data["cart_acceleration"]
        self.wrench: Array = data["wrench"] if "wrench" in data else np.zeros((self.time.size, 6))
        self.excitation: Array = self.wrench - self.cart_acceleration @ self.mass[:, :3].T
        self.rides = (
            "rider_wrench" in data
        )  # riders act like an external load that depends on the motion of the body
        if self.rides:
            self.excitation = self.excitation + data["rider_wrench"]
        self.deflection: Array = self.position @ self.rows.T
        self.step = median_step(self.time)  # s, 0 for a single instant
        self.trace_step = float(data.attrs["motion_step_s"])  # s, of the motion's samples

    @cached_property
    def stiffness(self) -> Array:
        """Stiffness matrix (6, 6) of L, with the nominal stiffness of every link."""
        return np.asarray((self.rows.T * self.links.stiffness) @ self.rows)

    @cached_property
    def response(self) -> Array:
        """Static link loads (6, link) [N] per unit force and moment on L; nominal stiffness."""
        free = np.ix_(self.free, self.free)
        position = np.zeros((6, 6))
        position[free] = np.linalg.inv(self.stiffness[free])
        return np.asarray(position @ (self.rows.T * self.links.stiffness))

    def quasi_static_resultants(self) -> Array:
        """Quasi-static resultants (time, carriage) [N]: K q = Q + E - M_u a at every instant."""
        loads, directions = (self.excitation + self.weight) @ self.response, self.links.directions
        resultants = np.zeros((self.time.size, len(self.machine.carriages)))
        for i, links in enumerate(self.machine.links_of_carriages):
            resultants[:, i] = np.linalg.norm(loads[:, links] @ directions[links, 1:], axis=1)
        return resultants

    @property
    def starts_at_rest(self) -> bool:
        """Whether nothing moves at the first instant, because it is the start of the run."""
        return not np.any(self.velocity[0])

    @property
    def usable_bandwidth(self) -> float:
        """Usable bandwidth of the motion [Hz]; see `TraceResolution`."""
        half_rate = 0.5 / self.trace_step if self.trace_step else np.inf
        return float(
            self.data.attrs.get("motion_bandwidth_Hz", half_rate)
        )  # results of older versions lack it

    @property
    def hidden_jumps(self) -> int:
        """Number of jumps of the excitation between two instants; a visible jump has two instants at one time."""
        return int(self.data.attrs["motion_jumps"]) - int(np.count_nonzero(np.diff(self.time) == 0.0))

    @property
    def as_fine_as_motion(self) -> bool:
        """Whether the instants are at most as far apart as the samples of the motion."""
        return 0.0 < self.step <= 1.001 * self.trace_step

    @property
    def has_motion(self) -> bool:
        """Whether the quantities contain all samples of the motion; False also for files that do not say so."""
        shown = self.starts_at_rest and self.data.attrs.get("instants") == "samples of the motion"
        return shown or ("motion_acceleration" in self.data and not self.rides)

    @property
    def repeatable(self) -> bool:
        """Whether the instants contain the whole excitation from the start, so that the run can be repeated."""
        return self.starts_at_rest and self.as_fine_as_motion and not self.hidden_jumps

    def solve_motion(self, method: str, rtol: float, factor: float) -> Array:
        """Link loads (time, link) [N] under the motion of `has_motion` times a factor."""
        if "motion_acceleration" not in self.data:
            return self.solve(method, rtol, factor)
        wrench = factor * self.data["motion_wrench"] if "motion_wrench" in self.data else None
        acceleration = factor * self.data["motion_acceleration"]
        motion = self.data["motion_time"], acceleration, wrench
        return self.machine.scene.solve(*motion, method=method, rtol=rtol, times=self.time).link_loads(
            "total"
        )

    def solve(self, method: str, rtol: float, factor: float, scene: Scene | None = None) -> Array:
        """Link loads (time, link) [N] of a scene, by default the machine's, under the excitation times a factor."""
        acceleration, wrench = factor * self.cart_acceleration, factor * self.wrench
        scene = scene or self.machine.scene
        travel = None
        if self.rides:
            method = "implicit" if method == "exact" else method
            travel = np.stack(
                [self.data[f"rider_{name}"].T for name in ("position", "velocity", "acceleration")], 2
            )
            travel[:, :, 0] -= np.array([[rider.position] for rider in self.machine.riders])
        solution = scene.solve(self.time, acceleration, wrench, method=method, rtol=rtol, travel=travel)
        return solution.link_loads("total")
