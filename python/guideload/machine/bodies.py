"""Bodies that move as one: payloads on the body, riders that stand still."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from guideload.base.arrays import Array
from guideload.machine.components import Body
from guideload.machine.inertia import point_inertia


def united(body: Body, others: Iterable[Body]) -> Body:
    """Bodies that move as one: sums of mass, first moment, and inertia about the common centre of mass."""
    for other in others:
        body = joined(body, other.mass, np.array(other.center_of_mass), other.central_inertia())
    return body


def joined(body: Body, mass: float, center: Array, inertia: Array) -> Body:
    """A body together with a mass [kg], its centre (3,) [m] from L and its inertia (3, 3) [kg m^2] about it."""
    total, own = body.mass + mass, np.array(body.center_of_mass)
    reduced = body.mass * mass / total
    return Body(
        mass=total,
        center_of_mass=((body.mass * own + mass * center) / total).tolist(),
        inertia=(body.central_inertia() + inertia + point_inertia(reduced, center - own)).tolist(),
    )
