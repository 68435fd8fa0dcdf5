"""Payloads: masses that come and go while a machine moves; and the machine with some of them, as one body."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Annotated, Literal, cast

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from guideload.base.config import ConfigModel, entries, in_range
from guideload.base.errors import ValueRefused
from guideload.base.ranges import TIME, TRAVEL
from guideload.machine.components import Body, Name, Tensor

Seconds = Annotated[float, in_range(TIME)]
Stay = Annotated[tuple[Seconds, Seconds], BeforeValidator(partial(entries, names=("from", "to")))]


class Place(ConfigModel):
    """A position of the cart at which a payload comes or goes."""

    x: Annotated[float, in_range(TRAVEL)] = Field(description='position of the cart, e.g. "1.2 m"')
    travel: Literal["+x", "-x", "any"] = Field(
        default="any", description='direction in which the cart reaches it: "+x", "-x" or "any"'
    )


class Payload(Body):
    """A mass that the body grips and releases on the way; the machine is the body alone without it."""

    name: Name = Field(description="a unique name for reports")
    times: tuple[Stay, ...] | None = Field(
        default=None,
        min_length=1,
        description='from when to when it is on the machine, e.g. [["0.5 s", "2 s"]], by the time of the motion',
    )
    picked_at: Place | None = Field(
        default=None,
        description='in place of times: where it is gripped, e.g. { x = "1.2 m", travel = "+x" }',
    )
    released_at: Place | None = Field(
        default=None, description="in place of times: where it is released; without it, it stays"
    )

    @model_validator(mode="after")
    def _one_description(self) -> Payload:
        if (self.times is None) == (self.picked_at is None):
            given = "both" if self.times is not None else "neither"
            raise ValueRefused("either times or picked_at", given, "they say when the payload comes")
        if self.times is not None and self.released_at is not None:
            raise ValueRefused("no released_at beside times", self.released_at.x, "times say when it goes")
        for start, end in self.times or ():
            if end <= start:
                raise ValueRefused("times that end after they begin", [start, end])
        ordered = sorted(self.times or ())
        for (_, end), (start, _) in zip(ordered, ordered[1:], strict=False):
            if start <= end:
                raise ValueRefused("times that are apart", [start, end], "unite those that touch or overlap")
        return self


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
