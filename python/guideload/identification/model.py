"""The machine as measured data see it: a function of its unknown numbers, under a motion, at places of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from guideload.base.arrays import Array, Complex
from guideload.base.errors import ArgumentError, ValueRefused
from guideload.base.number_text import joined
from guideload.identification.unknowns import Unknown
from guideload.machine.machine import Machine
from guideload.machine.response import AXES
from guideload.motion.motion import Motion
from guideload.sensitivity.linearised import Linearised
from guideload.sensitivity.modes import ModeDerivatives
from guideload.sensitivity.run import History, Instants, RunDerivatives
from guideload.sensitivity.varied import VariedMachine
from guideload.simulation.start import StartState, start_of

# ---- places of sensors: a point of the machine and a direction, "tool y", or a load, "1a Fy" or the name of a link


COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")  # of the load of a carriage; Fx is the drive's


@dataclass(frozen=True, eq=False)
class SensorPlace:
    """A point of the machine and a direction."""

    name: str  # "tool y"
    at: Array  # (3,) m from L
    direction: Array  # (3,) unit vector

    @cached_property
    def row(self) -> Array:
        """(6,) the displacement along the direction is row @ q, for q = (u, phi) of L; a force F acts on q as F row."""
        return np.concatenate([self.direction, np.cross(self.at, self.direction)])


def parse_place(text: str, machine: Machine) -> SensorPlace:
    """The place "tool y" or "tool -y": a point of [[points]], and x, y or z of the machine. Raises ValueRefused."""
    name, _, axis = text.strip().rpartition(" ")
    points = {point.name: point for point in machine.points}
    if axis.lstrip("+-") not in AXES or name.strip() not in points:
        known = joined([f'"{one}"' for one in points]) or "none: add [[points]] tables to the machine file"
        raise ValueRefused('a point and an axis, as "tool y"', text, f"the points of the machine are {known}")
    direction = np.array(AXES[axis.lstrip("+-")]) * (-1.0 if axis.startswith("-") else 1.0)
    return SensorPlace(f"{name.strip()} {axis}", np.array(points[name.strip()].at), direction)


@dataclass(frozen=True)
class LoadPlace:
    """A load that a cell or a strain gauge measures."""

    name: str  # "1a Fy", or that of a link
    unit: str  # N or N m
    quantity: Literal["carriage_loads", "link_loads"]  # of a run that it is part of
    # its place there: carriage and component of its load, an index into `COMPONENTS`, or link
    index: tuple[int, ...]

    def shown(self, at: Instants, rest: Linearised) -> History:
        """The change of the load from that at rest."""
        if self.quantity == "carriage_loads":
            still, by = rest.static_carriage_loads, rest.d_static_carriage_loads
        else:
            still, by = rest.static_link_loads, rest.d_static_link_loads
        one = np.zeros(still.shape)
        one[self.index] = 1.0
        history = at.history(self.quantity, one)
        return history.from_rest(float(still[self.index]), by.reshape(len(by), -1) @ one.ravel())


def parse_load_place(text: str, machine: Machine) -> LoadPlace:
    """A component of the load of a carriage, "1a Fy" or "1a Mz", or the name of a link. Raises ValueRefused."""
    names = [one.name for one in machine.links]
    if text.strip() in names:
        first = len(machine.link_table().names) - len(names)  # the extra links come last
        return LoadPlace(text.strip(), "N", "link_loads", (first + names.index(text.strip()),))
    name, _, component = text.strip().rpartition(" ")
    carriages = [one.name for one in machine.carriages]
    if name.strip() not in carriages or component not in COMPONENTS[1:]:
        loads = [f"{one} {component}" for one in carriages[:1] for component in COMPONENTS[1:]]
        known = joined([f'"{one}"' for one in (*carriages, *names)])
        expected = "a carriage and a component of its load, or a link"
        raise ValueRefused(expected, text, f"as {joined(loads)}; carriages and links are {known}")
    unit = "N" if component.startswith("F") else "N m"
    index = carriages.index(name.strip()), COMPONENTS.index(component)
    return LoadPlace(f"{name.strip()} {component}", unit, "carriage_loads", index)


# ---- the motion under which a record in time was taken


UNEVEN = 1e-3  # steps: stamps closer than this to an even grid are those of the grid, whose propagators recur


@dataclass(frozen=True, eq=False)
class Excitation:
    """A motion, and the state in which its runs start."""

    motion: Motion
    start: StartState

    @classmethod
    def of(cls, machine: Machine, motion: Motion) -> Excitation:
        """Raises ArgumentError for a machine whose motion is not linear in this excitation."""
        _require_linear(machine)
        time, start = motion.time, start_of(machine, motion, "auto")
        grid, step = np.linspace(time[0], time[-1], time.size, retstep=True)
        even = bool(np.abs(grid - time).max() < UNEVEN * step)
        return cls(replace(motion, time=grid) if even else motion, start)

    def within(self, instants: Array) -> Array:
        """The instants (n,) without the rounding by which some may lie outside the motion."""
        return np.asarray(np.clip(instants, self.motion.time[0], self.motion.time[-1]))


def _require_linear(machine: Machine) -> None:
    for what, way_out, there in (
        (
            f"links of the level {machine.model_level}",
            "give its stiffness as one number",
            machine.model_level != "linear",
        ),
        ("riders", "make them part of its body", machine.riders),
        ("payloads", "make them part of its body", machine.payloads),
        ("rails that are not straight", "leave out their profiles", not machine.has_straight_rails),
        ("a base", "leave out [base]", machine.base),
        (
            "a rack that pushes its body",
            "leave out pressure_angle, helix_angle and push_direction",
            machine.drive is not None and machine.drive.push_direction is not None,
        ),
    ):
        if there:
            raise ArgumentError(
                f"{machine.name}: records in time identify a linear machine, and this one has {what}; {way_out}"
            )


# ---- the machine as a function of its unknown numbers


BESIDE = (0.0, 1e-9, 1e-7, 1e-5)  # relative changes of all values that are tried where there is no derivative


@dataclass(frozen=True, eq=False)
class ModelAt:
    """The machine at one set of unknowns, from which each kind of measured data predicts its values."""

    machine: Machine  # the nominal machine: its points, free dofs, drive
    z: Array  # (p,) coordinates of the unknowns, see `Unknown`
    slopes: Array  # (p,) derivatives of the values by z: a derivative by a value times its slope is that by z
    rest: Linearised  # the machine linearised at rest, with derivatives by the values
    _runs: dict[int, RunDerivatives] = field(default_factory=dict)
    _responses: dict[tuple[str, bytes], tuple[Complex, Complex]] = field(default_factory=dict)

    @cached_property
    def modes(self) -> ModeDerivatives:
        """Its modes, with derivatives by the values."""
        return self.rest.modes()

    def run(self, excitation: Excitation) -> RunDerivatives:
        """Its run, with derivatives by the values; data with the same excitation share it."""
        if id(excitation) not in self._runs:
            self._runs[id(excitation)] = self.run_once(excitation)
        return self._runs[id(excitation)]

    def run_once(self, excitation: Excitation) -> RunDerivatives:
        """Its run under an excitation that is needed only once: the run is not kept."""
        return RunDerivatives(self.machine, self.rest, excitation.motion, excitation.start)

    def response(self, frequency: Array, force: SensorPlace) -> tuple[Complex, Complex]:
        """Amplitudes (n, 6) of L per newton at frequencies (n,) [Hz], and derivatives (n, p, 6) by the values."""
        key = force.name, frequency.tobytes()
        if key not in self._responses:
            self._responses[key] = self.rest.response(frequency, force.at.tolist(), force.direction.tolist())
        return self._responses[key]

    def by_z(self, derivative: Array) -> Array:
        """Derivatives (p, ...) by the values as derivatives by z."""
        return derivative * self.slopes.reshape(-1, *[1] * (derivative.ndim - 1))


class Model:
    """A machine with unknown numbers; `at` keeps the last machine that it built."""

    def __init__(self, machine: Machine, unknowns: Sequence[Unknown]) -> None:
        self.machine, self.unknowns = machine, tuple(unknowns)
        self._varied = VariedMachine(machine, {one.name: one.targets for one in self.unknowns})
        self._last: ModelAt | None = None

    def __reduce__(self) -> tuple[type[Model], tuple[Machine, Sequence[Unknown]]]:
        return Model, (self.machine, self.unknowns)  # a copy builds its machines anew

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
