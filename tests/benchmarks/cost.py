"""What a run costs and how right it is, beside what others take for the same job: `python tests/benchmarks/cost.py`.

Four carriages, 16 links, 5 free dofs, 7062 samples at 1 kHz: the yardstick's `cart` on `cycle` (clean) and `noisy`
(the same with 0.1 m/s2 rms of white noise, a kink at every sample). guideload is timed by its public calls:
`simulate(machine, motion, method=...)` with `.carriage_loads`, which holds force and moment of every carriage (24
histories), and `peak_loads`. The peers (see peers.py) give the 8 histories of force along y and z, all but the one
written by hand in Numba, which gives all 24. numba and pydiffsol are left out where they are not installed.

All take turns in one process on one thread, after a first call each; times are medians. Calls under 0.1 s are timed
5 times a turn in 15 turns, others once in 3. An error is the largest difference of any carriage's y or z force to
method "exact", over the largest such force: with the static part, and without it (dynamic). "exact" itself is held
against lsim with matrices assembled anew in NumPy, so the two lines show the same figure. Of the peaks, the
difference is that to the extremes of the history.

Then fresh processes: `import guideload` (names are imported when first used, so the names a script needs are timed
too), and the whole of `guideload run --no-pictures` on 25 s of 1 kHz cart velocity.
"""

from __future__ import annotations

import os

for _library in ("OPENBLAS", "OMP", "MKL", "RAYON", "NUMBA"):  # read when NumPy and the others are imported
    os.environ[f"{_library}_NUM_THREADS"] = "1"
os.environ["VECLIB_MAXIMUM_THREADS"] = "1"

import gc
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from peers import RTOL, Array, Problem, peers, problem
from reference import cart, cycle, noisy

from guideload import Machine, Motion, peak_loads, simulate

TURNS, CALLS = 15, 5
SLOW = 0.1  # s, a call from which on it is timed once in every fifth turn
EXACT = "guideload exact"
LSIM = "scipy.signal.lsim"
RK45 = ("solve_ivp RK45", "solve_ivp RK45, max_step 1 ms")

# What issue 2 asks: seconds, or ratio of noisy to clean.
LIMITS = {EXACT: 0.4e-3, "guideload rk45": 3e-3, "guideload implicit": 8e-3}
NOISE_LIMIT, IMPORT_LIMIT, RUN_LIMIT = 1.3, 0.3, 1.5


@dataclass(eq=False)
class Job:
    """One method on one motion: the call, its times [s], and its loads on y and z or their extremes."""

    call: Callable[[], Any]
    first: float = 0.0
    times: list[float] = field(default_factory=list)
    histories: str = ""
    error: float = 0.0
    dynamic_error: float = 0.0

    @property
    def median(self) -> float:
        return statistics.median(self.times)


def main() -> None:
    """Measure everything, print it."""
    machine, motions = cart(), {"clean": cycle(), "noisy": noisy()}
    jobs, missing = {}, []
    for name, motion in motions.items():
        jobs[name], missing = jobs_of(machine, motion)
    measure([job for of in jobs.values() for job in of.values()])
    for name, of in jobs.items():
        print_details(name, of)
    if missing:
        print(f"left out, not installed: {', '.join(missing)}\n")
    importing = [import_time(statement) for statement in ("guideload", NAMES)]
    whole, bare = run_time()
    print_markdown(jobs["clean"], jobs["noisy"], importing, whole, bare)
    print_limits(jobs["clean"], jobs["noisy"], importing[0], whole)


def jobs_of(machine: Machine, motion: Motion) -> tuple[dict[str, Job], list[str]]:
    """All jobs on a motion, each called once and held against "exact"."""
    jobs: dict[str, Job] = {}
    for method in ("exact", "rk45", "implicit"):
        jobs[f"guideload {method}"] = started(partial(history, machine, motion, method))
    for method in ("exact", "rk45", "implicit"):
        jobs[f"guideload {method}, peaks"] = started(partial(extremes, machine, motion, method))
    given: Problem = problem(machine, motion)
    others, missing = peers()
    for name, peer in others.items():
        jobs[name] = started(lambda peer=peer: peer(given))
    return jobs, missing


def history(machine: Machine, motion: Motion, method: Any) -> Callable[[], Array]:
    return lambda: simulate(machine, motion, method=method, rtol=RTOL).carriage_loads


def extremes(machine: Machine, motion: Motion, method: Any) -> Callable[[], Any]:
    return lambda: peak_loads(machine, motion, method=method, rtol=RTOL)
