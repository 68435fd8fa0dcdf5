"""Closed forms of m y'' + b y' + k y = F below critical damping."""

from typing import Any

import numpy as np

# Mass [kg], stiffness [N/m], damping [N s/m].
Constants = tuple[float, float, float]


def free_vibration(of: Constants, time: Any, place: float, speed: float = 0.0) -> tuple[Any, Any]:
    """Place and speed at these times without force, from this place and speed at 0."""
    mass, k, b = of
    decay = b / (2.0 * mass)
    rate = np.sqrt(k / mass - decay**2)
    fades, c, s = np.exp(-decay * time), np.cos(rate * time), np.sin(rate * time)
    return (
        fades * (place * c + (speed + decay * place) / rate * s),
        fades * (speed * c - (k / mass * place + decay * speed) / rate * s),
    )


def step_response(of: Constants, time: Any, force: float) -> tuple[Any, Any]:
    """Place and speed at these times under a force that sets in at 0, from rest."""
    still = force / of[1]
    place, speed = free_vibration(of, time, -still)
    return still + place, speed
