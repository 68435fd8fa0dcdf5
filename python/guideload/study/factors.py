"""What varies: the entries of a study, and the factors that they become for one machine.

A factor is a column of values, one draw of an entry; an entry has one or, with `each`, one for every part.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, PlainValidator, model_validator

from guideload.base.errors import ConfigError, KeyPath, Problem, ValueRefused, shown
from guideload.base.units import quantity
from guideload.study.distribution_spec import DistributionSpec, KeyRefused
from guideload.study.distributions import (
    Distribution,
    Form,
    Lognormal,
    Marginal,
    Normal,
    Sample,
    Triangular,
    Truncated,
    Uniform,
)
from guideload.study.parameters import Change, Parameter, Parameters

Each = Literal["carriage", "rail", "link", "value"]
# Of a draw for each: what it is for, in words, and how the paths of all begin.
OF_EACH = {
    "carriage": ("carriages", ("carriages.*.", "carriages[*].")),
    "rail": ("rails or carriages", ("rails.*.", "rails[*].")),
    "link": ("links", ("links.*.", "links[*].")),
}


# ---- as described


def _paths(value: object) -> object:
    return (value,) if isinstance(value, str) else value


def _coefficient(value: object) -> float:
    result = quantity(value, "1")
    if not -1.0 < result < 1.0:
        raise ValueRefused("a correlation between -1 and 1", value)
    return result


Coefficient = Annotated[float, PlainValidator(_coefficient)]


class Vary(DistributionSpec):
    """What varies (`path`), as what (`distribution`), and how many draws there are (`each`)."""

    path: Annotated[tuple[str, ...], BeforeValidator(_paths)] = Field(
        min_length=1, description='one or several, e.g. "body.mass" or "carriages.*.stiffness_y"'
    )
    name: str | None = Field(default=None, min_length=1, description="its name in tables; else its path")
    each: Each | None = Field(
        default=None,
        description="what has a draw of its own; one for all if left out",
    )
    within: Coefficient | None = Field(
        default=None, description="correlation of the draws of this entry among each other"
    )

    @model_validator(mode="after")
    def _named(self) -> Vary:
        if self.name is None and len(self.path) > 1:
            raise ValueRefused("a name where there are several paths", list(self.path), 'e.g. name = "k"')
        if self.within is not None and self.each is None:
            raise ValueRefused("no within where there is one draw", self.within, 'add each = "carriage"')
        return self

    @property
    def title(self) -> str:
        """What it is called: its name, or its path."""
        return self.name if self.name is not None else self.path[0]

    def title_of(self, owner: str) -> str:
        """Its title and the part whose draw it is: "k[1a]", or the path of that part: "carriages[1a].x"."""
        if not owner:
            return self.title
        if self.name is None and self.each == "value":
            return owner
        for every in OF_EACH[self.each][1] if self.name is None and self.each is not None else ():
            if self.title.startswith(every):
                return f"{every.split('.')[0].split('[')[0]}[{owner}].{self.title.removeprefix(every)}"
        return f"{self.title}[{owner}]"


# ---- for one machine


@dataclass(frozen=True)
class Factor:
    """One column of values.

    name      its own: "body.mass", "k[1a]"
    unit      of its values: SI, or "1" where they are factors on the machine's values
    targets   the full paths that it sets
    form      what its values are to them: "value", "factor" or "shift"
    marginal  what it is drawn from; None where cases are given
    entry     the index of its entry, or of its column where cases are given
    owner     the part whose draw it is, or ""
    """

    name: str
    unit: str
    targets: tuple[str, ...]
    form: Form
    marginal: Marginal | None
    entry: int
    owner: str

    @property
    def words(self) -> str:
        """How it is drawn and used: "uniform from 1125 to 1375 kg"."""
        if self.marginal is None:
            drawn = "given cases"
        else:
            unit = "" if self.unit == "1" else f" {self.unit}"
            drawn = _words(self.marginal.distribution, self.marginal.scale, unit)
        to = {
            "value": "",
            "factor": ", times the machine's values",
            "shift": ", added to the machine's values",
        }
        return drawn + to[self.form]


def _words(distribution: Distribution, scale: float, unit: str) -> str:
    """`scale` times a distribution, in words."""

    def span(low: float, high: float) -> str:
        first, last = sorted((scale * low, scale * high))
        return f"from {first:.9g} to {last:.9g}{unit}"

    match distribution:
        case Normal(mean, sigma):
            return f"normal with mean {scale * mean:.9g}{unit} and sigma {abs(scale) * sigma:.9g}{unit}"
        case Lognormal(median, sigma):
            return f"lognormal with median {scale * median:.9g}{unit} and sigma {sigma:.9g}"
        case Uniform(low, high):
            return f"uniform {span(low, high)}"
        case Triangular(low, mode, high):
            return f"triangular {span(low, high)} with mode {scale * mode:.9g}{unit}"
        case Sample(values):
            mean = scale * float(values.mean())
            return f"{values.size} values {span(*distribution.reach)} with mean {mean:.9g}{unit}"
        case Truncated(whole, low, high):
            return f"{_words(whole, scale, unit)}, only {span(low, high)}"
    raise TypeError(distribution)


def factors_of(
    entries: Sequence[Vary], parameters: Parameters
) -> tuple[tuple[Factor, ...], tuple[Change, ...]]:
    """The factors of these entries, and what they change in the core.

    Raises ConfigError with all that is wrong, its keys from "vary" on.
    """
    problems: list[Problem] = []
    factors: list[Factor] = []
    columns: list[tuple[Form, Sequence[Parameter]]] = []
    for i, entry in enumerate(entries):
        try:
            for owner, group in _draws(entry, parameters):
                factors.append(_factor(i, entry, owner, group))
                columns.append((factors[-1].form, group))
        except ValueRefused as refused:
            problems.append(problem(("vary", i), refused))
    told: set[int] = set()  # one conflict for each entry is enough
    for factor, other, what in conflicts(factors):
        if factor.entry != other.entry and factor.entry not in told:
            told.add(factor.entry)
            hint = f"{what} is set by vary[{other.entry}] ({entries[other.entry].title}) already"
            path = list(entries[factor.entry].path)
            key: KeyPath = ("vary", factor.entry, "path")
            problems.append(Problem(key, path, "one entry for each value", hint, None, shown(path)))
    names: dict[str, Factor] = {}
    for factor in factors:
        other = names.setdefault(factor.name, factor)
        if factor.entry != other.entry and factor.entry not in told:
            told.add(factor.entry)
            hint = f"vary[{other.entry}] has it already"
            key = ("vary", factor.entry, "name")
            problems.append(Problem(key, factor.name, "a name of its own", hint, None, shown(factor.name)))
    if problems:
        raise ConfigError(problems)
    return tuple(factors), parameters.changes(columns)


def problem(place: KeyPath, refused: ValueRefused) -> Problem:
    """A refusal at its place."""
    place = (*place, refused.key) if isinstance(refused, KeyRefused) else place
    return Problem(place, refused.value, refused.expected, refused.hint, None, shown(refused.value))


def conflicts(factors: Sequence[Factor]) -> Iterator[tuple[Factor, Factor, str]]:
    """A factor, another before it, and the parameter that both set."""
    first: dict[str, Factor] = {}
    for factor in factors:
        for target in factor.targets:
            other = first.setdefault(target, factor)
            if other is not factor:
                yield factor, other, target


def _draws(entry: Vary, parameters: Parameters) -> list[tuple[str, list[Parameter]]]:
    """The draws of an entry: the part that each is for, and what it sets."""
    found: dict[str, Parameter] = {}
    for path in entry.path:
        try:
            found |= {parameter.path: parameter for parameter in parameters.at(path)}
        except ValueRefused as refused:
            raise KeyRefused("path", refused.expected, refused.value, refused.hint) from None
    draws: dict[str, list[Parameter]] = {}
    for parameter in found.values():
        if entry.each is None or entry.each == "value":
            owner = parameter.path if entry.each else ""
        elif entry.each in parameter.owners:
            owner = parameter.owners[entry.each]
        else:
            words = f"paths of {OF_EACH[entry.each][0]}"
            raise KeyRefused("each", words, entry.each, f"{parameter.path} is of no {entry.each}")
        draws.setdefault(owner, []).append(parameter)
    return list(draws.items())


def _factor(i: int, entry: Vary, owner: str, group: Sequence[Parameter]) -> Factor:
    unit = group[0].unit
    marginal = entry.marginal(unit, [parameter.value for parameter in group])
    units = {parameter.unit: parameter.path for parameter in group}
    if len(units) > 1 and marginal.form != "factor":
        told = " and ".join(f"{path} is in {other}" for other, path in units.items())
        raise KeyRefused("path", "paths of one unit, or all amounts in percent", list(entry.path), told)
    try:
        require(group, marginal.form, *marginal.reach)
    except ValueRefused as refused:
        raise KeyRefused("distribution", refused.expected, refused.value, refused.hint) from None
    targets = tuple(parameter.path for parameter in group)
    unit = "1" if marginal.form == "factor" else unit
    return Factor(entry.title_of(owner), unit, targets, marginal.form, marginal, i, owner)


def require(group: Sequence[Parameter], form: Form, low: float, high: float) -> None:
    """Refuses a column with values from `low` to `high` if one of its parameters cannot have them."""
    for parameter in group:
        factor = parameter.value if form == "factor" else 1.0
        shift = parameter.value if form == "shift" else 0.0
        ends = (factor * low + shift, factor * high + shift)
        parameter.require(min(ends), max(ends))
