"""Payloads: masses that come and go while a machine moves; and the machine with some of them, as one body."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from guideload.base.config import ConfigModel, in_range, listed, optional
from guideload.base.errors import ValueRefused
from guideload.base.ranges import TIME, TRAVEL
from guideload.machine.components import Body, Name

Seconds = Annotated[float, in_range(TIME)]
Stay = Annotated[tuple[Seconds, Seconds], listed("from", "to")]


class Place(ConfigModel):
    """A position of the cart at which a payload comes or goes."""

    x: Annotated[float, in_range(TRAVEL)] = Field(description='position of the cart, e.g. "1.2 m"')
    travel: Literal["+x", "-x", "any"] = optional(
        'direction in which the cart reaches it: "+x", "-x" or "any"; a place where the motion starts is '
        "reached at the start, unless the cart leaves it against this direction",
        "any",
    )


class Payload(Body):
    """A mass that the body grips and releases on the way; the machine is the body alone without it."""

    name: Name = Field(description="a unique name for reports")
    times: tuple[Stay, ...] | None = optional(
        'from when to when it is on the machine, e.g. [["0.5 s", "2 s"]], by the time of the motion',
        min_length=1,
    )
    picked_at: Place | None = optional(
        'in place of times: where it is gripped, e.g. { x = "1.2 m", travel = "+x" }'
    )
    released_at: Place | None = optional("in place of times: where it is released; without it, it stays")

    @field_validator("times")
    @classmethod
    def _apart(cls, times: tuple[Stay, ...] | None) -> tuple[Stay, ...] | None:
        for start, end in times or ():
            if end <= start:
                raise ValueRefused("times that end after they begin", [start, end])
        ordered = sorted(times or ())
        for (_, end), (start, _) in zip(ordered, ordered[1:], strict=False):
            if start <= end:
                raise ValueRefused("times that are apart", [start, end], "unite those that touch or overlap")
        return times

    @model_validator(mode="after")
    def _one_description(self) -> Payload:
        if (self.times is None) == (self.picked_at is None):
            given = "both" if self.times is not None else "neither"
            raise ValueRefused("either times or picked_at", given, "they say when the payload comes")
        if self.times is not None and self.released_at is not None:
            raise ValueRefused("no released_at beside times", self.released_at.x, "times say when it goes")
        return self
