"""What all benchmarks share: the clock, turns, tables, the command line of those that count intervals."""

from __future__ import annotations

import argparse
import os
import platform
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

_ALLOWED = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []


def timed(call: Callable[[], Any]) -> float:
    """Seconds that a call takes."""
    start = time.perf_counter()
    given = call()
    seconds = time.perf_counter() - start
    del given  # freed outside
    return seconds


def processor() -> str:
    """The processor's name."""
    info = Path("/proc/cpuinfo")  # of Linux; platform knows no more than "x86_64" there
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def cores() -> int:
    """How many this process may use."""
    return len(_ALLOWED) or os.cpu_count() or 1


def on_cores(count: int) -> None:
    """Hold this thread, and those that it starts, on so many cores, where the system can do that."""
    if _ALLOWED:
        os.sched_setaffinity(0, _ALLOWED[:count])


def by_turns(
    calls: Mapping[str, Callable[[], object]], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> dict[str, list[float]]:
    """Seconds of each call, in as many rounds of all, so that what else the machine does hits them alike."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            start = clock()
            call()
            times[name].append(clock() - start)
    return times


def row(*cells: str) -> str:
    """A row of a Markdown table."""
    return f"| {' | '.join(cells)} |"


def print_table(description: str, columns: str, names: Iterable[str], row: Callable[[str, int], str]) -> None:
    """Print a row of a table for each case that the command line names, by default for all.

    columns: their titles, "case | share". row: of a case and a number of seeds.
    """
    known = tuple(names)
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("names", nargs="*", help=f"cases: {', '.join(known)}")
    asked = parser.parse_args()
    print(f"| {columns} |\n|{'---|' * (columns.count('|') + 1)}")
    for name in asked.names or known:
        print(row(name, asked.seeds), flush=True)


def share(inside: Sequence[bool]) -> str:
    """The share of intervals that hold the true value, its binomial standard error, and the number of intervals."""
    if not inside:
        return "no interval"
    mean = float(np.mean(inside))
    error = np.sqrt(mean * (1.0 - mean) / len(inside))
    return f"{100 * mean:.1f} +- {100 * error:.1f} % of {len(inside)}"
