"""Process forces of planned moves: constant during a phase of a move, such as its constant speed."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from guideload.base.arrays import Array
from guideload.base.config import ConfigModel, in_range, listed, optional
from guideload.base.errors import ValueRefused
from guideload.base.number_text import number
from guideload.base.ranges import FORCE, MOMENT
from guideload.machine.components import Point
from guideload.motion.profiles import Pieces

Phase = Literal["speeding up", "constant speed", "braking", "at rest"]
Force = Annotated[float, in_range(FORCE)]
Moment = Annotated[float, in_range(MOMENT)]
_XYZ = listed("x", "y", "z")


class PhaseForce(ConfigModel):
    """A process force on the body during a move or a phase of it; several add up."""

    force: Annotated[tuple[Force, Force, Force], _XYZ] = optional(
        'x, y, z in the axes of the machine, e.g. ["-800 N", "0 N", "-200 N"]', (0.0, 0.0, 0.0)
    )
    moment: Annotated[tuple[Moment, Moment, Moment], _XYZ] = optional(
        'about the point where it acts, e.g. ["0 N m", "0 N m", "30 N m"]', (0.0, 0.0, 0.0)
    )
    at: Point = optional(
        'x, y, z from L of the point where it acts, e.g. ["0 mm", "600 mm", "150 mm"]; L if left out',
        (0.0, 0.0, 0.0),
    )
    during: Phase | None = optional(
        'phase in which it acts, "at rest" is the dwell; the move without it if left out'
    )

    @model_validator(mode="after")
    def _acts(self) -> PhaseForce:
        if not any((*self.force, *self.moment)):
            raise ValueRefused("a force or a moment other than zero", self.model_dump(exclude_unset=True))
        return self

    @property
    def wrench(self) -> Array:
        """Force and moment about L (6,) [N, N, N, N m, N m, N m]."""
        return np.concatenate([self.force, np.add(self.moment, np.cross(self.at, self.force))])

    @property
    def text(self) -> str:
        """In words: `force (-800, 0, -200) N at (0, 0.6, 0.15) m from L, constant speed`."""
        parts = ("force", self.force, "N"), ("moment", self.moment, "N m")
        acting = [f"{name} ({', '.join(map(number, of))}) {unit}" for name, of, unit in parts if any(of)]
        where = f" at ({', '.join(map(number, self.at))}) m from L" if any(self.force) else ""
        return f"{' and '.join(acting)}{where}, {self.during or 'while it moves'}"

    def pieces(self, pieces: Pieces, dwell: float) -> range:
        """Of the pieces of a move and its pause, those during which it acts; none if the move lacks the phase."""
        change, count = np.sign(pieces.start + pieces.end), pieces.length.size
        if self.during is None:
            return range(count)
        if self.during == "at rest":
            return range(count, count + (dwell > 0.0))
        sign = {"speeding up": 1.0, "constant speed": 0.0, "braking": -1.0}[self.during]
        found = np.flatnonzero(change == sign)
        return range(int(found[0]), int(found[-1]) + 1) if found.size else range(0)
