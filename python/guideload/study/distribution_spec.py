"""Distributions as a study describes them: each value with its unit, or in percent of the machine's own value.

`DistributionSpec.marginal` makes numbers of them as soon as the path has told the unit and that value.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from guideload.base.config import ConfigModel, number
from guideload.base.errors import ValueRefused
from guideload.base.units import quantity
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
from guideload.study.tables import numbers_of
from guideload.traces.format.files import load_table
from guideload.traces.format.table import listed

Name = Literal["normal", "lognormal", "uniform", "triangular", "sample"]
# Of a distribution within at_least and at_most. Less is no scatter any more, and its place is lost in rounding.
LEAST_KEPT = 1e-6
PERCENT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*%\s*")
# The keys of each distribution; those of every one follow.
KEYS: dict[str, tuple[str, ...]] = {
    "normal": ("mean", "sigma"),
    "lognormal": ("median", "sigma"),
    "uniform": ("low", "high", "plus_minus"),
    "triangular": ("low", "mode", "high", "plus_minus"),
    "sample": ("values", "file", "column"),
}
CUTS = ("at_least", "at_most")
CENTERS = ("mean", "median", "mode")  # the machine's value where they are left out
WIDTHS = ("sigma", "plus_minus")  # amounts, not places


class KeyRefused(ValueRefused):
    """A value of a description was refused as soon as its path was known; `key` says which."""

    def __init__(self, key: str, expected: str, value: object, hint: str = "") -> None:
        super().__init__(expected, value, hint)
        self.key = key


@dataclass(frozen=True)
class Amount:
    """A number in SI, or a share of the machine's value."""

    number: float
    relative: bool


def _amount(value: object) -> object:
    """A number or text, whose unit is checked when the path has told which; NumPy's numbers are Python's."""
    value = value.item() if isinstance(value, np.generic) else value
    if value is not None and (isinstance(value, bool) or not isinstance(value, int | float | str)):
        raise ValueRefused('a number, or text with a unit or percent, such as "90 %"', value)
    return value


def _list(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _name(value: object) -> object:
    """The name of a distribution; its refusal is told once, with the nearest name."""
    names = get_args(Name)
    if value not in names:
        near = get_close_matches(str(value), names, n=1)
        hint = f'did you mean "{near[0]}"?' if near else 'as in distribution = "uniform"'
        known = ", ".join(f'"{name}"' for name in names)
        raise ValueRefused(f"one of {known}", value, hint)
    return value


Given = Annotated[float | str | None, BeforeValidator(_amount)]


class DistributionSpec(ConfigModel):
    """A distribution and its parameters, each with its unit or in percent of the machine's value."""

    distribution: Annotated[Name, BeforeValidator(_name)] = Field(
        description=f"one of {', '.join(get_args(Name))}"
    )
    mean: Given = Field(default=None, description="of a normal one; the machine's value if left out")
    median: Given = Field(default=None, description="of a lognormal one; the machine's value if left out")
    mode: Given = Field(default=None, description="of a triangular one; the machine's value if left out")
    sigma: Given = Field(
        default=None,
        description='standard deviation, e.g. "3 %" or "2 mm"; of a lognormal one that of the logarithm, e.g. 0.2',
    )
    low: Given = Field(default=None, description='the smallest value, e.g. "90 %" or "1100 kg"')
    high: Given = Field(default=None, description='the largest value, e.g. "110 %" or "1400 kg"')
    plus_minus: Given = Field(
        default=None, description='reach to both sides of the machine\'s value, e.g. "10 %" or "5 cm"'
    )
    values: Annotated[tuple[Given, ...] | None, BeforeValidator(_list)] = Field(
        default=None, min_length=1, description='measured values, e.g. ["118 N/um", "131 N/um"]'
    )
    file: str | None = Field(default=None, description="a table of measured values beside this file")
    column: str | None = Field(
        default=None, description='its column; a header such as "k [N/um]" or "k [%]" tells the unit'
    )
    at_least: Given = Field(default=None, description="values below are left out")
    at_most: Given = Field(default=None, description="values above are left out")

    @field_validator(*dict.fromkeys(key for keys in KEYS.values() for key in keys))
    @classmethod
    def _has_place(cls, value: Any, info: ValidationInfo) -> Any:
        kind = info.data.get("distribution")
        if value is not None and kind is not None and info.field_name not in KEYS[kind]:
            known = ", ".join((*KEYS[kind], *CUTS))
            raise ValueRefused(f'no {info.field_name} with distribution = "{kind}"', value, f"it has {known}")
        return value

    @model_validator(mode="after")
    def _complete(self) -> DistributionSpec:
        given = {key for key in KEYS[self.distribution] if getattr(self, key) is not None}
        shown = self.model_dump(exclude_unset=True, mode="json")
        if self.distribution in ("normal", "lognormal") and "sigma" not in given:
            raise ValueRefused("sigma", shown, type(self).model_fields["sigma"].description or "")
        if self.distribution in ("uniform", "triangular"):
            if ("plus_minus" in given) == bool(given & {"low", "high"}) or len(given & {"low", "high"}) == 1:
                raise ValueRefused("either plus_minus, or low and high", shown)
            if {"plus_minus", "mode"} <= given:
                raise ValueRefused(
                    "no mode beside plus_minus, which is counted from the machine's value", shown
                )
        if self.distribution == "sample" and ("values" in given) == ("file" in given):
            raise ValueRefused("either values or file", shown)
        if "column" in given and "file" not in given:
            raise ValueRefused("no column without a file", shown)
        return self

    def marginal(self, unit: str, own: Sequence[float]) -> Marginal:
        """What is drawn for places that have the values `own` [unit] in the machine.

        One place: its value. Several: a factor on each one's own value where all is told in percent or left to
        the machine, a shift where only a width is told, and one value for all where a place is told.
        sample: the measured values, if they are in a file. Raises KeyRefused.
        """
        amounts = self._amounts(unit)
        values = self._values(unit)
        kinds = {amount.relative for amount in (*amounts.values(), *values)}
        placed = bool(values) or any(amount is not None for amount in map(amounts.get, (*CENTERS, "low")))
        if False not in kinds:  # all in percent, or left to the machine
            if not any(own):
                raise KeyRefused(
                    "path", "a machine's value other than 0, or values with a unit", 0.0, "0 has no percent"
                )
            form: Form = "value" if len(own) == 1 else "factor"
            return Marginal(self._drawn(amounts, values, 1.0), form, own[0] if len(own) == 1 else 1.0)
        if len(own) == 1:
            return Marginal(self._drawn(*_absolute(amounts, values, own[0]), own[0]), "value")
        # A mode left out is each machine's own, a cut needs a place to count from.
        left_open = "mode" not in amounts and "low" in amounts and self.distribution == "triangular"
        if True in kinds or left_open or not (placed or amounts.keys() <= set(WIDTHS)):
            raise KeyRefused(
                "path",
                "one place where some amounts are in percent or left to the machine and others have a unit",
                len(own),
                'one draw serves all: give all amounts one way, or each its own draw, each = "value"',
            )
        return Marginal(self._drawn(amounts, values, 0.0), "value" if placed else "shift")

    def _amounts(self, unit: str) -> dict[str, Amount]:
        amounts = {}
        for key in (*KEYS[self.distribution], *CUTS):
            value = getattr(self, key)
            if value is None or key in ("values", "file", "column"):
                continue
            if key == "sigma" and self.distribution == "lognormal":
                # A plain number, neither of the path's unit nor a share: `_drawn` reads it from the field.
                try:
                    number(value, "1", above=0.0)
                except ValueRefused as refused:
                    share = PERCENT.fullmatch(value) if isinstance(value, str) else None
                    plain = float(share[1]) / 100.0 if share and float(share[1]) > 0.0 else 0.1
                    hint = (
                        f"of a lognormal distribution it is that of the logarithm, a plain number: {plain:g}"
                    )
                    raise KeyRefused(key, refused.expected, value, hint) from None
                continue
            amounts[key] = _read(key, value, unit)
            if key in WIDTHS and not amounts[key].number > 0.0:
                raise KeyRefused(key, "> 0", value)
        return amounts

    def _values(self, unit: str) -> list[Amount]:
        if self.file is None:
            return [_read("values", value, unit) for value in self.values or ()]
        table = load_table(self.file)
        header = self.column if self.column is not None else table.names[0]
        if header not in table.names or (self.column is None and len(table.names) > 1):
            hint = f"{table.source} has {listed(table.names)}"
            raise KeyRefused(
                "file" if self.column is None else "column", "the name of a column", self.column, hint
            )
        try:
            numbers, relative = numbers_of(table, header, unit)
        except ValueRefused as refused:
            hint = f"column {header} of {table.source}: {refused.hint}"
            raise KeyRefused("file", refused.expected, refused.value, hint) from None
        return [Amount(number, relative) for number in numbers.tolist()]

    def _drawn(self, amounts: dict[str, Amount], values: Sequence[Amount], own: float) -> Distribution:
        """The distribution of these numbers, `own` where the machine's value is meant."""
        at = {key: amount.number for key, amount in amounts.items()}
        low, high = at.get("at_least", -math.inf), at.get("at_most", math.inf)
        if not low < high:
            raise KeyRefused("at_least", "at_least < at_most", self.at_least)
        if self.distribution == "sample":
            return self._sample(values, low, high)
        whole = self._whole(at, own)
        if (low, high) == (-math.inf, math.inf):
            return whole
        kept = whole.cdf(high) - whole.cdf(low)
        if kept < LEAST_KEPT:
            key = "at_most" if self.at_least is None else "at_least"
            hint = f"only {kept:.2g} of the distribution lies there"
            raise KeyRefused(key, "bounds that keep a part of the distribution", getattr(self, key), hint)
        return Truncated(whole, low, high)

    def _whole(self, at: dict[str, float], own: float) -> Normal | Lognormal | Uniform | Triangular:
        if self.distribution == "normal":
            return Normal(at.get("mean", own), at["sigma"])
        if self.distribution == "lognormal":
            median = at.get("median", own)
            if not median > 0.0:
                raise KeyRefused("median", "> 0", median, "a lognormal distribution has no other values")
            return Lognormal(median, number(self.sigma, "1", above=0.0))
        low, high = (
            at.get("low", own - at.get("plus_minus", 0.0)),
            at.get("high", own + at.get("plus_minus", 0.0)),
        )
        if not low < high:
            raise KeyRefused("low", "low < high", self.low)
        if self.distribution == "uniform":
            return Uniform(low, high)
        mode = at.get("mode", own)
        if not low <= mode <= high:
            hint = "" if "mode" in at else "the machine's value is the mode if none is given"
            raise KeyRefused("mode", f"a mode from {low:g} to {high:g}", mode, hint)
        return Triangular(low, mode, high)

    def _sample(self, values: Sequence[Amount], low: float, high: float) -> Sample:
        key = "values" if self.file is None else "column"
        numbers = np.sort(np.array([value.number for value in values]))
        numbers = numbers[(numbers >= low) & (numbers <= high)]
        if not numbers.size:
            raise KeyRefused(key, "values within at_least and at_most", getattr(self, key))
        numbers.setflags(write=False)
        return Sample(numbers)


def _read(key: str, value: object, unit: str) -> Amount:
    """A number with the unit, or a share of the machine's value. Raises KeyRefused."""
    match = PERCENT.fullmatch(value) if isinstance(value, str) else None
    try:
        if match is None:
            return Amount(quantity(value, unit), False)
    except ValueRefused as refused:
        hint = refused.hint or 'or in percent of the machine\'s value, such as "90 %"'
        raise KeyRefused(key, refused.expected, value, hint) from None
    if key not in WIDTHS and match[1][0] in "+-":
        hint = 'e.g. "90 %"; for a deviation from it use plus_minus or sigma'
        raise KeyRefused(key, "percent of the machine's value, without a sign", value, hint)
    return Amount(float(match[1]) / 100.0, True)


def _absolute(
    amounts: dict[str, Amount], values: Sequence[Amount], own: float
) -> tuple[dict[str, Amount], list[Amount]]:
    """Shares as numbers: of a place with the machine's value, of a width with its size."""

    def number_of(amount: Amount, whole: float) -> Amount:
        return Amount(amount.number * whole, False) if amount.relative else amount

    numbers = {key: number_of(amount, abs(own) if key in WIDTHS else own) for key, amount in amounts.items()}
    return numbers, [number_of(value, own) for value in values]
