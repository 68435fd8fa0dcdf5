"""Records in time in the report of an identification: their own numbers, and how far the prediction is off."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from guideload.identification.motor_force import MotorForce
from guideload.identification.names import usual_unit
from guideload.identification.own_estimates import own_estimates
from guideload.identification.result import Identification
from guideload.identification.sensor_log import SensorLog
from guideload.reports.elements import new_table, remark, section

INTERVALS = (
    "These intervals, as those of the machine, contain the noise, the error of the acceleration of the trace, and what "
    "the model lacks as far as it changes within the record: the errors of neighbouring windows may be alike. They do "
    "not contain an error of the scale of a sensor, and what is wrong in the same way throughout."
)


def records(found: Identification) -> Iterator[RenderableType]:
    """A section for each record in time."""
    some = False
    for each in found.data:
        if isinstance(each, MotorForce | SensorLog):
            some = True
            kind = "Motor" if isinstance(each, MotorForce) else "Sensors"
            yield from section(f"{kind}: {each.name}")
            yield _own(found, each)
            yield from remark(*_differences(found, each))
    if some:
        yield from remark(INTERVALS)


def _own(found: Identification, data: MotorForce | SensorLog) -> Table:
    table = new_table("number", "now", "from", "to", texts=("unit",))
    for one in own_estimates(found, data):
        unit, scale = ("ms", 1e3) if one.unknown.unit == "s" else usual_unit(one.unknown.unit)
        digits = 7 if unit == "ms" else 4  # a delay may be many seconds, known to a microsecond
        values = [f"{scale * value:.{digits}g}" for value in (one.value, one.low, one.high)]
        name = one.unknown.name.removesuffix(f" in {data.name}").removesuffix(f" of {data.name}")
        table.add_row(Text(name), *values, "" if unit == "1" else unit)
    return table


def _differences(found: Identification, data: MotorForce | SensorLog) -> list[str]:
    """How far prediction and measurement differ, in words."""
    own = found.fit.objective.own_of(found.fit.minimum.x)[found.data.index(data)]
    measured, predicted = np.atleast_2d(data.measured), np.atleast_2d(data.predicted(found.model, own))
    if isinstance(data, MotorForce):
        names, units = [data.name], ["N m" if data.torque else "N"]
    else:
        names, units = (
            [one.name for one in data.channels],
            [one.unit for one in data.channels],
        )
    length = float(np.median(np.diff(data.window_time)))
    words = []
    for name, unit, seen, computed in zip(names, units, measured, predicted, strict=True):
        rms, share = float(np.sqrt(np.mean((computed - seen) ** 2))), 0.0
        if seen.std() > 0.0:
            share = 1.0 - float(np.mean((computed - seen) ** 2) / seen.var())
        shown = f"{rms:.3g}" if unit == "1" else f"{rms:.3g} {unit}"
        words.append(
            f"{name[:1].upper()}{name[1:]}: computed and measured differ by {shown} rms, in {seen.size} "
            f"windows of {1e3 * length:.3g} ms; the model explains {100.0 * share:.4g} % of the variance."
        )
    return words
