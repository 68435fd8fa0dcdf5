"""The columns of a study: those stored, and the quantities that are made of them."""

from __future__ import annotations

from collections.abc import Iterator
from difflib import get_close_matches
from functools import cached_property, reduce

import numpy as np
import xarray as xr

from guideload.base.arrays import Array
from guideload.base.errors import ValueRefused
from guideload.study.description.measures import CONTACT, LIFE, PEAK, QUANTITIES, RECORDED
from guideload.study.description.metadata import StudyMetadata
from guideload.study.storage.store import SampleStore


class StudyColumns:
    """Columns of samples, by name; read on demand and not cached.

    store     the stored samples
    metadata  what the study is

    Beside the stored columns there are the quantities of `QUANTITIES`: of one carriage, "peak_resultant_N[1a]", and of
    the machine, "peak_resultant_N": that of its worst carriage in each sample. Peaks are largest magnitudes.
    """

    def __init__(self, store: SampleStore, metadata: StudyMetadata) -> None:
        self.store = store
        self.metadata = metadata

    @property
    def runs(self) -> int:
        """Samples of the whole study, those of a Saltelli design included."""
        return self.metadata.runs

    @cached_property
    def reasons(self) -> dict[int, str]:
        """Why samples have no result, by their index."""
        return self.store.reasons()

    @property
    def failed(self) -> int:
        """Runs without result."""
        return len(self.reasons)

    @property
    def finished(self) -> int:
        """Runs that are done, failed ones included."""
        return self.store.done

    @cached_property
    def histories(self) -> xr.Dataset | None:
        """The stored histories, or None.

        force, moment (sample, time, carriage, axis) and resultant (sample, time, carriage) [N, N m] of the samples;
        nominal_resultant (time, carriage) [N], if it is there, of the machine as described.
        """
        return self.store.histories()

    # ---- columns

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        """The names of the quantities that the study has columns for."""
        return available(self.metadata)

    @cached_property
    def leading(self) -> str:
        """The main quantity of the study: the peak resultant, or the first one where that was not recorded."""
        names = sorted(summarised(self.metadata), key=lambda name: name == CONTACT)
        if PEAK in names or not names:
            return PEAK if names else self.metadata.columns[0]
        return names[0] if QUANTITIES[names[0]].worse else f"{names[0]}[{self.metadata.carriages[0]}]"

    def column(self, name: str) -> Array:
        """A column of the samples, the name of a parameter, a measure or a quantity; NaN without result.

        Raises ValueRefused with the nearest names.
        """
        return self._samples(self._of_all_runs(name))

    def _samples(self, runs: Array) -> Array:
        """The samples among all runs: of a Saltelli design those of A and B."""
        if not self.metadata.sensitivity:
            return runs
        return runs.reshape(-1, len(self.metadata.parameters) + 2)[:, :2].ravel()

    def _of_all_runs(self, name: str) -> Array:
        stem, _, label = name.partition("[")
        quantity, owner = QUANTITIES.get(stem), label.removesuffix("]")
        if stem in self.quantities and quantity is not None:
            owners = self.owners(stem)
            if owner in owners:
                return self._quantity(stem, owners.index(owner))
            if not label and quantity.worse is not None:
                return reduce(quantity.worse, (self._quantity(stem, i) for i in range(len(owners))))
        if name in self.store.columns:
            return self.store.column(name)
        names = [*self._names(), *self.store.columns]
        near = get_close_matches(name, names, n=3, cutoff=0.4) or names[:3]
        raise ValueRefused("a column of the study", name, f"nearest: {', '.join(near)}")

    def _quantity(self, name: str, index: int) -> Array:
        """A quantity of the carriage with this index, (runs,)."""
        metadata = self.metadata
        columns = dict(zip(metadata.measures, metadata.columns, strict=True))
        sources = QUANTITIES[name].sources
        first, *rest = (self.store.column(columns[load, index, statistic]) for load, statistic in sources)
        for other in rest:
            first = np.maximum(np.abs(first), np.abs(other))
        if name != LIFE:
            return first
        assert metadata.life is not None
        with np.errstate(divide="ignore"):  # without load it is infinite
            return 1e-3 * metadata.life.base * (metadata.life.rating / first) ** metadata.exponent

    def of_carriages(self, name: str) -> list[str]:
        """The columns of a quantity: of each carriage, or its only one."""
        return [f"{name}[{owner}]" if owner else name for owner in self.owners(name)]

    def owners(self, name: str) -> tuple[str, ...]:
        """The carriages of a quantity, or "" where it is the machine's."""
        return ("",) if QUANTITIES[name].of_machine else self.metadata.carriages

    def _owned(self, name: str) -> Iterator[tuple[str, Array]]:
        """Each carriage and its samples of a quantity, and "" with those of the worst carriage in each sample."""
        worse, worst = QUANTITIES[name].worse, None
        for index, owner in enumerate(self.owners(name)):
            values = self._samples(self._quantity(name, index))
            worst = values if worst is None or worse is None else worse(worst, values)
            yield owner, values
        if worse is not None and worst is not None and not QUANTITIES[name].of_machine:
            yield "", worst

    def _names(self) -> Iterator[str]:
        """The names of all quantities, of every carriage and of the machine."""
        for name in self.quantities:
            yield from self.of_carriages(name)
            if QUANTITIES[name].worse is not None and not QUANTITIES[name].of_machine:
                yield name


def available(metadata: StudyMetadata) -> tuple[str, ...]:
    """The quantities that a study has columns for; a life if the study has a rating.

    Recorded columns only where no other quantity is made of them: "max_Fy_N" without "min_Fy_N".
    """
    recorded = {(load, statistic) for load, _, statistic in metadata.measures}
    columns = dict.fromkeys(column.partition("[")[0] for column in metadata.columns)
    made = [
        name
        for name, quantity in QUANTITIES.items()
        if name not in RECORDED and recorded.issuperset(quantity.sources) and (name != LIFE or metadata.life)
    ]
    used = {source for name in made for source in QUANTITIES[name].sources}
    rest = (name for name in columns if name in RECORDED and not used.issuperset(QUANTITIES[name].sources))
    return (*made, *rest)


def summarised(metadata: StudyMetadata) -> tuple[str, ...]:
    """The quantities of the summary; all available ones where it would have no loads."""
    names = available(metadata)
    in_summary = tuple(name for name in names if QUANTITIES[name].in_summary)
    return in_summary if set(in_summary) - {CONTACT} else names
