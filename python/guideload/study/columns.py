"""The columns of a study: stored columns, and quantities computed from them."""

from __future__ import annotations

from collections.abc import Iterator
from difflib import get_close_matches
from functools import cached_property, reduce

import numpy as np
import xarray as xr

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.errors import ValueRefused
from guideload.life.criteria import Criteria
from guideload.study import statistics
from guideload.study.metadata import StudyMetadata
from guideload.study.quantities import (
    CONTACT,
    LIFE,
    PEAK,
    PEAK_LOAD,
    QUANTITIES,
    RECORDED,
    SAFETY,
    column_name,
)
from guideload.study.storage import SampleStore


class StudyColumns:
    """Columns of samples, by name; read on demand and not cached.

    store     the stored samples
    metadata  description of the study

    Beside the stored columns there are the quantities of `QUANTITIES`: "peak_resultant_N[1a]" of a carriage, and
    "peak_resultant_N" of the worst carriage in each sample. Peaks are largest magnitudes. "life_km" is the
    life that all carriages with ratings reach with the stated probability.
    """

    def __init__(self, store: SampleStore, metadata: StudyMetadata) -> None:
        self.store = store
        self.metadata = metadata

    @property
    def runs(self) -> int:
        """Number of all runs of the study, those of a Saltelli design included."""
        return self.metadata.runs

    @cached_property
    def reasons(self) -> dict[int, str]:
        """Reasons of failed runs, by index."""
        return self.store.reasons()

    @property
    def failed(self) -> int:
        """Number of runs without result."""
        return len(self.reasons)

    @property
    def finished(self) -> int:
        """Number of finished runs, failed ones included."""
        return self.store.done

    @cached_property
    def rated(self) -> dict[str, Criteria]:
        """How life and static safety follow from the loads, by the name of each carriage that has them."""
        return {one.name: one for one in self.metadata.rated()}

    @cached_property
    def histories(self) -> xr.Dataset | None:
        """The stored histories, or None.

        force, moment (sample, time, carriage, axis) and resultant (sample, time, carriage) [N, N m] of the samples;
        nominal_resultant (time, carriage) [N] of the nominal machine, if it has a solution.
        """
        return self.store.histories()

    @cached_property
    def replicate(self) -> statistics.Replicate:
        """(samples,) the replicate of each sample, in the order of `column`; None for a design without replicates."""
        if self.metadata.replicates == 1:
            return None
        replicate = np.arange(self.runs // self.metadata.matrices) % self.metadata.replicates
        return np.repeat(replicate, 2) if self.metadata.sensitivity else replicate

    # ---- columns

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        """Names of the quantities that the recorded columns give."""
        return available(self.metadata)

    @cached_property
    def leading(self) -> str:
        """The main quantity of the study: the peak resultant, or if it is not recorded, the first quantity."""
        names = sorted(summarised(self.metadata), key=lambda name: name == CONTACT)
        if PEAK in names or not names:
            return PEAK if names else self.metadata.columns[0]
        return names[0] if QUANTITIES[names[0]].worse else f"{names[0]}[{self.metadata.carriages[0]}]"

    @checked
    def column(self, name: str) -> Array:
        """The column of a parameter, a measure or a quantity, by name; NaN for samples without result.

        Raises ValueRefused with the nearest names.
        """
        return self._samples(self.of_all_runs(name))

    def _samples(self, runs: Array) -> Array:
        """The samples among all runs: for a Saltelli design the rows of A and B."""
        return runs.reshape(-1, self.metadata.matrices)[:, :2].ravel()

    @checked
    def of_all_runs(self, name: str) -> Array:
        """Values (runs,) of a column in all runs, of a Saltelli design the mixed ones included; names as in `column`.

        NaN for runs without result. Raises ValueRefused with the nearest names.
        """
        stem, _, label = name.partition("[")
        if stem in self.quantities:
            owner, worse = label.removesuffix("]"), QUANTITIES[stem].worse
            if owner in self.owners(stem):
                return self._quantity(stem, owner)
            if not label and worse is not None:
                return reduce(worse, (self._quantity(stem, one) for one in self.owners(stem)))
        if name in self.store.columns:
            return self.store.column(name)
        names = [*self.names(), *self.store.columns]
        raise ValueRefused("a column of the study", name, nearest(name, names))

    def _quantity(self, name: str, owner: str) -> Array:
        """(runs,) a quantity of a carriage, or with the name "" of the machine."""
        names = (column_name(*source) for source in QUANTITIES[name].sources)
        first, *rest = (self.store.column(f"{one}[{owner}]" if owner else one) for one in names)
        for other in rest:
            first = np.maximum(np.abs(first), np.abs(other))
        if name == LIFE:
            return 1e-3 * self.rated[owner].life_under(first)
        return self.rated[owner].safety_under(first) if name == SAFETY else first

    @checked
    def of_carriages(self, name: str) -> list[str]:
        """Columns of a quantity: one per carriage, or one for the machine."""
        return [f"{name}[{owner}]" if owner else name for owner in self.owners(name)]

    @checked
    def owners(self, name: str) -> tuple[str, ...]:
        """Names of the carriages that have the quantity; ("",) for a quantity of the machine.

        Raises ValueRefused for an unknown quantity.
        """
        if name not in QUANTITIES:
            raise ValueRefused("a quantity", name, f"this study has {', '.join(self.quantities)}")
        if QUANTITIES[name].is_rated:
            return tuple(self.rated)
        return ("",) if QUANTITIES[name].of_machine else self.metadata.carriages

    def _owned(self, name: str) -> Iterator[tuple[str, Array]]:
        """Samples of a quantity by carriage, and by "" those of the machine: of its worst carriage, or its life."""
        worse, worst = QUANTITIES[name].worse, None
        for owner in self.owners(name):
            values = self._samples(self._quantity(name, owner))
            worst = values if worst is None or worse is None else worse(worst, values)
            yield owner, values
        if worse is not None and worst is not None and not QUANTITIES[name].of_machine:
            yield "", worst

    def names(self) -> Iterator[str]:
        """Names of the columns of all quantities, of carriages and of the machine."""
        for name in self.quantities:
            yield from self.of_carriages(name)
            if QUANTITIES[name].worse is not None and not QUANTITIES[name].of_machine:
                yield name


def available(metadata: StudyMetadata) -> tuple[str, ...]:
    """Quantities that the recorded columns give; a life if they give a static safety, too.

    A recorded column is among them only if no other quantity contains it, as "max_Fy_N" without "min_Fy_N".
    """
    recorded = {(load, statistic) for load, _, statistic in metadata.measures}
    columns = dict.fromkeys(column_name(load, statistic) for load, _, statistic in metadata.measures)
    made = [
        name
        for name, quantity in QUANTITIES.items()
        if name not in RECORDED
        and recorded.issuperset(quantity.sources)
        and (name != LIFE or PEAK_LOAD in recorded)
    ]
    used = {source for name in made for source in QUANTITIES[name].sources}
    rest = (name for name in columns if name in RECORDED and not used.issuperset(QUANTITIES[name].sources))
    return (*made, *rest)


def summarised(metadata: StudyMetadata) -> tuple[str, ...]:
    """Quantities in the summary: those of `in_summary`, or all if these contain no load."""
    names = available(metadata)
    in_summary = tuple(name for name in names if QUANTITIES[name].in_summary)
    return in_summary if set(in_summary) - {CONTACT} else names


def nearest(name: str, names: list[str]) -> str:
    """Those of `names` that are nearest to a wrong name, or the first ones, as a hint."""
    near = get_close_matches(name, names, n=3, cutoff=0.4) or names[:3]
    return f"nearest: {', '.join(near)}"
