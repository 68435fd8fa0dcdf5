"""Given cases in place of drawn samples: a table with a column for each path and a row for each case."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ConfigError, Problem, TraceError, ValueRefused
from guideload.parameters.parameters import Form, Parameters
from guideload.study.description.factors import Factor, conflicts
from guideload.study.description.refusals import problem_at
from guideload.study.description.tables import name_and_unit, numbers_of
from guideload.traces.format.sources import load_table
from guideload.traces.format.table import Table

if TYPE_CHECKING:
    from guideload.traces.format.sources import TableLike


def cases_of(source: TableLike, parameters: Parameters) -> tuple[tuple[Factor, ...], Array]:
    """Factors, and their values (cases, factors), read-only.

    A header is a path, followed by a blank and the unit in brackets if it is not SI: "body.mass [t]"; [%] is percent of
    the machine's value. Raises TraceError for the table, ConfigError with all refused headers and columns.
    """
    table = load_table(source)
    columns: list[tuple[Factor, Array]] = []
    problems: list[Problem] = []
    for i, header in enumerate(table.names):
        try:
            columns.append(_factor(table, i, header, parameters))
        except ValueRefused as refused:
            problems.append(_problem(table, header, refused))
    factors = tuple(factor for factor, _ in columns)
    for factor, other, target in conflicts(factors):
        hint = f"column {table.names[other.entry]} sets {target} already"
        conflict = ValueRefused("one column for each value", factor.name, hint)
        problems.append(_problem(table, table.names[factor.entry], conflict))
    if problems:
        raise ConfigError(problems)
    if not columns or not columns[0][1].size:
        raise TraceError(f"{table.source}: expected a column for each path and a row for each case, got none")
    rows = np.ascontiguousarray(np.array([values for _, values in columns]).T)
    rows.setflags(write=False)
    return factors, rows


def _factor(table: Table, i: int, header: str, parameters: Parameters) -> tuple[Factor, Array]:
    path, _ = name_and_unit(header)
    group = parameters.at(path)
    unit = group[0].unit
    numbers, relative = numbers_of(table, header, unit)
    form: Form = "factor" if relative and len(group) > 1 else "value"
    if relative and form == "value":
        numbers = numbers * group[0].value
    if form == "value" and len({parameter.unit for parameter in group}) > 1:
        raise ValueRefused("a path to values of one unit, or [%]", path)
    for parameter in group if numbers.size else ():
        parameter.require(float(numbers.min()), float(numbers.max()), form)
    targets = tuple(parameter.path for parameter in group)
    return Factor(path, "1" if form == "factor" else unit, targets, form, None, i, ""), numbers


def _problem(table: Table, header: str, refused: ValueRefused) -> Problem:
    hint = f"{refused.hint} (column {header} of {table.source})".strip()
    return problem_at(("cases",), ValueRefused(refused.expected, refused.value, hint))
