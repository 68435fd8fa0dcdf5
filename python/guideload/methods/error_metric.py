"""Which loads tell runs apart: the forces of the carriages, or where these are blind the loads of links."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from guideload._core import Solution
from guideload.base.arrays import Array
from guideload.machine.machine import Machine

BLIND = 0.1  # carriages that move by less than this part of what their links do hide the motion


@dataclass(frozen=True, eq=False)
class ErrorMetric:
    """The loads that a run is judged by: the forces of the carriages, or the loads of the first `links` links."""

    machine: Machine
    links: int | None
    static: Array  # (carriage, 3) or (links,) N
    text: str

    @classmethod
    def chosen(cls, machine: Machine, solution: Solution) -> ErrorMetric:
        """The carriages' forces, unless their sums move much less than the links that they are the sums of.

        The two ends of a carriage can take the motion by opposite forces: in the paper's scene the carriages'
        forces move by 2 N while each of their links moves by 1 556 N.
        """
        scene, carriages = machine.scene, machine.carriages
        static_links = scene.static_link_loads()
        if not carriages:
            text = "the loads of the links: the machine has no carriages"
            return cls(machine, static_links.size, static_links, text)
        forces = scene.static_group_loads(machine.links_of_carriages, machine.carriage_centers)[:, :3]
        by_carriage = cls(machine, None, forces, "the forces of the carriages along x, y and z")
        count = sum(links.size for links in machine.links_of_carriages)  # they stand before the extra links
        by_link = cls(machine, count, static_links[:count], "")
        moved, links_moved = (difference(kind.of(solution), kind.static) for kind in (by_carriage, by_link))
        if moved >= BLIND * links_moved:
            return by_carriage
        text = (
            "the loads of the carriages' links; the carriages' forces, their sums, hide the motion: they move by "
            f"{moved:.3g} N, the links by {links_moved:.4g} N"
        )
        return replace(by_link, text=text)

    def of(self, solution: Solution) -> Array:
        """(time, carriage, 3) or (time, links) [N] of a run."""
        if self.links is not None:
            return solution.link_loads("total")[:, : self.links]
        machine = self.machine
        return solution.group_loads(machine.links_of_carriages, machine.carriage_centers, "total")[:, :, :3]


def difference(loads: Array, others: Array) -> float:
    """The largest over time and loads [N]."""
    return float(np.abs(loads - others).max(initial=0.0))
