"""The links of a machine: what the carriages and the extra links are to the core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from guideload._core import carriage_links
from guideload.parts import Array, Carriage, Link

ENDS = ("-y", "-z", "+y", "+z")  # the links of a carriage: "-" at x - length/2, "+" at x + length/2


@dataclass(frozen=True, eq=False)
class LinkTable:
    """All links: four for each carriage, in the carriages' order, then the extra ones. Read-only."""

    names: tuple[str, ...]
    points: Array  # (n, 3) m, from L
    directions: Array  # (n, 3) unit vectors
    stiffness: Array  # (n,) N/m
    damping: Array  # (n,) N s/m
    carriage: NDArray[np.intp]  # (n,) index into the carriages, -1 for an extra link


def table_of(carriages: Sequence[Carriage], centers: Array, links: Sequence[Link]) -> LinkTable:
    """All links of a machine. centers: of the carriages from L, shape (carriage, 3) [m]."""
    names: list[str] = []
    rows: list[list[float]] = []  # point, direction, stiffness, damping
    for carriage, center in zip(carriages, centers.tolist(), strict=True):
        stiffness = (carriage.stiffness_y, carriage.stiffness_z)
        damping = (carriage.damping_y, carriage.damping_z)
        rows += np.column_stack(carriage_links(center, carriage.length, stiffness, damping)).tolist()
        names += [f"{carriage.name}:{end}" for end in ENDS]
    for link in links:
        rows.append([*link.point, *link.direction, link.stiffness, link.damping])
        names.append(link.name)
    table = np.array(rows, dtype=np.float64).reshape(-1, 8)
    owner = np.repeat(np.arange(len(carriages)), 4)
    return LinkTable(
        names=tuple(names),
        points=read_only(table[:, 0:3]),
        directions=read_only(table[:, 3:6]),
        stiffness=read_only(table[:, 6]),
        damping=read_only(table[:, 7]),
        carriage=read_only(np.append(owner, np.full(len(links), -1)).astype(np.intp)),
    )


_Numbers = TypeVar("_Numbers", Array, NDArray[np.intp], NDArray[np.int64])


def read_only(array: _Numbers) -> _Numbers:
    """A contiguous copy that nobody can change."""
    array = array.copy()
    array.setflags(write=False)
    return array
