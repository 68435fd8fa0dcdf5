"""A study file whose distributions are what is known of the machine after the data."""

from __future__ import annotations

import json
from itertools import combinations

from guideload.identification.intervals import NORMAL_QUANTILE
from guideload.identification.result import Identification

SMALLEST = 5e-3  # correlation that is written
INSIDE = 1.0 - 1e-9  # factor on all correlations: rounding must not make their matrix singular


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
    for i, j in combinations(range(len(found.unknowns)), 2):
        value = float(found.correlation[i, j]) * INSIDE
        if abs(value) >= SMALLEST:
            names = ", ".join(_quoted(found.unknowns[k].name) for k in (i, j))
            rows += ["", "[[correlation]]", f"between = [{names}]", f"value = {value!r}"]
    return "\n".join(rows) + "\n"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
