"""Factors: the columns of drawn values in a study of one machine.

A varied parameter has one factor or, with `each`, one factor for every part.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from guideload.base.errors import ConfigError, Problem, ValueRefused
from guideload.parameters.parameters import Form, Parameter, Parameters
from guideload.study.description.metadata import ParameterMetadata
from guideload.study.description.refusals import KeyRefused, problem_at
from guideload.study.description.varied_parameter import ParameterPaths, VariedParameter
from guideload.study.sampling.distributions import Marginal, in_words


@dataclass(frozen=True)
class Factor:
    """One column of values.

    name      "body.mass", "k[1a]"
    unit      of its values: SI, or "1" where they are factors on the machine's values
    targets   the full paths of the parameters that it sets
    form      how a value sets them: as their "value", as a "factor" on it, or as a "shift" of it
    marginal  its distribution; None where cases are given
    entry     the index of its varied parameter, or of its column where cases are given
    owner     the part for which it is drawn, or ""
    """

    name: str
    unit: str
    targets: tuple[str, ...]
    form: Form
    marginal: Marginal | None
    entry: int
    owner: str

    @property
    def metadata(self) -> ParameterMetadata:
        """The factor with its distribution in words: "uniform from 1125 to 1375 kg"."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        uses = {"factor": ", times the machine's values", "shift": ", added to the machine's values"}
        marginal = self.marginal
        words = in_words(marginal.distribution, marginal.scale, unit) if marginal else "given cases"
        words += uses.get(self.form, "")
        return ParameterMetadata(name=self.name, unit=self.unit, targets=self.targets, distribution=words)


def factors_of(entries: Sequence[VariedParameter], parameters: Parameters) -> tuple[Factor, ...]:
    """The factors of these varied parameters.

    Raises ConfigError with all problems; their keys begin with "vary".
    """
    problems: list[Problem] = []
    factors: list[Factor] = []
    for i, entry in enumerate(entries):
        try:
            factors.extend(_factor(i, entry, *draw) for draw in draws_of(entry, parameters).items())
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


def draws_of(entry: ParameterPaths, parameters: Parameters) -> dict[str, list[Parameter]]:
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
    return Factor(entry.title_of(owner), unit, targets, marginal.form, marginal, i, owner)
