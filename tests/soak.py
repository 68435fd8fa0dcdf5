"""Memory stays flat however long the program runs: `python tests/soak.py [--minutes 60]`; Linux with glibc.

Repeats everything in one process: reading, smoothing, simulation with each method, peaks, report, result files, a study
in memory and in a folder. Prints resident memory over time. Exit code 1 if its minimum in the last quarter of the
rounds exceeds that in the second quarter by more than BOUND.

Allocators keep memory that is free, more or less of it as threads happen to meet, so that resident memory jumps by tens
of MB, up and down, without a leak. Measured is what does not:

- anonymous memory: the system takes pages of libraries away and gives them back;
- with one arena of malloc for all threads, which Arrow uses too, after a collection and `malloc_trim`, which returns
  free pages to the system;
- the smallest of a quarter: a leak is there in each round, so also in the smallest.

`--leak 0.5` keeps so many MB in each round: the script must then fail.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from guideload import Machine, Study, motion_from_trace, peak_loads, read_trace, run_study, simulate
from guideload.cli.inputs import EXAMPLES
from guideload.reports.run import result_report
from guideload.simulation.result import Result

BOUND = 1.0  # MB; in 27 rounds it rose by 0.2. One that keeps a history of its trace, 0.5 MB, passes it within 8 rounds
ALLOCATORS = {"MALLOC_ARENA_MAX": "1", "ARROW_DEFAULT_MEMORY_POOL": "system"}  # read when a process starts


def resident() -> float:
    """Resident anonymous memory of this process without what is free [MB]."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return 1.024e-3 * int(status.partition("RssAnon:")[2].split()[0])


def once(folder: Path, seed: int) -> None:
    """Use every part of the program once."""
    machine = Machine.from_toml(EXAMPLES / "manipulator.toml")
    motion = motion_from_trace(read_trace(EXAMPLES / "manipulator.csv"), machine.drive)
    for method in ("exact", "rk45", "implicit"):
        simulate(machine, motion, method=method, rtol=1e-4)
        peak_loads(machine, motion, method=method, rtol=1e-4)
    result = simulate(machine, motion)
    result_report(result).text()
    for write, ending in (
        (result.to_netcdf, ".nc"),
        (result.to_parquet, ".parquet"),
        (result.to_csv, ".csv"),
    ):
        write(folder / f"loads{ending}")
        if ending != ".csv":
            Result.load(folder / f"loads{ending}")
    study = Study.from_toml(EXAMPLES / "study.toml", samples=200, seed=seed)
    run_study(study, folder / f"study-{seed}").summary()
    run_study(study)


def main() -> None:
    """Run, print, judge."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--leak", type=float, default=0.0, help="MB to keep in each round, to see it found")
    asked = parser.parse_args()
    if not ALLOCATORS.items() <= os.environ.items():
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | ALLOCATORS)
    begun, said, rows, kept = time.monotonic(), 0.0, [], []
    end = begun + 60.0 * asked.minutes
    with tempfile.TemporaryDirectory() as folder:
        while time.monotonic() < end:
            once(Path(folder), len(rows))
            kept.append(np.ones(int(asked.leak * 1e6 / 8)))
            minutes = (time.monotonic() - begun) / 60.0
            rows.append((minutes, resident()))
            if minutes >= said:
                print(f"{minutes:6.1f} min  {len(rows):6d} rounds  {rows[-1][1]:8.1f} MB", flush=True)
                said += 0.5
    time_, memory = np.array(rows).T
    quarter = len(rows) // 4
    if quarter < 2:
        sys.exit(f"too few rounds to judge, {len(rows)}: take more minutes")
    growth = float(memory[-quarter:].min() - memory[quarter : 2 * quarter].min())
    slope = float(np.polyfit(time_[quarter:], memory[quarter:], 1)[0])
    print(f"{len(rows)} rounds; slope {60.0 * slope:.2f} MB/h; second to last quarter {growth:+.2f} MB")
    sys.exit(f"memory grows by more than {BOUND} MB" if growth > BOUND else 0)


if __name__ == "__main__":
    main()
