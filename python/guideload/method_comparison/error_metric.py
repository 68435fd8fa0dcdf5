"""The loads by which runs are compared: forces of the carriages, or loads of links where those hide the motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from guideload._core import Solution
from guideload.base.arrays import Array
from guideload.machine.machine import Machine

HIDDEN = 0.1  # carriages whose loads change by less than this part of what their links' do hide the motion


@dataclass(frozen=True, eq=False)
class ErrorMetric:
    """Which loads errors are of: the forces of the carriages, or the loads of the first `links` links.

    static  (carriage, 3) or (links,) N, in static equilibrium
    text    which these loads are, and why
    """

    machine: Machine
    links: int | None
    static: Array
    text: str

    @classmethod
    def choose(cls, machine: Machine, solution: Solution) -> ErrorMetric:
        """The carriages' forces, unless these change much less than the loads of their links.

        The two ends of a carriage can take the motion by opposite forces: in the paper's scene the carriages'
        forces change by 2 N while the load of each of their links changes by 1 556 N.
        """
        scene, carriages = machine.scene, machine.carriages
        static_links = scene.static_link_loads()
        if not carriages:
            text = "the loads of the links: the machine has no carriages"
            return cls(machine, static_links.size, static_links, text)
        forces = scene.static_group_loads(machine.links_of_carriages, machine.carriage_places)[:, :3]
        by_carriage = cls(machine, None, forces, "the forces of the carriages along x, y and z")
        count = sum(links.size for links in machine.links_of_carriages)  # these come before the extra links
        by_link = cls(machine, count, static_links[:count], "")
        change, links_change = (
            difference(metric.loads(solution), metric.static) for metric in (by_carriage, by_link)
        )
        if change >= HIDDEN * links_change:
            return by_carriage
        text = (
            "the loads of the carriages' links; the carriages' forces, their sums, hide the motion: they change by "
            f"{change:.3g} N, the links by {links_change:.4g} N"
        )
        return replace(by_link, text=text)

    def loads(self, solution: Solution) -> Array:
        """(time, carriage, 3) or (time, links) [N] of a run."""
        if self.links is not None:
            return solution.link_loads("total")[:, : self.links]
        machine = self.machine
        return solution.group_loads(machine.links_of_carriages, machine.carriage_places, "total")[:, :, :3]


def difference(loads: Array, others: Array) -> float:
    """The largest absolute difference [N] of two arrays of loads."""
    return float(np.abs(loads - others).max(initial=0.0))
