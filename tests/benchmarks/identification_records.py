"""Coverage of the 95 % intervals of an identification from records in time: motor force and accelerometers.

    python tests/benchmarks/identification_records.py [--seeds 200] [NAME ...]

As tests/benchmarks/identification.py: each seed draws a machine, a motion and noise. "measured trace": the motion is
estimated from encoder counts; "correlated": the force has an unmodelled part that changes over 0.1 s, as of friction.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from hammer_tests import unknown
from harness import print_table, share
from motor_records import OFFSET, SEAL, VISCOUS, axis, moves

from guideload import Machine, Motion, PointOfInterest
from guideload.identification.measured import Measured
from guideload.identification.model import Excitation, Model, ModelAt, parse_load_place, parse_place
from guideload.identification.motor_force import MotorForce, X
from guideload.identification.result import identify
from guideload.identification.sensor_log import Channel, SensorLog
from guideload.identification.unknowns import UnknownTable
from guideload.smoothing import smooth

SCATTER = 0.2  # of the logarithm of the true values about the machine file's
QUANTUM = 1e-6  # m, of the encoder
STILL = 300  # milliseconds at rest before the moves of a log
DELAY = 4.2  # s, between the clocks of two loggers
MEMORY = 0.99  # of a disturbance from one millisecond to the next: 0.1 s
MASS = (UnknownTable(path="body.mass"),)
STIFFNESS = (
    UnknownTable(path="carriages.*.stiffness_y"),
    UnknownTable(path="carriages.*.stiffness_z"),
    UnknownTable(path=("carriages.*.damping_y", "carriages.*.damping_z"), name="damping"),
)
Truths = dict[str, float]  # by the name of an own unknown


def soft() -> Machine:
    """The axis on soft carriages: modes from 13 to 60 Hz."""
    machine = axis(points=[PointOfInterest(name="tool", at=(0.05, 0.4, 0.1))])
    values = {"stiffness_y": 1e7, "stiffness_z": 8e6, "damping_y": 1e3, "damping_z": 1e3}
    return machine.model_copy(
        update={"carriages": tuple(one.model_copy(update=values) for one in machine.carriages)}
    )


def seen(motion: Motion) -> Motion:
    """The motion as estimated from the counts of an encoder."""
    velocity = motion.velocity[:, 0]
    position = np.concatenate([[0.0], np.cumsum(np.diff(motion.time) * 0.5 * (velocity[1:] + velocity[:-1]))])
    found = smooth(motion.time, QUANTUM * np.round(position / QUANTUM), "position", quantum=QUANTUM)
    return Motion.along_x(
        motion.time, found.acceleration, velocity=found.velocity, uncertainty=found.uncertainty, recorded=True
    )


def motor_force(
    true: ModelAt,
    motion: Motion,
    rng: np.random.Generator,
    *,
    measured: bool = False,
    correlated: bool = False,
) -> tuple[Measured, Truths]:
    run, velocity = true.run(Excitation.of(true.machine, motion)), motion.velocity[:, 0]
    force = run.at(motion.time).history("reaction", np.eye(6)[X]).values + OFFSET
    force += 2.0 * SEAL * np.sign(velocity) + VISCOUS * velocity + 2.0 * rng.standard_normal(force.size)
    if correlated:
        white = rng.standard_normal(force.size + 1000)
        force += 3.0 * np.sqrt(1.0 - MEMORY**2) * lfilter([1.0], [1.0, -MEMORY], white)[1000:]
    data = MotorForce.of(true.machine, seen(motion) if measured else motion, motion.time, force)
    truths = {"friction.seal in motor force": SEAL, "friction.viscous in motor force": VISCOUS}
    return data, truths | {"offset of motor force": OFFSET}


def from_standstill(motion: Motion) -> Motion:
    """The motion after a third of a second at rest: a log that begins in vibration has a start that nobody knows."""
    still = np.zeros(STILL)
    acceleration, velocity = (np.append(still, one[:, 0]) for one in (motion.acceleration, motion.velocity))
    return Motion.along_x(1e-3 * np.arange(acceleration.size), acceleration, velocity=velocity)


def sensors(
    true: ModelAt, motion: Motion, rng: np.random.Generator, *, measured: bool = False, cells: bool = False
) -> tuple[Measured, Truths]:
    """Accelerometers; with cells one along x, a calibrated cell and a strain gauge in place of the others."""
    motion = from_standstill(motion)
    channels = [Channel(parse_place(f"tool {i}", true.machine), gain_spread=0.02 * (i == "y")) for i in "xyz"]
    if cells:
        loads = [parse_load_place(text, true.machine) for text in ("a Fy", "b Fz")]
        channels[1:] = [Channel(loads[0], "load"), Channel(loads[1], "load", gain_spread=np.inf)]
    time = np.arange(0.2, motion.time[-1] - 0.2, 1.0 / 900.0)
    at = true.run(Excitation.of(true.machine, motion)).at(time)
    shown = np.array([one.shown(at, true.rest).values for one in channels]).T
    shown = shown + 0.1 * shown.std(axis=0) * rng.standard_normal(shown.shape)
    motion = seen(motion) if measured else motion
    data = SensorLog.of(true.machine, motion, channels, time + DELAY, shown)
    return data, {"delay of sensor log": DELAY}


Maker = Callable[[ModelAt, Motion, np.random.Generator], tuple[Measured, Truths]]
# Machine, unknowns, seconds of the record, and how it is made.
CASES: dict[str, tuple[Machine, tuple[UnknownTable, ...], float, Maker]] = {
    "motor force": (axis(), MASS, 3.0, motor_force),
    "motor force, correlated": (axis(), MASS, 12.0, lambda *a: motor_force(*a, correlated=True)),
    "motor force, measured trace": (axis(), MASS, 3.0, lambda *a: motor_force(*a, measured=True)),
    "accelerometers": (soft(), STIFFNESS, 3.0, sensors),
    "accelerometers, measured trace": (soft(), STIFFNESS, 3.0, lambda *a: sensors(*a, measured=True)),
    "load cell and strain gauge": (soft(), STIFFNESS, 3.0, lambda *a: sensors(*a, cells=True)),
    "cell and gauge, measured trace": (
        soft(),
        STIFFNESS,
        3.0,
        lambda *a: sensors(*a, measured=True, cells=True),
    ),
}


def coverage(name: str, seeds: int) -> str:
    """A row of the table: share of intervals that hold the truth, of the machine and of the data."""
    machine, tables, length, make = CASES[name]
    unknowns = unknown(machine, *tables)
    inside: list[bool] = []
    nuisance: list[bool] = []
    seconds = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        truth = SCATTER * rng.standard_normal(len(unknowns))
        data, truths = make(Model(machine, unknowns).at(truth), moves(length, seed=seed), rng)
        started = time.process_time()
        found = identify(machine, tables, [data])
        seconds.append(time.process_time() - started)
        inside += [reach.low <= z <= reach.high for reach, z in zip(found.intervals, truth, strict=True)]
        estimates = {one.parameter.name: one for one in found.nuisance_estimates(found.data[0])}
        nuisance += [estimates[key].low <= value <= estimates[key].high for key, value in truths.items()]
    return f"| {name} | {seeds} | {share(inside)} | {share(nuisance)} | {np.median(seconds):.2f} s |"


if __name__ == "__main__":
    columns = "case | seeds | numbers of the machine | friction, offset, delay | time of one"
    print_table(str(__doc__), columns, CASES, coverage)
