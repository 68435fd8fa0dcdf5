"""The link table of a machine: the links of its carriages and its extra links, as input of the core."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from guideload._core import Law
from guideload.base.arrays import Array
from guideload.machine.components import Carriage, Distances, Link


class CarriageLink(NamedTuple):
    """The place of a link in its carriage.

    end   -0.5 at the end -x, 0.5 at the end +x
    axis  1 along y, 2 along z, of the carriage's own axes
    row   across the rail: -0.5 in the row at -z, 0.5 in the one at +z, 0 in the middle
    """

    end: float
    axis: int
    row: float

    @property
    def name(self) -> str:
        """Its name without that of the carriage: "-y", or with rows "-y-z" and "-y+z"."""
        row = f"{_sign(self.row)}z" if self.row else ""
        return f"{_sign(self.end)}{'xyz'[self.axis]}{row}"

    def offset(self, distances: Distances) -> tuple[float, float]:
        """Its place from the carriage's centre along and across the rail [m]."""
        return self.end * (distances.pitch if self.axis == 1 else distances.yaw), self.row * distances.roll


def _sign(number: float) -> str:
    return "-" if number < 0.0 else "+"


ENDS = (-0.5, 0.5)
IN_MIDDLE = tuple(CarriageLink(end, axis, 0.0) for end in ENDS for axis in (1, 2))
IN_ROWS = tuple(CarriageLink(end, axis, row) for end in ENDS for axis, row in ((1, -0.5), (1, 0.5), (2, 0.0)))
NAMES = frozenset(link.name for link in (*IN_MIDDLE, *IN_ROWS))


def links_of(carriage: Carriage) -> tuple[CarriageLink, ...]:
    """The links of a carriage: with a width, those along y are in two rows."""
    return IN_ROWS if carriage.resists_roll else IN_MIDDLE


@dataclass(frozen=True, eq=False)
class LinkTable:
    """All links: four or six for each carriage, in the order of the carriages, then the extra links. Read-only."""

    names: tuple[str, ...]
    points: Array  # (n, 3) m, from L
    directions: Array  # (n, 3) unit vectors
    laws: tuple[Law, ...]
    stiffness: Array  # (n,) N/m, nominal stiffness: see `Law.stiffness` of the core
    damping: Array  # (n,) N s/m
    damping_in_contact: NDArray[np.bool_]  # (n,) whether the damping acts only outside the clearance
    carriage: NDArray[np.intp]  # (n,) index into the carriages, -1 for an extra link
    axis: NDArray[np.intp]  # (n,) 1 along the carriage's y, 2 along its z, -1 for an extra link


class _Row(NamedTuple):
    name: str
    point: tuple[float, ...]
    direction: tuple[float, ...]
    law: Law
    damping: float
    in_contact: bool
    carriage: int
    axis: int


def table_of(carriages: Sequence[Carriage], places: Array, links: Sequence[Link]) -> LinkTable:
    """The link table. The links along one axis of a carriage share its force at the same deflection.

    places: (carriage, 4) m, m, m from L, and rad, the roll of its rail. Raises SceneError for an impossible law.
    """
    rows: list[_Row] = []
    for i, (carriage, place) in enumerate(zip(carriages, places.tolist(), strict=True)):
        rows += _rows_of(i, carriage, *place)
    for link in links:
        own = link.law, link.damping, link.damping_in_contact
        rows.append(_Row(link.name, link.point, link.direction, *own, -1, -1))
    return LinkTable(
        names=tuple(row.name for row in rows),
        points=read_only(np.array([row.point for row in rows], dtype=np.float64)),
        directions=read_only(np.array([row.direction for row in rows], dtype=np.float64)),
        laws=tuple(row.law for row in rows),
        stiffness=read_only(np.array([row.law.stiffness for row in rows])),
        damping=read_only(np.array([row.damping for row in rows])),
        damping_in_contact=read_only(np.array([row.in_contact for row in rows])),
        carriage=read_only(np.array([row.carriage for row in rows], dtype=np.intp)),
        axis=read_only(np.array([row.axis for row in rows], dtype=np.intp)),
    )


def _rows_of(index: int, carriage: Carriage, x: float, y: float, z: float, roll: float) -> Iterator[_Row]:
    own_y = (math.cos(roll), math.sin(roll))
    own_z = (0.0 - own_y[1], own_y[0])
    (share_y, share_z), laws = carriage.damping_shares, carriage.laws
    damping = share_y * carriage.damping_y, share_z * carriage.damping_z
    clearance = carriage.clearance_y, carriage.clearance_z
    distances = carriage.distances
    links = links_of(carriage)
    for link in links:
        of_axis = link.axis - 1
        share = 1.0 / sum(other.axis == link.axis for other in links)
        along, across = link.offset(distances)
        yield _Row(
            name=f"{carriage.name}:{link.name}",
            point=(x + along, y + across * own_z[0], z + across * own_z[1]),
            direction=(0.0, *(own_y, own_z)[of_axis]),
            law=laws[of_axis].scaled(share),
            damping=share * damping[of_axis],
            in_contact=carriage.damping_in_contact and clearance[of_axis] > 0.0,
            carriage=index,
            axis=link.axis,
        )


_Numbers = TypeVar("_Numbers", Array, NDArray[np.intp], NDArray[np.int64], NDArray[np.bool_])


def read_only(array: _Numbers) -> _Numbers:
    """A contiguous, read-only copy."""
    array = array.copy()
    array.setflags(write=False)
    return array
