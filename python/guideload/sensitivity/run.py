"""The run of a machine under a motion, and the derivatives of its histories and of figures of them."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from guideload._core import Solution, VariedRun
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.sensitivity.instants import Instants, name_in_core
from guideload.sensitivity.linearised import Linearised
from guideload.simulation.start import Start, start_of

# Method and tolerance of the histories themselves; the exact method does not use the tolerance.
EXACT, WITH_PRELOAD = ("exact", 1e-6), ("implicit", 1e-11)


class RunDerivatives:
    """The run of a machine by the method exact, and its exact derivatives by p columns. With preloaded links both are
    integrated in steps whose errors are 1e-11 of the largest state and of the largest derivative of it.

    at_rest   the machine with the values of the columns, at rest
    motion    with the factors motion.scale and motion.force_scale, where these vary
    solution  the histories themselves, as in `simulate`

    Derivatives are (p, time, ...), at the samples of the motion; at other instants: `at`.
    """

    def __init__(self, machine: Machine, at_rest: Linearised, motion: Motion, start: Start) -> None:
        _require_plain(machine)
        self.machine, self.at_rest, self.motion = machine, at_rest, motion
        begin = start_of(self.machine, motion, start)
        inputs = np.ascontiguousarray(motion.acceleration), motion.wrench
        self._run: VariedRun = at_rest.system.run(motion.time, *inputs, start=begin)
        self._begin = begin

    @cached_property
    def solution(self) -> Solution:
        motion, (motion_factor, force_factor) = self.motion, self.at_rest.system.factors
        wrench = None if motion.wrench is None else force_factor * motion.wrench
        method, rtol = WITH_PRELOAD if self.machine.model_level == "smooth nonlinear" else EXACT
        acceleration = motion_factor * motion.acceleration
        return self.at_rest.scene.solve(
            motion.time, acceleration, wrench, method=method, rtol=rtol, start=self._begin
        )

    def at(self, time: Array) -> Instants:
        """The run at instants (n,) [s] in ascending order, between the samples of the motion too."""
        return Instants(self._run.at(np.ascontiguousarray(time, dtype=np.float64)))

    def history(self, quantity: str, part: str = "total") -> Array:
        """Derivatives of the history of a quantity.

        Parameters
        ----------
        quantity
            carriage_loads : (p, time, carriage, 6), force and moment about the carriage centre in its own axes
            link_loads : (p, time, link), along the links
            displacement, velocity, acceleration : (p, time, 6), of L in the carriage frame, sag included
            reaction : (p, time, 6), of the held dofs; of x it is the force of the drive without friction
        part
            Of the loads: "total", "elastic" or "damping".

        Returns
        -------
        Array in SI units per unit of each column.
        """
        found = self._run.derivatives(name_in_core(quantity), part)
        return found.reshape(*found.shape[:2], -1, 6) if quantity == "carriage_loads" else found

    def gradient(self, weights: Array, quantity: str = "carriage_loads", part: str = "total") -> Array:
        """Derivatives (p,) of one figure of a run, backwards in time: at the cost of some runs for any p. Of
        a machine with nonlinear links it is summed over the derivatives of the histories.

        weights: derivatives of the figure by the quantity, in the shape of its history without p. quantity:
        carriage_loads, link_loads, displacement, velocity, acceleration or reaction.
        """
        flat = np.ascontiguousarray(weights, dtype=np.float64).reshape(self.motion.time.size, -1)
        return self._run.gradient(name_in_core(quantity), flat, part)


def _require_plain(machine: Machine) -> None:
    """Raise ArgumentError for what changes the forces on the body with the loads."""
    if machine.drive is not None and machine.drive.push_direction is not None:
        raise ArgumentError(
            "drive: the push of the rack depends on the force of the drive, which derivatives do not follow; leave "
            "pressure_angle and push_direction out, or vary the machine in a study"
        )
