"""The run of a machine under a motion, and the derivatives of its histories and of figures of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from guideload._core import Solution, VariedInstants, VariedRun
from guideload.base.arguments import real_array
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.base.maxima import maxima_between
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion, with_instants
from guideload.sensitivity.linearised import Linearised
from guideload.simulation.instants import fastest_vibration, with_enough_instants
from guideload.simulation.peaks import RESULTANT
from guideload.simulation.simulation import prepared_run
from guideload.simulation.start import Start, start_of

# Method and tolerance of the histories themselves; the exact method does not use the tolerance.
EXACT, WITH_PRELOAD = ("exact", 1e-6), ("implicit", 1e-11)


@dataclass(frozen=True, eq=False)
class History:
    """A quantity at n instants: values (n,), derivatives (p, n) by p columns, and (n,) by time [1/s]."""

    values: Array
    by: Array
    slope: Array

    def from_rest(self, value: float, by: Array) -> History:
        """The change from a value at rest, whose derivatives by the columns are (p,)."""
        return replace(self, values=self.values - value, by=self.by - by[:, None])


class Instants:
    """The run of a linear machine at n instants.

    inputs        (n, 9) acceleration of the cart [m/s2] and external load about L [N, N m]
    input_slopes  (n, 9) their derivatives by time, behind an instant at which they have a kink
    """

    def __init__(self, instants: VariedInstants) -> None:
        self._instants = instants
        self.inputs, self.input_slopes = instants.inputs()

    def history(self, quantity: str, along: ArrayLike, part: str = "total") -> History:
        """The sum of the numbers of a quantity with factors `along`.

        quantity: as in `RunDerivatives.gradient`; along: an array of the shape of the quantity at one instant, such as
        (6,) for an acceleration. Loads and displacements contain those at rest.
        """
        factors = real_array("along", along).reshape(1, -1)
        values, slope, by = self._instants.histories(name_in_core(quantity), factors, part)
        return History(values[:, 0], by[:, :, 0], slope[:, 0])


class RunDerivatives:
    """The run of a machine by the method exact, and its exact derivatives by p columns. With preloaded links both are
    integrated in steps whose errors are 1e-11 of the largest state and of the largest derivative of it.

    at_rest   the machine with the values of the columns, at rest
    motion    with the factors motion.scale and motion.force_scale, where these vary
    solution  the histories themselves, as in `simulate`

    Derivatives are (p, time, ...), at the samples of the motion; at other instants: `at`.
    """

    def __init__(self, machine: Machine, at_rest: Linearised, motion: Motion, start: Start) -> None:
        machine.require_standing_riders("a sensitivity")
        if machine.drive is not None and machine.drive.push_direction is not None:
            raise ArgumentError(
                "drive: the push of the rack depends on the force of the drive, which derivatives do not follow; "
                "leave pressure_angle and push_direction out, or take differences of runs of varied machines"
            )
        self.machine, self.at_rest, self.motion = machine, at_rest, motion
        self._begin = start_of(machine, motion, start)
        inputs = np.ascontiguousarray(motion.acceleration), motion.wrench
        self._run: VariedRun = at_rest.system.run(motion.time, *inputs, start=self._begin)

    @cached_property
    def solution(self) -> Solution:
        return self.at_rest.scene.solve(*self._scaled(self.motion), **self._settings)

    def carriage_loads(self) -> Array:
        """Loads of the carriages (time, carriage, 6), force [N] and moment about the carriage centre [N m]."""
        return self._group_loads(self.solution)

    def on_instants(self, motion: Motion) -> RunDerivatives:
        """The same run under the same motion with other stamps."""
        same = motion is self.motion
        return self if same else RunDerivatives(self.machine, self.at_rest, motion, self._begin)

    def with_visible_vibration(self) -> RunDerivatives:
        """The same run with the instants that `simulate` reports, between which loads are nearly linear."""
        run = prepared_run(self.machine, self.motion, "auto", EXACT[1], None, None, self._begin, finer=True)
        return self.on_instants(run.motion)

    def with_peaks(self) -> RunDerivatives:
        """The same run with the instants of the largest resultants of the carriages, which lie between samples.

        Where the motion has few samples, also with those of `with_enough_instants`.
        """
        machine = self.machine
        motion = with_enough_instants(self.motion, fastest_vibration(machine))
        settings = self._settings | {"groups": machine.links_of_carriages, "centers": machine.carriage_places}
        _, largest, _, times, _ = self.at_rest.scene.peaks(*self._scaled(motion), **settings)
        run = self.on_instants(motion)
        tied = maxima_between(
            motion.time,
            _resultants(run.carriage_loads()),
            largest[:, RESULTANT],
            lambda times: _resultants(self._group_loads(run.solution_at(times))),
        )
        return self.on_instants(with_instants(motion, np.concatenate([times[:, RESULTANT], tied])))

    def solution_at(self, times: Array) -> Solution:
        """The histories at other instants (m,) [s], ascending."""
        return self.at_rest.scene.solve(*self._scaled(self.motion), times=times, **self._settings)

    def _group_loads(self, solution: Solution) -> Array:
        return solution.group_loads(self.machine.links_of_carriages, self.machine.carriage_places, "total")

    @property
    def _settings(self) -> dict[str, Any]:
        method, rtol = WITH_PRELOAD if self.machine.model_level == "smooth nonlinear" else EXACT
        return {"method": method, "rtol": rtol, "start": self._begin}

    def _scaled(self, motion: Motion) -> tuple[Array, Array, Array | None]:
        """Time, acceleration and wrench, with the factors."""
        motion_factor, force_factor = self.at_rest.system.factors
        wrench = None if motion.wrench is None else force_factor * motion.wrench
        return motion.time, motion_factor * motion.acceleration, wrench

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
            displacement, velocity, acceleration : (p, time, 6), of L in the travelling frame, sag included
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
        """Derivatives (p,) of one figure of a run, computed backwards in time: at the cost of some runs for any p.

        Of a machine with nonlinear links they are sums over the derivatives of the histories.

        weights: derivatives of the figure by the quantity, in the shape of its history without p. quantity:
        carriage_loads, link_loads, displacement, velocity, acceleration or reaction.
        """
        flat = np.ascontiguousarray(weights, dtype=np.float64).reshape(self.motion.time.size, -1)
        return self._run.gradient(name_in_core(quantity), flat, part)


def name_in_core(quantity: str) -> str:
    """The name of a quantity in the core."""
    return {"carriage_loads": "group_loads", "displacement": "position"}.get(quantity, quantity)


def _resultants(loads: Array) -> Array:
    """Resultants of y and z force of loads (n, carriage, 6)."""
    return np.asarray(np.linalg.norm(loads[:, :, 1:3], axis=2))
