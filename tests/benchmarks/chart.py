"""Speed against error, guideload beside its peers: `python tests/benchmarks/chart.py`.

    --quick            every second setting, fewer rounds; all of it takes about 7 minutes
    --picture FILE     the chart

Six scenes (scenes.py): the yardstick's cart, linear, on its clean and on its noisy trace; with 5 um of
clearance, on both; overdamped; preloaded. On each, guideload by its public call `simulate(machine, motion,
method=..., rtol=...)` with `.carriage_loads`, and the peers (the package peers says how each is called) over
their tolerances or steps. All give the y and z load of each carriage at the 7062 samples; guideload and the
Numba propagator give moments as well. Packages that are not installed are left out and named: `pip install
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

import os

# One thread each; read when NumPy and the others are imported.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"
os.environ["VECLIB_MAXIMUM_THREADS"] = "1"
os.environ["RAYON_NUM_THREADS"] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

import argparse
import platform
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from harness import processor, row
from measure import FULL, MISSED, PULSE_TOLERANCES, QUICK, Job, Measured, measure, pulse_errors, quickest
from peers.roster import installed, roster
from picture import draw
from reference import cart
from scenes import at_rest_then_pulse, cases

PACKAGES = ("numpy", "scipy", "numba", "pydiffsol", "numbalsoda", "scikit-sundae", "diffrax", "jax", "exudyn")
IMPORTED_AS = {"scikit-sundae": "sksundae"}
ACCURACIES = (1e-3, 1e-6, 1e-9)


def main() -> None:
    """Measure all, print all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="every second setting, fewer rounds")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="where to write the chart")
    asked = parser.parse_args()
    silence_libraries()
    scenes = measure(cases(), QUICK if asked.quick else FULL)
    pulse = pulse_errors(at_rest_then_pulse())
    for scene in scenes:
        print_scene(scene)
    print_markdown(scenes, pulse)
    print(made_on())
    missing = sorted({peer.package for peer in roster(cart()) if not installed(peer.package)})
    if missing:
        print(f"left out, not installed: {', '.join(missing)}")
    if asked.picture:
        draw(scenes, made_on(), asked.picture)


def silence_libraries() -> None:
    """numbalsoda's Fortran remarks on stiffness on the standard output, in the middle of the tables."""
    sys.stdout = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def made_on() -> str:
    """Machine and versions."""
    found = [name for name in PACKAGES if installed(IMPORTED_AS.get(name, name))]
    versions = ", ".join(f"{name} {version(name)}" for name in found)
    return f"One thread of {processor()}; Python {platform.python_version()}, {versions}."


def print_scene(scene: Measured) -> None:
    """A line per job, quick before slow."""
    print(f"{scene.case.title}\ntruth: {scene.case.truth.how}")
    print(f"{'':30}{'':14}{'ms':>11}{'error':>10}{'dynamic':>10}  front")
    for job in sorted(scene.done, key=lambda job: job.median):
        cells = f"{job.median * 1e3:>11.3f}{job.error:>10.1e}{job.dynamic:>10.1e}"
        print(f"{job.name:30}{job.setting:14}{cells}  {'yes' if job.pareto_optimal else 'no'}")
    for job in scene.jobs:
        if not np.isfinite(job.error):
            print(f"{job.name:30}{job.setting:14}{'failed: ' + job.failure}")
    print()


def pulse_text(error: float) -> str:
    if not np.isfinite(error):
        return "failed"
    return "MISSED" if error >= MISSED else f"{error:.0e}"


def print_markdown(scenes: list[Measured], pulse: dict[str, list[float]]) -> None:
    """The time that each needs for an accuracy, per scene; then who misses a pulse of 20 ms after rest."""
    for scene in scenes:
        print(f"**{scene.case.title}** (truth: {scene.case.truth.how})\n")
        print(row("ms for a load error of at most", *(f"{error:.0e}" for error in ACCURACIES)))
        print(row("---", *("---:" for _ in ACCURACIES)))
        by_name: dict[str, list[Job]] = {}
        for job in scene.valid:
            by_name.setdefault(job.name, []).append(job)
        for name, jobs in by_name.items():
            best = [quickest(jobs, error) for error in ACCURACIES]
            if any(best):
                print(row(name, *(f"{job.median * 1e3:.3g}" if job else "" for job in best)))
        print()
    print(row("dynamic error at rtol", *(f"{rtol:.0e}" for rtol in PULSE_TOLERANCES)))
    print(row("---", *("---:" for _ in PULSE_TOLERANCES)))
    for name, errors in pulse.items():
        cells = [pulse_text(error) for error in errors]
        print(row(name, *cells, *[""] * (len(PULSE_TOLERANCES) - len(cells))))
    print()


if __name__ == "__main__":
    main()
