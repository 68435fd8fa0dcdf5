"""Speed against error, guideload beside its peers: `python tests/benchmarks/chart.py`.

    --quick            every second setting, fewer rounds; all of it takes about 7 minutes
    --picture FILE     the chart

Six scenes (scenes.py): the yardstick's cart, linear, on its clean and on its noisy trace; with 5 um of
clearance, on both; overdamped; preloaded. On each, guideload by its public call `simulate(machine, motion,
method=..., rtol=...)` with `.carriage_loads`, and the peers (the package peers says how each is called) over
their tolerances or steps. All give the y and z load of each carriage at the 7062 samples (the exact method with
`times=motion.time`, which leaves out the look for vibration between them); guideload and the Numba propagator
give moments as well. Packages that are not installed are left out and named: `pip install
.[bench]`.

An error is the largest difference of any of these loads at any sample to the scene's truth, as a part of the
largest load, and as a part of the largest dynamic load (load minus static). The truth is computed anew
without guideload's core, and each scene says how, and how far a second way agrees. Exudyn's model is not ours
(finite rotations): its error is a check of the physics, not of its arithmetic.

All runs are in one process, on one thread. Each job is called once for its error and to compile, once timed;
those under 0.03 s then take turns with 3 calls in each of 9 rounds, those under 0.3 s with one in every third;
times are medians. Tighter settings are left out once a method has spent 2 s on a scene; a call that comes by
Python ends after 6 s. The Pareto front leaves out runs that have not seen the motion (half of the dynamic part
or more is wrong), and counts errors below 1e-12, which are rounding, as equal.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import harness
import numpy as np
from measure import FULL, MISSED, PULSE_TOLERANCES, QUICK, Measured, measure, pulse_errors, quickest
from peers.roster import roster
from picture import draw
from reference import cart
from scenes import at_rest_then_pulse, cases

PACKAGES = ("numba", "pydiffsol", "numbalsoda", "scikit-sundae", "diffrax", "jax", "exudyn")
ACCURACY = 1e-6


def main() -> None:
    """Measure all, print all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="every second setting, fewer rounds")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="where to write the chart")
    asked = parser.parse_args()
    silence_libraries()
    scenes = measure(cases(), QUICK if asked.quick else FULL)
    pulse = pulse_errors(at_rest_then_pulse())
    print_tables(scenes, pulse)
    made_on = harness.made_on(*PACKAGES)
    print(made_on)
    missing = sorted({peer.package for peer in roster(cart()) if not harness.installed(peer.package)})
    if missing:
        print(f"left out, not installed: {', '.join(missing)}")
    if asked.picture:
        draw(scenes, made_on, asked.picture)


def silence_libraries() -> None:
    """numbalsoda's Fortran remarks on stiffness on the standard output, in the middle of the tables."""
    sys.stdout = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def pulse_text(error: float) -> str:
    if not np.isfinite(error):
        return "failed"
    return "MISSED" if error >= MISSED else f"{error:.0e}"


def print_tables(scenes: list[Measured], pulse: dict[str, list[float]]) -> None:
    """Of each method and scene the time for ACCURACY, and the least error; who misses a pulse of 20 ms after rest."""
    names = dict.fromkeys(job.name for scene in scenes for job in scene.jobs)
    titles = [scene.case.title for scene in scenes]
    print(harness.heading(f"ms for a load error of at most {ACCURACY:.0e}", *titles))
    for name in names:
        best = [quickest(scene.of(name), ACCURACY) for scene in scenes]
        print(harness.row(name, *(f"{job.median * 1e3:.3g}" if job else "" for job in best)))
    print()
    print(harness.heading("least error of the load", *titles))
    for name in names:
        errors = [min((job.error for job in scene.of(name)), default=np.inf) for scene in scenes]
        print(harness.row(name, *(f"{error:.0e}" if np.isfinite(error) else "" for error in errors)))
    print()
    print(harness.heading("dynamic error at rtol", *(f"{rtol:.0e}" for rtol in PULSE_TOLERANCES)))
    for name, errors in pulse.items():
        cells = [pulse_text(error) for error in errors]
        print(harness.row(name, *cells, *[""] * (len(PULSE_TOLERANCES) - len(cells))))
    print()


if __name__ == "__main__":
    main()
