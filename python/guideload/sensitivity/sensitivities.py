"""`sensitivities`: exact derivatives of what a run and a machine at rest compute, as labelled arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.base.number_text import joined
from guideload.machine.machine import DOFS, Machine
from guideload.motion.motion import Motion
from guideload.sensitivity.columns import To
from guideload.sensitivity.figures import UNITS, CarriageQuantities
from guideload.sensitivity.run import RunDerivatives
from guideload.sensitivity.varied import VariedMachine
from guideload.simulation.start import Start

if TYPE_CHECKING:
    import xarray as xr

AXES = ("x", "y", "z")
LOADS, POSITIONS = "N, N, N, N m, N m, N m", "m, m, m, rad, rad, rad"
PER = " per unit of the parameter"
Values = tuple[Array, str, tuple[str, ...]]  # derivatives (p, ...), unit, dimensions after the parameter
Of = str | Sequence[str]


class _Wanted:
    """The quantities of one call; a run is computed only for those that need it."""

    def __init__(self, varied: VariedMachine, motion: Motion, start: Start) -> None:
        self.varied, self.motion, self.start = varied, motion, start
        self.at_rest = varied.at()
        self._run: RunDerivatives | None = None
        self._figures: CarriageQuantities | None = None

    @property
    def run(self) -> RunDerivatives:
        if self._run is None:
            self._run = RunDerivatives(self.varied.machine, self.at_rest, self.motion, self.start)
        return self._run

    @property
    def figures(self) -> CarriageQuantities:
        if self._figures is None:
            self._figures = CarriageQuantities(self.run)
        return self._figures

    def resultant(self) -> Array:
        """Derivatives of the y-z resultant (p, time, carriage): along the load; nan where it is zero."""
        machine = self.varied.machine
        loads = self.run.solution.group_loads(machine.links_of_carriages, machine.carriage_places, "total")
        across = loads[:, :, 1:3]
        size = np.linalg.norm(across, axis=2, keepdims=True)
        direction = np.divide(across, size, out=np.full_like(across, np.nan), where=size > 0.0)
        return np.asarray((self.run.carriage_loads()[..., 1:3] * direction).sum(axis=-1))

    def points(self, of_reference: Array) -> Array:
        if not self.varied.machine.points:
            raise ArgumentError(
                f"of: expected a machine with [[points]], {self.varied.machine.name} has none"
            )
        return self.run.of_points(of_reference)


HISTORIES: dict[str, tuple[Callable[[_Wanted], Array], str, tuple[str, ...]]] = {
    "force": (lambda w: w.run.carriage_loads()[..., :3], "N", ("time", "carriage", "axis")),
    "moment": (lambda w: w.run.carriage_loads()[..., 3:], "N m", ("time", "carriage", "axis")),
    "resultant": (lambda w: w.resultant(), "N", ("time", "carriage")),
    "link_load": (lambda w: w.run.link_loads(), "N", ("time", "link")),
    "reaction": (lambda w: w.run.reaction(), LOADS, ("time", "dof")),
    "displacement": (lambda w: w.run.displacement(), POSITIONS, ("time", "dof")),
    "velocity": (lambda w: w.run.velocity(), "m/s, m/s, m/s, rad/s, rad/s, rad/s", ("time", "dof")),
    "acceleration": (
        lambda w: w.run.acceleration(),
        "m/s2, m/s2, m/s2, rad/s2, rad/s2, rad/s2",
        ("time", "dof"),
    ),
    "point_displacement": (lambda w: w.points(w.run.displacement()), "m", ("time", "point", "axis")),
    "point_velocity": (lambda w: w.points(w.run.velocity()), "m/s", ("time", "point", "axis")),
    "point_acceleration": (lambda w: w.points(w.run.acceleration()), "m/s2", ("time", "point", "axis")),
}
AT_REST: dict[str, tuple[Callable[[_Wanted], Array], str, tuple[str, ...]]] = {
    "static_force": (lambda w: w.at_rest.d_static_carriage_loads[..., :3], "N", ("carriage", "axis")),
    "static_moment": (lambda w: w.at_rest.d_static_carriage_loads[..., 3:], "N m", ("carriage", "axis")),
    "static_link_load": (lambda w: w.at_rest.d_static_link_loads, "N", ("link",)),
    "static_displacement": (lambda w: w.at_rest.d_static_position, POSITIONS, ("dof",)),
}
MODES = {"frequency": "Hz", "damping_ratio": "1"}
NAMES = (*HISTORIES, *AT_REST, *MODES, *UNITS)


@checked
def sensitivities(machine: Machine, motion: Motion, *, of: Of, to: To, start: Start = "auto") -> xr.Dataset:
    """Exact derivatives of quantities by numbers of a machine, from one run.

    of     names of quantities: histories and static values as in `Result.data` (force, moment, resultant, link_load,
           reaction, displacement, velocity, acceleration, point_displacement, point_velocity, point_acceleration,
           static_force, static_moment, static_link_load, static_displacement), frequency and damping_ratio of the
           modes, and figures of each carriage: peak_resultant, mean_load, life
    to     paths as in a study, "carriages.*.stiffness_y": a parameter for each number; or a mapping from names to
           paths: a parameter for each name, whose numbers vary together
    start  as in `simulate`

    The dataset has a variable d_NAME for each quantity, with the dimension `parameter` first, per SI unit of the
    parameter. Times the coordinate `value` they are changes per 100 % of the value. For figures and modes it also has
    their values, NAME. `attrs["notes"]` says why a derivative is nan: a peak that two instants share, equal
    frequencies. Raises ArgumentError, SceneError, LifeError with the way out.
    """
    import xarray as xr

    names = (of,) if isinstance(of, str) else tuple(of)
    for name in names:
        if name not in NAMES:
            raise ArgumentError(f"of: expected names out of {joined(NAMES)}, got {name!r}")
    wanted = _Wanted(VariedMachine(machine, to, motion), motion, start)
    data, notes = {}, list[str]()
    for name, values, unit, dims in _values(wanted, names, notes):
        derivative = name.startswith("d_")
        data[name] = xr.Variable(
            ("parameter", *dims) if derivative else dims,
            values,
            {"units": unit + PER if derivative else unit},
        )
    columns = wanted.at_rest.columns
    table = machine.link_table()
    labels = {
        "parameter": [column.name for column in columns],
        "time": motion.time,
        "carriage": [carriage.name for carriage in machine.carriages],
        "link": list(table.names),
        "point": [point.name for point in machine.points],
        "axis": list(AXES),
        "dof": list(DOFS),
    }
    used = {dim for variable in data.values() for dim in variable.dims}
    out = xr.Dataset(
        data, {name: label for name, label in labels.items() if name in used or name == "parameter"}
    )
    out = out.assign_coords(
        value=("parameter", [column.value for column in columns]),
        unit=("parameter", [column.unit for column in columns]),
    )
    out.attrs = {"machine": machine.name, "notes": "\n".join(notes)}
    return out


def _values(
    wanted: _Wanted, names: Sequence[str], notes: list[str]
) -> Iterator[tuple[str, Array, str, tuple[str, ...]]]:
    """Name, values, unit and dimensions of every variable."""
    for name in names:
        if name in UNITS:
            values, derivatives = getattr(wanted.figures, name)()
            yield name, values, UNITS[name], ("carriage",)
            yield f"d_{name}", derivatives, UNITS[name], ("carriage",)
        elif name in MODES:
            modes = wanted.at_rest.modes()
            yield name, getattr(modes, name), MODES[name], ("mode",)
            yield f"d_{name}", getattr(modes, f"d_{name}"), MODES[name], ("mode",)
            notes.extend(reason for reason in modes.reasons if reason not in notes)
        else:
            compute, unit, dims = {**HISTORIES, **AT_REST}[name]
            yield f"d_{name}", compute(wanted), unit, dims
    if wanted._figures is not None:
        notes.extend(wanted._figures.notes)
