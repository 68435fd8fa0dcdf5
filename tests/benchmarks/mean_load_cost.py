"""What mean loads cost in a batch, beside peaks: `python tests/benchmarks/mean_load_cost.py`.

    --quick           fewer runs
    --cases WORD      only the cases whose name contains that word

The yardstick's cart and its draws (mass, centre of mass, stiffness and damping of each carriage), run by the core's
`Batch` on one thread held on one core. "peaks" are the least and the largest y and z load of the four carriages at the
samples, "means" their mean loads over the distance by the rule |Fy| + |Fz|, "both" both. Times are of the processor.
All jobs of a case take turns, and a ratio is the median of the ratios of the turns.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from clock import on_cores, processor
from reference import cart, cart_clear, core_batch, cycle, noisy, preloaded

from guideload import Machine, Motion
from guideload._core import Batch

Array = NDArray[np.float64]

ASKED = 1.3  # times the cost of peaks
PEAKS = [(load, i, end) for i in range(4) for load in ("Fy", "Fz") for end in ("min", "max")]
MEANS = [("load", i, "mean") for i in range(4)]
JOBS = {"peaks": PEAKS, "means": MEANS, "both": PEAKS + MEANS}
AT_REST = 1e-12  # m/s, below: rounding of the sum of all changes of the speed
ROUNDS, QUICK_ROUNDS = 15, 5


def main() -> None:
    """Measure all, print all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer runs")
    parser.add_argument(
        "--cases", default="", metavar="WORD", help="only the cases whose name contains that word"
    )
    asked = parser.parse_args()
    on_cores(1)
    print(f"{'us per scene':34}{'peaks':>8}{'means':>8}{'both':>8}{'means/peaks':>13}{'both/peaks':>12}")
    for name, machine, motion, exponent, scenes in cases():
        if asked.cases in name:
            measured(name, machine, motion, exponent, scenes, QUICK_ROUNDS if asked.quick else ROUNDS)
    print(f"Asked of means/peaks: <= {ASKED:g}. One thread of {processor()}.")


def cases() -> list[tuple[str, Machine, Motion, float, int]]:
    """Name, machine, motion, exponent, number of scenes."""
    ball, roller = 3.0, 10.0 / 3.0
    return [
        ("linear", cart(), cycle(), ball, 2048),
        ("linear, exponent 10/3", cart(), cycle(), roller, 2048),
        ("linear, noisy", cart(), noisy(), ball, 2048),
        ("linear, noisy, exponent 10/3", cart(), noisy(), roller, 2048),
        ("clearance", cart_clear(), cycle(), ball, 64),
        ("clearance, noisy", cart_clear(), noisy(), ball, 64),
        ("preloaded", preloaded(), cycle(), ball, 32),
    ]


def measured(name: str, machine: Machine, motion: Motion, exponent: float, scenes: int, rounds: int) -> None:
    """Time the jobs of a case by turns, and print them."""
    values = draws(machine, scenes)
    batches = {job: batch(machine, motion, exponent, measures) for job, measures in JOBS.items()}
    times: dict[str, list[float]] = {job: [] for job in JOBS}
    for turn in range(rounds + 1):
        for job, one in batches.items():
            start = time.process_time()
            one.run(values, 1)
            if turn:  # the first one is to warm up
                times[job].append(time.process_time() - start)
    microseconds = [statistics.median(of) / scenes * 1e6 for of in times.values()]
    means, both = (
        statistics.median(t / peaks for t, peaks in zip(times[job], times["peaks"], strict=True))
        for job in ("means", "both")
    )
    print(f"{name:34}{''.join(f'{of:8.1f}' for of in microseconds)}{means:13.2f}{both:12.2f}")


def draws(machine: Machine, count: int) -> Array:
    """(count, 12) mass, centre of mass, factors of stiffness and of damping of each carriage."""
    rng, body = np.random.default_rng(1), machine.body
    mass = body.mass * rng.uniform(0.9, 1.1, (count, 1))
    center = np.array(body.center_of_mass) + rng.uniform(-0.05, 0.05, (count, 3))
    return np.hstack([mass, center, np.exp(rng.normal(0.0, 0.2, (count, 8)))])


def batch(machine: Machine, motion: Motion, exponent: float, measures: list[tuple[str, int, str]]) -> Batch:
    """The machine with scattered parameters on a motion along x."""
    instants, along = motion.time, motion.acceleration[:, 0]
    speed = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(instants) * (along[1:] + along[:-1]))])
    speed[np.abs(speed) < AT_REST] = 0.0
    of = [carriage for carriage, links in enumerate(machine.links_of_carriages) for _ in links]
    return core_batch(
        machine,
        time=instants,
        acceleration=motion.acceleration,
        wrench=None,
        speed=speed,
        exponent=exponent,
        changes=[
            (("mass", 0, 0), 0.0, [(0, 1.0)]),
            *((("center_of_mass", axis, 0), 0.0, [(1 + axis, 1.0)]) for axis in range(3)),
            *((("law", link, "scale"), 0.0, [(4 + carriage, 1.0)]) for link, carriage in enumerate(of)),
            *((("damping", link, 0), 0.0, [(8 + carriage, 5e4)]) for link, carriage in enumerate(of)),
        ],
        measures=measures,
        method="auto",
        rtol=1e-6,
    )


if __name__ == "__main__":
    main()
