"""The histories of a result as the audit reads them: arrays of the motion of L, the excitation and the links."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from guideload._core import Scene
from guideload.base.arrays import Array, median_step
from guideload.base.quantities import Quantities
from guideload.machine.machine import DOFS, Machine


class Histories:
    """A machine and the arrays of a result, time first, SI.

    `excitation` (time, 6) is the force [N] and moment about L [N m] that drives L in the carriage frame: external
    ones and those of the cart's acceleration, E - M_u a. `rows` (link, 6) give deflections from positions.
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
        self.deflection: Array = self.position @ self.rows.T
        self.step = median_step(self.time)  # s, 0 for a single instant
        self.trace_step = float(data.attrs["motion_step_s"])  # s, of the motion's samples

    @cached_property
    def stiffness(self) -> Array:
        """(6, 6) of L, with the nominal stiffness of every link."""
        return np.asarray((self.rows.T * self.links.stiffness) @ self.rows)

    @cached_property
    def response(self) -> Array:
        """(6, link) link loads [N] per steady force [N] and moment about L [N m]; nominal stiffness."""
        free = np.ix_(self.free, self.free)
        position = np.zeros((6, 6))
        position[free] = np.linalg.inv(self.stiffness[free])
        return np.asarray(position @ (self.rows.T * self.links.stiffness))

    def quasi_static_resultants(self) -> Array:
        """(time, carriage) N, y-z resultants by K q = Q + E - M_u a at every instant: static calculation with m a."""
        loads, directions = (self.excitation + self.weight) @ self.response, self.links.directions
        resultants = np.zeros((self.time.size, len(self.machine.carriages)))
        for i, links in enumerate(self.machine.links_of_carriages):
            resultants[:, i] = np.linalg.norm(loads[:, links] @ directions[links, 1:], axis=1)
        return resultants

    @property
    def starts_at_rest(self) -> bool:
        """Whether the first instant is that of the start, where nothing moves yet."""
        return not np.any(self.velocity[0])

    @property
    def usable_bandwidth(self) -> float:
        """Up to which frequency the motion shows accelerations [Hz]; see `TraceResolution`."""
        half_rate = 0.5 / self.trace_step if self.trace_step else np.inf
        return float(self.data.attrs.get("motion_bandwidth_Hz", half_rate))  # older files do not have it

    @property
    def hidden_jumps(self) -> int:
        """Jumps of the excitation that the instants do not show from both sides."""
        return int(self.data.attrs["motion_jumps"]) - int(np.count_nonzero(np.diff(self.time) == 0.0))

    @property
    def fine(self) -> bool:
        """Whether the instants are as close as the motion's samples, so that no excitation is lost between them."""
        return 0.0 < self.step <= 1.001 * self.trace_step

    @property
    def repeatable(self) -> bool:
        """Whether the instants hold the whole excitation from the start on, so that the run can be repeated."""
        return self.starts_at_rest and self.fine and not self.hidden_jumps

    def solved(self, scene: Scene, factor: float = 1.0) -> Array:
        """(time, link) N, link loads of a scene under the excitation times a factor; links not preloaded."""
        acceleration, wrench = factor * self.cart_acceleration, factor * self.wrench
        return scene.solve(self.time, acceleration, wrench, method="exact", rtol=1e-6).link_loads("total")
