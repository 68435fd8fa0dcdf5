"""Coverage of the 95 % intervals of an identification: share of seeds in which they hold the true value.

    python tests/benchmarks/identification.py [--seeds 200] [NAME ...]

Each seed draws a machine, makes measurements of it with noise, and identifies it. Numbers that are not identified do
not count. Expected: 93 to 97 %; "+-" is the binomial standard error of the share. Records in time have unknowns of
their own beside those of the machine: friction, offset, delay. "Measured trace": the motion is estimated from encoder
counts; "correlated": the force has an unmodelled part that changes over 0.1 s, as of friction. The last column is time
of the processor.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product

import harness
import numpy as np
from hammer_tests import deflections, hammer_test, response_curves, unknown, with_corners
from motor_records import OFFSET, SEAL, VISCOUS, axis, from_standstill, moves, seen, soft_axis
from reference import cart, preloaded
from scipy.signal import lfilter

from guideload import Machine
from guideload.identification.measured import Measured
from guideload.identification.model import Excitation, Model, parse_load_place, parse_place
from guideload.identification.motor_force import MotorForce, X
from guideload.identification.responses import FrequencyResponses
from guideload.identification.result import identify
from guideload.identification.sensor_log import Channel, SensorLog
from guideload.identification.unknowns import UnknownTable

DAMPING = UnknownTable(path=("carriages.*.damping_y", "carriages.*.damping_z"), name="damping")
BY_CARRIAGE = (
    UnknownTable(path="carriages.*.stiffness_y", each="carriage"),
    UnknownTable(path="carriages.*.stiffness_z", each="carriage"),
    DAMPING,
)
BY_AXIS = (
    UnknownTable(path="carriages.*.stiffness_y"),
    UnknownTable(path="carriages.*.stiffness_z"),
    DAMPING,
)
PRELOADED = (UnknownTable(path="carriages.*.preload", name="preload"), *BY_AXIS)
MASS = (UnknownTable(path="body.mass"),)

Array = np.ndarray
Truths = dict[str, float]  # by the name of an own unknown of the data
# Measurements of a model whose unknowns have these values, by a generator that the seed began.
Maker = Callable[[Model, Array, np.random.Generator, int], tuple[Measured, Truths]]


@dataclass(frozen=True)
class Case:
    """A row of the table; scatter: of the logarithm of the true values about the machine file's."""

    machine: Machine
    unknowns: tuple[UnknownTable, ...]
    make: Maker
    scatter: float


# ---- measurements of vibration and of deflections at rest


def modal(
    model: Model,
    truth: Array,
    rng: np.random.Generator,
    seed: int,
    *,
    shapes: bool = True,
    known: bool = True,
) -> tuple[Measured, Truths]:
    levels = (0.01, 0.05, 0.02)
    noise = levels if known else (0.005, 0.1, 0.03)
    return hammer_test(model, truth, rng, shapes=shapes, noise=noise, levels=levels, known=known), {}


def responses(
    model: Model, truth: Array, rng: np.random.Generator, seed: int, *, known: bool = True
) -> tuple[Measured, Truths]:
    """With noise of 5 %, which is known; or of 1 %, of which nothing is known."""
    level = 0.05 if known else 0.01
    curves = response_curves(model, truth, np.linspace(10.0, 200.0, 40), level, rng)
    stated = (level, 1e-6) if known else (0.05, 0.005)  # the latter where an identify file has neither
    return FrequencyResponses("responses", curves, *stated, known, known), {}


def at_rest(model: Model, truth: Array, rng: np.random.Generator, seed: int) -> tuple[Measured, Truths]:
    forces, places = ("p0 y", "p3 y", "p2 z"), ("p0 y", "p1 y", "p2 y", "p3 y", "p2 z", "p3 z")
    return deflections(model, truth, list(product(forces, places)), 0.02, rng), {}


# ---- records in time

DELAY = 4.2  # s, between the clocks of two loggers
MEMORY = 0.99  # of a disturbance from one millisecond to the next: 0.1 s


def motor_force(
    model: Model,
    truth: Array,
    rng: np.random.Generator,
    seed: int,
    *,
    seconds: float = 3.0,
    measured: bool = False,
    correlated: bool = False,
) -> tuple[Measured, Truths]:
    machine, motion = model.machine, moves(seconds, seed=seed)
    run, velocity = model.at(truth).run(Excitation.of(machine, motion)), motion.velocity[:, 0]
    force = run.at(motion.time).history("reaction", np.eye(6)[X]).values + OFFSET
    force += 2.0 * SEAL * np.sign(velocity) + VISCOUS * velocity + 2.0 * rng.standard_normal(force.size)
    if correlated:
        white = rng.standard_normal(force.size + 1000)
        force += 3.0 * np.sqrt(1.0 - MEMORY**2) * lfilter([1.0], [1.0, -MEMORY], white)[1000:]
    data = MotorForce.of(machine, seen(motion) if measured else motion, motion.time, force)
    truths = {"friction.seal in motor force": SEAL, "friction.viscous in motor force": VISCOUS}
    return data, truths | {"offset of motor force": OFFSET}


def sensors(
    model: Model,
    truth: Array,
    rng: np.random.Generator,
    seed: int,
    *,
    measured: bool = False,
    cells: bool = False,
) -> tuple[Measured, Truths]:
    """Accelerometers; with cells one along x, a calibrated cell and a strain gauge in place of the others."""
    machine, motion = model.machine, from_standstill(moves(3.0, seed=seed))
    channels = [Channel(parse_place(f"tool {i}", machine), gain_spread=0.02 * (i == "y")) for i in "xyz"]
    if cells:
        loads = [parse_load_place(text, machine) for text in ("a Fy", "b Fz")]
        channels[1:] = [Channel(loads[0], "load"), Channel(loads[1], "load", gain_spread=np.inf)]
    time = np.arange(0.2, motion.time[-1] - 0.2, 1.0 / 900.0)
    true = model.at(truth)
    at = true.run(Excitation.of(machine, motion)).at(time)
    shown = np.array([one.shown(at, true.rest).values for one in channels]).T
    shown = shown + 0.1 * shown.std(axis=0) * rng.standard_normal(shown.shape)
    motion = seen(motion) if measured else motion
    return SensorLog.of(machine, motion, channels, time + DELAY, shown), {"delay of sensor log": DELAY}


# ---- the table

CART, SOFT = with_corners(cart()), soft_axis()
CASES = {
    "modal test, shapes": Case(CART, BY_CARRIAGE, modal, 0.3),
    "modal test, noise estimated": Case(CART, BY_CARRIAGE, partial(modal, known=False), 0.3),
    "modal test, frequencies only": Case(CART, BY_AXIS, partial(modal, shapes=False), 0.3),
    "modal test, preloaded": Case(with_corners(preloaded()), PRELOADED, modal, 0.3),
    "modal test, play": Case(with_corners(cart(clearance_y=5e-6)), BY_AXIS, modal, 0.3),
    "frequency responses": Case(CART, BY_CARRIAGE, responses, 0.3),
    "frequency responses, noise estimated": Case(CART, BY_CARRIAGE, partial(responses, known=False), 0.3),
    "static deflections": Case(CART, BY_CARRIAGE[:2], at_rest, 0.3),
    "motor force": Case(axis(), MASS, motor_force, 0.2),
    "motor force, correlated": Case(axis(), MASS, partial(motor_force, seconds=12.0, correlated=True), 0.2),
    "motor force, measured trace": Case(axis(), MASS, partial(motor_force, measured=True), 0.2),
    "accelerometers": Case(SOFT, BY_AXIS, sensors, 0.2),
    "accelerometers, measured trace": Case(SOFT, BY_AXIS, partial(sensors, measured=True), 0.2),
    "load cell and strain gauge": Case(SOFT, BY_AXIS, partial(sensors, cells=True), 0.2),
    "cell and gauge, measured trace": Case(SOFT, BY_AXIS, partial(sensors, measured=True, cells=True), 0.2),
}


def coverage(name: str, seeds: int) -> str:
    """A row of the table."""
    case = CASES[name]
    unknowns = unknown(case.machine, *case.unknowns)
    inside: list[bool] = []
    of_data: list[bool] = []
    seconds = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        truth = case.scatter * rng.standard_normal(len(unknowns))
        data, truths = case.make(Model(case.machine, unknowns), truth, rng, seed)
        started = time.process_time()
        found = identify(case.machine, case.unknowns, [data])
        seconds.append(time.process_time() - started)
        intervals = zip(found.intervals, truth, strict=True)
        inside += [one.low <= z <= one.high for one, z in intervals if one.is_identified]
        estimates = {one.parameter.name: one for one in found.nuisance_estimates(found.data[0])}
        of_data += [estimates[key].low <= value <= estimates[key].high for key, value in truths.items()]
    identified = f"{100 * len(inside) / (seeds * len(unknowns)):.0f} %"
    median = f"{np.median(seconds):.2f} s"
    return harness.row(name, str(seeds), share(inside), identified, share(of_data), median)


def share(inside: list[bool]) -> str:
    """The share of intervals that hold the true value, its binomial standard error, and the number of intervals."""
    if not inside:
        return ""
    mean = float(np.mean(inside))
    error = np.sqrt(mean * (1.0 - mean) / len(inside))
    return f"{100 * mean:.1f} +- {100 * error:.1f} % of {len(inside)}"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("names", nargs="*", help=f"cases: {', '.join(CASES)}")
    asked = parser.parse_args()
    cells = "case", "seeds", "true value inside", "identified", "friction, offset, delay", "time of one"
    print(harness.heading(*cells, words=6))
    for name in asked.names or CASES:
        print(coverage(name, asked.seeds), flush=True)


if __name__ == "__main__":
    main()
