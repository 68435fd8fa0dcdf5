"""Made records in time of machines whose parameters are known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from machines import with_carriages

from guideload import Machine, Motion, PointOfInterest
from guideload.base.arrays import Array
from guideload.identification.motor_force import X
from guideload.identification.sensor_log import Channel
from guideload.identification.unknowns import UnknownTable
from guideload.sensitivity import RunDerivatives, VariedMachine
from guideload.smoothing import smooth

MASS, SEAL, VISCOUS, OFFSET = 95.0, 10.0, 200.0, -3.0
QUANTUM = 1e-6  # m, of an encoder
STILL = 300  # milliseconds at rest before the moves of a log


def moves(seconds: float = 6.0, step: float = 1e-3, seed: int = 0) -> Motion:
    """There and back with accelerations up to 3 m/s2 that change every 50 ms, from rest, with its velocity."""
    rng = np.random.default_rng(seed)
    corners = np.arange(0.0, seconds + 0.05, 0.05)
    jolts = rng.uniform(-1.0, 1.0, corners.size) + 2.0 * np.cos(2.0 * np.pi * corners / 1.5)
    jolts[0] = 0.0
    time = np.arange(round(seconds / step) + 1) * step
    acceleration = np.interp(time, corners, jolts)
    velocity = np.concatenate([[0.0], np.cumsum(0.5 * step * (acceleration[1:] + acceleration[:-1]))])
    drift = np.polyval(np.polyfit(time, velocity, 1), time)
    acceleration = acceleration - np.gradient(drift, time)
    velocity = np.concatenate([[0.0], np.cumsum(0.5 * step * (acceleration[1:] + acceleration[:-1]))])
    return Motion.along_x(time, acceleration, velocity=velocity)


def from_standstill(motion: Motion) -> Motion:
    """The motion after a third of a second at rest: a log that begins in vibration has a start that nobody knows."""
    still = np.zeros(STILL)
    acceleration, velocity = (np.append(still, one[:, 0]) for one in (motion.acceleration, motion.velocity))
    return Motion.along_x(1e-3 * np.arange(acceleration.size), acceleration, velocity=velocity)


def counted(motion: Motion, quantum: float = QUANTUM) -> Array:
    """(n,) m, the positions that an encoder shows."""
    velocity = motion.velocity[:, 0]
    position = np.concatenate([[0.0], np.cumsum(np.diff(motion.time) * 0.5 * (velocity[1:] + velocity[:-1]))])
    return np.asarray(quantum * np.round(position / quantum))


def seen(motion: Motion, quantum: float = QUANTUM, step: int = 1) -> Motion:
    """The motion as estimated from every `step`-th count of an encoder."""
    time = motion.time[::step]
    found = smooth(time, counted(motion, quantum)[::step], "position", quantum=quantum)
    return Motion.along_x(
        time, found.acceleration, velocity=found.velocity, uncertainty=found.uncertainty, recorded=True
    )


def axis(**others: object) -> Machine:
    """A slide of 95 kg on two carriages, its centre of mass above them, with friction."""
    carriage = {"rail": "1", "length": 0.1, "width": 0.06, "stiffness_y": 1e8, "stiffness_z": 8e7}
    damping = {"damping_y": 1e4, "damping_z": 1e4}
    keys = {
        "rails": [{"name": "1", "position": [0.0, 0.0]}],
        "body": {
            "mass": MASS,
            "center_of_mass": [0.0, 0.15, 0.02],
            "inertia": np.diag([2.0, 4.0, 4.0]).tolist(),
        },
        "carriages": [{"name": n, "x": x, **carriage, **damping} for n, x in (("a", -0.1), ("b", 0.1))],
        "friction": {"seal": SEAL, "viscous": VISCOUS},
    }
    return Machine(**{**keys, **others})


TOOL = PointOfInterest(name="tool", at=(0.05, 0.4, 0.1))
SOFT_TABLES = (
    UnknownTable(path="carriages.*.stiffness_y"),
    UnknownTable(path=("carriages.*.damping_y", "carriages.*.damping_z"), name="damping"),
)


def soft_axis(stiffness: float = 1.0, damping: float = 1.0, **others: object) -> Machine:
    """The axis on soft carriages, with modes from 13 to 60 Hz; factors on stiffness along y and on damping."""
    machine = axis(points=[TOOL], **others)
    values = {"stiffness_y": 1e7 * stiffness, "stiffness_z": 8e6}
    values |= dict.fromkeys(("damping_y", "damping_z"), 1e3 * damping)
    return with_carriages(machine, **values)


def force_of(machine: Machine, motion: Motion, time: Array) -> Array:
    """(n,) N that moves the axis at these times, without offset."""
    reaction = _run(machine, motion).at(time).history("reaction", np.eye(6)[X]).values
    velocity = np.interp(time, motion.time, motion.velocity[:, 0])
    return reaction + 2.0 * SEAL * np.sign(velocity) + VISCOUS * velocity


def shown_by(machine: Machine, motion: Motion, channels: Sequence[Channel], time: Array) -> Array:
    """(n, k) what sensors show at these times."""
    run = _run(machine, motion)
    at = run.at(time)
    return np.array([one.shown(at, run.at_rest).values for one in channels]).T


def _run(machine: Machine, motion: Motion) -> RunDerivatives:
    return VariedMachine(machine, ["body.mass"]).run(motion)
