"""What drives a figure of a run: its change by a small change of each number of the machine, strongest first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, LifeError
from guideload.base.number_text import joined
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.parameters.parameters import Parameter, Parameters
from guideload.sensitivity.columns import Column
from guideload.sensitivity.figures import UNITS, CarriageQuantities, most_critical
from guideload.sensitivity.varied import VariedMachine
from guideload.simulation.peaks import LargestLoad
from guideload.simulation.start import Start

SHARE, SHIFT, ERROR = 0.01, 1e-3, 1e-5  # of a value; of a place [m], which may be 0; of a mounting error [m]


@dataclass(frozen=True, eq=False)
class Influence:
    """The change of a figure of one carriage by a small change of each number.

    figure, unit  peak_resultant [N], mean_load [N] or life [m]
    carriage      its name
    value         of the figure
    columns       the numbers, those with the strongest influence first
    steps         their changes in words: "1 %", "1 mm" or "10 um"
    changes       (columns,) of the figure by these changes, to first order [`unit`]
    """

    figure: str
    unit: str
    carriage: str
    value: float
    columns: tuple[Column, ...]
    steps: tuple[str, ...]
    changes: Array


@checked
def rank_influences(
    machine: Machine,
    motion: Motion,
    figure: str = "peak_resultant",
    to: Sequence[str] = (),
    carriage: str | None = None,
    start: Start = "auto",
) -> Influence:
    """What drives a figure of a carriage, by default of the most loaded one: exact derivatives times small changes.

    to: paths; by default all numbers that can vary, except clearances of 0, which have no derivative. The change is 1 %
    of a number, 1 mm of a place, 10 um of a mounting error. If the peak occurs at several instants, the derivative is
    that of the instant whose load grows most. Raises the errors of `sensitivities`, ArgumentError for a machine without
    carriages, and LifeError for a carriage without load.
    """
    if figure not in UNITS:
        raise ArgumentError(f"of: expected one of {joined(UNITS)}, got {figure!r}")
    names = [one.name for one in machine.carriages]
    if not names:
        raise ArgumentError(
            "expected a machine with carriages, whose figures have derivatives; got links only"
        )
    if carriage is not None and carriage not in names:
        raise ArgumentError(f"carriage: expected one of {joined(names)}, got {carriage!r}")
    parameters = Parameters(machine, motion)
    paths = tuple(to) or [one.path for one in parameters if one.floor != ">= 0" or one.value > 0.0]
    varied = VariedMachine(machine, paths, motion)
    figures = CarriageQuantities(varied.run(motion, start=start))
    known = {parameter.path: _step(parameter) for parameter in parameters}
    steps = [known[column.name] for column in varied.columns]
    sizes = np.array([step for step, _ in steps])
    if figure == "peak_resultant":
        largest = LargestLoad.of(names, figures.at_peaks.motion.time, figures.resultants)
        index = largest.index if carriage is None else names.index(carriage)
        value, changes = figures.peak_changes(index, sizes)
    else:
        values, derivatives = getattr(figures, figure)()
        index = most_critical(figure, values) if carriage is None else names.index(carriage)
        value, changes = float(values[index]), derivatives[:, index] * sizes
    if not np.isfinite([value, *changes]).all():
        raise LifeError(
            f"carriage {names[index]}: nothing drives its {figure.replace('_', ' ')}: it carries no load, or "
            "its product has no ratings"
        )
    order = np.argsort(-np.abs(changes), kind="stable")
    return Influence(
        figure=figure,
        unit=UNITS[figure],
        carriage=names[index],
        value=value,
        columns=tuple(varied.columns[i] for i in order),
        steps=tuple(steps[i][1] for i in order),
        changes=changes[order],
    )


def _step(parameter: Parameter) -> tuple[float, str]:
    """The change of a number, and its words."""
    if "mounting_error" in parameter.path:
        return ERROR, "10 um"
    if parameter.unit == "m" and not parameter.floor:
        return SHIFT, "1 mm"
    return SHARE * parameter.value, "1 %"
