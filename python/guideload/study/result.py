"""The result of a study: statistics of its columns, tables, files."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from pyarrow.parquet import ParquetWriter

from guideload.base.arguments import checked, real_array
from guideload.base.arrays import Array, Flags
from guideload.base.atomic import atomic_write, with_ending
from guideload.base.errors import ArgumentError, DoubtfulResult, ValueRefused, shown
from guideload.base.finite import finite_json
from guideload.base.notebook import as_html
from guideload.base.units import quantity as to_unit
from guideload.life.rating_life import failure_probability
from guideload.study import statistics
from guideload.study.columns import StudyColumns, summarised
from guideload.study.metadata import StudyVerification
from guideload.study.quantities import CONTACT, LIFE, QUANTITIES, SAFETY, quantity_unit
from guideload.study.statistics import Estimate, Exceedance
from guideload.study.storage import FolderStore

LEVELS = (0.01, 0.05, 0.5, 0.95, 0.99)
RANKED = 2**17  # samples in a rank correlation: the first ones, for a standard error of 0.003
NUMBER = r"\d[\d.,_]*(?:e[+-]?\d+)?"
FEWEST = 10  # samples, or rows of a Saltelli design, for the influence of parameters on a quantity


class StudyResult(StudyColumns):
    """The samples of a study and their statistics; see `StudyColumns` for its columns.

    Statistics leave out samples that failed or have not run yet; `runs`, `finished` and `failed` count them. In a
    Saltelli design the samples are the rows of A and B; the other matrices are for `sensitivity` only.
    """

    def __repr__(self) -> str:
        head = f"StudyResult({self.metadata.machine.name!r}, runs={self.runs}, finished={self.finished}"
        return f"{head}, {' '.join(self.doubts) or self.verification_text})"

    def _repr_html_(self) -> str:
        return as_html(repr(self), self.summary())

    @classmethod
    @checked
    def load(cls, folder: str | PathLike[str]) -> StudyResult:
        """The finished or interrupted study in a folder. Raises ReadError if the folder holds none."""
        store = FolderStore.open(Path(folder))
        return cls(store, store.metadata)

    # ---- judgement of the samples

    @property
    def verification(self) -> StudyVerification | str | None:
        """Samples that were solved again; text if none had to be or could be; None in an unfinished study."""
        return self.metadata.verification

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Warnings that samples are wrong or unpredictable, from those that were solved again."""
        second = self.verification
        return second.doubts(self._sample_word) if isinstance(second, StudyVerification) else ()

    @property
    def verification_text(self) -> str:
        """The outcome of the verification without doubts, in words."""
        second, what = self.verification, self._sample_word
        if second is None:
            return f"not judged: the check of some {what}s by a second method follows when all are done"
        return f"check by a second method: {second}" if isinstance(second, str) else second.agreement(what)

    @property
    def _sample_word(self) -> str:
        return "case" if self.metadata.chosen else "sample"

    def raise_if_doubtful(self) -> None:
        """Raise DoubtfulResult if samples are wrong or unpredictable; see `doubts`."""
        if self.doubts:
            raise DoubtfulResult(" ".join(self.doubts))

    def failures(self) -> pd.DataFrame:
        """A row per kind of failure: count, share of the finished runs, first sample.

        Reasons that differ only in numbers are one kind, shown by its first reason.
        """
        samples = pd.DataFrame(sorted(self.reasons.items()), columns=["first_sample", "reason"])
        kinds = samples["reason"].astype(str).str.replace(NUMBER, "#", regex=True).rename("kind")
        table = samples.groupby(kinds, sort=False).agg(
            reason=("reason", "first"), count=("reason", "size"), first_sample=("first_sample", "first")
        )
        table.insert(2, "share", table["count"] / self.finished)
        return table.sort_values("count", ascending=False, kind="stable", ignore_index=True)

    # ---- statistics

    def summary(self) -> pd.DataFrame:
        """A row per quantity and carriage, and per quantity of the machine, with carriage "".

        Columns: samples (their number), standard_deviation, mean and quantiles q01, q05, q50, q95, q99, each with
        _low and _high, the ends of its 95 % interval, and _standard_error; infinite for too few samples.
        """
        return _by_quantity_and_carriage(self._summary)

    @cached_property
    def _summary(self) -> dict[tuple[str, str], dict[str, float]]:
        return {
            (name, owner): row
            for name in summarised(self.metadata)
            for owner, values in self._owned(name)
            if (row := _described(values, self.replicate))["samples"]
        }

    @checked
    def quantiles(
        self, name: str, levels: ArrayLike = LEVELS, confidence: float = statistics.CONFIDENCE
    ) -> pd.DataFrame:
        """Quantiles of a column: a row per level with value, low, high and standard_error.

        See `statistics.quantiles`. Raises ArgumentError for levels that do not lie between 0 and 1.
        """
        shares = real_array("levels", levels)
        if shares.ndim != 1 or not shares.size or not np.all((shares > 0) & (shares < 1)):
            raise ArgumentError(
                f"levels: expected a list of levels between 0 and 1, got {shown(levels)}; "
                "[0.95] is for the 95 % quantile"
            )
        estimates = statistics.quantiles(self.column(name), shares, confidence, self.replicate)
        columns = ("value", "low", "high", "standard_error")
        return pd.DataFrame(np.transpose(estimates), pd.Index(shares, name="level"), columns)

    @checked
    def exceedance(self, name: str, confidence: float = statistics.CONFIDENCE) -> Exceedance:
        """Exceedance curve of a column: limits and probabilities; see `statistics.exceedance`."""
        return statistics.exceedance(self.column(name), confidence, self.replicate)

    @checked
    def probability_above(
        self, name: str, limit: float | str, confidence: float = statistics.CONFIDENCE
    ) -> Estimate:
        """Probability that a column is above a limit; see `statistics.probability`.

        limit: in the column's unit, or text with a unit, "7 kN". Raises ValueRefused.
        """
        return self._probability(name, limit, np.greater, confidence)

    @checked
    def probability_below(
        self, name: str, limit: float | str, confidence: float = statistics.CONFIDENCE
    ) -> Estimate:
        """Probability that a column, such as a life, is below a limit."""
        return self._probability(name, limit, np.less, confidence)

    def _probability(self, name: str, limit: float | str, compare: Any, confidence: float) -> Estimate:
        units = {parameter.name: parameter.unit for parameter in self.metadata.parameters}
        unit = units.get(name) or quantity_unit(name.partition("[")[0]) or "1"
        bound = to_unit(limit, unit) if isinstance(limit, str) else float(limit)
        if np.isnan(bound):
            raise ValueRefused("a number as the limit", bound, 'such as "7 kN"')
        values = self.column(name)
        return self._event_probability(compare(values, bound), values, confidence)

    def _event_probability(
        self, event: Flags, values: Array, confidence: float = statistics.CONFIDENCE
    ) -> Estimate:
        """Probability of an event, in the samples that have a value."""
        counts, samples = (statistics.counted(which, self.replicate) for which in (event, ~np.isnan(values)))
        return Estimate(*map(float, statistics.probability(counts, samples, confidence)))

    @cached_property
    def limits(self) -> dict[str, float]:
        """The limits, and NaN for lost contact where it was recorded."""
        return self.metadata.limits | ({CONTACT: np.nan} if CONTACT in self.quantities else {})

    def probabilities(self) -> pd.DataFrame:
        """Probabilities of exceeding the limits: a row per limit and carriage, and with carriage "" for any carriage.

        A life exceeds its limit if it is below, other quantities if they are above. Lost contact has a row with
        the limit NaN. Columns: limit, samples, count, probability, low, high, standard_error; see
        `statistics.probability`.
        """
        rows = {}
        for name, limit in self.limits.items():
            for owner, column in self._owned(name):
                exceeded, samples = QUANTITIES[name].exceeds(column, limit), statistics.known(column).size
                estimate = self._event_probability(exceeded, column)
                rows[name, owner] = (limit, samples, int(np.count_nonzero(exceeded)), *estimate)
        columns = ["limit", "samples", "count", "probability", "low", "high", "standard_error"]
        return _by_quantity_and_carriage(rows, columns)

    @checked
    def failure_probability(
        self, travel: float | str | None = None, confidence: float = statistics.CONFIDENCE
    ) -> pd.DataFrame:
        """Probability of a failure by fatigue before a travel: a row per carriage with a rating, and "" for any.

        travel: in km, or a life as text, "20000 km" or "10000 h"; default: the limit on the life. In each sample a
        carriage fails before it with the probability 1 - R^((travel/L)^1.5), a Weibull distribution, with the rating
        life L of this sample and its reliability R. The mean over the samples combines the scatter of fatigue with that
        of the parameters.

        Columns: travel_km, samples, probability, low, high and standard_error (of the mean), and shorter, the share of
        the samples whose rating life is shorter than the travel. Raises ArgumentError without rating or
        travel.
        """
        travel = self.metadata.limits.get(LIFE) if travel is None else travel
        if not self.rated or travel is None:
            missing = "a limit on the life" if self.rated else "carriages whose products have ratings"
            raise ArgumentError(f"failure_probability: expected {missing}, which this study does not have")
        life = QUANTITIES[LIFE]
        distance = life.limit(travel, self.metadata.repetition) if isinstance(travel, str) else float(travel)
        if not distance > 0.0:
            raise ArgumentError(f"travel: expected > 0 km, got {shown(travel)}")
        rows = {}
        for owner, column in self._owned(LIFE):
            lives = statistics.known(column)
            failed = failure_probability(distance, column, self.metadata.machine.life.reliability)
            estimate = statistics.mean_share(failed, confidence, self.replicate)
            shorter = float(np.mean(lives < distance)) if lives.size else np.nan
            rows[owner] = (distance, lives.size, *estimate, shorter)
        columns = ["travel_km", "samples", "probability", "low", "high", "standard_error", "shorter"]
        return pd.DataFrame(list(rows.values()), pd.Index(list(rows), name="carriage"), columns)

    def cases(self) -> pd.DataFrame:
        """A row per run: parameters, main quantity, and exceeded limits.

        Columns: parameters; the leading quantity of each carriage; life_km and static_safety of the machine, if
        carriages have ratings; exceeded: the limits that any carriage exceeds and lost contact, or "failed" for a run
        without result.
        """
        stem = self.leading.partition("[")[0]
        life = [name for name in (LIFE, SAFETY) if name in self.quantities and stem != name]
        table = self.table([*(one.name for one in self.metadata.parameters), *self.of_carriages(stem), *life])
        exceeded: list[list[str]] = [["failed"] if i in self.reasons else [] for i in range(self.runs)]
        for name, limit in self.limits.items():
            for i in np.flatnonzero(QUANTITIES[name].exceeds(self.column(name), limit)):
                exceeded[i].append(self.metadata.title(name))
        table["exceeded"] = [", ".join(names) for names in exceeded]
        return table.drop(columns="reason")

    # ---- influence of the parameters

    @property
    def too_few(self) -> bool:
        """Whether there are too few samples to estimate the influence of parameters."""
        drawn = 2 if self.metadata.sensitivity else 1
        return statistics.known(self.column(self.leading)).size < FEWEST * drawn

    @checked
    def sensitivity(self, name: str | None = None, confidence: float = statistics.CONFIDENCE) -> pd.DataFrame:
        """First-order and total Sobol indices of a column, a row per parameter; see `statistics.sobol_indices`.

        name: None for `leading`. Columns: first_order and total, each with _low, _high and _standard_error, and rows,
        the number of rows of the design with results. Raises ArgumentError if the samples are no Saltelli design.
        """
        if not self.metadata.sensitivity:
            raise ArgumentError(
                "sensitivity: expected a Saltelli design, got samples that are drawn once; set sensitivity = true in "
                "the study, or use rank_correlation()"
            )
        matrices = self.of_all_runs(name or self.leading).reshape(-1, self.metadata.matrices)
        replicate = None if self.replicate is None else self.replicate[::2]  # of the rows
        indices = statistics.sobol_indices(
            matrices[:, 0], matrices[:, 1], matrices[:, 2:], confidence, replicate
        )
        table = _with_ends("first_order", indices.first) | _with_ends("total", indices.total)
        names = pd.Index([one.name for one in self.metadata.parameters], name="parameter")
        return pd.DataFrame(table | {"rows": indices.rows}, index=names)

    @checked
    def rank_correlation(
        self,
        name: str | None = None,
        confidence: float = statistics.CONFIDENCE,
        *,
        to_both_sides: bool = False,
    ) -> pd.DataFrame:
        """Spearman's rank correlation of a column with each parameter: rank_correlation, low, high, standard_error.

        to_both_sides: with the distance of each parameter from its median. The correlation with the parameter itself
        is 0 for a centre of mass that loads another carriage on either side, that with the distance is not.

        At most the first RANKED samples are used. For correlated parameters it includes the influence of the others. A
        drawn motion has no rank: `sensitivity` gives its influence.
        """
        names = [one.name for one in self.metadata.parameters if not one.is_draw]
        parameters = (self.column(name)[:RANKED] for name in names)
        if to_both_sides:
            parameters = (np.abs(each - np.nanmedian(each)) for each in parameters)
        values = self.column(name or self.leading)[:RANKED]
        estimates = statistics.rank_correlation(parameters, values, confidence)
        columns = ("rank_correlation", "low", "high", "standard_error")
        return pd.DataFrame(np.transpose(estimates), pd.Index(names, name="parameter"), columns)

    @checked
    def driving(self, name: str | None = None) -> pd.DataFrame:
        """Influence of the parameters on a column, strongest first.

        `sensitivity` if the design allows it; else a `rank_correlation`: that with the parameter, or that with its
        distance from its median if it is larger and its interval excludes 0. Column `to_both_sides` says which.
        """
        if self.metadata.sensitivity:
            return self.sensitivity(name).sort_values("total", ascending=False, kind="stable")
        one_way, both = (self.rank_correlation(name, to_both_sides=each) for each in (False, True))
        folded = both["rank_correlation"].abs() > one_way["rank_correlation"].abs()
        folded &= both["low"] * both["high"] > 0.0  # no zero in the interval: not by chance
        table = one_way.mask(folded, both).assign(to_both_sides=folded)
        return table.sort_values("rank_correlation", key=abs, ascending=False, kind="stable")

    # ---- tables and files

    @checked
    def table(self, columns: Sequence[str] | None = None) -> pd.DataFrame:
        """A row per run: these columns, or all stored ones, and `reason`, None for a run with a result."""
        names = self.store.columns if columns is None else columns
        index = pd.RangeIndex(self.runs, name="sample")
        table = pd.DataFrame({name: self.of_all_runs(name) for name in names}, index=index)
        table["reason"] = [self.reasons.get(i) for i in range(self.runs)] if self.reasons else None
        return table

    @checked
    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Write all runs as one Parquet file: sample, parameters, measures, reason; chunk by chunk."""
        tables = self.store.tables()
        first = next(tables)
        with (
            atomic_write(with_ending(path, ".parquet")) as draft,
            ParquetWriter(draft, first.schema) as writer,
        ):
            for table in chain([first], tables):
                writer.write_table(table)

    @checked
    def to_json(self, path: str | PathLike[str]) -> None:
        """Write the metadata, the counts and all tables of statistics as one small file; unknown values are null.

        For given cases, the table of cases replaces the statistics.
        """
        tables = {"failures": self.failures()}
        if self.metadata.chosen:
            tables["cases"] = self.cases().reset_index()
        else:
            tables["summary"] = self.summary().reset_index()
            tables["probabilities"] = self.probabilities().reset_index()
            tables["driving"] = self.driving().reset_index()
            if LIFE in self.limits:
                tables["failure"] = self.failure_probability().reset_index()
        content: dict[str, Any] = {
            "metadata": self.metadata.as_json(),
            "runs": self.runs,
            "finished": self.finished,
            "failed": self.failed,
            "doubts": self.doubts,
            **{name: json.loads(table.to_json(orient="records")) for name, table in tables.items()},
        }
        with atomic_write(with_ending(path, ".json")) as draft:
            draft.write_text(finite_json(content, indent=1), encoding="utf-8")


def weaker_parameters(drivers: pd.DataFrame, shown: int) -> list[str]:
    """Text for the parameters of `StudyResult.driving` after the first `shown`; empty if there are none."""
    rest = drivers.iloc[shown:]
    if not len(rest):
        return []
    largest = rest["total" if "total" in rest else "rank_correlation"].abs().max()
    beyond = "which do not vary" if np.isnan(largest) else f"none beyond {largest:.2f}"
    return [f"and {len(rest)} more, {beyond}"]


def _by_quantity_and_carriage(
    rows: dict[tuple[str, str], Any], columns: list[str] | None = None
) -> pd.DataFrame:
    index = pd.MultiIndex.from_tuples(list(rows), names=["quantity", "carriage"])
    return pd.DataFrame(list(rows.values()), index=index, columns=columns)


def _described(values: Array, replicate: statistics.Replicate) -> dict[str, float]:
    row: dict[str, float] = {"samples": statistics.known(values).size}
    row |= _with_ends("mean", statistics.mean(values, replicate=replicate))
    row["standard_deviation"] = statistics.mean_and_deviation(values)[1]
    estimates = statistics.quantiles(values, LEVELS, replicate=replicate)
    for level, *estimate in zip(LEVELS, *estimates, strict=True):
        row |= _with_ends(f"q{round(100 * level):02d}", map(float, estimate))
    return row


def _with_ends(name: str, estimate: Iterable[Any]) -> dict[str, Any]:
    """An estimate, the ends of its interval and its standard error, by column name."""
    return dict(zip((name, f"{name}_low", f"{name}_high", f"{name}_standard_error"), estimate, strict=True))
