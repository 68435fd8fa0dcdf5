"""Bodies that move as one: payloads on the body, riders that stand still."""

from __future__ import annotations

from collections.abc import Iterable
from typing import cast

import numpy as np

from guideload.machine.components import Body, Tensor


def united(bodies: Iterable[Body]) -> Body:
    """Bodies that move as one: sums of mass, first moment, and inertia about the common centre of mass."""
    bodies = list(bodies)
    if len(bodies) == 1:
        return bodies[0]
    masses = np.array([body.mass for body in bodies])
    places = np.array([body.center_of_mass for body in bodies])
    center = masses @ places / masses.sum()
    inertia = np.zeros((3, 3))
    for body, arm in zip(bodies, places - center, strict=True):
        inertia += body.central_inertia() + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    tensor = cast("Tensor", tuple(map(tuple, inertia.tolist())))
    return Body(mass=float(masses.sum()), center_of_mass=tuple(center.tolist()), inertia=tensor)
