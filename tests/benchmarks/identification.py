"""Coverage of the 95 % intervals of an identification: share of seeds in which they hold the true value.

    python tests/benchmarks/identification.py [--seeds 200] [NAME ...]

Each case draws a machine, makes measurements of it with noise, and identifies it. Numbers that are not
identified do not count. Expected: 93 to 97 %; "+-" is the binomial standard error of the share. The last columns:
share of identified numbers, and processor time.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from hammer_tests import hammer_test, unknown, with_corners
from harness import print_table, share
from reference import cart, preloaded

from guideload import Machine
from guideload.identification.measured import Measured
from guideload.identification.model import Model, parse_place
from guideload.identification.responses import Deflection, Deflections, FrequencyResponses, ResponseCurve
from guideload.identification.result import identify
from guideload.identification.unknowns import UnknownTable

SCATTER = 0.3  # of the logarithm of the true values about the machine file's
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
PRELOADED = (
    UnknownTable(path="carriages.*.preload", name="preload"),
    UnknownTable(path="carriages.*.stiffness_y"),
    UnknownTable(path="carriages.*.stiffness_z"),
    DAMPING,
)

Maker = Callable[[Model, np.ndarray, np.random.Generator], Measured]


def modal(
    model: Model, truth: np.ndarray, rng: np.random.Generator, *, shapes: bool = True, known: bool = True
) -> Measured:
    levels = (0.01, 0.05, 0.02)
    noise = levels if known else (0.005, 0.1, 0.03)
    return hammer_test(model, truth, rng, shapes=shapes, noise=noise, levels=levels, known=known)


def responses(model: Model, truth: np.ndarray, rng: np.random.Generator, *, known: bool = True) -> Measured:
    hertz, level, curves = np.linspace(10.0, 200.0, 40), 0.05, []
    for force in ("p0 y", "p4 z"):
        for place in ("p1 y", "p3 y", "p2 z"):
            empty = np.zeros(hertz.size, dtype=np.complex128)
            curve = ResponseCurve(
                parse_place(force, model.machine), parse_place(place, model.machine), 2, hertz, empty
            )
            value = curve.computed(model.at(truth))[0]
            noise = rng.standard_normal((hertz.size, 2)) @ [1.0, 1.0j]
            curves.append(ResponseCurve(curve.force, curve.place, 2, hertz, value * (1.0 + level * noise)))
    return FrequencyResponses("responses", tuple(curves), level if known else 0.02, 1e-6, known)


def deflections(model: Model, truth: np.ndarray, rng: np.random.Generator) -> Measured:
    pairs = [
        (a, b) for a in ("p0 y", "p3 y", "p2 z") for b in ("p0 y", "p1 y", "p2 y", "p3 y", "p2 z", "p3 z")
    ]
    values = [
        Deflection(parse_place(a, model.machine), 1e3, parse_place(b, model.machine), 0.0) for a, b in pairs
    ]
    still = Deflections("static", tuple(values), 1e-7, True)
    moved = still.computed(model.at(truth))[0]
    level = 0.02 * float(abs(moved).max())
    noisy = moved + level * rng.standard_normal(moved.size)
    made = [
        Deflection(one.force_at, one.force, one.at, float(x)) for one, x in zip(values, noisy, strict=True)
    ]
    return Deflections("static", tuple(made), level, True)


CASES: dict[str, tuple[Machine, tuple[UnknownTable, ...], Maker]] = {
    "modal test, shapes": (cart(), BY_CARRIAGE, modal),
    "modal test, noise estimated": (cart(), BY_CARRIAGE, lambda *a: modal(*a, known=False)),
    "modal test, frequencies only": (cart(), BY_AXIS, lambda *a: modal(*a, shapes=False)),
    "modal test, preloaded": (preloaded(), PRELOADED, modal),
    "modal test, play": (cart(clearance_y=5e-6), BY_AXIS, modal),
    "frequency responses": (cart(), BY_CARRIAGE, responses),
    "frequency responses, noise estimated": (cart(), BY_CARRIAGE, lambda *a: responses(*a, known=False)),
    "static deflections": (cart(), BY_CARRIAGE[:2], deflections),
}


def coverage(name: str, seeds: int) -> str:
    """A row of the table: share of intervals that hold the truth, share identified, seconds."""
    machine, tables, make = CASES[name]
    machine = with_corners(machine)
    unknowns = unknown(machine, *tables)
    inside, identified, seconds = [], [], []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        truth = SCATTER * rng.standard_normal(len(unknowns))
        data = make(Model(machine, unknowns), truth, rng)
        started = time.process_time()
        found = identify(machine, tables, [data])
        seconds.append(time.process_time() - started)
        for reach, z in zip(found.intervals, truth, strict=True):
            identified.append(reach.is_identified)
            if reach.is_identified:
                inside.append(reach.low <= z <= reach.high)
    found_share = f"{100 * np.mean(identified):.0f} %"
    return f"| {name} | {seeds} | {share(inside)} | {found_share} | {np.median(seconds):.2f} s |"


if __name__ == "__main__":
    print_table(str(__doc__), "case | seeds | true value inside | identified | time of one", CASES, coverage)
