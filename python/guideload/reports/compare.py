"""The comparison of several runs: what differs between the machines, then the figures of each run side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from guideload.base.errors import ArgumentError, GuideloadError, LifeError, shown
from guideload.base.number_text import load_in_table
from guideload.drive.requirements import drive_requirements
from guideload.life.life import life_of
from guideload.reports.elements import new_table, remark, section, to_text
from guideload.reports.life import kilometres, unverified_lines

if TYPE_CHECKING:
    from guideload.machine.machine import Machine
    from guideload.simulation.result import Result

MOST_DIFFERENCES = 30  # rows of the table of differences
MOST_KEYS = 4  # of a product, in its row of this table
DEFINITIONS = (
    "Peak: largest resultant of any carriage, and where; f_W: peak over quasi-static peak (statics with m a); life: of "
    "all carriages together; S0: smallest static safety. In brackets: change against the first row."
)


def comparison_report(results: Mapping[str, Result], encoding: str = "utf-8") -> str:
    """Differences of the machines, a row of figures per run, and the peaks of each carriage, by title of the run.

    Raises ArgumentError if a machine has no carriages.
    """
    return to_text(comparison_parts(results), encoding=encoding)


def comparison_parts(results: Mapping[str, Result]) -> list[RenderableType]:
    """The elements of `comparison_report`."""
    require_carriages(results)
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
    products = (
        one for machine in machines.values() for one in machine.product_of_carriage if one is not None
    )
    return [*parts, *remark("", *unverified_lines(products), *warned)]


def require_carriages(results: Mapping[str, Result]) -> None:
    """Raise ArgumentError if a machine has no carriages, whose loads are compared."""
    for title, result in results.items():
        if not result.machine.carriages:
            raise ArgumentError(
                f"{title}: expected a machine with carriages, got links only; compare shows the loads of carriages, "
                "the report of a run those of links"
            )


def _differences(machines: Mapping[str, Machine]) -> list[RenderableType]:
    if len(machines) < 2:
        return remark("The machines are the same; the motions differ.")
    found = [
        (path, tuple(None if value is None else shown(value) for value in values))
        for path, values in differences(*machines.values())
    ]
    found += product_differences(*machines.values())
    table = new_table("key", texts=tuple(machines))
    for path, words in found[:MOST_DIFFERENCES]:
        table.add_row(Text(path), *(Text(word or "") for word in words))
    rest = len(found) - MOST_DIFFERENCES
    more = [f"and {rest} more differences"] if rest > 0 else []
    return [*section("Differences of the machines, in SI units"), table, *remark(*more)]


def differences(*machines: Machine) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Keys whose values differ, with the value of each machine; None where a machine does not have the key.

    Parts with a name are matched by it: `carriages[1a].stiffness_y`. Without those of products.
    """
    flat = [dict(_values(machine.model_dump(mode="json", exclude={"products"}))) for machine in machines]
    for path in dict.fromkeys(path for values in flat for path in values):
        values = tuple(each.get(path) for each in flat)
        if any(value != values[0] for value in values):
            yield path, values


def product_differences(*machines: Machine) -> Iterator[tuple[str, tuple[str | None, ...]]]:
    """A row for each product whose records differ, with the values that do; None where a machine lacks it."""
    of_machines = [
        {one.name: one.model_dump(mode="json") for one in machine.products} for machine in machines
    ]
    for name in dict.fromkeys(name for products in of_machines for name in products):
        records = [products.get(name) for products in of_machines]
        flat = [dict(_values(record)) for record in records if record is not None]
        keys = dict.fromkeys(key for values in flat for key in values)
        differing = [key for key in keys if any(values.get(key) != flat[0].get(key) for values in flat)]
        if differing or None in records:
            yield (
                f"products[{name}]",
                tuple(None if one is None else _short(one, differing) for one in records),
            )


def _short(record: dict[str, Any], keys: list[str]) -> str:
    """The values of some keys of a product in one line: `static 60000.0, mass none`."""
    values = dict(_values(record))
    words = (f"{key} {shown(values[key]) if key in values else 'none'}" for key in keys[:MOST_KEYS])
    more = [f"and {len(keys) - MOST_KEYS} more"] if len(keys) > MOST_KEYS else []
    return ", ".join([*words, *more]) or "has it"


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
