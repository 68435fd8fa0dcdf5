"""What a study gives: columns of samples, read when asked for, and what follows from them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from functools import cached_property, reduce
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.arrays import Array
from guideload.base.atomic import atomic_write
from guideload.base.errors import ArgumentError, GuideloadError, ValueRefused, shown
from guideload.base.units import quantity as to_unit
from guideload.simulation.files import _ending
from guideload.study import limits as passing
from guideload.study import quantities, statistics
from guideload.study.metadata import StudyMetadata
from guideload.study.quantities import CONTACT, PEAK, known_quantity, unit_of
from guideload.study.statistics import Estimate, Exceedance

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from guideload.study.store import SampleStore


LEVELS = (0.01, 0.05, 0.5, 0.95, 0.99)
# Samples that ranks are compared of, the first ones: the standard error of a rank correlation is then 0.003.
RANKED = 2**17
FEWEST = 10  # samples, or rows of a Saltelli design, from which on it is told what drives a figure


class StudyResult:
    """The samples of a study and their statistics; `studied` tells what was studied.

    A column is read when it is asked for and kept by nobody. Beside the columns as stored, `column` knows the
    figures of `QUANTITIES`: of one carriage, "peak_resultant_N[1a]", and of the machine, "peak_resultant_N": that
    of its worst carriage in each sample. Peaks are largest magnitudes.

    Samples that failed or have not run yet are left out of all statistics, and counted: `runs`, `finished`,
    `failed`. Of a Saltelli design the matrices A and B are the samples; the others only serve `sensitivity`.
    """

    def __init__(self, parts: SampleStore, studied: StudyMetadata) -> None:
        self.parts = parts
        self.studied = studied

    def __repr__(self) -> str:
        return f"StudyResult({self.studied.machine.name!r}, runs={self.runs}, failed={self.failed})"

    @classmethod
    def load(cls, folder: str | PathLike[str]) -> StudyResult:
        """The study in a folder, done or left. Raises ArgumentError if the folder holds none."""
        from guideload.study import manifest
        from guideload.study.store import FolderStore

        parts = FolderStore.open(Path(folder))
        there = manifest.read(Path(folder))
        try:
            return cls(parts, StudyMetadata.from_json((there or {})["studied"]))
        except (LookupError, TypeError, GuideloadError) as error:
            raise ArgumentError(f"{folder}: expected a study that guideload wrote, got {error}") from error

    @cached_property
    def histories(self) -> xr.Dataset | None:
        """The histories that were kept, or None.

        force, moment (sample, time, carriage, axis) and resultant (sample, time, carriage) [N, N m] of the samples;
        nominal_resultant (time, carriage) [N], if it is there, of the machine as described.
        """
        return self.parts.histories()

    # ---- columns

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        """The names of the quantities that the study has columns for, see `quantities.available`."""
        return quantities.available(self.studied)

    @cached_property
    def leading(self) -> str:
        """The figure that a study is about: the peak resultant, or the first there is where that was not kept."""
        told = sorted(quantities.summarised(self.studied), key=lambda name: name == CONTACT)
        if PEAK in told or not told:
            return PEAK if told else self.studied.columns[0]
        return told[0] if known_quantity(told[0]).has_worst else f"{told[0]}[{self.studied.carriages[0]}]"

    def column(self, name: str) -> Array:
        """A column of the samples, a name of a parameter, a measure or a quantity; NaN without result.

        Raises ValueRefused with the nearest names.
        """
        return self.samples_of(self._of_all_runs(name))

    def samples_of(self, whole: Array) -> Array:
        """The samples among all runs: of a Saltelli design those of A and B."""
        if not self.studied.sensitivity:
            return whole
        return whole.reshape(-1, len(self.studied.varied) + 2)[:, :2].ravel()

    def _of_all_runs(self, name: str) -> Array:
        quantity, _, label = name.partition("[")
        carriage = label.removesuffix("]")
        if quantity in self.quantities and not label and known_quantity(quantity).has_worst:
            figures = (figure for _, figure in self.figures(quantity))
            return reduce(known_quantity(quantity).worse, figures)
        if quantity in self.quantities and carriage in self.owners(quantity):
            return quantities.figure(
                self.parts, self.studied, quantity, self.owners(quantity).index(carriage)
            )
        if name in self.parts.columns:
            return self.parts.column(name)
        names = [*self._names(), *self.parts.columns]
        near = get_close_matches(name, names, n=3, cutoff=0.4) or names[:3]
        raise ValueRefused("a column of the study", name, f"nearest: {', '.join(near)}")

    def figures(self, name: str) -> Iterator[tuple[str, Array]]:
        """Each carriage, or "" for the machine, and the quantity of it for all runs."""
        for index, owner in enumerate(self.owners(name)):
            yield owner, quantities.figure(self.parts, self.studied, name, index)

    def owners(self, name: str) -> tuple[str, ...]:
        """The carriages that a quantity is told of, or "" where it is the machine's."""
        return ("",) if known_quantity(name).of_machine else self.studied.carriages

    def _names(self) -> Iterator[str]:
        """The names of all quantities, of every carriage and of the machine."""
        for name in self.quantities:
            yield from (f"{name}[{owner}]" for owner in self.owners(name) if owner)
            if known_quantity(name).has_worst:
                yield name

    # ---- counts

    @property
    def runs(self) -> int:
        """Samples of the whole study, those of a Saltelli design included."""
        return self.studied.runs

    @cached_property
    def reasons(self) -> dict[int, str]:
        """Why samples have no result, by their index."""
        return self.parts.reasons()

    @property
    def failed(self) -> int:
        """Runs without result."""
        return len(self.reasons)

    @property
    def finished(self) -> int:
        """Runs that are done, failed ones included."""
        return self.parts.done

    def failures(self) -> pd.DataFrame:
        """A row per kind of failure: how many, their share of the finished runs, the first sample.

        Reasons that differ in figures only are of one kind; the first one is shown.
        """
        import pandas as pd

        kinds: dict[str, list[int]] = {}
        for index in sorted(self.reasons):
            kinds.setdefault(re.sub(r"\d[\d.,_]*(?:e[+-]?\d+)?", "#", self.reasons[index]), []).append(index)
        rows = [
            (self.reasons[found[0]], len(found), len(found) / self.finished, found[0])
            for found in sorted(kinds.values(), key=len, reverse=True)
        ]
        return pd.DataFrame(rows, columns=["reason", "count", "share", "first_sample"])

    # ---- statistics

    def summary(self) -> pd.DataFrame:
        """A row per quantity and carriage, and for the machine one with carriage "".

        Columns: samples that count, mean, standard_deviation, quantiles q01, q05, q50, q95, q99, each with _low and
        _high, the ends of its interval at 95 %; infinite where there are too few samples.
        """
        import pandas as pd

        return pd.DataFrame(
            list(self._summary.values()),
            index=pd.MultiIndex.from_tuples(list(self._summary), names=["quantity", "carriage"]),
        )

    @cached_property
    def _summary(self) -> dict[tuple[str, str], dict[str, float]]:
        rows = {}
        for name in quantities.summarised(self.studied):
            quantity = known_quantity(name)
            worst: Array | None = None
            for owner, whole in self.figures(name):
                figure = self.samples_of(whole)
                worst = figure if worst is None else quantity.worse(worst, figure)
                rows[name, owner] = _described(figure)
            if worst is not None and quantity.has_worst:
                rows[name, ""] = _described(worst)
        return {key: row for key, row in rows.items() if row["samples"]}

    def quantiles(
        self, name: str, levels: Sequence[float] = LEVELS, confidence: float = statistics.CONFIDENCE
    ) -> pd.DataFrame:
        """Quantiles of a column: a row per level with value, low and high; see `statistics.quantiles`.

        Raises ArgumentError for levels that do not lie between 0 and 1.
        """
        import pandas as pd

        if np.ndim(levels) != 1 or not all(0 < level < 1 for level in levels):
            raise ArgumentError(
                f"levels: expected a list of levels between 0 and 1, got {shown(levels)}; "
                "[0.95] is for the 95 % quantile"
            )
        found = statistics.quantiles(self.column(name), levels, confidence)
        return pd.DataFrame(found._asdict(), index=pd.Index(levels, name="level")).rename(
            columns={"values": "value"}
        )

    def exceedance(self, name: str, confidence: float = statistics.CONFIDENCE) -> Exceedance:
        """Probability that a column reaches each of some limits; see `statistics.exceedance`."""
        return statistics.exceedance(self.column(name), confidence)

    def probability_above(
        self, name: str, limit: float | str, confidence: float = statistics.CONFIDENCE
    ) -> Estimate:
        """Probability that a column is above a limit; see `statistics.probability`.

        limit : in the column's unit, or text with its unit, "7 kN". Raises ValueRefused.
        """
        return self._probability(name, limit, below=False, confidence=confidence)

    def probability_below(
        self, name: str, limit: float | str, confidence: float = statistics.CONFIDENCE
    ) -> Estimate:
        """Probability that a column, such as a life, is below a limit."""
        return self._probability(name, limit, below=True, confidence=confidence)

    def _probability(self, name: str, limit: float | str, *, below: bool, confidence: float) -> Estimate:
        values = statistics.known(self.column(name))
        bound = to_unit(limit, self._unit(name)) if isinstance(limit, str) else limit
        passed = np.count_nonzero(values < bound if below else values > bound)
        return Estimate(*map(float, statistics.probability(passed, values.size, confidence)))

    def _unit(self, name: str) -> str:
        """The unit of a column, "1" without one."""
        units = {one.name: one.unit for one in self.studied.varied}
        return units.get(name) or unit_of(name.partition("[")[0]) or "1"

    def limits(self) -> dict[str, float]:
        """The limits asked for, by quantity and in its unit. Raises ValueRefused for one that there is not."""
        return quantities.limits_of(self.studied)

    def probabilities(self) -> pd.DataFrame:
        """A row per limit and carriage, and for the machine: that any carriage passes it, with carriage "".

        See `passing.probabilities`.
        """
        return passing.probabilities(self)

    def cases(self) -> pd.DataFrame:
        """A row per run, by sample: the values varied, `leading` of each carriage, life, limits passed.

        See `passing.cases`.
        """
        return passing.cases(self)

    @property
    def too_few(self) -> bool:
        """Whether there are too few samples to tell what drives a figure."""
        drawn = 2 if self.studied.sensitivity else 1
        return statistics.known(self.column(self.leading)).size < FEWEST * drawn

    # ---- what drives it

    def sensitivity(self, name: str | None = None, confidence: float = statistics.CONFIDENCE) -> pd.DataFrame:
        """First-order and total Sobol indices of a column, a row per parameter; see `statistics.sobol_indices`.

        name: None for `leading`.

        Columns: first_order, total, each with _low and _high, and rows, those of the design that count. Raises
        ArgumentError if the samples are no Saltelli design.
        """
        import pandas as pd

        if not self.studied.sensitivity:
            raise ArgumentError(
                "sensitivity: expected a Saltelli design, got samples that are drawn once; set sensitivity = true in "
                "the study, or use rank_correlation()"
            )
        matrices = self._of_all_runs(name or self.leading).reshape(-1, len(self.studied.varied) + 2)
        found = statistics.sobol_indices(matrices[:, 0], matrices[:, 1], matrices[:, 2:], confidence)
        table = {
            f"{what}{end}": values
            for what, part in (("first_order", found.first), ("total", found.total))
            for end, values in zip(("", "_low", "_high"), part, strict=True)
        }
        return pd.DataFrame({**table, "rows": found.rows}, index=self._parameters())

    def rank_correlation(
        self, name: str | None = None, confidence: float = statistics.CONFIDENCE
    ) -> pd.DataFrame:
        """Spearman's rank correlation of a column with each parameter: rank_correlation, low and high.

        Over the first 131 072 samples at most. That of correlated parameters holds what their partners do.
        """
        import pandas as pd

        factors = (self.column(one.name)[:RANKED] for one in self.studied.varied)
        found = statistics.rank_correlation(factors, self.column(name or self.leading)[:RANKED], confidence)
        table = {"rank_correlation": found.values, "low": found.low, "high": found.high}
        return pd.DataFrame(table, index=self._parameters())

    def driving(self, name: str | None = None) -> pd.DataFrame:
        """The parameters that drive a column, strongest first: by total Sobol indices if the design gives them,
        else by the size of their rank correlation."""
        if self.studied.sensitivity:
            return self.sensitivity(name).sort_values("total", ascending=False, kind="stable")
        return self.rank_correlation(name).sort_values(
            "rank_correlation", ascending=False, kind="stable", key=abs
        )

    def _parameters(self) -> pd.Index[str]:
        import pandas as pd

        return pd.Index([one.name for one in self.studied.varied], name="parameter")

    # ---- tables and files

    def table(self, columns: Sequence[str] | None = None) -> pd.DataFrame:
        """All runs by sample: these columns, or all as stored; and `reason`, None where there is a result."""
        import pandas as pd

        names = self.parts.columns if columns is None else columns
        data = {name: self._of_all_runs(name) for name in names}
        table = pd.DataFrame(data, index=pd.RangeIndex(self.runs, name="sample"))
        table["reason"] = [self.reasons.get(i) for i in range(self.runs)] if self.reasons else None
        return table

    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Write all runs as one Parquet file: sample, parameters, measures, reason; part by part."""
        import pyarrow.parquet

        with atomic_write(_ending(path, ".parquet")) as draft:
            tables = self.parts.tables()
            first = next(tables)
            with pyarrow.parquet.ParquetWriter(draft, first.schema) as writer:
                writer.write_table(first)
                for table in tables:
                    writer.write_table(table)

    def to_json(self, path: str | PathLike[str]) -> None:
        """Write what was studied, the counts and all tables of statistics as one small file; unknown is null.

        Of chosen cases the table of cases in place of the statistics.
        """
        tables = {"failures": self.failures()}
        if self.studied.chosen:
            tables["cases"] = self.cases().reset_index()
        else:
            tables["summary"] = self.summary().reset_index()
            tables["probabilities"] = self.probabilities().reset_index()
            tables["driving"] = self.driving().reset_index()
        content: dict[str, Any] = {
            "studied": self.studied.as_json(),
            "runs": self.runs,
            "finished": self.finished,
            "failed": self.failed,
            **{name: json.loads(table.to_json(orient="records")) for name, table in tables.items()},
        }
        with atomic_write(_ending(path, ".json")) as draft:
            draft.write_text(json.dumps(content, indent=1), encoding="utf-8")


def _described(values: Array) -> dict[str, float]:
    mean, deviation = statistics.mean_and_deviation(values)
    row: dict[str, float] = {
        "samples": statistics.known(values).size,
        "mean": mean,
        "standard_deviation": deviation,
    }
    for level, value, low, high in zip(LEVELS, *statistics.quantiles(values, LEVELS), strict=True):
        name = f"q{round(100 * level):02d}"
        row |= {name: float(value), f"{name}_low": float(low), f"{name}_high": float(high)}
    return row
