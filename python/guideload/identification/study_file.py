"""A study file whose distributions are what is known of the machine after the data."""

from __future__ import annotations

import json
from itertools import combinations

import numpy as np

from guideload.base.arrays import Array
from guideload.identification.intervals import NORMAL_QUANTILE
from guideload.identification.result import Identification

SMALLEST = (5e-3, 1e-3, 1e-4, 0.0)  # correlations below are left out if the others are possible without them
INSIDE = 1.0 - 1e-6  # factor on all correlations: rounding must not make their matrix singular


def study_text(found: Identification, machine: str, trace: str, samples: int = 1024) -> str:
    """The study file; machine: the file with the identified values, which are the medians."""
    rows = [
        "# Loads of the machine as identified: the distributions are what is known of it after the measurement.",
        f"machine = {_quoted(machine)}",
        f"trace = {_quoted(trace)}",
        f"samples = {samples}",
        "seed = 1",
        vary_text(found),
    ]
    return "\n".join(rows)


def vary_text(found: Identification) -> str:
    """The tables [[vary]] and [[correlation]] of a study."""
    rows: list[str] = []
    for one, reach in zip(found.unknowns, found.intervals, strict=True):
        sigma = (reach.high - reach.low) / (2.0 * NORMAL_QUANTILE)
        kind, width = (
            ("normal", f'"{sigma:.6g} {one.unit}"') if one.additive else ("lognormal", f"{sigma:.6g}")
        )
        rows += [
            "",
            "[[vary]]",
            f"name = {_quoted(one.name)}",
            f"path = [{', '.join(map(_quoted, one.targets))}]",
            f"distribution = {_quoted(kind)}",
            f"sigma = {width}",
        ]
    correlation = _written(found.correlation)
    for i, j in combinations(range(len(found.unknowns)), 2):
        if value := float(correlation[i, j]):
            names = ", ".join(_quoted(found.unknowns[k].name) for k in (i, j))
            rows += ["", "[[correlation]]", f"between = [{names}]", f"value = {value!r}"]
    return "\n".join(rows) + "\n"


def _written(correlation: Array) -> Array:
    """The correlations that are written, 0 for those that are left out; the matrix stays positive definite."""
    inside = correlation * INSIDE
    for smallest in SMALLEST:
        written = np.where(abs(inside) >= smallest, inside, 0.0)
        np.fill_diagonal(written, 1.0)
        if np.linalg.eigvalsh(written)[0] > 0.1 * (1.0 - INSIDE):
            break
    return written


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
