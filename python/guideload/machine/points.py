"""Points of the body that matter: a tool, a sensor, the place where a process force acts."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from guideload.base.arrays import Array, read_only
from guideload.base.config import ConfigModel, in_range, listed, optional
from guideload.base.errors import ValueRefused
from guideload.base.ranges import LENGTH
from guideload.machine.components import Name, Point, Vector, unit_vector

SQUARE = 1e-6  # largest cosine between the two axes of a point: the rounding of printed directions

_AXES = listed("direction of its x", "direction of its y")


class PointOfInterest(ConfigModel):
    """A point fixed to the body, such as a tool: the result has its motion, and process forces may act at it."""

    name: Name = Field(description='a unique name, e.g. "tool"')
    at: Point = Field(description='x, y, z from L, e.g. ["0 mm", "-400 mm", "120 mm"]')
    axes: Annotated[tuple[Vector, Vector], _AXES] = optional(
        "directions of the point's own x and y, at right angles, in the axes of the machine; its z "
        "completes them. Forces may be given in these axes; by default those of the machine",
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    )
    settle_window: Annotated[float, in_range(LENGTH, above=0.0)] | None = optional(
        'the point has settled when it stays this close to its place at rest, e.g. "10 um"'
    )

    @field_validator("axes")
    @classmethod
    def _at_right_angles(cls, axes: tuple[Vector, Vector]) -> tuple[Vector, Vector]:
        x, y = (unit_vector(axis, "e.g. [[0, 0, 1], [1, 0, 0]]") for axis in axes)
        cosine = float(np.dot(x, y))
        if abs(cosine) > SQUARE:
            angle = float(np.degrees(np.arccos(cosine)))
            raise ValueRefused(
                "two directions at right angles", axes, f"they have an angle of {angle:.4g} deg"
            )
        return x, y

    @cached_property
    def rotation(self) -> Array:
        """(3, 3), its rows are the point's own axes: a vector v in these axes is v @ rotation in the machine's."""
        x, y = np.array(self.axes)
        y = y - (x @ y) * x  # exactly at right angles
        y /= np.linalg.norm(y)
        return read_only(np.array([x, y, np.cross(x, y)]))
