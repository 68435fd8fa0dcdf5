"""The figure that matters: an unknown of the machine, or a peak load, mean load or life that follows from all of them.

Its uncertainty is that of the unknowns through its derivatives (delta method). Figures of runs are positive, so their
intervals are those of the logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field, StrictStr, model_validator

from guideload.base.arrays import Array
from guideload.base.config import ConfigModel
from guideload.base.errors import ArgumentError, ValueRefused
from guideload.base.number_text import joined
from guideload.duty.description import read_duty
from guideload.identification.intervals import NORMAL_QUANTILE
from guideload.identification.result import Identification
from guideload.life.criteria import Criteria, criteria_of
from guideload.life.mean_load import Travel, integrals
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.sensitivity.figures import Figures
from guideload.sensitivity.influence import UNITS
from guideload.sensitivity.varied import VariedMachine
from guideload.study.options import TraceOptions

FileName = Annotated[StrictStr, Field(min_length=1)]
Quantity = Literal["peak_resultant", "mean_load", "life"]
WORDS = {"peak_resultant": "peak load", "mean_load": "mean load", "life": "life"}


class Run(NamedTuple):
    """A motion of a machine, and how often it is run."""

    machine: Machine
    motion: Motion
    cycles: float = 1.0


@dataclass(frozen=True, eq=False)
class Figure:
    """A figure of an identified machine.

    name         in words
    unit         SI
    value        of the most probable machine
    derivatives  by the values of the unknowns, by their names
    low, high    interval with a probability of 95 %
    """

    name: str
    unit: str
    value: float
    derivatives: dict[str, float]
    low: float
    high: float


class FigureTable(ConfigModel):
    """A figure of a carriage under a motion, or under all load cases of a duty file."""

    quantity: Quantity = Field(description='"peak_resultant", "mean_load" or "life" of a carriage')
    carriage: StrictStr | None = Field(
        default=None,
        description="its name; by default the carriage with the largest load or the shortest life",
    )
    motion: FileName | None = Field(default=None, description='trace or planned moves, e.g. "moves.toml"')
    reading: TraceOptions = Field(default=TraceOptions(), description="how the trace is read, as in a study")
    duty: FileName | None = Field(
        default=None, description="a duty file, in place of a motion: all its load cases together"
    )

    @model_validator(mode="after")
    def _one_motion(self) -> FigureTable:
        if (self.motion is None) == (self.duty is None):
            raise ValueRefused("either motion or duty", [self.motion, self.duty], "of the figure")
        return self

    def of(self, found: Identification, folder: Path) -> Figure:
        """The figure of an identified machine. Raises ConfigError, ArgumentError, LifeError, TraceError."""
        if self.duty is None:
            assert self.motion is not None
            runs = [Run(found.nominal, self.reading.motion(folder / self.motion, found.nominal))]
        else:
            described, machines = read_duty(folder / self.duty)
            runs = [
                Run(
                    machine,
                    case.reading.motion((folder / self.duty).parent / case.motion, machine),
                    case.cycles,
                )
                for case, machine in zip(described.cases, machines, strict=True)
            ]
        return figure_of(found, self.quantity, runs, self.carriage)


def figure_of_unknown(found: Identification, name: str) -> Figure:
    """An unknown as the figure that matters. Raises ArgumentError for a name that is no unknown."""
    names = [one.name for one in found.unknowns]
    if name not in names:
        raise ArgumentError(f"figure: expected names of unknowns ({', '.join(names)}), got {name!r}")
    one = found.estimates[names.index(name)]
    return Figure(name, one.unit, one.value, {name: 1.0}, one.low, one.high)


def figure_of(
    found: Identification, quantity: Quantity, runs: Sequence[Run], carriage: str | None = None
) -> Figure:
    """A figure of a carriage of the identified machine, under motions that are run in turns.

    The peak load is the largest one of all runs, mean load and life are over the distance of all. The machines of the
    runs take the identified values. Raises ArgumentError without derivatives, LifeError without ratings.
    """
    names = [one.name for one in found.nominal.carriages]
    if carriage is not None and carriage not in names:
        raise ArgumentError(f"figure.carriage: expected one of {joined(names)}, got {carriage!r}")
    computed = [_figures(found, one.machine, one.motion) for one in runs]
    if quantity == "peak_resultant":
        peaks = [each.peak_resultant() for each in computed]
        largest = np.argmax([values for values, _ in peaks], axis=0)
        values = np.array([peaks[k][0][i] for i, k in enumerate(largest)])
        slopes = np.array([peaks[k][1][:, i] for i, k in enumerate(largest)]).T
    else:
        values, slopes = _over_distance(found.nominal, computed, runs, quantity)
    worst = np.nanargmin(values) if quantity == "life" else np.nanargmax(values)
    index = int(worst) if carriage is None else names.index(carriage)
    value, slope = float(values[index]), slopes[:, index]
    if not np.isfinite([value, *slope]).all():
        notes = "; ".join(note for each in computed for note in each.notes) or "it has no ratings"
        raise ArgumentError(
            f"figure: the {WORDS[quantity]} of carriage {names[index]} has no derivatives: {notes}"
        )
    derivatives = {one.name: float(by) for one, by in zip(found.unknowns, slope, strict=True)}
    p, gradient = len(found.unknowns), slope * found.model.slopes / value
    half = NORMAL_QUANTILE * math.sqrt(gradient @ found.covariance[:p, :p] @ gradient)
    name = f"{WORDS[quantity]} of carriage {names[index]}"
    ends = value * math.exp(-half), value * math.exp(half)
    return Figure(name, UNITS[quantity], value, derivatives, *ends)


def _figures(found: Identification, machine: Machine, motion: Motion) -> Figures:
    """Figures of a run with the identified values. Raises ArgumentError if the unknowns mean something else there."""
    varied = VariedMachine(machine, {one.name: one.targets for one in found.unknowns}, motion)
    for unknown, column in zip(found.unknowns, varied.columns, strict=True):
        if unknown.is_factor != (column.form == "factor") or (
            unknown.is_factor and column.value != unknown.start
        ):
            raise ArgumentError(
                f"figure: {unknown.name} sets numbers that are equal in {found.nominal.name} and differ in "
                f"{machine.name}, or the other way round; leave them out of the changes of the load case"
            )
    return Figures(varied.run(motion, [estimate.value for estimate in found.estimates]))


def _over_distance(
    machine: Machine, computed: Sequence[Figures], runs: Sequence[Run], quantity: Quantity
) -> tuple[Array, Array]:
    """Mean load or life (carriage,) over the distance of all runs, and derivatives (p, carriage)."""
    means = [each.mean_load() for each in computed]
    values, slopes = np.full(means[0][0].size, np.nan), np.full(means[0][1].shape, np.nan)
    for one in criteria_of(machine, machine.life):
        distances = np.array([run.cycles * _distance(run.motion, one) for run in runs])
        if not distances.any():
            raise ArgumentError(
                "figure: expected a motion that travels, as the mean load is a mean over distance"
            )
        shares = distances / distances.sum()
        exponent = one.rating.exponent
        loads = np.array([mean[one.index] for mean, _ in means])
        mean = float((shares @ loads**exponent) ** (1.0 / exponent))
        by = (shares * (loads / mean) ** (exponent - 1.0)) @ [each[:, one.index] for _, each in means]
        values[one.index], slopes[:, one.index] = mean, by
        if quantity == "life":
            life = float(one.life_under(mean))
            values[one.index], slopes[:, one.index] = life, -exponent * life / mean * by
    return values, slopes


def _distance(motion: Motion, criteria: Criteria) -> float:
    """Travel [m] of a motion."""
    assert motion.velocity is not None  # or there is no mean load
    travel = Travel(motion.time, motion.velocity[:, 0], motion.acceleration[:, 0])
    still = np.zeros((motion.time.size, 6))
    return float(integrals(travel, still, criteria.rule, criteria.rating.exponent)[1].sum())
