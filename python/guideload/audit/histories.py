"""The histories of a result that the audit needs: motion of L, excitation and links, as arrays."""

from __future__ import annotations

import json
from functools import cached_property
from typing import Literal

import numpy as np

from guideload._core import Scene
from guideload.base.arrays import Array, median_step
from guideload.base.quantities import Quantities
from guideload.machine.machine import DOFS, Machine
from guideload.machine.stretches import Stretches


class Histories:
    """A machine and the arrays of a result; time is the first dimension, units are SI.

    `excitation` (time, 6): E - M_u a, force [N] and moment about L [N m] of process forces and inertia in the carriage
    frame, and of rails that are not straight. `load` (time, link): N, without what such rails add. `damping`,
    `stiffness` (6, 6): of L, with the nominal stiffness of every link, all in contact. `rows` (link, 6): deflection of
    a link = row . position of L - offset of the rail. `stretches`: the histories between the changes of payload, each
    with the machine that carries it; `mass` is that of the first.
    """

    def __init__(self, machine: Machine, data: Quantities) -> None:
        self.data = data
        self.changes = payload_changes(data)
        self.machine = machine.with_payloads(self.changes[0][1]) if self.changes else machine
        self.given_machine = machine
        self.links = machine.link_table()
        self.linear = machine.scene.model_level == "linear"
        self.rows = self.links.rows
        self.free = [DOFS.index(dof) for dof in machine.free]
        (self.mass, self.damping, self.stiffness), self.weight = self.machine.nominal_scene.matrices()
        # On an elastic base the links move by (relative q - dragged q'), q the motion of the body.
        self.relative: Array = np.eye(6)
        self.dragged: Array = np.zeros((6, 6))
        if self.machine.base is not None:
            compliance = np.array(self.machine.base.compliance)
            links, dampers = (
                (self.rows.T * each) @ self.rows for each in (self.links.stiffness, self.links.damping)
            )
            self.relative = np.asarray(np.linalg.inv(np.eye(6) + compliance @ links))
            self.dragged = self.relative @ compliance @ dampers @ self.relative
        self.time: Array = data["time"]
        self.position: Array = data["displacement"]
        self.velocity: Array = data["velocity"]
        self.acceleration: Array = data["acceleration"]
        self.cart_acceleration: Array = data["cart_acceleration"]
        self.wrench: Array = data["wrench"] if "wrench" in data else np.zeros((self.time.size, 6))
        self.excitation: Array = self.wrench - self.cart_acceleration @ self.mass[:, :3].T
        self.rides = "rider_wrench" in data  # like an external load that depends on the motion of the body
        if self.rides:
            self.excitation = self.excitation + data["rider_wrench"]
        self.payload_weight = np.zeros(6)  # more than at the start; (time, 6) if payloads come and go
        if self.changes:  # masses and weight change
            at_start = self.weight
            self.excitation = np.concatenate([part.excitation for part in self.stretches])
            self.weight = np.concatenate(
                [np.broadcast_to(part.weight, (part.time.size, 6)) for part in self.stretches]
            )
            self.payload_weight = self.weight - at_start
        self.foot_load: Array | None = data.get("foot_load")
        self.load: Array = data["link_load"] if self.foot_load is None else data["link_load"] - self.foot_load
        self.deflection: Array = self.position @ (self.rows @ self.relative).T - self.machine.offsets
        if self.machine.base is not None:
            pull = (self.machine.offsets * self.links.stiffness) @ self.rows
            self.deflection += self.rows @ self.relative @ np.array(self.machine.base.compliance) @ pull
        self.step = median_step(self.time)  # s, 0 for a single instant
        self.start = str(data.attrs.get("start", "rest"))  # results of older versions lack it
        self.trace_step = float(data.attrs["motion_step_s"])  # s, of the motion's samples

    @cached_property
    def stretches(self) -> tuple[Histories, ...]:
        """The histories between the changes of payload; of a stretch without reported instants there are none."""
        if not self.changes:
            return (self,)
        bounds = [*_firsts(self.time, self.changes), self.time.size]
        return tuple(
            Histories(self.given_machine.with_payloads(names), _part(self.data, first, end))
            for (_, names), first, end in zip(self.changes, bounds, bounds[1:], strict=False)
            if first < end
        )

    def _scene(self, time: Array) -> Scene | Stretches:
        """What the core runs under a motion with these stamps."""
        return self.stretches_at(time) or self.machine.scene

    def stretches_at(self, time: Array) -> Stretches | None:
        """The stretches between the changes of payload of a motion with these stamps; None without changes."""
        if not self.changes:
            return None
        first = tuple(_firsts(time, self.changes))
        return Stretches(self.given_machine, tuple(names for _, names in self.changes), first)

    @cached_property
    def response(self) -> Array:
        """Static link loads (6, link) [N] per unit force and moment on L; nominal stiffness."""
        free = np.ix_(self.free, self.free)
        position = np.zeros((6, 6))
        position[free] = np.linalg.inv(self.stiffness[free])
        return np.asarray(position @ ((self.rows @ self.relative).T * self.links.stiffness))

    def by_law(self, quantity: Literal["force", "tangent", "energy"]) -> Array:
        """Elastic force, its slope or elastic energy of each link at its deflection, (time, link)."""
        columns = zip(self.links.laws, self.deflection.T, strict=True)
        values = [getattr(law, quantity)(np.ascontiguousarray(deflection)) for law, deflection in columns]
        return np.stack(values, axis=1)

    @cached_property
    def edges(self) -> Array:
        """Deflection (link,) [m] of the last edge of each law; 0 for a law without edges."""
        return np.array([law.edges[-1] if law.edges.size else 0.0 for law in self.links.laws])

    @cached_property
    def active_damping(self) -> Array:
        """Damping of every link at its deflection, (time, link) [N s/m]."""
        apart = self.links.damping_in_contact & (np.abs(self.deflection) <= self.edges)
        return np.where(apart, 0.0, self.links.damping)

    @cached_property
    def rail_wrench(self) -> Array:
        """Force and moment about L (time, 6) of rails that are not straight: a part of the excitation."""
        return np.zeros((self.time.size, 6)) if self.foot_load is None else -self.foot_load @ self.rows

    @cached_property
    def quasi_static_change(self) -> Array:
        """Change of `quasi_static` from rest, (time, link) [N]."""
        return np.asarray((self.excitation - self.rail_wrench + self.payload_weight) @ self.response)

    @cached_property
    def quasi_static(self) -> Array:
        """Quasi-static link loads (time, link) [N]: K q = Q + E - M_u a, on rails without errors."""
        return np.asarray((self.weight - self.payload_weight) @ self.response + self.quasi_static_change)

    @cached_property
    def rail_load(self) -> Array:
        """What errors of rails and carriages add to `quasi_static`, (time, link) [N]."""
        at_rest = self.quasi_static - self.quasi_static_change
        moving = 0.0 if self.foot_load is None else self.foot_load + self.rail_wrench @ self.response
        return np.asarray(self.machine.nominal_scene.static_link_loads() - at_rest + moving)

    @property
    def starts_at_rest(self) -> bool:
        """Whether nothing moves at the first instant, because it is the start of the run."""
        return not np.any(self.velocity[0])

    @property
    def usable_bandwidth(self) -> float:
        """Usable bandwidth of the motion [Hz]; see `TraceResolution`."""
        half_rate = 0.5 / self.trace_step if self.trace_step else np.inf
        found = self.data.attrs.get("motion_bandwidth_Hz", half_rate)  # results of older versions lack it
        return np.inf if found == "unlimited" else float(found)

    @property
    def hidden_jumps(self) -> int:
        """Number of jumps of the excitation between two instants; a visible jump has two instants at one time."""
        jumps = np.diff(self.time) == 0.0
        if self.changes:  # two stamps at a change are no jump of the excitation
            jumps[[first - 1 for first in _firsts(self.time, self.changes)[1:] if first > 0]] = False
        return int(self.data.attrs["motion_jumps"]) - int(np.count_nonzero(jumps))

    @property
    def as_fine_as_motion(self) -> bool:
        """Whether the instants are at most as far apart as the samples of the motion."""
        return 0.0 < self.step <= 1.001 * self.trace_step

    @property
    def has_motion(self) -> bool:
        """Whether the quantities contain all samples of the motion; False also for files that do not say so."""
        instants = str(self.data.attrs.get("instants"))
        shown = self.starts_at_rest and instants.startswith("samples of the motion")
        return shown or ("motion_acceleration" in self.data and not self.rides)

    @property
    def repeatable(self) -> bool:
        """Whether the instants contain the whole excitation from the start, so that the run can be repeated."""
        return self.starts_at_rest and self.as_fine_as_motion and not self.hidden_jumps

    def solve_motion(self, method: str, rtol: float, factor: float) -> Array:
        """Link loads (time, link) [N] under the motion of `has_motion` times a factor."""
        if "motion_acceleration" not in self.data:
            return self.solve(method, rtol, factor)
        time, wrench = self.data["motion_time"], self.data.get("motion_wrench")
        solution = self._scene(time).solve(
            time,
            factor * self.data["motion_acceleration"],
            None if wrench is None else factor * wrench,
            method=method,
            rtol=rtol,
            times=self.time,
            start=self.start,
        )
        return solution.link_loads("total")

    def solve(self, method: str, rtol: float, factor: float, scene: Scene | None = None) -> Array:
        """Link loads (time, link) [N] of a scene, by default the machine's, under the excitation times a factor."""
        acceleration, wrench = factor * self.cart_acceleration, factor * self.wrench
        if self.rides and method == "exact":
            method = "implicit"
        solution = (scene or self._scene(self.time)).solve(
            self.time, acceleration, wrench, method=method, rtol=rtol, start=self.start, travel=self.travel
        )
        return solution.link_loads("total")

    @property
    def travel(self) -> Array | None:
        """Travel [m] from where they stand, speed and acceleration of the riders (riders, time, 3), if they move."""
        if not self.rides:
            return None
        parts = [self.data[f"rider_{name}"].T for name in ("position", "velocity", "acceleration")]
        travel = np.stack(parts, axis=2)
        travel[:, :, 0] -= np.array([[rider.position] for rider in self.machine.riders])
        return travel


Changes = list[tuple[float, tuple[str, ...]]]


def payload_changes(data: Quantities) -> Changes:
    """When each stretch of a result begins [s], and the payloads on the machine in it; none without payloads."""
    changes = json.loads(str(data.attrs.get("payload_changes", "[]")))
    return [(float(time), tuple(names)) for time, names in changes]


def _firsts(time: Array, changes: Changes) -> list[int]:
    """Index of the first instant of each stretch: the second of two equal stamps, else the first at or after it."""
    began = np.array([start for start, _ in changes[1:]])
    before, after = np.searchsorted(time, began, "left"), np.searchsorted(time, began, "right")
    return [0, *np.where(after - before > 1, before + 1, before).tolist()]


def _part(data: Quantities, first: int, end: int) -> Quantities:
    """Quantities at some of the instants, of one machine."""
    variables = {
        name: one._replace(values=one.values[first:end]) if one.dims[:1] == ("time",) else one
        for name, one in data.variables.items()
    }
    kept = {key: value for key, value in data.attrs.items() if key != "payload_changes"}
    return Quantities(variables, kept)
