"""The loads of the carriages in parts: weight, quasi-static load of acceleration and process force, vibration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from guideload.audit.histories import Histories
from guideload.base.arrays import Array
from guideload.simulation.result import Result

CAUSES = ("weight", "acceleration", "process force", "vibration")


class LoadParts(NamedTuple):
    """Parts of the loads, each (time, carriage, 6) or (carriage, 6): force [N] and moment [N m].

    weight          static load
    acceleration    quasi-static load of the cart's acceleration (m a), with nominal stiffness
    process_force   quasi-static load of the process forces, and of rails that are not straight
    vibration       the rest: dynamic overshoot, and what the elastic laws add if they are not linear
    """

    weight: Array
    acceleration: Array
    process_force: Array
    vibration: Array

    @property
    def quasi_static(self) -> Array:
        """Loads of statics with m a, which catalogues put into their formulas."""
        return np.asarray(self.weight + self.acceleration + self.process_force)

    def at(self, instant: int, carriage: int) -> Array:
        """The parts (4, 6) of the load of a carriage at an instant, in the order of `CAUSES`."""
        changing = (self.acceleration, self.process_force, self.vibration)
        return np.stack([self.weight[carriage], *(part[instant, carriage] for part in changing)])


def load_parts(result: Result) -> LoadParts:
    """The parts of the loads of a result."""
    machine, histories = result.machine, Histories(result.machine, result.quantities)
    data = result.quantities
    weight = np.concatenate([data["static_force"], data["static_moment"]], axis=1)
    links = histories.links
    to_carriage = np.zeros((len(machine.carriages), 6, len(links.names)))
    places = zip(machine.links_of_carriages, machine.carriage_centers, machine.carriage_axes, strict=True)
    for i, (of_carriage, center, axes) in enumerate(places):
        direction = links.directions[of_carriage]
        moment = np.cross(links.points[of_carriage] - center, direction)
        to_carriage[i][:, of_carriage] = np.hstack([direction @ axes.T, moment @ axes.T]).T

    to_loads = histories.response @ to_carriage.reshape(-1, len(links.names)).T  # (6, 6 for each carriage)

    def quasi_static(excitation: Array) -> Array:
        return np.asarray((excitation @ to_loads).reshape(-1, len(machine.carriages), 6))

    process = quasi_static(histories.wrench)
    if histories.foot_load is not None:
        process += (histories.foot_load @ to_carriage.reshape(-1, len(links.names)).T).reshape(process.shape)
    acceleration = quasi_static(histories.excitation - histories.wrench)
    vibration = result.carriage_loads - weight - process - acceleration
    return LoadParts(weight, acceleration, process, vibration)
