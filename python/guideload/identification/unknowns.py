"""The unknown numbers of a machine: one [[unknown]] table each, what each number sets in the machine, and its names."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from guideload.base.arrays import Array
from guideload.base.config import optional
from guideload.base.errors import ConfigError, KeyPath, KeyRefused, Problem, ValueRefused, problem_at
from guideload.base.number_text import joined
from guideload.base.ranges import FACTOR
from guideload.base.units import quantity
from guideload.machine.machine import Machine
from guideload.parameters.parameters import Parameter, Parameters
from guideload.sensitivity.varied import NO_MOTION
from guideload.study.factors import parameters_by_draw
from guideload.study.varied_parameters import NumberOrText, ParameterPaths

# ---- names and units, as reports and comments show them


USUAL = {"N/m": ("N/um", 1e-6), "N s/m": ("kN s/m", 1e-3), "m": ("mm", 1e3)}
OF_PART = re.compile(r'(\w+)\["?([^\]"]+)"?\]\.(.+)')


def usual_unit(unit: str) -> tuple[str, float]:
    """The unit in which machine files state a quantity, and the factor from SI to it."""
    return USUAL.get(unit, (unit, 1.0))


def short_name(name: str) -> str:
    """`1a stiffness_y` from "carriages[1a].stiffness_y"; other names as they are."""
    part = OF_PART.fullmatch(name)
    return f"{part[2]} {part[3]}" if part else name


def grouped_names(names: Sequence[str]) -> str:
    """`stiffness_y of carriages 1a and 1b` from "carriages[1a].stiffness_y" and "carriages[1b].stiffness_y"."""
    groups: dict[tuple[str, str], list[str]] = {}
    for name in names:
        part = OF_PART.fullmatch(name)
        groups.setdefault((part[1], part[3]) if part else ("", name), []).append(part[2] if part else name)
    return joined(
        f"{key} of {kind if len(parts) > 1 else kind.removesuffix('s')} {joined(parts)}" if kind else key
        for (kind, key), parts in groups.items()
    )


# ---- the unknown numbers


# Spread of the logarithm before the data if none is given: a value within a factor of 7 to either side with 95 %.
VAGUE = 1.0
LEAST_SPREAD = 1e-12  # of a logarithm, or in SI units: what is known so well is no unknown
MOST_SPREAD = 10.0  # of a logarithm: a factor of 5e8 to either side says nothing any more
FURTHEST = 6.0  # spreads from the expected value where the search ends: hardly any probability is left beyond


class UnknownTable(ParameterPaths):
    """Parameters that the measured data are to determine, with what is known of them before."""

    expected: NumberOrText | None = optional("most likely value before the data; by default the machine's")
    spread: NumberOrText | None = optional(
        "standard deviation before the data: of the logarithm for a positive parameter, e.g. 0.3 (default "
        '1: hardly anything is known); with its unit for any other, e.g. "5 mm"'
    )
    at_least: NumberOrText | None = optional("lower bound of the value")
    at_most: NumberOrText | None = optional("upper bound of the value")


@dataclass(frozen=True, eq=False)
class Unknown:
    """One unknown number. The search uses its coordinate z: 0 for the value in the machine file."""

    name: str  # "carriages.*.stiffness_y", "k[1a]"
    unit: str  # of its value: SI, or "1" where it is a factor on different values of the machine
    targets: tuple[str, ...]  # full paths of the parameters that it sets; they keep their ratios
    nominal: Array  # (targets,) their values in the machine file
    additive: bool  # whether a parameter is nominal + z; otherwise nominal exp(z), which is positive
    expected: float  # z before the data
    spread: float  # standard deviation of z before the data
    bounds: tuple[float, float]  # smallest and largest z

    @cached_property
    def is_factor(self) -> bool:
        """Whether its value is a factor on parameters that differ in the machine file."""
        return bool(np.ptp(self.nominal))

    @cached_property
    def start(self) -> float:
        """Its value in the machine file."""
        return 1.0 if self.is_factor else float(self.nominal[0])

    def value(self, z: float) -> float:
        """Its value in `unit`."""
        return self.start + z if self.additive else self.start * math.exp(z)

    def slope(self, z: float) -> float:
        """Derivative of its value by z."""
        return 1.0 if self.additive else self.value(z)

    def coordinate(self, value: float) -> float:
        """z of a value."""
        return value - self.start if self.additive else math.log(value) - math.log(self.start)


def resolve_unknowns(tables: Sequence[UnknownTable], machine: Machine) -> tuple[Unknown, ...]:
    """The unknown numbers of a machine. Raises ConfigError with all problems; their keys begin with "unknown"."""
    parameters = Parameters(machine, NO_MOTION)
    problems: list[Problem] = []
    found: list[Unknown] = []
    owner_of: dict[str, int] = {}
    table_of: dict[str, int] = {}
    for i, table in enumerate(tables):
        try:
            for owner, group in parameters_by_draw(table, parameters).items():
                name = table.draw_title(owner)
                for parameter in group:
                    other = owner_of.setdefault(parameter.path, i)
                    if other != i:
                        hint = f"{parameter.path} is set by unknown[{other}] already"
                        raise KeyRefused("path", "one entry for each value", list(table.path), hint)
                if (other := table_of.setdefault(name, i)) != i:
                    raise KeyRefused("name", "a unique name", name, f"unknown[{other}] has it already")
                found.append(_unknown(table, name, group))
        except ValueRefused as refused:
            problems.append(problem_at(("unknown", i), refused))
    if problems:
        raise ConfigError(problems)
    return tuple(found)


def _unknown(table: UnknownTable, name: str, group: Sequence[Parameter]) -> Unknown:
    """The unknown of a group of parameters that share one number. Raises KeyRefused."""
    units = {parameter.unit: parameter.path for parameter in group}
    if len(units) > 1:
        hint = " and ".join(f"{path} is in {unit}" for unit, path in units.items())
        raise KeyRefused("path", "paths of one unit", list(table.path), hint)
    if group[0].path.startswith(("motion.", "payloads")):
        hint = "unknown are numbers of the machine itself"
        raise KeyRefused("path", "a parameter of body, rails, carriages or links", group[0].path, hint)
    nominal, unit = np.array([parameter.value for parameter in group]), group[0].unit
    additive = group[0].floor == ""
    if not additive and not nominal.all():
        hint = "the search starts at the machine's value: write one above 0 into the machine file"
        raise KeyRefused("path", "a machine's value other than 0", 0.0, hint)
    if np.ptp(nominal) and additive:
        hint = 'give each its own number: each = "value"'
        raise KeyRefused(
            "path", "equal values of parameters that may be 0 or negative", nominal.tolist(), hint
        )
    unit = "1" if np.ptp(nominal) else unit
    if table.spread is None and additive:
        raise KeyRefused("spread", f"a standard deviation with its unit ({unit})", None, 'e.g. "5 mm"')
    spread = VAGUE if table.spread is None else _number(table, "spread", unit if additive else "1")
    most = group[0].within.most if additive else MOST_SPREAD
    if not LEAST_SPREAD <= spread <= most:
        raise KeyRefused("spread", f"{LEAST_SPREAD:g} to {most:g}", table.spread)
    plain = Unknown(name, unit, tuple(one.path for one in group), nominal, additive, 0.0, spread, (-1.0, 1.0))

    def coordinate(key: str, otherwise: float) -> float:
        if getattr(table, key) is None:
            return otherwise
        value = _number(table, key, unit)
        if not additive and not value > 0.0:
            raise KeyRefused(key, f"> 0 {unit}", getattr(table, key))
        within = FACTOR if plain.is_factor else group[0].within
        if not within.holds(value):
            raise KeyRefused(key, within.words, getattr(table, key))
        return plain.coordinate(value)

    expected = coordinate("expected", 0.0)
    low = coordinate("at_least", expected - FURTHEST * spread)
    high = coordinate("at_most", expected + FURTHEST * spread)
    if not low < expected < high:
        raise KeyRefused("expected", "at_least < expected < at_most", table.expected, "widen the bounds")
    for parameter in group:
        scale = parameter.value / plain.start if plain.is_factor else 1.0
        parameter.require(scale * plain.value(low), scale * plain.value(high))
    return replace(plain, expected=expected, bounds=(low, high))


def _number(table: UnknownTable, key: str, unit: str) -> float:
    try:
        return quantity(getattr(table, key), unit)
    except ValueRefused as refused:
        raise KeyRefused(key, refused.expected, refused.value, refused.hint) from None


# ---- the machine with other values of its parameters


AXES = "xyz"
CROSS = ("position", "mounting_error")  # their first component is y
KINDS = {"carriage": "carriages", "link": "links", "rail": "rails"}


def key_path(machine: Machine, parameter: Parameter) -> KeyPath:
    """The keys of a parameter in a machine file: ("carriages", 0, "stiffness_y"), ("rails", 1, "position", 0)."""
    head, _, key = parameter.path.rpartition("].")
    names = key.split(".")
    keys: list[str | int] = [*names]
    if names[:2] == ["body", "inertia"]:
        keys[2:] = [AXES.index(axis) for axis in names[2]]
    elif len(names) > 1 and names[-1] in AXES:
        keys[-1] = AXES.index(names[-1]) - (names[-2] in CROSS)
    if not head:
        return tuple(keys)
    kind = head.partition("[")[0]
    owner = next(parameter.owners[one] for one, many in KINDS.items() if many == kind)
    return (kind, [part.name for part in getattr(machine, kind)].index(owner), *keys)


def machine_with(machine: Machine, values: Iterable[tuple[Parameter, float]]) -> Machine:
    """The machine with these values of its parameters, in SI. Raises ConfigError for an impossible one."""
    update: dict[str, Any] = {}
    for parameter, value in values:
        key, *keys = key_path(machine, parameter)
        update[str(key)] = _with(update.get(str(key), getattr(machine, str(key))), keys, value)
    return machine.model_copy(update=update)


def _with(part: Any, keys: list[str | int], value: float) -> Any:
    """A part of the machine with another value at some keys and indices in it."""
    if not keys:
        return value
    key, *inner = keys
    if key == "scale":  # of a curve
        return tuple((deflection, value * force) for deflection, force in part)
    if isinstance(key, int):
        return (*part[:key], _with(part[key], inner, value), *part[key + 1 :])
    changed = _with(getattr(part, key), inner, value)
    if key == "inertia":
        changed = _with(changed, inner[::-1], value)
    return part.model_copy(update={key: changed})
