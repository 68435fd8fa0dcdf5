"""The quantities of a run, with names, dimensions and units."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.base.arrays import Array, median_step
from guideload.base.finite import finite_json
from guideload.base.quantities import Quantities, Quantity, QuantityRow, quantities
from guideload.base.versions import version
from guideload.machine.machine import DOFS
from guideload.motion.consistency import motion_texts
from guideload.simulation.peaks import peak_rows, resultants
from guideload.simulation.point_motion import point_rows
from guideload.simulation.run import AXES, Run

MOST_STORED = 200_000  # samples of the motion beside other instants: 5 MB
LOAD_UNITS = "N, N, N, N m, N m, N m"
POSITION_UNITS = "m, m, m, rad, rad, rad"
SPEED_UNITS = "m/s, m/s, m/s, rad/s, rad/s, rad/s"
ACCELERATION_UNITS = "m/s^2, m/s^2, m/s^2, rad/s^2, rad/s^2, rad/s^2"


def quantities_of(run: Run, carriage_loads: Array) -> Quantities:
    """All quantities of a run but its credible bands.

    carriage_loads: (time, carriage, 6) N and N m, of `run.carriage_loads()`.
    """
    machine = run.machine
    labels = {
        "carriage": [carriage.name for carriage in machine.carriages],
        "rail": [rail.name for rail in machine.rails],
        "link": machine.link_table().names,
        "axis": AXES,
        "dof": DOFS,
    }
    if machine.points:
        labels["point"] = [point.name for point in machine.points]
    if run.travel is not None:
        labels["rider"] = [rider.name for rider in machine.riders]
    rows = [*_loads(run, carriage_loads), *_reference_point(run), *_static(run), *_motion(run), *_riders(run)]
    rows += peak_rows(run)
    rows += point_rows(machine, {name: values for name, _, values, *_ in rows})
    rows.append(("time", ("time",), run.time, "s", "time"))
    variables = quantities(
        sorted(rows, key=lambda row: row[1] == (row[0],))
    )  # coordinates last, as xarray writes
    variables |= {name: Quantity((name,), np.array(names), {}) for name, names in labels.items()}
    return Quantities(variables, _attributes(run))


def _loads(run: Run, carriage_loads: Array) -> Iterator[QuantityRow]:
    of_carriages, of_rails = ("time", "carriage", "axis"), ("time", "rail", "axis")
    for part in ("total", "elastic", "damping"):
        loads = carriage_loads if part == "total" else run.carriage_loads(part)
        suffix, share = ("", "") if part == "total" else (f"_{part}", f"{part} part of the ")
        yield f"force{suffix}", of_carriages, loads[:, :, :3], "N", f"{share}load of the carriage"
        words = f"{share}moment about the carriage centre"
        yield f"moment{suffix}", of_carriages, loads[:, :, 3:], "N m", words
        load = run.link_loads(part)
        yield f"link_load{suffix}", ("time", "link"), load, "N", f"{share}load along the link"
    machine = run.machine
    if machine.has_rolled_rails:
        turned, (cosine, sine) = carriage_loads.copy(), machine.carriage_axes[:, 1, 1:].T
        for y, z in ((1, 2), (4, 5)):
            own_y, own_z = carriage_loads[:, :, y], carriage_loads[:, :, z]
            turned[:, :, y], turned[:, :, z] = cosine * own_y - sine * own_z, sine * own_y + cosine * own_z
        text = "of the carriage in the axes of the machine"
        yield "force_global", of_carriages, turned[:, :, :3], "N", f"load {text}"
        yield "moment_global", of_carriages, turned[:, :, 3:], "N m", f"moment {text}, about its centre"
    if run.straightness_loads is not None:
        words = "part of the load along the link that the motion of its foot adds"
        yield "foot_load", ("time", "link"), run.straightness_loads.loads("total", run.times), "N", words
    resultant, words = resultants(carriage_loads)[0], "resultant load of the carriage in y and z"
    yield "resultant", ("time", "carriage"), resultant, "N", words
    rails = run.rail_loads()
    yield "rail_force", of_rails, rails[:, :, :3], "N", "load of the rail"
    yield "rail_moment", of_rails, rails[:, :, 3:], "N m", "moment about the mean of its carriage centres"


def _reference_point(run: Run) -> Iterator[QuantityRow]:
    solution, dims = run.solution, ("time", "dof")
    yield "reaction", dims, solution.reaction(), LOAD_UNITS, "reaction of the held dofs; x: the drive force"
    yield "displacement", dims, solution.position(), POSITION_UNITS, "displacement of L, sag included"
    yield "velocity", dims, solution.velocity(), SPEED_UNITS, "velocity of L in the travelling frame"
    words = "acceleration of L in the travelling frame"
    yield "acceleration", dims, solution.acceleration(), ACCELERATION_UNITS, words


def _static(run: Run) -> Iterator[QuantityRow]:
    scene, loads = run.machine_at_start.scene, run.machine_at_start.static_carriage_loads
    yield "static_force", ("carriage", "axis"), loads[:, :3], "N", "static load of the carriage"
    yield "static_moment", ("carriage", "axis"), loads[:, 3:], "N m", "static moment of the carriage"
    yield "static_link_load", ("link",), scene.static_link_loads(), "N", "static load along the link"
    yield "static_reaction", ("dof",), scene.static_reaction(), LOAD_UNITS, "static reaction of the held dofs"
    yield "static_displacement", ("dof",), scene.static_position(), POSITION_UNITS, "static displacement of L"


def _motion(run: Run) -> Iterator[QuantityRow]:
    motion, inputs = run.motion, run.solution.inputs()
    yield "cart_acceleration", ("time", "axis"), inputs[:, :3], "m/s^2", "acceleration of the cart"
    if motion.wrench is not None:
        yield "wrench", ("time", "dof"), inputs[:, 3:], LOAD_UNITS, "external force and moment about L"
    if run.times is None:  # measured histories are not interpolated to other instants
        if motion.velocity is not None:
            yield "cart_velocity", ("time", "axis"), motion.velocity, "m/s", "velocity of the cart"
        if motion.position is not None:
            yield "cart_position", ("time", "axis"), motion.position, "m", "position of the cart"
        if motion.motor_speed is not None:
            yield "motor_speed", ("time",), motion.motor_speed, "rad/s", "measured speed of the motor"
    elif motion.time.size <= MOST_STORED:  # so that the audit of a stored result can solve the run again
        yield "motion_time", ("motion_time",), motion.time, "s", "samples of the motion"
        dims, text = ("motion_time", "axis"), "acceleration of the cart"
        yield "motion_acceleration", dims, motion.acceleration, "m/s^2", text
        if motion.wrench is not None:
            dims, text = ("motion_time", "dof"), "external force and moment about L"
            yield "motion_wrench", dims, motion.wrench, LOAD_UNITS, text


def _riders(run: Run) -> Iterator[QuantityRow]:
    if run.travel is None:
        return
    solution, dims, starts = run.solution, ("time", "rider"), [rider.position for rider in run.machine.riders]
    travel, speed, acceleration = np.ascontiguousarray(solution.rider_travel().transpose(2, 1, 0))
    relative = "of the rider relative to the main body"
    yield "rider_position", dims, travel + starts, "m", "travel of the rider"
    yield "rider_velocity", dims, speed, "m/s", f"speed {relative}"
    yield "rider_acceleration", dims, acceleration, "m/s^2", f"acceleration {relative}"
    yield "rider_force", dims, solution.rider_forces(), "N", "force of the rider's drive along its direction"
    text = "force and moment about L by which the riders' motion differs from riders at their start"
    yield "rider_wrench", ("time", "dof"), solution.rider_wrench(), LOAD_UNITS, text


def _attributes(run: Run) -> dict[str, str | float | int]:
    solution, bandwidth = run.solution, run.motion.usable_bandwidth
    more = "" if run.original_times is None else ", and more between them"
    jumps = int(np.count_nonzero(np.diff(run.motion.time) == 0.0))
    attributes: dict[str, str | float | int] = {
        "title": f"Loads of the linear guides of {run.machine.name}",
        "program": f"guideload {version('guideload')}",
        "machine": run.machine.model_dump_json(),
        "free": " ".join(run.machine.free),
        "method": run.method,
        "method_reason": run.reason,
        "rtol": run.rtol,
        "start": run.start if isinstance(run.start, str) else "state",
        "load_scale_N": solution.load_scale,
        "steps": solution.steps,
        "rejected_steps": solution.rejected,
        "contact_changes": solution.contact_changes,
        "instants": f"samples of the motion{more}" if run.times is None else "given",
        "motion_step_s": median_step(run.sample_times),
        "motion_samples": run.sample_times.size,
        "cart_step_s": median_step(run.motion.sample_times),
        "cart_samples": run.motion.sample_times.size,
        "motion_bandwidth_Hz": "unlimited" if np.isinf(bandwidth) else bandwidth,
        "motion_jumps": jumps if run.stretches is None else jumps + 1 - len(run.stretches.first),
        "motion_source": run.motion.source,
        "motion_notes": "\n".join(run.motion.notes),
        "motion_warnings": "\n".join(motion_texts(run.motion, run.machine)),
    }
    if run.stretches is not None:
        # When each stretch begins [s], and the payloads that are on the machine then.
        began = run.motion.time[list(run.stretches.first)].tolist()
        attributes["payload_changes"] = finite_json(list(zip(began, run.stretches.payloads, strict=True)))
    if run.step is not None:
        attributes["step_s"] = run.step
    return attributes
