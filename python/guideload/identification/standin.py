"""Until the package of sensitivities is there: matrices of a linear machine and their derivatives.

They are at most quadratic in each parameter, so that a central difference with a large step is exact up to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array
from guideload.identification.machine_values import machine_with
from guideload.machine.machine import DOFS, Machine
from guideload.machine.response import linearised
from guideload.motion.motion import Motion
from guideload.study.description.parameters import Parameters

STEP = 0.25


@dataclass(frozen=True, eq=False)
class Linearised:
    mass: Array
    damping: Array
    stiffness: Array
    d_mass: Array
    d_damping: Array
    d_stiffness: Array
    free: Array
    weight: Array
    d_weight: Array
    static_position: Array
    d_static_position: Array

    def modes(self) -> ModeDerivatives:
        return modes_of(self)


class VariedMachine:
    def __init__(self, machine: Machine, to: Mapping[str, Sequence[str]]) -> None:
        self.machine = machine
        parameters = Parameters(machine, Motion.along_x([0.0, 1.0], [0.0, 0.0]))
        self.groups = [[parameters.at(path)[0] for path in paths] for paths in to.values()]
        self.values = np.array(
            [1.0 if np.ptp([one.value for one in group]) else group[0].value for group in self.groups]
        )

        self._slopes = np.zeros((4, len(self.values), 6, 6))
        self._here = self._matrices(self.values)
        for j, value in enumerate(self.values):
            unit = np.eye(len(self.values))[j] * STEP * value
            change = self._matrices(self.values + unit) - self._matrices(self.values - unit)
            self._slopes[:, j] = change / (2.0 * STEP * value)

    def _matrices(self, values: Array) -> Array:
        given = []
        for group, value in zip(self.groups, values, strict=True):
            factor = np.ptp([one.value for one in group]) > 0
            given += [(one, one.value * value if factor else value) for one in group]
        machine = machine_with(self.machine, given)
        force = machine.body.mass * np.array(machine.gravity)
        weight = np.concatenate([force, np.cross(machine.body.center_of_mass, force)])
        return np.array([*linearised(machine), np.diag(weight)])

    def at(self, values: Array) -> Linearised:
        """Of parameters in which the matrices are linear, as stiffnesses and dampings."""
        free = np.array([DOFS.index(dof) for dof in self.machine.free])
        here = self._here + np.einsum("mpij,p->mij", self._slopes, values - self.values)
        m, c, k, w = here
        d_m, d_c, d_k, d_w = self._slopes
        w, d_w = np.diag(w), np.einsum("pii->pi", d_w)
        square, sag, d_sag = np.ix_(free, free), np.zeros(6), np.zeros((len(values), 6))
        sag[free] = np.linalg.solve(k[square], w[free])
        right = d_w[:, free] - d_k[(slice(None), *square)] @ sag[free]
        d_sag[:, free] = np.linalg.solve(k[square], right.T).T
        return Linearised(m, c, k, d_m, d_c, d_k, free, w, d_w, sag, d_sag)


@dataclass(frozen=True, eq=False)
class ModeDerivatives:
    eigenvalue: np.ndarray
    d_eigenvalue: np.ndarray
    damped_shape: np.ndarray
    d_damped_shape: np.ndarray


def modes_of(one: Linearised) -> ModeDerivatives:
    square = np.ix_(one.free, one.free)
    m, c, k = one.mass[square], one.damping[square], one.stiffness[square]
    n, p = len(m), len(one.d_mass)
    inverse = np.linalg.inv(m)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ k, -inverse @ c]])
    values, vectors = np.linalg.eig(state)
    order = [i for i in np.argsort(abs(values)) if values[i].imag > 1e-9 * abs(values[i])]
    d_value = np.zeros((p, len(order)), complex)
    shape, d_shape = np.zeros((len(order), 6), complex), np.zeros((p, len(order), 6), complex)
    for at, i in enumerate(order):
        lam, x = values[i], vectors[:n, i]
        x = x / np.sqrt(x @ (2 * lam * m + c) @ x)
        top = lam**2 * m + lam * c + k
        slope = (2 * lam * m + c) @ x
        bordered = np.block([[top, slope[:, None]], [np.conj(x)[None], np.zeros((1, 1))]])
        for j in range(p):
            change = (
                lam**2 * one.d_mass[j][square] + lam * one.d_damping[j][square] + one.d_stiffness[j][square]
            )
            found = np.linalg.solve(bordered, np.append(-change @ x, 0.0))
            d_value[j, at], d_shape[j, at, one.free] = found[-1], found[:-1]
        shape[at, one.free] = x
    return ModeDerivatives(values[order], d_value, shape, d_shape)
