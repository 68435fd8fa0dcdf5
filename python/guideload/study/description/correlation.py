"""Correlations among factors: the tables [[correlation]] of a study, and the resulting copula."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product

import numpy as np
from pydantic import Field

from guideload.base.config import ConfigModel
from guideload.base.errors import ConfigError, KeyPath, Problem, ValueRefused
from guideload.study.description.factors import Factor
from guideload.study.description.refusals import KeyRefused, problem_at
from guideload.study.description.varied_parameter import Coefficient, VariedParameter
from guideload.study.sampling.design import Copula, cholesky


class Correlation(ConfigModel):
    """Correlation of the normal scores of all pairs of several varied parameters or factors.

    If both parameters of a pair have a draw for each carriage (rail, link), only draws of the same carriage correlate.
    """

    between: tuple[str, ...] = Field(
        min_length=2,
        description='names or paths of varied parameters, or single factors, e.g. ["body.mass", "k[1a]"]',
    )
    value: Coefficient = Field(description="a number such as 0.5, for each pair")


def copula_of(
    correlations: Sequence[Correlation], factors: Sequence[Factor], entries: Sequence[VariedParameter]
) -> Copula | None:
    """The copula of the correlated columns; None if there are none.

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
        return None
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
    return Copula(columns, rows)


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
