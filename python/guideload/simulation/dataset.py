"""The labelled arrays of a result: names, dimensions and units of all quantities stand here."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.metadata import version

import numpy as np
import xarray as xr

from guideload.base.arrays import Array
from guideload.machine.machine import DOFS
from guideload.motion.resolution import usable_bandwidth
from guideload.simulation.run import AXES, Run

Variable = tuple[str, tuple[str, ...], Array, str, str]
SIX = "N, N, N, N m, N m, N m"


def dataset(run: Run, carriage_loads: Array) -> xr.Dataset:
    """All quantities of a run. carriage_loads: (time, carriage, 6), which the caller has already."""
    machine = run.machine
    labels = {
        "carriage": [carriage.name for carriage in machine.carriages],
        "rail": [rail.name for rail in machine.rails],
        "link": machine.link_table().names,
        "axis": AXES,
        "dof": DOFS,
    }
    coords = labelled([("time", ("time",), run.time, "s", "time")])
    coords |= {name: xr.Variable((name,), np.array(found), fastpath=True) for name, found in labels.items()}
    variables = [*_loads(run, carriage_loads), *_reference_point(run), *_static(run), *_motion(run)]
    data = xr.Dataset(labelled(variables), coords=coords)
    data.attrs = _attributes(run)
    return data


def labelled(variables: Iterable[Variable]) -> dict[str, xr.Variable]:
    """Arrays with their dimensions, units and names, as a dataset takes them.

    The fast path takes them as the arrays that they are; any other asks whether they are dask's, and where dask is
    installed imports the whole of it for that, in 0.2 s.
    """
    return {
        name: xr.Variable(dims, values, {"units": units, "long_name": text}, fastpath=True)
        for name, dims, values, units, text in variables
    }


def _loads(run: Run, carriage_loads: Array) -> Iterator[Variable]:
    machine, solution = run.machine, run.solution
    of_carriages, of_rails = ("time", "carriage", "axis"), ("time", "rail", "axis")
    force, moment = carriage_loads[:, :, :3], carriage_loads[:, :, 3:]
    yield "force", of_carriages, force, "N", "load of the carriage"
    yield "moment", of_carriages, moment, "N m", "moment about the carriage centre"
    for part in ("elastic", "damping"):
        loads = run.carriage_loads(part)
        yield f"force_{part}", of_carriages, loads[:, :, :3], "N", f"{part} part of the load"
        yield f"moment_{part}", of_carriages, loads[:, :, 3:], "N m", f"{part} part of the moment"
    resultant = np.hypot(force[:, :, 1], force[:, :, 2])
    yield "resultant", ("time", "carriage"), resultant, "N", "resultant load of the carriage in y and z"
    yield "link_load", ("time", "link"), solution.link_loads("total"), "N", "load along the link"
    for part in ("elastic", "damping"):
        load = solution.link_loads(part)
        yield f"link_load_{part}", ("time", "link"), load, "N", f"{part} part of the load along the link"
    rails = solution.group_loads(machine.links_of_rails, machine.rail_centers, "total")
    yield "rail_force", of_rails, rails[:, :, :3], "N", "load of the rail"
    yield "rail_moment", of_rails, rails[:, :, 3:], "N m", "moment about the mean of its carriage centres"


def _reference_point(run: Run) -> Iterator[Variable]:
    solution, dims = run.solution, ("time", "dof")
    yield "reaction", dims, solution.reaction(), SIX, "reaction of the held dofs; of x: the drive force"
    units = "m, m, m, rad, rad, rad"
    yield "displacement", dims, solution.position(), units, "displacement of L, sag included"
    units = "m/s, m/s, m/s, rad/s, rad/s, rad/s"
    yield "velocity", dims, solution.velocity(), units, "velocity of L in the carriage frame"
    units = "m/s2, m/s2, m/s2, rad/s2, rad/s2, rad/s2"
    yield "acceleration", dims, solution.acceleration(), units, "acceleration of L in the carriage frame"


def _static(run: Run) -> Iterator[Variable]:
    machine, scene = run.machine, run.machine.scene
    loads = scene.static_group_loads(machine.links_of_carriages, machine.carriage_centers)
    yield "static_force", ("carriage", "axis"), loads[:, :3], "N", "static load of the carriage"
    yield "static_moment", ("carriage", "axis"), loads[:, 3:], "N m", "static moment of the carriage"
    yield "static_link_load", ("link",), scene.static_link_loads(), "N", "static load along the link"
    yield "static_reaction", ("dof",), scene.static_reaction(), SIX, "static reaction of the held dofs"
    position = scene.static_position()
    yield "static_displacement", ("dof",), position, "m, m, m, rad, rad, rad", "static displacement of L"


def _motion(run: Run) -> Iterator[Variable]:
    motion, inputs = run.motion, run.solution.inputs()
    yield "cart_acceleration", ("time", "axis"), inputs[:, :3], "m/s2", "acceleration of the cart"
    if motion.wrench is not None:
        yield "wrench", ("time", "dof"), inputs[:, 3:], SIX, "external force and moment about L"
    if run.time is motion.time:  # measured histories are not interpolated to other instants
        if motion.velocity is not None:
            yield "cart_velocity", ("time", "axis"), motion.velocity, "m/s", "velocity of the cart"
        if motion.position is not None:
            yield "cart_position", ("time", "axis"), motion.position, "m", "position of the cart"
        if motion.motor_speed is not None:
            yield "motor_speed", ("time",), motion.motor_speed, "rad/s", "measured speed of the motor"


def _attributes(run: Run) -> dict[str, str | float | int]:
    solution = run.solution
    attributes: dict[str, str | float | int] = {
        "title": f"Loads of the linear guides of {run.machine.name}",
        "program": f"guideload {version('guideload')}",
        "machine": run.machine.model_dump_json(),
        "free": " ".join(run.machine.free),
        "method": run.method,
        "method_reason": run.reason,
        "rtol": run.rtol,
        "load_scale_N": solution.load_scale,
        "steps": solution.steps,
        "rejected_steps": solution.rejected,
        "contact_changes": solution.contact_changes,
        "motion_step_s": _median_step(run.motion.time),
        "motion_bandwidth_Hz": usable_bandwidth(run.motion.time, run.motion.bandwidth),
        "motion_jumps": int(np.count_nonzero(np.diff(run.motion.time) == 0.0)),
        "motion_source": run.motion.source,
        "motion_notes": "\n".join(run.motion.notes),
    }
    if run.step is not None:
        attributes["step_s"] = run.step
    return attributes


def _median_step(time: Array) -> float:
    """Median distance of the samples of a motion [s], 0 if all are at one instant."""
    steps = np.diff(time)
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else 0.0
