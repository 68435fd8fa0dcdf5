"""`sensitivities`: exact derivatives of what a run and a machine at rest compute, as labelled arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
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
from guideload.sensitivity.modes import ModeDerivatives
from guideload.sensitivity.run import RunDerivatives
from guideload.sensitivity.varied import VariedMachine
from guideload.simulation.point_motion import moved
from guideload.simulation.run import AXES
from guideload.simulation.run_quantities import ACCELERATION_UNITS, LOAD_UNITS, POSITION_UNITS, SPEED_UNITS
from guideload.simulation.start import Start

if TYPE_CHECKING:
    import xarray as xr

Of = str | Sequence[str]


class _Derivatives:
    """What the quantities of one call are made of; a run is computed only for those that need it."""

    def __init__(self, machine: Machine, to: To, motion: Motion, start: Start) -> None:
        self.machine, self.motion, self.start = machine, motion, start
        self.at_rest = VariedMachine(machine, to, motion).at()

    @cached_property
    def run(self) -> RunDerivatives:
        return RunDerivatives(self.machine, self.at_rest, self.motion, self.start)

    @cached_property
    def of_carriages(self) -> CarriageQuantities:
        return CarriageQuantities(self.run)

    @cached_property
    def of_modes(self) -> ModeDerivatives:
        return self.at_rest.modes()

    def resultant(self) -> Array:
        """Derivatives of the y-z resultant (p, time, carriage): along the load; nan where it is zero."""
        across = self.run.carriage_loads()[:, :, 1:3]
        size = np.linalg.norm(across, axis=2, keepdims=True)
        direction = np.divide(across, size, out=np.full_like(across, np.nan), where=size > 0.0)
        return np.asarray((self.run.history("carriage_loads")[..., 1:3] * direction).sum(axis=-1))

    def points(self, quantity: str) -> Array:
        """Derivatives of the motion of all points (p, time, point, 3)."""
        if not self.machine.points:
            raise ArgumentError(f"of: expected a machine with [[points]], {self.machine.name} has none")
        return moved(self.machine, self.run.history(quantity))


OF_CARRIAGE, OF_POINT = ("time", "carriage", "axis"), ("time", "point", "axis")
# By quantity: its derivatives (p, ...), unit, dimensions after the parameter.
ARRAYS: dict[str, tuple[Callable[[_Derivatives], Array], str, tuple[str, ...]]] = {
    "force": (lambda d: d.run.history("carriage_loads")[..., :3], "N", OF_CARRIAGE),
    "moment": (lambda d: d.run.history("carriage_loads")[..., 3:], "N m", OF_CARRIAGE),
    "resultant": (lambda d: d.resultant(), "N", ("time", "carriage")),
    "link_load": (lambda d: d.run.history("link_loads"), "N", ("time", "link")),
    "reaction": (lambda d: d.run.history("reaction"), LOAD_UNITS, ("time", "dof")),
    "displacement": (lambda d: d.run.history("displacement"), POSITION_UNITS, ("time", "dof")),
    "velocity": (lambda d: d.run.history("velocity"), SPEED_UNITS, ("time", "dof")),
    "acceleration": (lambda d: d.run.history("acceleration"), ACCELERATION_UNITS, ("time", "dof")),
    "point_displacement": (lambda d: d.points("displacement"), "m", OF_POINT),
    "point_velocity": (lambda d: d.points("velocity"), "m/s", OF_POINT),
    "point_acceleration": (lambda d: d.points("acceleration"), "m/s^2", OF_POINT),
    "static_force": (lambda d: d.at_rest.d_static_carriage_loads[..., :3], "N", OF_CARRIAGE[1:]),
    "static_moment": (lambda d: d.at_rest.d_static_carriage_loads[..., 3:], "N m", OF_CARRIAGE[1:]),
    "static_link_load": (lambda d: d.at_rest.d_static_link_loads, "N", ("link",)),
    "static_displacement": (lambda d: d.at_rest.d_static_position, POSITION_UNITS, ("dof",)),
}
MODES = {"frequency": "Hz", "damping_ratio": "1"}
NAMES = (*ARRAYS, *MODES, *UNITS)


@checked
def sensitivities(machine: Machine, motion: Motion, *, of: Of, to: To, start: Start = "auto") -> xr.Dataset:
    """Exact derivatives of quantities by numbers of a machine, from one run.

    Parameters
    ----------
    of
        Names of quantities: histories and static values as in `Result.data` (force, moment, resultant, link_load,
        reaction, displacement, velocity, acceleration, point_displacement, point_velocity, point_acceleration,
        static_force, static_moment, static_link_load, static_displacement), frequency and damping_ratio of the modes,
        and of each carriage peak_resultant, mean_load and life.
    to
        Paths as in a study, "carriages.*.stiffness_y": a parameter for each number; or a mapping from names to paths:
        a parameter for each name, whose numbers vary together.
    start
        As in `simulate`.

    Returns
    -------
    Dataset with a variable d_NAME for each quantity, whose first dimension is `parameter`: derivatives per SI unit of
    the parameter, `units_of_numerator` per `unit`. Times the coordinate `value` they are per 100 % of the parameter.
    For modes and carriages it also has the values themselves, NAME. damping_ratio is that of the damped machine, as in
    `Modes`. `attrs["notes"]` says why a derivative is nan: e.g. equal frequencies, or a peak that occurs at two
    instants.

    Raises
    ------
    ArgumentError, SceneError, LifeError
        With the way out.
    """
    import xarray as xr

    names = (of,) if isinstance(of, str) else tuple(of)
    for name in names:
        if name not in NAMES:
            raise ArgumentError(f"of: expected names out of {joined(NAMES)}, got {name!r}")
    wanted = _Derivatives(machine, to, motion, start)
    data, notes = {}, dict[str, None]()
    dims: tuple[str, ...]
    for name in names:
        values = None
        if name in UNITS:
            unit, dims = UNITS[name], ("carriage",)
            values, derivatives = getattr(wanted.of_carriages, name)()
            notes |= dict.fromkeys(wanted.of_carriages.notes)
        elif name in MODES:
            unit, dims = MODES[name], ("mode",)
            values, derivatives = (getattr(wanted.of_modes, each) for each in (name, f"d_{name}"))
            notes |= dict.fromkeys(wanted.of_modes.reasons)
        else:
            compute, unit, dims = ARRAYS[name]
            derivatives = compute(wanted)
        if values is not None:
            data[name] = xr.Variable(dims, values, {"units": unit})
        data[f"d_{name}"] = xr.Variable(("parameter", *dims), derivatives, {"units_of_numerator": unit})
    columns = wanted.at_rest.columns
    labels = {
        "parameter": [column.name for column in columns],
        "time": motion.time,
        "carriage": [carriage.name for carriage in machine.carriages],
        "link": list(machine.link_table().names),
        "point": [point.name for point in machine.points],
        "axis": list(AXES),
        "dof": list(DOFS),
    }
    used = {"parameter", *(dim for variable in data.values() for dim in variable.dims)}
    out = xr.Dataset(data, {name: label for name, label in labels.items() if name in used})
    out = out.assign_coords(
        value=("parameter", [column.value for column in columns]),
        unit=("parameter", [column.unit for column in columns]),
    )
    out.attrs = {"machine": machine.name, "notes": "\n".join(notes)}
    return out
