"""What calls and commands of guideload cost: `python tests/benchmarks/cost.py`; chart.py has its peers beside it.

The yardstick's cart, linear, with clearance and with preload, on its `cycle` of 7062 samples at 1 kHz (clean) and on
`noisy` (0.1 m/s2 rms of white noise on top, so that every sample is a kink): `simulate(machine, motion, method=...)`
with `.carriage_loads`, the 24 histories of force and moment of all carriages, and `peak_loads`, in turns after a first
call each, on one thread; medians in time of the processor. The spread is that between the quartiles. Last in a row:
`peak_loads` for every tenth sample of the motion, as a controller logs it, over that for the motion along the lines
between them at 1 kHz.

Then fresh processes: `import guideload` (its names are imported when first used, so those that a script needs are
timed too), and the whole of `guideload run --no-pictures` on 25 s of cart velocity at 1 kHz.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import get_args

import harness
import numpy as np
from harness import by_turns, heading, row, timed
from reference import cart, cart_clear, cycle, noisy, preloaded

from guideload import GuideloadError, Machine, Motion, peak_loads, simulate
from guideload.base.methods import Method
from guideload.cli.inputs import EXAMPLES

TURNS = 75
NAMES = "from guideload import Machine, motion_from_trace, read_trace, simulate"


def main() -> None:
    """Measure all, print all."""
    cells = (
        "scene",
        "method",
        "simulate",
        "spread",
        "peak_loads",
        "spread",
        "peak_loads / simulate",
        "100 Hz / 1 kHz",
    )
    print(heading(*cells, words=2))
    for scene, machine in {
        "linear": cart(),
        "5 um clearance": cart_clear(),
        "preloaded": preloaded(),
    }.items():
        for title, motion in (("clean", cycle()), ("noisy", noisy())):
            for method in get_args(Method):
                print_calls(f"{scene}, {title}", machine, motion, method)
    print(f"\n{harness.made_on()}\n")
    for statement in ("import guideload", NAMES):
        print(f"- `{statement}`: {import_time(statement):.3f} s")
    whole, bare = run_time()
    print(f"- `guideload run --no-pictures` on 25 s at 1 kHz: {whole:.2f} s (a bare Python: {bare:.2f} s)")


def print_calls(scene: str, machine: Machine, motion: Motion, method: Method) -> None:
    """A row of the table: milliseconds of both calls, their spread and ratio; none if the method refuses the scene."""
    calls = {
        "histories": lambda: simulate(machine, motion, method=method).carriage_loads,
        "peaks": lambda: peak_loads(machine, motion, method=method),
    }
    try:
        by_turns(calls, 1)
    except GuideloadError:
        return
    times = by_turns(calls, TURNS, time.process_time).values()
    middle = [statistics.median(those) for those in times]
    quartiles = [np.percentile(those, [25.0, 75.0]) for those in times]
    cells = [
        cell
        for median, (low, high) in zip(middle, quartiles, strict=True)
        for cell in (f"{1e3 * median:.3g} ms", f"{(high - low) / median:.0%}")
    ]
    coarse = f"{coarse_ratio(machine, motion):.2f}" if method == "auto" else ""
    print(row(scene, method, *cells, f"{middle[1] / middle[0]:.2f}", coarse), flush=True)


def coarse_ratio(machine: Machine, motion: Motion) -> float:
    """Time of the peaks of every tenth sample over that of the same motion at the rate of all."""
    stamps, some, values = motion.time, motion.time[::10], motion.acceleration[::10, 0]
    every = stamps[stamps <= some[-1]]
    motions = Motion.along_x(some, values), Motion.along_x(every, np.interp(every, some, values))
    names = "coarse", "fine"
    calls = {name: partial(peak_loads, machine, each) for name, each in zip(names, motions, strict=True)}
    by_turns(calls, 1)
    coarse, fine = map(statistics.median, by_turns(calls, TURNS, time.process_time).values())
    return coarse / fine


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

    def once(*command: str) -> float:
        return timed(partial(subprocess.run, command, check=True, capture_output=True))

    with tempfile.TemporaryDirectory() as folder:
        trace, out = Path(folder) / "trace.csv", Path(folder) / "out"
        write_trace(trace)
        machine, options = str(EXAMPLES / "manipulator.toml"), ("--no-pictures", "--overwrite")
        command = (sys.executable, "-m", "guideload", "run", machine, str(trace), "-o", str(out), *options)
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


if __name__ == "__main__":
    main()
