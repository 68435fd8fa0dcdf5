"""Records in time in the report of an identification: their own numbers, and how far the prediction is off."""

from __future__ import annotations

import numpy as np

from guideload.base.number_text import capitalised, digits
from guideload.identification.motor_force import MotorForce
from guideload.identification.records import Record
from guideload.identification.result import Identification
from guideload.identification.unknowns import usual_unit
from guideload.reports.report import Definitions, Section, Table

INTERVALS = (
    "These intervals, as those of the machine, contain the noise, the error of the acceleration of the trace, and what "
    "the model lacks as far as it changes within the record: the errors of neighbouring windows may be alike. They do "
    "not contain an error of the scale of a sensor, and what is wrong in the same way throughout."
)


def record_sections(found: Identification) -> list[Section]:
    """A section for each record in time."""
    records = [each for each in found.data if isinstance(each, Record)]
    return [
        Section(
            f"{'Motor' if isinstance(each, MotorForce) else 'Sensors'}: {each.name}",
            _own_table(found, each),
            *_differences(found, each),
            Definitions(INTERVALS),
        )
        for each in records
    ]


def _own_table(found: Identification, data: Record) -> Table:
    rows: list[tuple[str, ...]] = []
    for one in found.nuisance_estimates(data):
        unit, scale = ("ms", 1e3) if one.parameter.unit == "s" else usual_unit(one.parameter.unit)
        count = 7 if unit == "ms" else 4  # a delay may be many seconds, known to a microsecond
        ends = (digits(scale * value, count) for value in (one.value, one.low, one.high))
        values = ends if one.is_identified else ("none", "", "")
        name = one.parameter.name.removesuffix(f" in {data.name}").removesuffix(f" of {data.name}")
        rows.append((name, *values, "" if unit == "1" else unit))
    return Table.by_rows(
        [("number",), *((end, "", "number") for end in ("now", "from", "to")), ("unit",)], rows
    )


def _differences(found: Identification, data: Record) -> list[str]:
    """How far prediction and measurement differ, in words."""
    predicted = data.predicted(found.model, found.nuisance_values(data))
    length = float(np.median(np.diff(data.window_time)))
    words = []
    for (name, unit), seen, computed in zip(data.titles, data.measured, predicted, strict=True):
        rms, share = float(np.sqrt(np.mean((computed - seen) ** 2))), 0.0
        if seen.std() > 0.0:
            share = 1.0 - float(np.mean((computed - seen) ** 2) / seen.var())
        shown = f"{digits(rms)}" if unit == "1" else f"{digits(rms)} {unit}"
        words.append(
            f"{capitalised(name)}: computed and measured differ by {shown} rms, in {seen.size} "
            f"windows of {digits(1e3 * length)} ms; the model explains {digits(100.0 * share, 4)} % of the variance."
        )
    return words
