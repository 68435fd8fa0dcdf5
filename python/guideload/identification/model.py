"""The machine as a function of its unknown numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.identification.excitation import Excitation
from guideload.identification.places import Place
from guideload.identification.unknowns import Unknown
from guideload.machine.machine import Machine
from guideload.sensitivity.linearised import Linearised
from guideload.sensitivity.modes import Complex, ModeDerivatives
from guideload.sensitivity.run import RunDerivatives
from guideload.sensitivity.varied import VariedMachine

BESIDE = (0.0, 1e-9, 1e-7, 1e-5)  # relative changes of all values that are tried where there is no derivative


@dataclass(frozen=True, eq=False)
class ModelAt:
    """The machine at one set of unknowns: what a kind of measured data predicts its values from.

    machine   the nominal machine: its points, free dofs, drive
    z         (p,) coordinates of the unknowns, see `Unknown`
    slopes    (p,) derivatives of the values by z: a derivative by a value times its slope is that by z
    rest      the machine linearised at rest, with derivatives by the values
    """

    machine: Machine
    z: Array
    slopes: Array
    rest: Linearised

    @cached_property
    def modes(self) -> ModeDerivatives:
        """Its modes, with derivatives by the values."""
        return self.rest.modes()

    @cached_property
    def _runs(self) -> dict[int, RunDerivatives]:
        return {}

    def run(self, excitation: Excitation) -> RunDerivatives:
        """Its run, with derivatives by the values; data with the same excitation share it."""
        if id(excitation) not in self._runs:
            run = RunDerivatives(self.machine, self.rest, excitation.motion, excitation.start)
            self._runs[id(excitation)] = run
        return self._runs[id(excitation)]

    def response(self, frequency: Array, force: Place) -> tuple[Complex, Complex]:
        """Amplitudes (n, 6) of L per newton at frequencies (n,) [Hz], and derivatives (n, p, 6) by the values."""
        key = force.name, frequency.tobytes()
        if key not in self._responses:
            self._responses[key] = self.rest.response(frequency, force.at.tolist(), force.direction.tolist())
        return self._responses[key]

    @cached_property
    def _responses(self) -> dict[tuple[str, bytes], tuple[Complex, Complex]]:
        return {}

    def by_z(self, derivative: Array) -> Array:
        """Derivatives (p, ...) by the values as derivatives by z."""
        return derivative * self.slopes.reshape(-1, *[1] * (derivative.ndim - 1))


class Model:
    """A machine with unknown numbers; `at` keeps the last machine that it built."""

    def __init__(self, machine: Machine, unknowns: Sequence[Unknown]) -> None:
        self.machine, self.unknowns = machine, tuple(unknowns)
        self._varied = VariedMachine(machine, {one.name: one.targets for one in self.unknowns})
        self._last: ModelAt | None = None

    def at(self, z: Array) -> ModelAt:
        """The machine at z (p,). Raises SceneError for an impossible one, ArgumentError for one without derivatives."""
        if self._last is None or not np.array_equal(self._last.z, z):
            values = np.array([one.value(c) for one, c in zip(self.unknowns, z.tolist(), strict=True)])
            slopes = np.array([one.slope(c) for one, c in zip(self.unknowns, z.tolist(), strict=True)])
            self._last = ModelAt(self.machine, z.copy(), slopes, self._linearised(values))
        return self._last

    def _linearised(self, values: Array) -> Linearised:
        """The machine linearised at rest, or a machine beside it if a link rests just at a kink of its law."""
        for beside in BESIDE:
            try:
                return self._varied.at(values * (1.0 + beside))
            except ArgumentError:
                pass
        return self._varied.at(values)
