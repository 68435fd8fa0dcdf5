"""What passes its limit: probabilities over drawn samples, and a table of chosen cases."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.study import quantities, statistics
from guideload.study.quantities import CONTACT, LIFE, known_quantity

if TYPE_CHECKING:
    import pandas as pd

    from guideload.study.result import StudyResult


def probabilities(result: StudyResult) -> pd.DataFrame:
    """A row per limit and carriage, and for the machine: that any carriage passes it, with carriage "".

    A life passes its limit below it, all else above. Lost contact is one of them, without a limit (NaN).
    Columns: limit, samples, count, probability, low, high; at 95 %, see `statistics.probability`.
    """
    import pandas as pd

    rows = {}
    for name, limit in _asked(result).items():
        worst: Array | None = None
        for owner, whole in result.figures(name):
            figure = result.samples_of(whole)
            worst = figure if worst is None else known_quantity(name).worse(worst, figure)
            rows[name, owner] = _passed(name, figure, limit)
        if worst is not None:
            rows[name, ""] = _passed(name, worst, limit)
    columns = ["limit", "samples", "count", "probability", "low", "high"]
    index = pd.MultiIndex.from_tuples(list(rows), names=["quantity", "carriage"])
    return pd.DataFrame(list(rows.values()), index=index, columns=columns)


def cases(result: StudyResult) -> pd.DataFrame:
    """A row per run, by sample: the values varied, `leading` of each carriage, what follows from it.

    Columns: parameters; the leading figure of each carriage; life_km, the shortest of the carriages, if it is
    rated; passed, the limits that any carriage passes and whether contact is lost, or "failed" of a run without
    result.
    """
    stem = result.leading.partition("[")[0]
    figures = [f"{stem}[{owner}]" if owner else stem for owner in result.owners(stem)]
    life = [LIFE] if LIFE in result.quantities and stem != LIFE else []
    table = result.table([*(one.name for one in result.studied.varied), *figures, *life])
    passed: list[list[str]] = [["failed"] if i in result.reasons else [] for i in range(result.runs)]
    for name, limit in _asked(result).items():
        for i in np.flatnonzero(_beyond(name, result.column(name), limit)):
            passed[i].append(quantities.title_of(name, result.studied))
    table["passed"] = [", ".join(names) for names in passed]
    return table.drop(columns="reason")


def _asked(result: StudyResult) -> dict[str, float]:
    """The limits, and NaN for lost contact where it was watched."""
    asked = {name: limit for name, limit in result.limits().items() if name != CONTACT}
    if CONTACT in result.quantities:
        asked[CONTACT] = math.nan
    return asked


def _passed(name: str, values: Array, limit: float) -> tuple[float, ...]:
    """A row of `probabilities`."""
    figures = statistics.known(values)
    count = int(np.count_nonzero(_beyond(name, figures, limit)))
    return (limit, figures.size, count, *map(float, statistics.probability(count, figures.size)))


def _beyond(name: str, values: Array, limit: float) -> NDArray[np.bool_]:
    """Whether values pass a limit; NaN: whether there is lost contact."""
    bound = 0.5 if math.isnan(limit) else limit
    return values < bound if known_quantity(name).smallest_is_worst else values > bound
