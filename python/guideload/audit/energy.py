"""The energy balance of a run: stored, fed in and dissipated energy must agree, whatever method solved it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.audit.histories import Histories
from guideload.base.arrays import Array


@dataclass(frozen=True)
class Energy:
    """Balance of the energy in the carriage frame.

    turned_over  J, fed in and taken out by the excitation, and dissipated
    residual     largest distance of the stored energy from the energy fed in less dissipated, over that turned over
    resolution   error of the quadrature between the instants, over that turned over: two orders compared
    """

    turned_over: float
    residual: float
    resolution: float


def energy(histories: Histories) -> Energy | None:
    """Energy balance over the reported instants; None where these hide jumps of the excitation.

    Energy: q'.M q' / 2 + sum of U_i(delta_i) - Q.q; input power: q'.(E - M_u a); dissipated: sum of b_i delta_i'^2.
    Powers are integrated with their first two derivatives (Hermite, order 6 in the step), from the states and, for
    q''', from the equation of motion; between instants the excitation is linear, at them it may have kinks. The
    resolution is the distance from the quadrature with first derivatives only (order 4), and what dampers took that
    begin or end between two instants.
    """
    if histories.hidden_jumps:
        return None
    velocity, acceleration, excitation = histories.velocity, histories.acceleration, histories.excitation
    kinetic = 0.5 * _dot(velocity @ histories.mass, velocity)
    stored = kinetic - histories.position @ histories.weight + _elastic_energy(histories)
    drag, drag_rate, elastic_rate = _link_forces(histories)
    free = np.ix_(histories.free, histories.free)
    inverse = np.zeros((6, 6))
    inverse[free] = np.linalg.inv(histories.mass[free])
    jerk = -(drag_rate + elastic_rate) @ inverse  # without that from the change of the excitation
    steps = np.diff(histories.time)
    inside = steps > 0
    width = np.where(inside, steps, 1.0)[:, None]
    slope = np.where(inside[:, None], np.diff(excitation, axis=0) / width, 0.0)

    fed, dissipated = _dot(velocity, excitation), _dot(velocity, drag)
    through = excitation - 2.0 * drag
    trapezoid = steps * _ends(fed - dissipated).sum(axis=0) / 2.0
    left, right = _ends(_dot(acceleration, through)) + _dot(_ends(velocity), slope)
    first = steps**2 * (left - right)
    by_state = _dot(jerk, through) - 2.0 * _dot(drag_rate, acceleration)
    by_slope = _dot(_ends(through @ inverse + 2.0 * acceleration), slope)
    second = steps**3 * (_ends(by_state) + by_slope).sum(axis=0)
    sixth, fourth = trapezoid + first / 10.0 + second / 120.0, trapezoid + first / 12.0

    turned_over = float(steps @ _ends(np.abs(fed) + dissipated).sum(axis=0)) / 2.0
    if turned_over <= 1e-12 * float(np.abs(stored).max()):  # nothing moves but rounding
        return Energy(0.0, 0.0, 0.0)
    residual = np.abs(np.diff(stored).cumsum() - sixth.cumsum()).max()
    resolution = np.abs((sixth - fourth).cumsum()).max() + _unseen(histories, steps)
    return Energy(turned_over, float(residual) / turned_over, float(resolution) / turned_over)


def _ends(values: Array) -> Array:
    """(2, interval, ...): values (time, ...) at the beginning and at the end of every interval."""
    return np.stack([values[:-1], values[1:]])


def _link_forces(histories: Histories) -> tuple[Array, Array, Array]:
    """(time, 6) force and moment about L of the dampers, its derivative, and that of the elastic force.

    A link's damping and tangent stiffness are those at its deflection.
    """
    links, rows = histories.links, histories.rows
    if histories.linear:
        damping = (rows.T * links.damping) @ rows
        elastic_rate = histories.velocity @ histories.stiffness
        return histories.velocity @ damping, histories.acceleration @ damping, elastic_rate
    active = _active_damping(histories)
    tangent = np.empty_like(histories.deflection)
    for i, law in enumerate(links.laws):
        tangent[:, i] = law.tangent(np.ascontiguousarray(histories.deflection[:, i]))
    rate, second = histories.velocity @ rows.T, histories.acceleration @ rows.T
    return (active * rate) @ rows, (active * second) @ rows, (tangent * rate) @ rows


def _active_damping(histories: Histories) -> Array:
    """(time, link) N s/m, that of every link at its deflection."""
    links = histories.links
    active = np.broadcast_to(links.damping, histories.deflection.shape).copy()
    for i in np.flatnonzero(links.damping_in_contact):
        active[np.abs(histories.deflection[:, i]) <= links.laws[i].edges[-1], i] = 0.0
    return active


def _unseen(histories: Histories, steps: Array) -> float:
    """J, what dampers that begin or end between two instants may have taken more or less than the quadrature has."""
    if not histories.links.damping_in_contact.any():
        return 0.0
    fastest = _ends((histories.velocity @ histories.rows.T) ** 2).max(axis=0)
    return 0.5 * float(steps @ (np.abs(np.diff(_active_damping(histories), axis=0)) * fastest).sum(axis=1))


def _elastic_energy(histories: Histories) -> Array:
    """(time,) J, of all links."""
    if histories.linear:
        return 0.5 * _dot(histories.position @ histories.stiffness, histories.position)
    total = np.zeros(histories.time.size)
    for law, deflection in zip(histories.links.laws, histories.deflection.T, strict=True):
        total += law.energy(np.ascontiguousarray(deflection))
    return total


def _dot(left: Array, right: Array) -> Array:
    return np.asarray(np.einsum("...j,...j->...", left, right))
