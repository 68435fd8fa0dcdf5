"""Factors: the columns of values in a study of one machine, drawn by [[vary]] tables or given as cases.

A varied parameter has one factor or, with `each`, one factor for every part. Given cases are a table with a column for
each path and a row for each case. The tables [[correlation]] correlate drawn factors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from guideload.base.arrays import Array
from guideload.base.config import ConfigModel
from guideload.base.errors import (
    ArgumentError,
    ConfigError,
    KeyPath,
    KeyRefused,
    Problem,
    TraceError,
    ValueRefused,
    problem_at,
    refused_at,
)
from guideload.machine.products import stiffness_estimates
from guideload.parameters.parameters import Form, Parameter, Parameters
from guideload.study.distributions import Marginal, in_words
from guideload.study.metadata import ParameterMetadata
from guideload.study.sampling import Copula, cholesky
from guideload.study.varied_parameters import (
    Coefficient,
    LognormalSpec,
    ParameterPaths,
    VariedParameter,
    column_numbers,
    name_and_unit,
    no_percent,
)
from guideload.traces.format.sources import load_table
from guideload.traces.format.table import Table

if TYPE_CHECKING:
    from guideload.traces.format.sources import TableLike

# ---- drawn factors


@dataclass(frozen=True)
class Factor:
    """One column of values."""

    name: str  # "body.mass", "k[1a]"
    unit: str  # of its values: SI, or "1" where they are factors on the machine's values
    targets: tuple[str, ...]  # the full paths of the parameters that it sets
    form: Form  # how a value sets them: as their "value", as a "factor" on it, or as a "shift" of it
    marginal: Marginal | None  # its distribution; None where cases are given
    entry: int  # the index of its varied parameter, or of its column where cases are given
    owner: str  # the part for which it is drawn, or ""

    @property
    def metadata(self) -> ParameterMetadata:
        """The factor with its distribution in words: "uniform from 1125 to 1375 kg"."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        uses = {"factor": ", times the machine's values", "shift": ", added to the machine's values"}
        marginal = self.marginal
        words = in_words(marginal.distribution, marginal.scale, unit) if marginal else "given cases"
        words += uses.get(self.form, "")
        return ParameterMetadata(name=self.name, unit=self.unit, targets=self.targets, distribution=words)


def drawn_factors(entries: Sequence[VariedParameter], parameters: Parameters) -> tuple[Factor, ...]:
    """The factors of these varied parameters.

    Raises ConfigError with all problems; their keys begin with "vary".
    """
    problems: list[Problem] = []
    factors: list[Factor] = []
    for i, entry in enumerate(entries):
        try:
            factors.extend(_factor(i, entry, *draw) for draw in parameters_by_draw(entry, parameters).items())
        except ValueRefused as refused:
            problems.append(problem_at(("vary", i), refused))
    refused_entries: set[int] = set()  # one conflict for each entry is enough
    names: dict[str, Factor] = {}
    same_name = ((factor, names.setdefault(factor.name, factor), "") for factor in factors)
    for factor, other, target in (*conflicts(factors), *same_name):
        if factor.entry == other.entry or factor.entry in refused_entries:
            continue
        refused_entries.add(factor.entry)
        entry, hint = entries[factor.entry], f"vary[{other.entry}] has it already"
        conflict = KeyRefused("name", "a unique name", factor.name, hint)
        if target:
            hint = f"{target} is set by vary[{other.entry}] ({entries[other.entry].title}) already"
            conflict = KeyRefused("path", "one entry for each value", list(entry.path), hint)
        problems.append(problem_at(("vary", factor.entry), conflict))
    if problems:
        raise ConfigError(problems)
    return tuple(factors)


def conflicts(factors: Sequence[Factor]) -> Iterator[tuple[Factor, Factor, str]]:
    """Conflicts: a factor, an earlier factor, and the parameter that both set."""
    first: dict[str, Factor] = {}
    for factor in factors:
        for target in factor.targets:
            other = first.setdefault(target, factor)
            if other is not factor:
                yield factor, other, target


def parameters_by_draw(entry: ParameterPaths, parameters: Parameters) -> dict[str, list[Parameter]]:
    """For each part with a number of its own, or "" for all parts, the parameters that this number sets."""
    varied: dict[str, Parameter] = {}
    for path in entry.path:
        try:
            varied |= {parameter.path: parameter for parameter in parameters.at(path)}
        except ValueRefused as refused:
            raise KeyRefused("path", refused.expected, refused.value, refused.hint) from None
    draws: dict[str, list[Parameter]] = {}
    for parameter in varied.values():
        if entry.each is None or entry.each == "value":
            owner = parameter.path if entry.each else ""
        elif entry.each in parameter.owners:
            owner = parameter.owners[entry.each]
        else:
            words = "paths of rails or carriages" if entry.each == "rail" else f"paths of {entry.each}s"
            raise KeyRefused("each", words, entry.each, f"{parameter.path} is of no {entry.each}")
        draws.setdefault(owner, []).append(parameter)
    return draws


def _factor(i: int, entry: VariedParameter, owner: str, group: Sequence[Parameter]) -> Factor:
    unit = group[0].unit
    marginal = entry.marginal(unit, [parameter.value for parameter in group])
    units = {parameter.unit: parameter.path for parameter in group}
    if len(units) > 1 and marginal.form != "factor":
        hint = " and ".join(f"{path} is in {other}" for other, path in units.items())
        raise KeyRefused("path", "paths of one unit, or all amounts in percent", list(entry.path), hint)
    try:
        for parameter in group:
            parameter.require(*marginal.reach, marginal.form)
    except ValueRefused as refused:
        raise KeyRefused("distribution", refused.expected, refused.value, refused.hint) from None
    targets = tuple(parameter.path for parameter in group)
    unit = "1" if marginal.form == "factor" else unit
    return Factor(entry.draw_title(owner), unit, targets, marginal.form, marginal, i, owner)


def estimated_entries(entries: Sequence[VariedParameter], parameters: Parameters) -> Iterator[LognormalSpec]:
    """A lognormal factor on each estimated stiffness, one draw for all carriages with the same product and class.

    Its interval is that of the estimate. Stiffnesses that `entries` vary are left out, and those that cannot vary,
    because the carriage has a compliance in series or states its stiffness against rotations.
    """
    machine, taken = parameters.machine, set[str]()
    for entry in entries:
        with suppress(ValueRefused):  # `drawn_factors` tells it
            draws = parameters_by_draw(entry, parameters)
            taken |= {parameter.path for group in draws.values() for parameter in group}
    found: dict[str, tuple[float, list[str]]] = {}
    estimates = stiffness_estimates(machine.carriages, machine.product_of_carriage)
    for carriage, estimate in zip(machine.carriages, estimates, strict=True):
        if estimate is None:
            continue
        title = " ".join(filter(None, ("estimated stiffness of", carriage.product, carriage.preload_class)))
        for key in ("stiffness_y", "stiffness_z"):
            parameter = parameters.of_part["carriages", carriage.name].get(key)
            if parameter and parameter.path not in taken and parameter.value == estimate.stiffness:
                found.setdefault(title, (estimate.sigma, []))[1].append(parameter.path)
    for title, (sigma, paths) in found.items():
        yield LognormalSpec(path=tuple(paths), name=title, distribution="lognormal", sigma=sigma)


# ---- given cases


def read_cases(source: TableLike, parameters: Parameters) -> tuple[tuple[Factor, ...], Array]:
    """Factors, and their values (cases, factors), read-only.

    A header is a path, followed by a blank and the unit in brackets if it is not SI: "body.mass [t]"; [%] is percent of
    the machine's value. Raises ConfigError for what is no table, and with all refused headers and columns, TraceError
    for cells without a number.
    """
    try:
        table = load_table(source)
    except ArgumentError as error:
        raise refused_at(("cases",), "a table of cases, or its file", source, str(error)) from None
    columns: list[tuple[Factor, Array]] = []
    problems: list[Problem] = []
    for i, header in enumerate(table.names):
        try:
            columns.append(_given_factor(table, i, header, parameters))
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


def _given_factor(table: Table, i: int, header: str, parameters: Parameters) -> tuple[Factor, Array]:
    path, _ = name_and_unit(header)
    group = parameters.at(path)
    unit = group[0].unit
    numbers, relative = column_numbers(table, header, unit)
    form: Form = "factor" if relative and len(group) > 1 else "value"
    if relative and not any(parameter.value for parameter in group):
        raise no_percent()
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


# ---- correlations


class Correlation(ConfigModel):
    """Correlation of the normal scores of all pairs of several varied parameters or factors.

    If both parameters of a pair have a draw for each carriage (rail, link), only draws of the same carriage correlate.
    """

    between: tuple[str, ...] = Field(
        min_length=2,
        description='names or paths of varied parameters, or single factors, e.g. ["body.mass", "k[1a]"]',
    )
    value: Coefficient = Field(description="a number such as 0.5, for each pair")


def build_copula(
    correlations: Sequence[Correlation], factors: Sequence[Factor], entries: Sequence[VariedParameter]
) -> tuple[Copula | None, dict[str, float]]:
    """The copula of the correlated columns, None if there are none; and the correlations, by the names of both.

    Raises ConfigError for unknown names, a pair given twice, and a matrix that is not positive definite.
    """
    coefficients: dict[tuple[int, int], float] = {}
    last: KeyPath = ()
    for i, entry in enumerate(entries):
        if entry.within is not None:
            draws = [column for column, factor in enumerate(factors) if factor.entry == i]
            coefficients |= dict.fromkeys(combinations(draws, 2), entry.within)
            last = ("vary", i, "within")
    for i, correlation in enumerate(correlations):
        last = ("correlation", i, "value")
        try:
            for pair in _pairs(correlation, factors, entries):
                if pair in coefficients:
                    both = " and ".join(factors[column].name for column in pair)
                    hint = f"{both} have a correlation already"
                    raise KeyRefused("between", "each pair once", list(correlation.between), hint)
                coefficients[pair] = correlation.value
        except ValueRefused as refused:
            raise ConfigError([problem_at(("correlation", i), refused)]) from None
    coefficients = {pair: value for pair, value in coefficients.items() if value}
    columns = tuple(sorted({column for pair in coefficients for column in pair}))
    if not columns:
        return None, {}
    matrix = np.eye(len(columns))
    for pair, value in coefficients.items():
        i, j = map(columns.index, pair)
        matrix[i, j] = matrix[j, i] = value
    rows = cholesky(matrix.tolist())
    if rows is None:
        smallest = float(np.linalg.eigvalsh(matrix)[0])
        hint = f"its smallest eigenvalue is {smallest:.2g}: these correlations contradict each other; "
        hint += f"all of them times {0.99 / (1.0 - smallest):.2g} would not"
        words = f"the correlations of {len(columns)} factors"
        raise ConfigError([Problem(last, None, "a positive definite matrix", hint, None, words)])
    ordered = sorted(coefficients, key=lambda pair: pair[::-1])
    named = {f"{factors[i].name} and {factors[j].name}": coefficients[i, j] for i, j in ordered}
    return Copula(columns, rows), named


def _pairs(
    correlation: Correlation, factors: Sequence[Factor], entries: Sequence[VariedParameter]
) -> Iterator[tuple[int, int]]:
    """The pairs of columns that are correlated, the lower first."""
    for first, second in combinations(correlation.between, 2):
        a, b = _columns(first, factors, entries), _columns(second, factors, entries)
        if set(a) & set(b):
            way_out = "within is the correlation between the draws of one entry"
            raise KeyRefused("between", "different entries", list(correlation.between), way_out)
        each = {entries[factors[i].entry].each if len(group) > 1 else None for group in (a, b) for i in group}
        by_part = len(each) == 1 and not each & {None, "value"}
        for i, j in product(a, b):
            if not by_part or factors[i].owner == factors[j].owner:
                yield min(i, j), max(i, j)


def _columns(name: str, factors: Sequence[Factor], entries: Sequence[VariedParameter]) -> list[int]:
    """The columns with this name: all columns of a varied parameter, or a single factor."""
    columns = [i for i, factor in enumerate(factors) if name in (factor.name, entries[factor.entry].title)]
    if not columns:
        known = dict.fromkeys([*(entry.title for entry in entries), *(factor.name for factor in factors)])
        raise KeyRefused(
            "between", "names of varied parameters or factors", name, f"they are {', '.join(known)}"
        )
    return columns
