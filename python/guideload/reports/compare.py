"""The comparison of several runs: what differs between the machines, then the figures of each run side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from guideload.base.errors import GuideloadError, LifeError, shown
from guideload.base.number_text import load_in_table
from guideload.drive.requirements import drive_requirements
from guideload.life.life import life_of
from guideload.reports.elements import new_table, remark, section, to_text
from guideload.reports.life import kilometres

if TYPE_CHECKING:
    from guideload.machine.machine import Machine
    from guideload.simulation.result import Result

MOST_DIFFERENCES = 30  # rows of the table of differences
DEFINITIONS = (
    "Peak: largest resultant of any carriage, and where; f_W: peak over quasi-static peak (statics with m a); life: of "
    "all carriages together; S0: smallest static safety. In brackets: change against the first row."
)


def comparison_report(results: Mapping[str, Result], encoding: str = "utf-8") -> str:
    """Differences of the machines, a row of figures per run, and the peaks of each carriage, by title of the run."""
    return to_text(comparison_parts(results), encoding=encoding)


def comparison_parts(results: Mapping[str, Result]) -> list[RenderableType]:
    """The elements of `comparison_report`."""
    machines: dict[str, Machine] = {}
    for title, result in results.items():
        if result.machine not in machines.values():
            machines[title] = result.machine
    parts = [*_differences(machines), *section("Figures"), _figures(results), *remark(DEFINITIONS)]
    if len({tuple(carriage.name for carriage in one.machine.carriages) for one in results.values()}) == 1:
        parts += [*section("Peak resultants of the carriages, N"), _peaks(results)]
    warned = [
        f"{title}: {result.audit.verdict}" for title, result in results.items() if result.audit.warnings
    ]
    return [*parts, *remark("", *warned)]


def _differences(machines: Mapping[str, Machine]) -> list[RenderableType]:
    if len(machines) < 2:
        return remark("The machines are the same; the motions differ.")
    found = list(differences(*machines.values()))
    table = new_table("key", texts=tuple(machines))
    for path, values in found[:MOST_DIFFERENCES]:
        table.add_row(Text(path), *(Text("" if value is None else shown(value)) for value in values))
    rest = len(found) - MOST_DIFFERENCES
    more = [f"and {rest} more differences"] if rest > 0 else []
    return [*section("Differences of the machines, in SI units"), table, *remark(*more)]


def differences(*machines: Machine) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Keys whose values differ, with the value of each machine; None where a machine does not have the key.

    Parts with a name are matched by it: `carriages[1a].stiffness_y`.
    """
    flat = [dict(_values(machine.model_dump(mode="json"))) for machine in machines]
    for path in dict.fromkeys(path for values in flat for path in values):
        values = tuple(each.get(path) for each in flat)
        if any(value != values[0] for value in values):
            yield path, values


def _values(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _values(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for i, inner in enumerate(value):
            yield from _values(inner, f"{path}[{inner.get('name', i)}]")
    elif value is not None:
        yield path, value


def _figures(results: Mapping[str, Result]) -> RenderableType:
    rows = {title: _row(result) for title, result in results.items()}
    names = [name for name in next(iter(rows.values())) if any(name in row for row in rows.values())]
    table = new_table("run", *(name for name in names), texts=("on",))
    first = next(iter(rows.values()))
    for title, row in rows.items():
        cells = (
            _cell(row[name], None if row is first else first.get(name)) if name in row else ""
            for name in names
        )
        peaks = results[title].peak_columns["peak_resultant_N"]
        carriage = results[title].machine.carriages[int(peaks.argmax())].name
        table.add_row(Text(title), *cells, Text(carriage))
    return table


def _row(result: Result) -> dict[str, float]:
    """The figures of a run by heading."""
    peaks = result.peak_columns["peak_resultant_N"]
    at = int(peaks.argmax())
    row = {"peak\nN": float(peaks[at]), "f_W\n": float(result.audit.simpler_models.dynamic_factor[at])}
    if any(result.machine.product_of_carriage):
        try:
            life = life_of(result)
            row |= {"life\nkm": 1e-3 * life.machine, "S0\n": life.weakest.static.safety}
        except LifeError:
            pass  # the report of a run says why
    if "x" not in result.machine.free:
        try:
            row["drive\nN"] = drive_requirements(result).peak_force
        except GuideloadError:
            pass  # no velocity: the report of a run says so
    row["mode 1\nHz"] = float(result.modes.frequency.min(initial=np.inf))
    return row


def _cell(value: float, first: float | None) -> str:
    text = kilometres(1e3 * value) if value >= 1e4 else f"{value:.4g}"
    if first is None or not np.isfinite(first) or first == 0.0:
        return text
    return f"{text} ({100.0 * (value / first - 1.0):+.1f} %)"


def _peaks(results: Mapping[str, Result]) -> RenderableType:
    table = new_table("carriage", *results)
    columns = [result.peak_columns["peak_resultant_N"] for result in results.values()]
    for i, carriage in enumerate(next(iter(results.values())).machine.carriages):
        table.add_row(Text(carriage.name), *(load_in_table(float(column[i])) for column in columns))
    return table
