"""The link table of a machine: the links of its carriages and its extra links, as input of the core."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from guideload._core import Law
from guideload.base.arrays import Array, Flags, Indices, Integers, read_only
from guideload.base.errors import SceneError
from guideload.machine.components import Carriage, Distances, Link, Rail
from guideload.machine.straightness import Profile


class CarriageLink(NamedTuple):
    """The place of a link in its carriage."""

    end: float  # -0.5 at the end -x, 0.5 at the end +x
    axis: int  # 1 along y, 2 along z, of the carriage's own axes
    row: float  # across the rail: -0.5 in the row at -z, 0.5 in the one at +z, 0 in the middle

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
    damping_in_contact: Flags  # (n,) whether the damping acts only outside the clearance
    offsets: Array  # (n,) m, displacement of the foot along the direction, from mounting errors
    carriage: Indices  # (n,) index into the carriages, -1 for an extra link
    axis: Indices  # (n,) 1 along the carriage's y, 2 along its z, -1 for an extra link

    @cached_property
    def rows(self) -> Array:
        """Deflection of each link per displacement and rotation (u, phi) of L, (n, 6) [1, m]."""
        return read_only(np.hstack([self.directions, np.cross(self.points, self.directions)]))

    def arms(self, links: Integers, center: Array, axes: Array) -> Array:
        """Force and moment about a centre, along axes (3, 3), per load of some links: (k, 6) [1, m]."""
        directions = self.directions[links]
        moments = np.cross(self.points[links] - center, directions)
        return np.hstack([directions @ axes.T, moments @ axes.T])


class _LinkRow(NamedTuple):
    name: str
    point: tuple[float, ...]
    direction: tuple[float, ...]
    law: Law
    damping: float
    in_contact: bool
    offset: float
    carriage: int
    axis: int


def table_of(carriages: Sequence[Carriage], places: Array, links: Sequence[Link], errors: Array) -> LinkTable:
    """The link table. The links along one axis of a carriage share its force at the same deflection.

    places: (carriage, 4) m, m, m from L, and rad, the roll of its rail. errors: (carriage, 3) m, mounting errors.
    Raises SceneError for an impossible law.
    """
    rows: list[_LinkRow] = []
    for i, (one, place) in enumerate(zip(carriages, places.tolist(), strict=True)):
        rows += _link_rows(i, one, place, errors[i])
    for link in links:
        own = link.law, link.damping, link.damping_in_contact
        rows.append(_LinkRow(link.name, link.point, link.direction, *own, 0.0, -1, -1))
    names, points, directions, laws, damping, in_contact, offsets, carriage, axis = zip(*rows, strict=True)
    return LinkTable(
        names=names,
        points=read_only(np.array(points)),
        directions=read_only(np.array(directions)),
        laws=laws,
        stiffness=read_only(np.array([law.stiffness for law in laws])),
        damping=read_only(np.array(damping)),
        damping_in_contact=read_only(np.array(in_contact)),
        offsets=read_only(np.array(offsets)),
        carriage=read_only(np.array(carriage)),
        axis=read_only(np.array(axis)),
    )


def _link_rows(index: int, carriage: Carriage, place: Sequence[float], error: Array) -> Iterator[_LinkRow]:
    x, y, z, roll = place
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
        direction = (0.0, *(own_y, own_z)[of_axis])
        yield _LinkRow(
            name=f"{carriage.name}:{link.name}",
            point=(x + along, y + across * own_z[0], z + across * own_z[1]),
            direction=direction,
            law=laws[of_axis].scaled(share),
            damping=share * damping[of_axis],
            in_contact=carriage.damping_in_contact and clearance[of_axis] > 0.0,
            offset=float(error @ direction),
            carriage=index,
            axis=link.axis,
        )


def offsets_of_rails(
    rails: Sequence[Rail], carriages: Sequence[Carriage], table: LinkTable, position: Array
) -> tuple[Array, Array]:
    """Displacements [m] and slopes [1] of the rails at all links, along the links, each (n, link).

    rails: that of each carriage. position: (n,) m, of the cart. Raises SceneError where a profile is not known.
    """
    displacement, slope = np.zeros((2, position.size, table.carriage.size))
    for i, (rail, carriage) in enumerate(zip(rails, carriages, strict=True)):
        links = np.flatnonzero(table.carriage == i) if rail.profiles else np.array([], dtype=np.intp)
        for x in np.unique(table.points[links, 0]).tolist():
            here = links[table.points[links, 0] == x]
            across = table.directions[here, 1:].T
            for profile in rail.profiles:
                _require_known(profile, position + x, rail.name, carriage.name)
                moved, inclined = profile.at(position + x)
                displacement[:, here] += moved @ across
                slope[:, here] += inclined @ across
    return displacement, slope


def _require_known(profile: Profile, places: Array, rail: str, carriage: str) -> None:
    """Raise SceneError unless a profile is known at all places (n,) [m]."""
    (first, last), low, high = profile.reach, float(places.min()), float(places.max())
    if first <= low and high <= last:
        return
    raise SceneError(
        f"rail {rail}: straightness: expected points from {low:.6g} to {high:.6g} m, where carriage {carriage} runs, "
        f"got points from {first:g} to {last:g} m; add points, or for the machine at rest set rest_at, the position of "
        "the cart"
    )


def own_axes(places: Array) -> Array:
    """Own x, y and z of carriages or rails, as rows, in the axes of the machine: (n, 3, 3).

    places: (n, 4) m, m, m from L, and rad, the roll.
    """
    rolls = places[:, 3]
    axes = np.zeros((rolls.size, 3, 3))
    axes[:, 0, 0] = 1.0
    axes[:, 1, 1] = axes[:, 2, 2] = np.cos(rolls)
    axes[:, 1, 2], axes[:, 2, 1] = np.sin(rolls), 0.0 - np.sin(rolls)
    return axes
