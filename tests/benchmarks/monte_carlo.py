"""Scenes per second and core, guideload beside its peers: `python tests/benchmarks/monte_carlo.py`.

    --quick       fewer runs
    --million     also a million machines of the packaged study by `guideload study`, their time and memory

The yardstick's cart, 16 links and 5 free dofs, where it scatters: mass uniform within 10 %, centre of mass
within 5 cm per axis, stiffness and damping of each carriage lognormal with sigma 0.2. The cycle of 7062 samples
at 1 kHz, the same with 0.1 m/s2 rms of noise on every sample, and the cycle with 5 um of clearance in each
link. Of each scene and carriage the peaks of the y and z load are kept, the largest magnitude at the samples; by
guideload also that at any time, whose error is against `peak_loads`.

guideload runs them by the plan of a `Study`, from a new `Batch` on; the package peers says how each peer does
(those called batch_*), and what they get: the draws. All that is to be done for a scene, its matrices, position
at rest, exponential and peaks, is inside the time (but for RK4); what is done once, as drawing and compiling, is
not. Packages that are not installed are left out and named: `pip install .[bench]`.

All is in one process held on one core, where the system can do that, by turns; times are medians. A call runs as
many scenes as give a stable figure. An error is the largest difference of a peak from the truth, as a part of the
scene's largest peak, over the first scenes. The truth is computed anew without guideload's core; who differs from
it by more than 1e-3 is not counted. Exudyn's model is not ours (finite rotations): its error is a check of the
physics.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import harness
import numpy as np
from harness import heading, on_cores, row, timed
from peers.batch_roster import BatchPeer, clear_peers, linear_peers
from peers.scatter import Peaks, Scatter
from scattered import CHECKED, Case, cases

from guideload import peak_loads
from guideload.cli.inputs import EXAMPLES

PACKAGES = ("numba", "jax", "pydiffsol", "exudyn")
ROUNDS, PATIENCE = 7, 2.5  # runs of each, as long as they have not taken that many seconds
QUICK_ROUNDS, QUICK_PATIENCE = 3, 0.5
OURS = "guideload"
MILLION = 1_000_000
USEFUL = 1e-3  # error of the load that a designer can still use


@dataclass(eq=False)
class Job:
    """One way to run a case."""

    name: str
    run: Callable[[], Peaks]
    scenes: int
    error: float = np.inf
    failure: str = ""
    times: list[float] = field(default_factory=list)  # s

    @property
    def rate(self) -> float:
        """Scenes per second."""
        return self.scenes / statistics.median(self.times)

    @property
    def counted(self) -> bool:
        return self.error <= USEFUL


def main() -> None:
    """Measure all, print all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer runs")
    parser.add_argument(
        "--million", action="store_true", help="also a million machines of the packaged study"
    )
    asked = parser.parse_args()
    on_cores(1)
    done, missing = {}, []
    for case in cases():
        peers = clear_peers() if case.scatter.clearance else linear_peers()
        missing += [peer.missing() for peer in peers if peer.missing()]
        done[case.title] = measure(case, [peer for peer in peers if not peer.missing()], asked.quick)
    print_table(done)
    print(harness.made_on(*PACKAGES))
    if missing:
        print(f"left out: {', '.join(dict.fromkeys(missing))}")
    if asked.million:
        print(f"a million machines of the packaged study on two cores: {run_million()}")


# ---- measure


def measure(case: Case, peers: list[BatchPeer], quick: bool) -> list[Job]:
    """All jobs of a case, one run each for error and compilers, then by turns."""
    print(f"{case.title}: {case.truth.how}", file=sys.stderr)
    scenes = len(case.scatter)
    jobs = [Job(OURS, case.run, scenes, case.truth.error(case.run()))]
    # Beside peak_loads, which finds the peaks between the samples too.
    at_any_time = partial(case.run, at_any_time=True)
    jobs.append(Job(f"{OURS}, at any time", at_any_time, scenes, apart(case.scatter, at_any_time())))
    jobs += [peer_job(case, peer) for peer in peers]
    able = [job for job in jobs if not job.failure]
    rounds, patience = (QUICK_ROUNDS, QUICK_PATIENCE) if quick else (ROUNDS, PATIENCE)
    for _ in range(rounds):
        for job in able:
            if sum(job.times) < patience:
                job.times.append(timed(job.run))
    return jobs


def peer_job(case: Case, peer: BatchPeer) -> Job:
    """A peer, run once for its error and to compile."""
    count = peer.rough if case.rough and peer.rough else peer.scenes
    part = case.scatter.first(count)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            error = case.truth.error(peer.run(part))
        return Job(peer.name, partial(peer.run, part), count, error)
    except (RuntimeError, ArithmeticError, ValueError, OSError, subprocess.CalledProcessError) as failed:
        return Job(peer.name, list, count, failure=str(failed).partition("\n")[0][:100])


def apart(given: Scatter, batch: Peaks) -> float:
    """How far the batch is from `peak_loads` of each of the first scenes."""
    worst = 0.0
    for scene in range(CHECKED):
        peaks = peak_loads(given.machine_of(scene), given.motion, method="exact")
        single = np.maximum(-peaks.smallest, peaks.largest)[:, 1:3].ravel()
        worst = max(worst, float(np.abs(batch[scene] - single).max() / single.max()))
    return worst


def run_million() -> str:
    """Time and memory of `guideload study` from its start to the summary."""
    on_cores(2)
    options = ("--samples", str(MILLION), "--threads", "2", "--no-pictures")
    with tempfile.TemporaryDirectory() as folder:
        study = ("study", str(EXAMPLES / "study.toml"), "-o", str(Path(folder) / "out"))
        command = (sys.executable, "-m", "guideload", *study, *options)
        seconds = timed(lambda: subprocess.run(command, stdout=subprocess.DEVNULL, check=True))
    on_cores(1)
    unit = 1 if sys.platform == "darwin" else 1024  # of the largest resident set, bytes
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * unit
    return f"{seconds:.1f} s, {memory / 2**30:.2f} GiB"


# ---- print


def print_table(done: dict[str, list[Job]]) -> None:
    """Rates of all on all cases, the error on the first that each has; then what failed."""
    ran = [{job.name: job for job in jobs if job.times and job.counted} for jobs in done.values()]
    print(heading("scenes/s per core", *done, "error"))
    for name in dict.fromkeys(name for jobs in ran for name in jobs):
        found = [jobs.get(name) for jobs in ran]
        cells = [short(job.rate) if job else "" for job in found]
        print(row(name, *cells, next(f"{job.error:.0e}" for job in found if job)))
    for title, jobs in done.items():
        for job in jobs:
            if not job.counted:
                print(f"{title}, {job.name}: {job.failure or f'WRONG by {job.error:.1e}, not counted'}")
    print()


def short(value: float) -> str:
    """Two digits or more, no exponent."""
    return f"{float(f'{value:.3g}'):,.0f}".replace(",", " ") if value >= 10.0 else f"{value:.2g}"


if __name__ == "__main__":
    main()
