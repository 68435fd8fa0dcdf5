"""Scenes per second and core, guideload beside its peers: `python tests/benchmarks/monte_carlo.py`.

    --quick       fewer runs
    --markdown    a table for docs/benchmarks.md
    --million     also a million machines of the packaged study by `guideload study`, their time and memory

The yardstick's cart, 16 links and 5 free dofs, where it scatters: mass uniform within 10 %, centre of mass
within 5 cm per axis, stiffness and damping of each carriage lognormal with sigma 0.2. The cycle of 7062 samples
at 1 kHz, the same with 0.1 m/s2 rms of noise on every sample, and the cycle with 5 um of clearance in each
link. Of each scene and carriage the peaks of the y and z load are kept, the largest magnitude at the samples; by
guideload also that at any time, whose error is against `peak_loads`.

guideload runs them by the plan of a `Study`, from a new `Batch` on; the package peers says how each peer does
(those called batch_*), and what they get: the draws. All that is to be done for a scene, its matrices, position
at rest, exponential and peaks, is inside the time; what is done once, as drawing and compiling, is not. Packages
that are not installed are left out and named: `pip install .[bench]`.

All is in one process held on one core (two for two threads, where the system can do that), by turns; times are
medians. A call runs as many scenes as give a stable figure. An error is the largest difference of a peak from
the truth, as a part of the scene's largest peak, over the first scenes. The truth is computed anew without
guideload's core; who differs from it by more than 1e-3 is not counted. Exudyn's model is not ours (finite
rotations): its error is a check of the physics. Two threads are only worth looking at where nothing else runs.
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
from pathlib import Path

import harness
import numpy as np
from harness import on_cores, row, timed
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
    threads: int = 1
    error: float = np.inf
    failure: str = ""
    times: list[float] = field(default_factory=list)  # s

    @property
    def rate(self) -> float:
        """Scenes per second."""
        return self.scenes / statistics.median(self.times)

    @property
    def per_core(self) -> float:
        return self.rate / self.threads

    @property
    def counted(self) -> bool:
        return self.error <= USEFUL


@dataclass(eq=False)
class Measured:
    """A case and its jobs."""

    case: Case
    jobs: list[Job]
    same: bool  # whether two threads gave the same bits as one


def main() -> None:
    """Measure all, print all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer runs")
    parser.add_argument("--markdown", action="store_true", help="a table for docs/benchmarks.md")
    parser.add_argument(
        "--million", action="store_true", help="also a million machines of the packaged study"
    )
    asked = parser.parse_args()
    on_cores(1)
    done, missing = [], []
    for case in cases():
        peers = clear_peers() if case.scatter.clearance else linear_peers()
        missing += [peer.missing() for peer in peers if peer.missing()]
        measured = measure(case, [peer for peer in peers if not peer.missing()], asked.quick)
        done.append(measured)
        print_case(measured)
    if asked.markdown:
        print_markdown(done)
    print(harness.made_on(*PACKAGES))
    if missing:
        print(f"left out: {', '.join(dict.fromkeys(missing))}")
    if asked.million:
        print(f"a million machines of the packaged study on two cores: {run_million()}")


# ---- measure


def measure(case: Case, peers: list[BatchPeer], quick: bool) -> Measured:
    """All jobs of a case, one run each for error and compilers, then by turns."""
    print(f"{case.title}: {case.truth.how}", file=sys.stderr)
    given, scenes = case.scatter, len(case.scatter)
    results = {threads: case.run(threads) for threads in (1, 2)}
    same = np.array_equal(results[1], results[2])
    jobs = [
        Job(OURS, lambda n=threads: case.run(n), scenes, threads)
        for threads in (1, 2)
        if threads <= harness.cores()
    ]
    for job in jobs:
        job.error = case.truth.error(results[job.threads])
    # Beside peak_loads, which finds the peaks between the samples too.
    error = apart(given, case.run(1, at_any_time=True))
    jobs.append(Job(f"{OURS}, at any time", lambda: case.run(1, at_any_time=True), scenes, error=error))
    jobs += [peer_job(case, peer) for peer in peers]
    able = [job for job in jobs if not job.failure]
    rounds, patience = (QUICK_ROUNDS, QUICK_PATIENCE) if quick else (ROUNDS, PATIENCE)
    for _ in range(rounds):
        for job in able:
            if sum(job.times) < patience:
                on_cores(job.threads)
                job.times.append(timed(job.run))
                on_cores(1)
    return Measured(case, jobs, same)


def peer_job(case: Case, peer: BatchPeer) -> Job:
    """A peer, run once on the scenes whose truth is known."""
    count = peer.rough if case.rough and peer.rough else peer.scenes
    part = case.scatter.first(count)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            error = case.truth.error(peer.run(part.first(CHECKED)))
        return Job(peer.name, lambda: peer.run(part), count, error=error)
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


def print_case(done: Measured) -> None:
    """A line per job, quick before slow."""
    print(f"{done.case.title}\ntruth: {done.case.truth.how}")
    print(f"{'':34}{'threads':>8}{'scenes/s per core':>19}{'spread':>8}{'scenes':>8}{'runs':>6}{'error':>10}")
    for job in sorted((job for job in done.jobs if job.times), key=lambda job: -job.per_core):
        low, high = np.percentile(job.times, [25.0, 75.0])
        spread = f"{(high - low) / statistics.median(job.times):.0%}"
        cells = f"{short(job.per_core):>19}{spread:>8}{job.scenes:>8}{len(job.times):>6}{job.error:>10.1e}"
        print(f"{job.name:34}{job.threads:>8}{cells}{'' if job.counted else '  WRONG, not counted'}")
    for job in done.jobs:
        if job.failure:
            print(f"{job.name:34}failed: {job.failure}")
    print(f"two threads give {'the same' if done.same else 'OTHER'} bits\n")


def print_markdown(done: list[Measured]) -> None:
    """Rates of all on all cases, the error on the first that each has."""
    names = dict.fromkeys(job.name for measured in done for job in measured.jobs if job.times and job.counted)
    print(row("scenes/s per core", *(measured.case.title for measured in done), "error"))
    print(row("---", *("---:" for _ in done), "---:"))
    for name in names:
        found = [next((job for job in m.jobs if job.name == name and job.times), None) for m in done]
        cells = [short(job.per_core) if job else "" for job in found]
        print(row(name, *cells, next(f"{job.error:.0e}" for job in found if job)))
    print()


def short(value: float) -> str:
    """Two digits or more, no exponent."""
    return f"{float(f'{value:.3g}'):,.0f}".replace(",", " ") if value >= 10.0 else f"{value:.2g}"


if __name__ == "__main__":
    main()
