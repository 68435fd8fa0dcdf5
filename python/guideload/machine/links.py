"""The link table of a machine: the links of its carriages and its extra links, as input of the core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from guideload._core import Law, carriage_links
from guideload.base.arrays import Array
from guideload.base.errors import SceneError
from guideload.machine.components import Carriage, Link, Rail
from guideload.machine.straightness import Profile

ENDS = ("-y", "-z", "+y", "+z")  # the links of a carriage: "-" at x - length/2, "+" at x + length/2


@dataclass(frozen=True, eq=False)
class LinkTable:
    """All links: four for each carriage, in the order of the carriages, then the extra links. Read-only."""

    names: tuple[str, ...]
    points: Array  # (n, 3) m, from L
    directions: Array  # (n, 3) unit vectors
    laws: tuple[Law, ...]
    stiffness: Array  # (n,) N/m, nominal stiffness: see `Law.stiffness` of the core
    damping: Array  # (n,) N s/m
    damping_in_contact: NDArray[np.bool_]  # (n,) whether the damping acts only outside the clearance
    offsets: Array  # (n,) m, displacement of the foot along the direction, from mounting errors
    carriage: NDArray[np.intp]  # (n,) index into the carriages, -1 for an extra link


def table_of(
    carriages: Sequence[Carriage], centers: Array, links: Sequence[Link], errors: Array
) -> LinkTable:
    """The link table. Each end of a carriage has half of the carriage's force at the same deflection.

    centers: (carriage, 3) m from L. errors: (carriage, 3) m, mounting errors. Raises SceneError for an impossible law.
    """
    names: list[str] = []
    laws: list[Law] = []
    damping: list[float] = []
    in_contact: list[bool] = []
    for carriage in carriages:
        names += [f"{carriage.name}:{end}" for end in ENDS]
        laws += [law.scaled(0.5) for law in carriage.laws] * 2
        damping += [0.5 * carriage.damping_y, 0.5 * carriage.damping_z] * 2
        clearances = carriage.clearance_y, carriage.clearance_z
        in_contact += [carriage.damping_in_contact and clearance > 0.0 for clearance in clearances] * 2
    for link in links:
        names.append(link.name)
        laws.append(link.law)
        damping.append(link.damping)
        in_contact.append(link.damping_in_contact)
    lengths = [carriage.length for carriage in carriages]
    ends = [np.hstack(carriage_links(*end)) for end in zip(centers.tolist(), lengths, strict=True)]
    lines = np.vstack([*ends, *((*link.point, *link.direction) for link in links)])
    owner = np.append(np.repeat(np.arange(len(carriages)), len(ENDS)), np.full(len(links), -1)).astype(
        np.intp
    )
    moved = np.vstack([errors, np.zeros(3)])[owner]  # an extra link, of carriage -1, has none
    return LinkTable(
        names=tuple(names),
        points=read_only(lines[:, :3]),
        directions=read_only(lines[:, 3:]),
        laws=tuple(laws),
        stiffness=read_only(np.array([law.stiffness for law in laws])),
        damping=read_only(np.array(damping)),
        damping_in_contact=read_only(np.array(in_contact)),
        offsets=read_only((lines[:, 3:] * moved).sum(axis=1)),
        carriage=read_only(owner),
    )


def feet_on(
    rails: Sequence[Rail], carriages: Sequence[Carriage], table: LinkTable, position: Array
) -> tuple[Array, Array]:
    """Displacements [m] and slopes [1] of the feet of all links along the links, each (n, link).

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


_Numbers = TypeVar("_Numbers", Array, NDArray[np.intp], NDArray[np.int64], NDArray[np.bool_])


def read_only(array: _Numbers) -> _Numbers:
    """A contiguous, read-only copy."""
    array = array.copy()
    array.setflags(write=False)
    return array
