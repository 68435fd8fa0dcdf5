"""Measured static deflections of a machine under known forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.identification.measured import Noise, OwnUnknown, Residuals
from guideload.identification.model import ModelAt
from guideload.identification.places import Place


@dataclass(frozen=True, eq=False)
class Deflection:
    """A displacement [m] along a place, under a force [N] along another one."""

    force_at: Place
    force: float
    at: Place
    moved: float


@dataclass(frozen=True, eq=False)
class Deflections:
    """Static deflections of a machine with linear links, from its place at rest.

    level  standard deviation [m]
    known  whether it is known, or a start only
    """

    name: str
    values: tuple[Deflection, ...]
    level: float
    known: bool

    own: tuple[OwnUnknown, ...] = ()
    instants: ClassVar[None] = None
    error_draws: ClassVar[None] = None

    @property
    def noise(self) -> tuple[Noise, ...]:
        return (Noise(f"displacements of {self.name}", self.known),)

    @property
    def noise_of(self) -> NDArray[np.intp]:
        return np.zeros(len(self.values), dtype=np.intp)

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"displacement {one.at.name} by a force at {one.force_at.name}" for one in self.values)

    def computed(self, model: ModelAt) -> tuple[Array, Array]:
        """The displacements (n,) [m] of the machine, and their derivatives (n, p) by the values."""
        free = model.rest.free
        forces = np.array([one.force * one.force_at.row[free] for one in self.values]).T
        rows = np.array([one.at.row[free] for one in self.values])
        stiffness = model.rest.stiffness[np.ix_(free, free)]
        change = model.rest.d_stiffness[:, free][:, :, free]
        q, back = np.linalg.solve(stiffness, forces), np.linalg.solve(stiffness, rows.T)
        return np.einsum("nk,kn->n", rows, q), -np.einsum("kn,pkl,ln->np", back, change, q)

    def residuals(self, model: ModelAt, own: Array) -> Residuals:
        found, by = self.computed(model)
        rest = (found - np.array([one.moved for one in self.values])) / self.level
        return Residuals(rest, by * model.slopes / self.level, np.zeros((rest.size, 0)))

    def settled(self, model: ModelAt, own: Array) -> Deflections:
        return self
