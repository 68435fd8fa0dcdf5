"""The energy balance of a run: stored energy = energy from the excitation - dissipated energy, for every method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.audit.histories import Histories
from guideload.base.arrays import Array, Flags


@dataclass(frozen=True)
class Energy:
    """Energy balance in the travelling frame."""

    exchanged: float  # J, integral of |power of the excitation| + dissipated power
    # largest error of: change of stored energy = work of the excitation - dissipation; over `exchanged`
    residual: float
    resolution: float  # error of the quadrature between the instants, from two orders; over `exchanged`
    # energy exchanged in the intervals in which a link passes an edge of its law, where the quadrature has no estimate
    # of its error; over `exchanged`
    crossed: float


def energy(histories: Histories) -> Energy | None:
    """Energy balance over the reported instants; None if the excitation jumps between them, or riders
    move, whose forces are not linear between the instants.

    At a change of payload stored energy comes and goes with the payload: each stretch between changes is balanced for
    itself, and the figures are sums over all stretches.
    """
    if histories.hidden_jumps or histories.rides:
        return None
    exchanged, *errors = np.sum([_energy(part) for part in histories.stretches], axis=0).tolist()
    return Energy(exchanged, *(error / exchanged if exchanged else 0.0 for error in errors))


def _energy(histories: Histories) -> tuple[float, float, float, float]:
    """The numbers of `Energy` of one machine, all in J.

    Stored energy: q'.M q' / 2 + sum of U_i(delta_i) - Q.q; power of the excitation: q'.(E - M_u a); dissipated power:
    sum of b_i delta_i'^2. Powers are integrated with their first two derivatives (Hermite quadrature of order 6), which
    follow from the states and, for q''', from the equation of motion. The excitation is linear between the instants
    and may have kinks at them. The resolution is the difference from Hermite quadrature with first derivatives only
    (order 4), plus the largest dissipation of dampers that gain or lose contact between two instants.
    """
    velocity, acceleration, excitation = histories.velocity, histories.acceleration, histories.excitation
    kinetic = 0.5 * _dot(velocity @ histories.mass, velocity)
    stored = kinetic - histories.position @ histories.weight + _elastic_energy(histories)
    drag, drag_rate, elastic_rate = _link_forces(histories)
    free = np.ix_(histories.free, histories.free)
    inverse = np.zeros((6, 6))
    inverse[free] = np.linalg.inv(histories.mass[free])
    jerk = -(drag_rate + elastic_rate) @ inverse  # without the part M^-1 of the slope of the excitation
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

    turned_over = steps * _ends(np.abs(fed) + dissipated).sum(axis=0) / 2.0
    exchanged = float(turned_over.sum())
    if exchanged <= 1e-12 * float(np.abs(stored).max()):  # nothing moves: only rounding
        return 0.0, 0.0, 0.0, 0.0
    residual = np.abs(np.diff(stored).cumsum() - sixth.cumsum()).max()
    resolution = np.abs((sixth - fourth).cumsum()).max() + _contact_error(histories, steps)
    crossed = float(turned_over[_edge_crossed(histories)].sum())
    return exchanged, float(residual), float(resolution), crossed


def _ends(values: Array) -> Array:
    """Values (time, ...) at the start and at the end of every interval, shape (2, interval, ...)."""
    return np.stack([values[:-1], values[1:]])


def _link_forces(histories: Histories) -> tuple[Array, Array, Array]:
    """Damper force on L (force and moment), its time derivative, and that of the elastic force, each (time, 6).

    Damping and tangent stiffness of a link depend on its deflection.
    """
    rows = histories.rows
    if histories.linear:
        damping = histories.damping
        elastic_rate = histories.velocity @ histories.stiffness
        return histories.velocity @ damping, histories.acceleration @ damping, elastic_rate
    active, tangent = histories.active_damping, histories.by_law("tangent")
    rate, second = histories.velocity @ rows.T, histories.acceleration @ rows.T
    return (active * rate) @ rows, (active * second) @ rows, (tangent * rate) @ rows


def _contact_error(histories: Histories, steps: Array) -> float:
    """Largest error [J] of the quadrature by dampers that gain or lose contact between two instants."""
    if not histories.links.damping_in_contact.any():
        return 0.0
    fastest = _ends((histories.velocity @ histories.rows.T) ** 2).max(axis=0)
    return 0.5 * float(steps @ (np.abs(np.diff(histories.active_damping, axis=0)) * fastest).sum(axis=1))


def _edge_crossed(histories: Histories) -> Flags:
    """Whether any link is on different segments of its law at both ends of an interval, (interval,)."""
    crossed = np.zeros(max(histories.time.size - 1, 0), dtype=np.bool_)
    for law, deflection in zip(histories.links.laws, histories.deflection.T, strict=True):
        crossed |= np.diff(np.searchsorted(law.edges, deflection)) != 0
    return crossed


def _elastic_energy(histories: Histories) -> Array:
    """Elastic energy of all links, (time,) [J]."""
    if histories.linear:
        energy = 0.5 * _dot(histories.position @ histories.stiffness, histories.position)
        pull = (histories.machine.offsets * histories.links.stiffness) @ histories.rows @ histories.relative
        return energy - histories.position @ pull if pull.any() else energy
    return np.asarray(histories.by_law("energy").sum(axis=1))


def _dot(left: Array, right: Array) -> Array:
    return np.asarray(np.einsum("...j,...j->...", left, right))
