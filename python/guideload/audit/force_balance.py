"""Force balance of a result: its link loads must follow from its motion, and its motion from its link loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.audit.histories import Histories
from guideload.base.arrays import Array
from guideload.machine.machine import DOFS

# Over the sum of the magnitudes of all terms. Loads, accelerations and reactions of a state balance to rounding, 1e-15
# of each term; 1e-9 leaves room for an ill-conditioned mass matrix and for the digits of a result file.
UNBALANCED_FORCE = 1e-9


@dataclass(frozen=True)
class ForceBalance:
    """The largest residual of two equations that hold at every instant, for the reported quantities."""

    # of M q'' + link loads = Q + E - M_u a + reaction in a dof of L, and of load = F(deflection) + b rate of a link;
    # over the largest sum of the magnitudes of all terms in forces, moments or links; nan if a number is not finite
    residual: float
    place: str  # dof or link where it occurs
    time: float  # s, when it occurs

    @property
    def holds(self) -> bool:
        """Whether the forces balance to rounding; False for numbers that are not finite."""
        return self.residual <= UNBALANCED_FORCE


def force_balance(histories: Histories) -> ForceBalance:
    """The force balance of the reported motion, link loads and reactions.

    It finds numbers that do not belong together (changed or damaged files, overflow), not errors of integration.
    """
    bodies = [_of_body(part) for part in histories.stretches]
    relative = np.hstack([np.concatenate(bodies), _of_links(histories)])
    time, column = divmod(int(relative.argmax()), relative.shape[1])
    names = (*DOFS, *histories.links.names)
    return ForceBalance(float(relative[time, column]), names[column], float(histories.time[time]))


def _of_body(histories: Histories) -> Array:
    """Relative residual (time, 6) of the equation of motion."""
    load, reaction, rows = histories.load, histories.data["reaction"], histories.rows
    inertia, given = histories.acceleration @ histories.mass, histories.excitation + histories.weight
    terms = np.abs(histories.acceleration) @ np.abs(histories.mass) + np.abs(load) @ np.abs(rows)
    terms += np.abs(histories.wrench) + np.abs(histories.cart_acceleration) @ np.abs(histories.mass[:, :3].T)
    terms += np.abs(histories.weight) + np.abs(reaction)
    if histories.rides:
        terms += np.abs(histories.data["rider_wrench"])
    residual = inertia + load @ rows - given - reaction
    parts = slice(0, 3), slice(3, 6)  # forces and moments have their own scales
    return np.hstack([_relative(residual[:, part], terms[:, part]) for part in parts])


def _of_links(histories: Histories) -> Array:
    """Relative residual (time, link) of the laws of the links; 0 within rounding of an edge, where a damper sets in."""
    links, rows, deflection = histories.links, histories.rows, histories.deflection
    load, rate = histories.load, histories.velocity @ rows.T
    size, speed = (np.abs(one) @ np.abs(rows).T for one in (histories.position, histories.velocity))
    terms = links.stiffness * size + links.damping * speed + np.abs(load)
    if histories.linear:
        if histories.machine.base is not None:  # the dampers move the base, too
            rate = histories.velocity @ (rows @ histories.relative).T
            deflection = deflection - histories.velocity @ (rows @ histories.dragged).T
        return _relative(load - links.stiffness * deflection - links.damping * rate, terms)
    residual = load - histories.active_damping * rate - histories.by_law("force")
    at_edge = np.abs(np.abs(deflection) - histories.edges) <= UNBALANCED_FORCE * size
    residual[at_edge & links.damping_in_contact] = 0.0
    return _relative(residual, terms)


def _relative(residual: Array, terms: Array) -> Array:
    """Magnitude of a residual (time, m) over the largest sum of terms; 0 without terms."""
    return np.abs(residual) / (float(terms.max()) or 1.0)
