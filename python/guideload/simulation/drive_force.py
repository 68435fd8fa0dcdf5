"""Force of the drive on the cart: reaction of the held x plus friction of the guides."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.motion.standstill import is_moving

if TYPE_CHECKING:
    from guideload.machine.machine import Machine


def require_held_x(machine: Machine) -> None:
    """Raise ArgumentError if x is free: the force of the drive is then that of a link."""
    if "x" in machine.free:
        raise ArgumentError(
            "free: the force of the drive is the reaction of x, but x is free; hold x, or use the load of its link"
        )


def has_friction(machine: Machine) -> bool:
    """Whether friction of the guides adds to the force of the drive."""
    viscous = machine.friction is not None and machine.friction.viscous > 0.0
    return viscous or bool(machine.seal_forces.any() or friction_coefficients(machine).any())


def friction_coefficients(machine: Machine) -> Array:
    """Coefficient of friction of each carriage (carriage,), without seals: of [friction], or else of its product."""
    if machine.friction is not None and machine.friction.coefficient is not None:
        return np.full(len(machine.carriages), machine.friction.coefficient)
    own = [None if one is None else one.friction_coefficient for one in machine.product_of_carriage]
    return np.array([value or 0.0 for value in own])


def rolling_speed(time: Array, acceleration: Array, velocity: Array) -> Array:
    """Speed of the cart along x (time,) [m/s], 0 at standstill. acceleration, velocity: (time, 3) m/s2, m/s."""
    return np.where(is_moving(time, acceleration, velocity), velocity[:, 0], 0.0)


def friction_force(machine: Machine, loads: Array, speed: Array | None) -> Array:
    """Force [N] (time,) along x with which the drive overcomes the friction of the guides; 0 at standstill.

    loads: (time, carriage, 6) of the carriages. speed: (time,) m/s, `rolling_speed`.
    Without a table [friction] it is the friction of the products, where the speed is known.
    Raises ArgumentError if there is a table [friction] but no speed, which decides its sign.
    """
    friction = machine.friction
    if friction is None and (speed is None or not has_friction(machine)):
        return np.zeros(loads.shape[0])
    if speed is None:
        raise ArgumentError(
            "velocity: friction needs the velocity of the cart, which this motion does not have"
        )
    rolling = friction_coefficients(machine) * np.abs(loads[:, :, 1:3]).sum(axis=2)
    dry = rolling.sum(axis=1) + machine.seal_forces.sum()
    viscous = 0.0 if friction is None else friction.viscous
    return np.asarray(np.sign(speed) * dry + viscous * speed)
