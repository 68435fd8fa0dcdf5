"""The command line of the benchmarks that measure how often intervals hold the true value."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence

import numpy as np


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
