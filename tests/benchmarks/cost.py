"""What a run costs and how right it is, beside what others take for the same: `python tests/benchmarks/cost.py`.

Four carriages, 16 links, 5 free dofs, 7062 samples at 1 kHz: the yardstick's `cart` on its `cycle` (clean) and on
`noisy` (0.1 m/s2 rms of white noise on top, so that every sample is a kink). guideload is timed by its public calls:
`simulate(machine, motion, method=...)` with `.carriage_loads`, the 24 histories of force and moment of all
carriages, and `peak_loads`. The peers (the package peers says what each does) give the 8 histories of force along y
and z; only the one written by hand in Numba gives all 24. numba and pydiffsol are left out where not installed.

All take turns in one process, on one thread, after a first call each; times are medians. Calls under 0.1 s are timed
5 times in each of 15 turns, others once in 3 of them. The spread is that between the quartiles; ratios to solve_ivp
RK45 are to the quicker of its two calls.

An error is the largest difference of any carriage's y or z force to method "exact", as a part of the largest such
force: of the whole force, and of its dynamic part. "exact" is held against lsim on matrices assembled anew in NumPy,
so these two show the same figures. Of peaks, the difference is that to the extremes of the history.

Then `simulate` and `peak_loads` in turns on the cart, with clearance and with preload, and how the time of the second
compares with that of the first, in time of the processor; and the parts of `simulate`, beside the least that they can
take: writing as many bytes as the histories have.

Then fresh processes: `import guideload` (its names are imported when first used, so those that a script needs are
timed too), and the whole of `guideload run --no-pictures` on 25 s of cart velocity at 1 kHz.
"""

from __future__ import annotations

import os

# One thread each; read when NumPy and the others are imported.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"
os.environ["VECLIB_MAXIMUM_THREADS"] = "1"
os.environ["RAYON_NUM_THREADS"] = "1"

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
from typing import get_args

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from harness import by_turns, processor, timed
from peers.problem import Array, problem
from peers.roster import LSIM, RK45, RTOL, found_peers
from reference import cart, cart_clear, cycle, noisy, preloaded

from guideload import Machine, Motion, peak_loads, simulate
from guideload.base.methods import Method
from guideload.simulation.peaks import Peaks
from guideload.simulation.simulation import prepared_run

TURNS, CALLS = 15, 5
SLOW, EVERY = 0.1, 5  # s, from which on a call is timed once, and in every fifth turn only
METHODS = [method for method in get_args(Method) if method not in ("auto", "exponential")]
EXACT = "guideload exact"
NAMES = "from guideload import Machine, motion_from_trace, read_trace, simulate"


@dataclass(eq=False)
class Job:
    """One method on one motion."""

    call: Callable[[], Array | Peaks]
    histories: str  # how many a call gives
    first: float  # s, of preparation and first call, with all that is compiled or imported then
    error: float  # of the whole force
    dynamic_error: float
    times: list[float] = field(default_factory=list)  # s

    @property
    def median(self) -> float:
        return statistics.median(self.times)


Jobs = dict[str, Job]


def main() -> None:
    """Measure all, print all."""
    machine = cart()
    clean, missing = jobs_of(machine, cycle())
    noise, _ = jobs_of(machine, noisy())
    measure([*clean.values(), *noise.values()])
    ratios, parts = peak_ratios(), parts_of_runs()
    imports = {"import guideload": import_time("import guideload"), NAMES: import_time(NAMES)}
    whole, bare = run_time()
    print_details("clean", clean)
    print_details("noisy", noise)
    if missing:
        print(f"left out, not installed: {', '.join(missing)}\n")
    print_markdown(clean, noise)
    for scene, ratio in ratios.items():
        print(f"- `peak_loads` over `simulate`, {scene}: {ratio:.2f}")
    for scene, times in parts.items():
        print(f"- `simulate`, {scene}: " + ", ".join(f"{what} {1e3 * t:.2f} ms" for what, t in times.items()))
    for statement, seconds in imports.items():
        print(f"- `{statement}`: {seconds:.3f} s")
    print(f"- `guideload run --no-pictures` on 25 s at 1 kHz: {whole:.2f} s (a bare Python: {bare:.2f} s)")


# ---- in process


def jobs_of(machine: Machine, motion: Motion) -> tuple[Jobs, list[str]]:
    """All jobs on a motion, each called once; and the packages that are not installed."""
    exact = histories(machine, motion, "exact")[:, :, 1:3]
    jobs = {f"guideload {m}": started(partial(histories, machine, motion, m), exact) for m in METHODS}
    jobs |= {f"guideload {m}, peaks": started(partial(peaks, machine, motion, m), exact) for m in METHODS}
    given = problem(machine, motion)
    peers, missing = found_peers()
    for name, peer in peers.items():
        start = time.perf_counter()
        call = peer(given)
        jobs[name] = started(call, exact, time.perf_counter() - start)
    jobs[EXACT].error, jobs[EXACT].dynamic_error = jobs[LSIM].error, jobs[LSIM].dynamic_error
    return jobs, missing


def histories(machine: Machine, motion: Motion, method: Method) -> Array:
    return simulate(machine, motion, method=method, rtol=RTOL).carriage_loads


def peaks(machine: Machine, motion: Motion, method: Method) -> Peaks:
    return peak_loads(machine, motion, method=method, rtol=RTOL)


def started(call: Callable[[], Array | Peaks], exact: Array, prepared: float = 0.0) -> Job:
    """A job called once and held against the y and z forces `exact`, (time, carriage, 2)."""
    start = time.perf_counter()
    given = call()
    first = prepared + time.perf_counter() - start
    if isinstance(given, Peaks):
        differences = [given.smallest[:, 1:3] - exact.min(axis=0), given.largest[:, 1:3] - exact.max(axis=0)]
        count = "peaks"
    else:
        differences = [(given[:, :, 1:3] if given.shape[2] == 6 else given) - exact]
        count = str(given[0].size)
    worst = max(float(np.abs(difference).max()) for difference in differences)
    dynamic = exact - exact[0]  # all motions begin at rest
    return Job(call, count, first, worst / np.abs(exact).max(), worst / np.abs(dynamic).max())


def measure(jobs: list[Job]) -> None:
    """Let all jobs take turns, so that what else the machine does hits them alike."""
    slow = {id(job): timed(job.call) > SLOW for job in jobs}
    gc.disable()
    for turn in range(TURNS):
        for job in jobs:
            if not slow[id(job)]:
                job.times += [timed(job.call) for _ in range(CALLS)]
            elif turn % EVERY == 0:
                job.times.append(timed(job.call))
        gc.collect()
    gc.enable()


def scenes() -> dict[str, Machine]:
    return {"linear": cart(), "5 um clearance": cart_clear(), "preloaded": preloaded()}


def parts_of_runs() -> dict[str, dict[str, float]]:
    """Seconds of the parts of `simulate` under the clean motion: medians, in time of the processor, in turns."""
    motion, all_times = cycle(), {}
    for scene, machine in scenes().items():
        run = prepared_run(machine, motion, "auto", RTOL, None, None, "auto")
        calls: dict[str, Callable[[], object]] = {
            "whole": partial(histories, machine, motion, "auto"),
            "states": partial(run.solution_under, motion.acceleration),
            "loads from them": partial(run.carriage_loads, solution=run.solution),
            "bytes": partial(np.ones, run.carriage_loads().shape),
        }
        times = by_turns(calls, TURNS * CALLS, time.process_time)
        all_times[scene] = {what: statistics.median(those) for what, those in times.items()}
    return all_times


def peak_ratios() -> dict[str, float]:
    """Time of the extremes alone over that of the histories, medians in time of the processor."""
    ratios = {}
    for scene, machine in scenes().items():
        for title, motion in (("clean", cycle()), ("noisy", noisy())):
            calls = {call.__name__: partial(call, machine, motion, "auto") for call in (histories, peaks)}
            times = by_turns(calls, TURNS * CALLS, time.process_time)
            of_all, of_peaks = map(statistics.median, times.values())
            ratios[f"{scene}, {title}"] = of_peaks / of_all
    return ratios


# ---- processes


def import_time(statement: str, runs: int = 7) -> float:
    """Seconds of an import in a fresh process, median."""
    code = f"import time; start = time.perf_counter(); {statement}; print(time.perf_counter() - start)"

    def once() -> float:
        done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
        return float(done.stdout)

    once()
    return statistics.median(once() for _ in range(runs))


def run_time(runs: int = 5) -> tuple[float, float]:
    """Seconds of `guideload run` on 25 s of 1 kHz data as a whole process, and of a bare Python; medians."""
    program = shutil.which("guideload", path=str(Path(sys.executable).parent))
    if program is None:
        sys.exit(f"no command guideload beside {sys.executable}: install the package with that Python's pip")

    def once(*command: str) -> float:
        return timed(lambda: subprocess.run(command, check=True, capture_output=True))

    with tempfile.TemporaryDirectory() as folder:
        trace, out = Path(folder) / "trace.csv", Path(folder) / "out"
        write_trace(trace)
        machine = str(files("guideload") / "examples" / "manipulator.toml")
        command = (program, "run", machine, str(trace), "-o", str(out), "--no-pictures", "--overwrite")
        once(*command)
        whole = statistics.median(once(*command) for _ in range(runs))
    return whole, statistics.median(once(sys.executable, "-c", "pass") for _ in range(runs))


def write_trace(path: Path) -> None:
    """25 s of cycles: cart velocity in steps of 0.1 mm/s, as an encoder gives it."""
    acceleration = cycle().acceleration[:, 0]
    velocity = np.concatenate([[0.0], np.cumsum(0.5 * (acceleration[1:] + acceleration[:-1]) * 1e-3)])
    stamps = np.arange(25_000) / 1000.0
    rows = np.column_stack([stamps, np.resize(np.round(velocity * 1e3, 1), stamps.size)])
    np.savetxt(
        path, rows, delimiter=",", header="time_s,velocity_mm_per_s", comments="", fmt=("%.3f", "%.1f")
    )


# ---- tables


def quicker_rk45(jobs: Jobs) -> float:
    return min(jobs[name].median for name in RK45)


def print_details(title: str, jobs: Jobs) -> None:
    """A line per job."""
    lsim, rk45 = jobs[LSIM].median, quicker_rk45(jobs)
    columns = ("ms", "spread", "first ms", "lsim / it", "RK45 / it", "histories", "error", "dynamic")
    print(f"{title:32}" + "".join(f"{column:>11}" for column in columns))
    for name, job in jobs.items():
        low, high = np.percentile(job.times, [25.0, 75.0])
        cells = [
            f"{job.median * 1e3:.3f}",
            f"{(high - low) / job.median:.0%}",
            f"{job.first * 1e3:.1f}",
            short(lsim / job.median),
            short(rk45 / job.median),
            job.histories,
            part(job.error),
            part(job.dynamic_error),
        ]
        print(f"{name:32}" + "".join(f"{cell:>11}" for cell in cells))
    print()


def print_markdown(clean: Jobs, noise: Jobs) -> None:
    """The table for docs/benchmarks.md."""
    print(
        "| | clean | noisy | noisy / clean | times as fast as lsim | as solve_ivp RK45 | error, dynamic part |"
    )
    print("|---|---:|---:|---:|---:|---:|---:|")
    for name, job in clean.items():
        other = noise[name]
        pairs = (
            f"{short(job.median * 1e3)} ms",
            f"{short(other.median * 1e3)} ms",
            f"{other.median / job.median:.2f}",
            f"{short(clean[LSIM].median / job.median)}, {short(noise[LSIM].median / other.median)}",
            f"{short(quicker_rk45(clean) / job.median)}, {short(quicker_rk45(noise) / other.median)}",
            f"{part(job.dynamic_error)}, {part(other.dynamic_error)}",
        )
        print(f"| {name} | {' | '.join(pairs)} |")
    versions = f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}"
    print("\nWhere a cell has two figures: clean, noisy. `cart`, 7062 samples, rtol 1e-6, one thread of")
    print(f"{processor()}; {versions}.\n")


def short(value: float) -> str:
    """Two digits, three from 100 on, and no exponent."""
    return f"{float(f'{value:.3g}'):.0f}" if value >= 10.0 else f"{value:.2g}"


def part(value: float) -> str:
    """An error as a part of something."""
    return f"{value:.0e}" if value else "0"


if __name__ == "__main__":
    main()
