"""What to measure next: which further measurement shrinks the interval of a target quantity most.

The target is an unknown of the machine, or a peak load, mean load or life that follows from all of them. Its
uncertainty is that of the unknowns through its derivatives (delta method). Targets of runs are positive, so their
intervals are those of the logarithm. Nothing is measured for the ranking: at the most probable machine the derivatives
of what a measurement would show give how much it would say.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, StrictStr, model_validator

from guideload.base.arrays import Array
from guideload.base.config import ConfigModel, optional
from guideload.base.errors import ArgumentError, ValueRefused
from guideload.base.number_text import joined
from guideload.duty.duty_cycle import LoadCase, load_cases
from guideload.identification.measured import Measured
from guideload.identification.result import Identification
from guideload.identification.tables import Text
from guideload.identification.uncertainty import IDENTIFIED, NORMAL_QUANTILE, marginal_information
from guideload.life.criteria import criteria_of
from guideload.life.mean_load import Travel
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.sensitivity.figures import UNITS, CarriageQuantities, most_critical
from guideload.sensitivity.varied import VariedMachine
from guideload.study.options import Reading, TraceOptions

# ---- the target quantity


Quantity = Literal["peak_resultant", "mean_load", "life"]
WORDS = {"peak_resultant": "peak load", "mean_load": "mean load", "life": "life"}


@dataclass(frozen=True, eq=False)
class TargetQuantity:
    """A target quantity of an identified machine.

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


class TargetTable(ConfigModel):
    """Target quantity: of a carriage under a motion, or under all load cases of a duty file."""

    quantity: Quantity = Field(description='"peak_resultant", "mean_load" or "life" of a carriage')
    carriage: StrictStr | None = optional(
        "its name; by default the carriage with the largest load or the shortest life"
    )
    motion: Text | None = optional('trace or planned moves, e.g. "moves.toml"')
    reading: Reading = optional("how the trace is read, as in a study", TraceOptions())
    duty: Text | None = optional("a duty file, in place of a motion: all its load cases together")

    @model_validator(mode="after")
    def _one_motion(self) -> TargetTable:
        if (self.motion is None) == (self.duty is None):
            raise ValueRefused("either motion or duty", [self.motion, self.duty], "of the figure")
        return self

    def of(self, found: Identification, folder: Path) -> TargetQuantity:
        """The target quantity of an identified machine. Raises ConfigError, ArgumentError, LifeError, TraceError."""
        if self.duty is None:
            assert self.motion is not None
            motion = self.reading.motion(folder / self.motion, found.nominal)
            cases: Sequence[LoadCase] = [LoadCase(self.motion, found.nominal, motion, 1.0)]
        else:
            cases, _ = load_cases(folder / self.duty)
        return carriage_target(found, self.quantity, cases, self.carriage)


def unknown_target(found: Identification, name: str) -> TargetQuantity:
    """An unknown as the target quantity. Raises ArgumentError for a name that is no unknown."""
    names = [one.name for one in found.unknowns]
    if name not in names:
        raise ArgumentError(f"figure: expected names of unknowns ({', '.join(names)}), got {name!r}")
    one = found.estimates[names.index(name)]
    return TargetQuantity(name, one.unit, one.value, {name: 1.0}, one.low, one.high)


def carriage_target(
    found: Identification, quantity: Quantity, cases: Sequence[LoadCase], carriage: str | None = None
) -> TargetQuantity:
    """The target quantity of a carriage of the identified machine, under load cases that are run in turns.

    Parameters
    ----------
    quantity
        The peak load [N] is the largest one of all cases; mean load [N] and life [m] are over the distance of all.
    cases
        Their machines take the identified values.
    carriage
        Its name; by default the carriage with the largest load or the shortest life.

    Raises
    ------
    ArgumentError
        For an unknown carriage, and for a quantity without derivatives.
    LifeError
        Without ratings.
    """
    names = [one.name for one in found.nominal.carriages]
    if carriage is not None and carriage not in names:
        raise ArgumentError(f"figure.carriage: expected one of {joined(names)}, got {carriage!r}")
    computed = [_quantities(found, one.machine, one.motion) for one in cases]
    if quantity == "peak_resultant":
        peaks = [each.peak_resultant() for each in computed]
        largest = np.argmax([values for values, _ in peaks], axis=0)
        values = np.array([peaks[k][0][i] for i, k in enumerate(largest)])
        slopes = np.array([peaks[k][1][:, i] for i, k in enumerate(largest)]).T
    else:
        values, slopes = _over_distance(found.nominal, computed, cases, quantity)
    index = most_critical(quantity, values) if carriage is None else names.index(carriage)
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
    return TargetQuantity(name, UNITS[quantity], value, derivatives, *ends)


def _quantities(found: Identification, machine: Machine, motion: Motion) -> CarriageQuantities:
    """Quantities of a run with the identified values. Raises ArgumentError if an unknown means something else there."""
    varied = VariedMachine(machine, {one.name: one.targets for one in found.unknowns}, motion)
    for unknown, column in zip(found.unknowns, varied.columns, strict=True):
        if unknown.is_factor != (column.form == "factor") or (
            unknown.is_factor and column.value != unknown.start
        ):
            raise ArgumentError(
                f"figure: {unknown.name} sets numbers that are equal in {found.nominal.name} and differ in "
                f"{machine.name}, or the other way round; leave them out of the changes of the load case"
            )
    return CarriageQuantities(varied.run(motion, [estimate.value for estimate in found.estimates]))


def _over_distance(
    machine: Machine, computed: Sequence[CarriageQuantities], cases: Sequence[LoadCase], quantity: Quantity
) -> tuple[Array, Array]:
    """Mean load or life (carriage,) over the distance of all load cases, and derivatives (p, carriage)."""
    means = [each.mean_load() for each in computed]
    values, slopes = np.full(means[0][0].size, np.nan), np.full(means[0][1].shape, np.nan)
    distances = np.array([case.cycles * Travel.of(case.motion).distance for case in cases])
    if not distances.any():
        raise ArgumentError(
            "figure: expected a motion that travels, as the mean load is a mean over distance"
        )
    shares = distances / distances.sum()
    for one in criteria_of(machine, machine.life):
        exponent = one.rating.exponent
        loads = np.array([mean[one.index] for mean, _ in means])
        mean = float((shares @ loads**exponent) ** (1.0 / exponent))
        by = (shares * (loads / mean) ** (exponent - 1.0)) @ [each[:, one.index] for _, each in means]
        values[one.index], slopes[:, one.index] = mean, by
        if quantity == "life":
            life = float(one.life_under(mean))
            values[one.index], slopes[:, one.index] = life, -exponent * life / mean * by
    return values, slopes


# ---- the ranking


@dataclass(frozen=True)
class RankedMeasurement:
    """A measurement in a ranking.

    name       of the measurement
    deviation  standard deviation of the target quantity with this measurement over that without: 1 if it adds nothing;
               without a target the geometric mean of this ratio over the unknowns
    identified unknowns that the data determine only with this measurement
    """

    name: str
    deviation: float
    identified: tuple[str, ...]


def rank_measurements(
    found: Identification, candidates: Sequence[Measured], target: Mapping[str, float] | None = None
) -> tuple[RankedMeasurement, ...]:
    """Possible further measurements, the most informative one first.

    Parameters
    ----------
    candidates
        Measurements as they would be made; their measured values do not matter.
    target
        Derivatives of the target quantity by the values of the unknowns [SI], by the unknowns' names, as
        `sensitivities` gives them; by default the geometric mean of all unknowns' intervals is judged.

    Raises
    ------
    ArgumentError
        For a name that is no unknown and for a target that depends on none.
    """
    p = len(found.unknowns)
    model, now = found.model, found.covariance[:p, :p]
    gradient = None if target is None else _by_coordinates(found, target)
    before = np.linalg.inv(now)
    rows = []
    for one in candidates:
        nuisance = np.array([each.expected for each in one.nuisance])
        there = one.prepared_for(model, nuisance).residuals(model, nuisance)
        weights = 1.0 / np.array([each.spread for each in one.nuisance])
        after = np.linalg.inv(before + marginal_information(there.by_unknowns, there.by_nuisance, weights))
        if gradient is None:
            share = float(np.exp(0.5 * np.mean(np.log(np.diag(after) / np.diag(now)))))
        else:
            share = float(np.sqrt((gradient @ after @ gradient) / (gradient @ now @ gradient)))
        identified = tuple(
            unknown.name
            for unknown, was, new in zip(
                found.unknowns, found.intervals, np.sqrt(np.diag(after)), strict=True
            )
            if not was.is_identified and new / unknown.spread <= IDENTIFIED
        )
        rows.append(RankedMeasurement(one.name, share, identified))
    # Measurements whose shares differ by rounding alone, as by symmetry, stay in the order given.
    return tuple(sorted(rows, key=lambda row: float(f"{row.deviation:.6g}")))


def _by_coordinates(found: Identification, target: Mapping[str, float]) -> Array:
    """Derivatives (p,) of the target quantity by the coordinates."""
    names = [one.name for one in found.unknowns]
    if strange := [name for name in target if name not in names]:
        raise ArgumentError(f"target: expected names of unknowns ({', '.join(names)}), got {strange[0]!r}")
    gradient: Array = found.model.slopes * np.array([target.get(name, 0.0) for name in names])
    if not gradient.any():
        raise ArgumentError("target: expected one that depends on an unknown, got derivatives that are all 0")
    return gradient
