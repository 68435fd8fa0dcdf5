"""Columns: the values by which derivatives are taken, and the numbers of the machine that each of them sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from guideload.base.errors import ArgumentError, ValueRefused
from guideload.parameters.parameters import Form, Parameter, Parameters

To = str | Sequence[str] | Mapping[str, str | Sequence[str]]


@dataclass(frozen=True)
class Column:
    """One value that varies.

    name   the full path of its number, "carriages[1a].stiffness_y", or the given name of several numbers
    unit   of the value, SI; "1" for a factor
    value  of the machine as it is
    paths  full paths of the numbers that it sets
    form   whether the numbers are the "value" itself, or their own values times it, a "factor"
    """

    name: str
    unit: str
    value: float
    paths: tuple[str, ...]
    form: Form


def resolve_columns(parameters: Parameters, to: To) -> tuple[Column, ...]:
    """The columns of paths, one for each number; of named groups of paths, one for each group.

    Equal numbers of a group stay equal; if they differ, the column is a common factor on them. Raises ArgumentError for
    an unknown path and for numbers in two columns.
    """
    if isinstance(to, Mapping):
        columns = [_together(name, _found(parameters, paths)) for name, paths in to.items()]
    else:
        columns = [
            Column(one.path, one.unit, one.value, (one.path,), "value") for one in _found(parameters, to)
        ]
    owners: dict[str, str] = {}
    for column in columns:
        for path in column.paths:
            if path in owners:
                raise ArgumentError(
                    f"to: expected each number once, got {path} in {owners[path]} and in {column.name}"
                )
            owners[path] = column.name
    if not columns:
        raise ArgumentError('to: expected paths such as ["carriages.*.stiffness_y", "body.mass"], got none')
    return tuple(columns)


def _found(parameters: Parameters, paths: str | Sequence[str]) -> list[Parameter]:
    """The parameters of paths, each once."""
    try:
        listed = [paths] if isinstance(paths, str) else paths
        return list({one.path: one for path in listed for one in parameters.at(path)}.values())
    except ValueRefused as refused:
        hint = f"; {refused.hint}" if refused.hint else ""
        raise ArgumentError(f"to: expected {refused.expected}, got {refused.value!r}{hint}") from None


def _together(name: str, parameters: Sequence[Parameter]) -> Column:
    """The column of several numbers that vary together."""
    if not parameters:
        raise ArgumentError(f"to: {name}: expected paths, got none")
    first, paths = parameters[0], tuple(parameter.path for parameter in parameters)
    if all((one.value, one.unit) == (first.value, first.unit) for one in parameters):
        return Column(name, first.unit, first.value, paths, "value")
    return Column(name, "1", 1.0, paths, "factor")
