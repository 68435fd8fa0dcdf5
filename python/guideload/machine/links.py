"""The links of a machine: what the carriages and the extra links are to the core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from guideload._core import Law, carriage_links
from guideload.base.arrays import Array
from guideload.machine.parts import Carriage, Link

ENDS = ("-y", "-z", "+y", "+z")  # the links of a carriage: "-" at x - length/2, "+" at x + length/2


@dataclass(frozen=True, eq=False)
class LinkTable:
    """All links: four for each carriage, in the carriages' order, then the extra ones. Read-only."""

    names: tuple[str, ...]
    points: Array  # (n, 3) m, from L
    directions: Array  # (n, 3) unit vectors
    laws: tuple[Law, ...]
    stiffness: (
        Array  # (n,) N/m, nominal: k, the larger side, at no load where preloaded, the steepest of a curve
    )
    damping: Array  # (n,) N s/m
    damping_in_contact: NDArray[np.bool_]  # (n,) whether the damping acts only outside the clearance
    carriage: NDArray[np.intp]  # (n,) index into the carriages, -1 for an extra link


def table_of(carriages: Sequence[Carriage], centers: Array, links: Sequence[Link]) -> LinkTable:
    """All links of a machine; each end of a carriage has half of its forces at the same deflections.

    centers: of the carriages from L, shape (carriage, 3) [m]. Raises SceneError for a law that no link can have.
    """
    names: list[str] = []
    rows: list[list[float]] = []  # point, direction, damping
    laws: list[Law] = []
    in_contact: list[bool] = []
    for carriage, center in zip(carriages, centers.tolist(), strict=True):
        damping = 0.5 * np.array([carriage.damping_y, carriage.damping_z] * 2)
        rows += np.column_stack([*carriage_links(center, carriage.length), damping]).tolist()
        laws += [law.scaled(0.5) for law in carriage.laws] * 2
        clear = (carriage.clearance_y > 0.0, carriage.clearance_z > 0.0)
        in_contact += [carriage.damping_in_contact and gap for gap in clear] * 2
        names += [f"{carriage.name}:{end}" for end in ENDS]
    for link in links:
        rows.append([*link.point, *link.direction, link.damping])
        laws.append(link.law)
        in_contact.append(link.damping_in_contact)
        names.append(link.name)
    table = np.array(rows, dtype=np.float64).reshape(-1, 7)
    owner = np.repeat(np.arange(len(carriages)), 4)
    return LinkTable(
        names=tuple(names),
        points=read_only(table[:, 0:3]),
        directions=read_only(table[:, 3:6]),
        laws=tuple(laws),
        stiffness=read_only(np.array([law.stiffness for law in laws], dtype=np.float64)),
        damping=read_only(table[:, 6]),
        damping_in_contact=read_only(np.array(in_contact, dtype=np.bool_)),
        carriage=read_only(np.append(owner, np.full(len(links), -1)).astype(np.intp)),
    )


_Numbers = TypeVar("_Numbers", Array, NDArray[np.intp], NDArray[np.int64], NDArray[np.bool_])


def read_only(array: _Numbers) -> _Numbers:
    """A contiguous copy that nobody can change."""
    array = array.copy()
    array.setflags(write=False)
    return array
