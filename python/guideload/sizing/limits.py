"""How far a machine may go until a requirement is no longer met: faster, heavier, with more overhang."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arguments import checked, real_array
from guideload.base.errors import ArgumentError, ConfigError, RunError
from guideload.base.ranges import DIRECTION
from guideload.catalogue.conditions import LifeConditions
from guideload.life.life import life_of
from guideload.machine.components import Body, joined
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.motion.moves import LimitName, Moves
from guideload.simulation.simulation import simulate
from guideload.sizing.requirements import Margins, margins_of

Quantity = Literal["pace", "payload", "overhang", "speed", "acceleration", "deceleration", "jerk"]
# Relative accuracy of the largest value: catalogues are no better than some percent.
ACCURACY = 1e-4
# Where the search ends: 64 times the pace or a limit of the moves; a thousand times mass or size of the machine.
MOST_DOUBLINGS = 6
MOST_DOUBLINGS_OF_ADDED = 10
ADDED = ("payload", "overhang")  # quantities that begin at 0
# Smaller values that are tried: so many from 0 on, or so many per halving, down to a 16th and a quarter of the first.
SMALLER, PER_HALVING, HALVINGS, BELOW_FIRST = 12, 4, 4, 2


@dataclass(frozen=True)
class Limit:
    """The largest value of a quantity at which all requirements are met.

    quantity  pace: factor on the speed of the whole motion (acceleration grows with its square, jerk with its cube);
              payload: kg, added at a point; overhang: m, shift of the body's centre of mass along a direction;
              speed, acceleration, deceleration, jerk: SI, the largest among the planned moves, all scaled alike
    value     its largest value; inf if the search ends before anything fails
    margins, motion, machine  at this value, or at the largest tried
    tried     smallest and largest value that was tried
    failing   smaller values that were tried, at which a requirement fails
    beyond    why no larger value can be tried, e.g. a process force names a phase that the moves no longer have, or ""
    at        m from L, the place of the payload; None for other quantities
    direction  of the overhang; None for other quantities
    """

    quantity: Quantity
    value: float
    margins: Margins
    tried: tuple[float, float]
    motion: Motion
    machine: Machine
    failing: tuple[float, ...] = ()
    beyond: str = ""
    at: tuple[float, ...] | None = None
    direction: tuple[float, ...] | None = None


@checked
def largest(
    machine: Machine,
    motion: Motion | Moves,
    quantity: Quantity,
    *,
    at: tuple[float, float, float] | None = None,
    direction: tuple[float, float, float] | None = None,
    conditions: LifeConditions | None = None,
) -> Limit:
    """The largest pace, payload, overhang or limit of planned moves at which the machine meets its requirements.

    The value is doubled until a requirement fails, then the limit is found between the last two values, with a full
    simulation at each. Loads need not grow with the value: a ramp may last as long as the period of a mode, and a
    payload may balance the body. So smaller values are tried too: `Limit.failing`.

    at          m from L, the place of the payload; default: L
    direction   of the overhang; default: x
    conditions  requirements; default: the table [life] of the machine

    Raises ArgumentError for an unknown quantity, for `at` or `direction` that is no vector or belongs to another
    quantity, and for a limit that no move has. Raises RunError if a requirement is missed even without payload or
    overhang, at a 64th of the pace or of the limit, or at the least limit that the moves allow. Also raises the errors
    of `simulate` and `life_of`.
    """
    if quantity not in get_args(Quantity):
        raise ArgumentError(f"quantity: expected one of {', '.join(get_args(Quantity))}, got {quantity!r}")
    place = _vector("at", at, (0.0, 0.0, 0.0), quantity == "payload", "payload")
    along = _vector("direction", direction, (1.0, 0.0, 0.0), quantity == "overhang", "overhang")
    machine.require_no_payloads("the search for a limit")
    vary, unit = _variation(machine, motion, quantity, place, along)

    from scipy.optimize import brentq  # takes 0.2 s to import, and `size` does without

    runs: dict[float, tuple[Margins, Motion, Machine]] = {}

    def margins(value: float) -> Margins:
        if value not in runs:
            changed, moved = vary(value)
            life = life_of(simulate(changed, moved), conditions or machine.life)
            runs[value] = margins_of(life), moved, changed
        return runs[value][0]

    low, high, beyond = _bracket(margins, unit, quantity)
    value = low
    if math.isfinite(high):
        near = ACCURACY * high
        value = float(brentq(lambda x: margins(x).smallest - 1.0, low, high, rtol=ACCURACY, xtol=near))
        value = value if margins(value).hold else max(value - 2.0 * near, low)
        margins(value)
    for smaller in _smaller(value, unit, quantity):
        # Moves may lack the phase of a force there; the answer is the same.
        with suppress(ConfigError):
            margins(smaller)
    found, moved, changed = runs[value]
    return Limit(
        quantity=quantity,
        value=value if math.isfinite(high) else high,
        margins=found,
        tried=(min(runs), max(runs)),
        motion=moved,
        machine=changed,
        failing=tuple(sorted(one for one, (tried, *_) in runs.items() if one < value and not tried.hold)),
        beyond=beyond,
        at=tuple(place.tolist()) if quantity == "payload" else None,
        direction=tuple(along.tolist()) if quantity == "overhang" else None,
    )


def _vector(
    name: str, given: ArrayLike | None, default: tuple[float, ...], counts: bool, of: Quantity
) -> np.ndarray:
    """An argument as a vector (3,), by default `default`. counts: whether the quantity that is varied has it."""
    if given is None:
        return np.array(default)
    if not counts:
        raise ArgumentError(f'{name}: belongs to the quantity "{of}" alone; leave it out')
    vector = real_array(name, given)
    if vector.shape != (3,) or not np.all(np.abs(vector) <= DIRECTION.most):
        raise ArgumentError(
            f"{name}: expected three finite numbers up to {DIRECTION.most:g}, got {given!r:.80}"
        )
    return vector


def _smaller(value: float, unit: float, quantity: Quantity) -> list[float]:
    """Values below an answer that are tried too; `unit`: the first value tried."""
    if quantity in ADDED:
        return [value * i / SMALLER for i in range(SMALLER)]
    halvings = max(HALVINGS, math.log2(value / unit) + BELOW_FIRST)
    return [value * 2.0 ** (-i / PER_HALVING) for i in range(1, math.ceil(halvings * PER_HALVING) + 1)]


def _bracket(
    margins: Callable[[float], Margins], unit: float, quantity: Quantity
) -> tuple[float, float, str]:
    """A value that holds, a larger one that does not, or inf, and why values beyond it are impossible.

    unit: the first value tried.
    """
    added, value, beyond = quantity in ADDED, unit, ""
    holds = margins(unit).hold
    if added and not holds:
        if margins(0.0).hold:
            return 0.0, unit, ""
        value = 0.0
    else:
        for _ in range(MOST_DOUBLINGS_OF_ADDED if added else MOST_DOUBLINGS):
            other, beyond = _possible(margins, value, (2.0 if holds else 0.5) * value, quantity)
            if margins(other).hold != holds:
                return min(value, other), max(value, other), ""
            value = other
            if beyond:
                break
        if holds:
            return value, math.inf, beyond
    found = margins(value)
    where = f"without {quantity}" if added else f"at {value / unit:.3g} of the {quantity}"
    less = f"; with less the moves are refused: {beyond}" if beyond else ""
    raise RunError(
        f"{quantity}: the requirement on {found.first_to_fail} is missed even {where} (margin {found.smallest:.3g}); "
        f"take a larger product or drive, or lower the requirement{less}"
    )


def _possible(
    margins: Callable[[float], Margins], known: float, wanted: float, quantity: Quantity
) -> tuple[float, str]:
    """The wanted value; if the moves are refused there, the possible value nearest to it, and the reason.

    known: a value that is possible.
    """
    value, reason = wanted, ""
    while not reason or abs(wanted - known) > ACCURACY * known:
        try:
            margins(value)
        except ConfigError as error:  # a force lacks its phase, or there are too many stamps
            if quantity not in get_args(LimitName):
                raise
            wanted, reason = value, str(error)
        else:
            known = value
            if not reason:
                break
        value = 0.5 * (known + wanted)
    return known, reason


def _variation(
    machine: Machine, motion: Motion | Moves, quantity: Quantity, at: np.ndarray, direction: np.ndarray
) -> tuple[Callable[[float], tuple[Machine, Motion]], float]:
    """Machine and motion by the value of the quantity, and a first value to try."""
    if quantity in ("speed", "acceleration", "deceleration", "jerk"):
        if not isinstance(motion, Moves):
            raise ArgumentError(
                f"{quantity}: expected planned moves, as of a motion file: a trace has no limits to raise"
            )
        moves, present = motion, motion.limit(quantity)
        if not present:
            raise ArgumentError(f"{quantity}: no move has this limit; give it, or vary another one")
        return lambda value: (machine, moves.with_limit(quantity, value / present).motion()), present
    body = machine.body
    motion = motion.motion() if isinstance(motion, Moves) else motion
    if quantity == "pace":
        return lambda factor: (machine, at_pace(motion, factor)), 1.0
    if quantity == "payload":
        return lambda mass: (
            machine.model_copy(update={"body": with_payload(body, mass, at)}),
            motion,
        ), body.mass
    if not direction.any():
        raise ArgumentError(f"direction: expected a vector other than zero, got {direction.tolist()}")
    along = direction / np.abs(direction).max()
    center, along = np.array(body.center_of_mass), along / np.linalg.norm(along)
    size = float(np.abs(machine.link_table().points).max())

    def shifted(distance: float) -> tuple[Machine, Motion]:
        shift = {"center_of_mass": center + distance * along, "inertia_about": "center_of_mass"}
        moved = body.model_copy(update=shift | {"inertia": body.central_inertia()})
        return machine.model_copy(update={"body": moved}), motion

    return shifted, size or 1.0


def at_pace(motion: Motion, factor: float) -> Motion:
    """The same travel at another pace: time / factor, speed x factor, acceleration x factor^2; forces as they are."""
    return replace(
        motion,
        time=motion.time[0] + (motion.time - motion.time[0]) / factor,
        acceleration=motion.acceleration * factor**2,
        velocity=None if motion.velocity is None else motion.velocity * factor,
        motor_speed=None if motion.motor_speed is None else motion.motor_speed * factor,
        bandwidth=motion.bandwidth * factor,
        uncertainty=None,
    )


def with_payload(body: Body, mass: float, at: np.ndarray) -> Body:
    """The body with a point mass [kg] at a place (3,) [m] from L."""
    return joined(body, mass, at, np.zeros((3, 3)))
