"""Varied parameters: one [[vary]] table each, with a class per distribution.

A table gives the paths of the parameters (`path`), how many draws they have (`each`), and their distribution, in
numbers with a unit or in percent of the machine's value.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, Field, PlainValidator, model_validator

from guideload.base.arrays import Array
from guideload.base.config import ConfigModel, number, optional
from guideload.base.errors import KeyRefused, UnreadableTrace, ValueRefused
from guideload.base.units import factor, quantity
from guideload.parameters.parameters import Form
from guideload.study import distributions
from guideload.study.distributions import Distribution, Marginal
from guideload.traces.format.sources import load_table
from guideload.traces.format.table import Table, listed

if TYPE_CHECKING:
    from typing_extensions import Self

# ---- columns of tables beside a study


HEADER = re.compile(r"\s*(?P<name>.*\S)\s+\[(?P<unit>[^\[\]]*)\]\s*")


def name_and_unit(header: str) -> tuple[str, str]:
    """("body.mass", "t") from "body.mass [t]"; the unit is "" if there is none."""
    match = HEADER.fullmatch(header)
    return (match["name"], match["unit"]) if match else (header.strip(), "")


def column_numbers(table: Table, header: str, unit: str) -> tuple[Array, bool]:
    """A column (n,) in SI `unit`, and False; or as shares, and True, if its header has the unit [%].

    Without a unit in the header, the row of units below applies, else SI. Raises TraceError with the rows that hold no
    number, and ValueRefused for another dimension.
    """
    numbers = table.values(header).astype(np.float64)
    if (bad := np.flatnonzero(~np.isfinite(numbers))).size:
        raise table.no_number(header, bad, "remove the rows; nothing is filled in")
    written = name_and_unit(header)[1] or table.units.get(header, "")
    if written == "%":
        return numbers / 100.0, True
    return numbers * (factor(written, unit) if written else 1.0), False


def no_percent() -> KeyRefused:
    """The refusal of percent of values of the machine that are all 0."""
    expected = "a machine's value other than 0, or values with a unit"
    return KeyRefused("path", expected, 0.0, "0 has no percent")


# ---- the tables [[vary]]


Each = Literal["carriage", "rail", "link", "payload", "value"]
NAMES = "one of normal, lognormal, uniform, triangular, sample"
LEAST_PROBABILITY = 1e-6  # least probability between at_least and at_most: rounding spoils draws from less
PERCENT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*%\s*")
# Keys of amounts, with or without a unit.
AMOUNTS = ("mean", "sigma", "median", "low", "mode", "high", "plus_minus", "at_least", "at_most")
LOCATIONS = ("mean", "median", "mode", "low")  # values of the parameter
ENDS = (("low", "high"), ("at_least", "at_most"))  # of which the first is less
WIDTHS = ("sigma", "plus_minus")  # differences of values


class Amount(NamedTuple):
    """A number in SI, or a share of the machine's value."""

    number: float
    relative: bool


def _number_or_text(value: object) -> object:
    """A number, or text whose unit is checked later; NumPy's numbers become Python's."""
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueRefused("a number, or text with a unit", value)
    return value


def _listed(value: object) -> object:
    """Text or an array as a list; other values unchanged."""
    return [value] if isinstance(value, str) else value.tolist() if isinstance(value, np.ndarray) else value


def _coefficient(value: object) -> float:
    result = quantity(value, "1")
    if not -1.0 < result < 1.0:
        raise ValueRefused("a correlation between -1 and 1", value)
    return result


def _sigma_of_logarithm(value: object) -> float:
    try:
        return number(value, "1", above=0.0)
    except ValueRefused as refused:
        share = PERCENT.fullmatch(value) if isinstance(value, str) else None
        plain = float(share[1]) / 100.0 if share and float(share[1]) > 0.0 else 0.1
        hint = f"the sigma of a lognormal distribution is that of the logarithm, a plain number: {plain:g}"
        raise ValueRefused(refused.expected, value, hint) from None


Numbers = Mapping[str | int, float]  # amounts as numbers
Coefficient = Annotated[float, PlainValidator(_coefficient)]
NumberOrText = Annotated[Any, PlainValidator(_number_or_text)]


class ParameterPaths(ConfigModel):
    """Paths of parameters of a machine, and whether they share one number (`each`)."""

    path: Annotated[tuple[str, ...], BeforeValidator(_listed)] = Field(
        min_length=1, description='one or several, e.g. "body.mass" or "carriages.*.stiffness_y"'
    )
    name: str | None = optional("name in tables; by default the path", min_length=1)
    each: Each | None = optional(
        "one number for each carriage, rail, link, payload or value; by default one for all"
    )

    @model_validator(mode="after")
    def _named(self) -> Self:
        if self.name is None and len(self.path) > 1:
            raise ValueRefused("a name where there are several paths", list(self.path), 'e.g. name = "k"')
        return self

    @property
    def title(self) -> str:
        """Its name, or its path."""
        return self.name if self.name is not None else self.path[0]

    def draw_title(self, owner: str) -> str:
        """The name of one number: "k[1a]", or without a name its path: "carriages[1a].x"."""
        if not owner:
            return self.title
        if self.name is None and self.each == "value":
            return owner
        all_of_a_kind = re.fullmatch(rf"({self.each}s)(?:\.\*|\[\*\])\.(.+)", self.title)
        if self.name is None and all_of_a_kind:
            return f"{all_of_a_kind[1]}[{owner}].{all_of_a_kind[2]}"
        return f"{self.title}[{owner}]"


class VariedParameter(ParameterPaths):
    """Varied parameters, one draw for all or for each part, and bounds of their distribution."""

    KEYS: ClassVar[tuple[str, ...]] = AMOUNTS
    within: Coefficient | None = optional("correlation between the draws of this table")
    at_least: NumberOrText | None = optional("lower bound of the distribution")
    at_most: NumberOrText | None = optional("upper bound of the distribution")

    @model_validator(mode="after")
    def _drawn_several_times(self) -> Self:
        if self.within is not None and self.each is None:
            raise ValueRefused("no within where there is one draw", self.within, 'add each = "carriage"')
        return self

    def marginal(self, unit: str, nominal: Sequence[float]) -> Marginal:
        """The distribution of a column that sets parameters; nominal: their values [unit] in the machine.

        For one parameter the column is its value. For several it is a factor on the value of each if all amounts are in
        percent or left out, a shift of each if only a width is given, and the value of all if a location is given.
        Raises KeyRefused.
        """
        amounts = self._amounts(unit)
        kinds = {amount.relative for amount in amounts.values()}
        if False not in kinds:  # all in percent, or left out
            if not any(nominal):
                raise no_percent()
            drawn = self._bounded(amounts, 1.0)
            return Marginal(drawn, "value", nominal[0]) if len(nominal) == 1 else Marginal(drawn, "factor")
        if len(nominal) == 1:
            shares = {key for key, amount in amounts.items() if amount.relative}
            for key, (share, relative) in amounts.items():
                if relative:
                    amounts[key] = Amount(share * (abs(nominal[0]) if key in WIDTHS else nominal[0]), False)
            for low, high in ENDS if nominal[0] < 0.0 else ():  # 90 % of it is above 110 %
                ends = amounts.keys() & {low, high}
                if ends <= shares:
                    other: dict[str | int, str | int] = {low: high, high: low}
                    amounts = {other.get(key, key): amount for key, amount in amounts.items()}
                elif ends & shares:
                    expected = f"{low} and {high} both in percent or both with a unit"
                    hint = "90 % of a negative value lies above 110 % of it"
                    raise KeyRefused(low, expected, getattr(self, low), hint)
            return Marginal(self._bounded(amounts, nominal[0]), "value")
        located = any(key in LOCATIONS or isinstance(key, int) for key in amounts)
        # The default mode is the value of each parameter, and a bound without a location refers to nothing.
        without_mode = isinstance(self, TriangularSpec) and "low" in amounts and "mode" not in amounts
        if without_mode and True not in kinds:
            hint = 'give the mode, or a draw per value: each = "value", or low and high in percent'
            expected = f"the most likely value, because the {len(nominal)} values have no common one"
            raise KeyRefused("mode", expected, None, hint)
        if True in kinds or not (located or amounts.keys() <= set(WIDTHS)):
            expected = "a single value where some amounts are in percent or left out and others have a unit"
            hint = 'give all amounts in percent, or all with a unit, or a draw per value: each = "value"'
            raise KeyRefused("path", expected, len(nominal), hint)
        form: Form = "value" if located else "shift"
        return Marginal(self._bounded(amounts, 0.0), form)

    def _amounts(self, unit: str) -> dict[str | int, Amount]:
        """The given amounts by key, measured values by index."""
        given = {key: getattr(self, key, None) for key in self.KEYS}
        return {key: _read(key, value, unit) for key, value in given.items() if value is not None}

    def _bounded(self, amounts: Mapping[str | int, Amount], nominal: float) -> Distribution:
        """The truncated distribution; nominal: its location if none is given."""
        numbers = {key: amount.number for key, amount in amounts.items()}
        low, high = numbers.get("at_least", -math.inf), numbers.get("at_most", math.inf)
        if not low < high:
            raise KeyRefused("at_least", "at_least < at_most", self.at_least)
        return self._truncated(self._distribution(numbers, nominal), low, high)

    def _distribution(self, numbers: Numbers, nominal: float) -> Any:
        """The distribution before truncation; nominal: its location if none is given."""
        raise NotImplementedError

    def _truncated(self, base: Any, low: float, high: float) -> Distribution:
        inside = base.cdf(high) - base.cdf(low)
        if inside < LEAST_PROBABILITY:
            key = "at_most" if self.at_least is None else "at_least"
            hint = f"only {inside:.2g} of the distribution lies between the bounds"
            raise KeyRefused(key, "bounds that contain a part of the distribution", getattr(self, key), hint)
        return base if (low, high) == (-math.inf, math.inf) else distributions.Truncated(base, low, high)


class NormalSpec(VariedParameter):
    """A normal distribution."""

    distribution: Literal["normal"] = Field(description=NAMES)
    mean: NumberOrText | None = optional("by default the machine's value")
    sigma: NumberOrText = Field(description='standard deviation, e.g. "3 %" or "2 mm"')

    def _distribution(self, numbers: Numbers, nominal: float) -> Distribution:
        return distributions.Normal(numbers.get("mean", nominal), numbers["sigma"])


class LognormalSpec(VariedParameter):
    """A lognormal distribution."""

    KEYS = ("median", "at_least", "at_most")  # sigma is a plain number: without unit, no share of a value
    distribution: Literal["lognormal"] = Field(description=NAMES)
    median: NumberOrText | None = optional("by default the machine's value")
    sigma: Annotated[float, PlainValidator(_sigma_of_logarithm)] = Field(
        description="standard deviation of the logarithm, e.g. 0.2"
    )

    def _distribution(self, numbers: Numbers, nominal: float) -> Distribution:
        median = numbers.get("median", nominal)
        if not median > 0.0:
            raise KeyRefused("median", "> 0", median, "a lognormal distribution has no other values")
        return distributions.Lognormal(median, self.sigma)


class _IntervalSpec(VariedParameter):
    """A distribution between two values, or around the machine's value."""

    low: NumberOrText | None = optional('the smallest value, e.g. "90 %" or "1100 kg"')
    high: NumberOrText | None = optional('the largest value, e.g. "110 %" or "1400 kg"')
    plus_minus: NumberOrText | None = optional('half width around the machine\'s value: "10 %", "5 cm"')

    @model_validator(mode="after")
    def _complete(self) -> _IntervalSpec:
        given = {key for key in ("low", "high", "plus_minus") if getattr(self, key) is not None}
        if given not in ({"plus_minus"}, {"low", "high"}):
            table = self.model_dump(exclude_unset=True, mode="json")
            hint = 'e.g. plus_minus = "10 %", around the machine\'s value'
            raise ValueRefused("either plus_minus, or low and high", table, hint)
        return self

    def _ends(self, numbers: Numbers, nominal: float) -> tuple[float, float]:
        reach = numbers.get("plus_minus", 0.0)
        low, high = numbers.get("low", nominal - reach), numbers.get("high", nominal + reach)
        if not low < high:
            raise KeyRefused("low", "low < high", self.low)
        return low, high


class UniformSpec(_IntervalSpec):
    """A uniform distribution."""

    distribution: Literal["uniform"] = Field(description=NAMES)

    def _distribution(self, numbers: Numbers, nominal: float) -> Distribution:
        return distributions.Uniform(*self._ends(numbers, nominal))


class TriangularSpec(_IntervalSpec):
    """A triangular distribution."""

    distribution: Literal["triangular"] = Field(description=NAMES)
    mode: NumberOrText | None = optional("the most likely value; by default the machine's value")

    @model_validator(mode="after")
    def _one_center(self) -> TriangularSpec:
        if self.plus_minus is not None and self.mode is not None:
            raise ValueRefused("no mode beside plus_minus, which is around the machine's value", self.mode)
        return self

    def _distribution(self, numbers: Numbers, nominal: float) -> Distribution:
        low, high = self._ends(numbers, nominal)
        mode = numbers.get("mode", nominal)
        if not low <= mode <= high:
            hint = (
                ""
                if "mode" in numbers
                else "it is the machine's value if none is given: give one, or move the ends"
            )
            raise KeyRefused("mode", f"a mode from {self.low} to {self.high}", mode, hint)
        return distributions.Triangular(low, mode, high)


class SampleSpec(VariedParameter):
    """Measured values, in the study or in a table beside it."""

    distribution: Literal["sample"] = Field(description=NAMES)
    values: Annotated[tuple[NumberOrText, ...] | None, BeforeValidator(_listed)] = optional(
        'measured values, e.g. ["118 N/um", "131 N/um"]', min_length=1
    )
    file: str | None = optional("a table of measured values beside this file")
    column: str | None = optional('its column; a header such as "k [N/um]" or "k [%]" gives the unit')

    @model_validator(mode="after")
    def _one_source(self) -> SampleSpec:
        if (self.values is None) == (self.file is None):
            raise ValueRefused("either values or file", self.model_dump(exclude_unset=True, mode="json"))
        if self.column is not None and self.file is None:
            raise ValueRefused("no column without a file", self.column)
        return self

    def _amounts(self, unit: str) -> dict[str | int, Amount]:
        return super()._amounts(unit) | dict(enumerate(self._values(unit)))

    def _values(self, unit: str) -> list[Amount]:
        if self.file is None:
            return [_read("values", value, unit) for value in self.values or ()]
        try:
            table = load_table(self.file)
        except UnreadableTrace as error:
            raise KeyRefused("file", "a table of measured values", self.file, str(error)) from None
        header = self.column if self.column is not None else table.names[0]
        if header not in table.names or (self.column is None and len(table.names) > 1):
            key = "file" if self.column is None else "column"
            hint = f"{table.source} has {listed(table.names)}"
            raise KeyRefused(key, "the name of a column", self.column, hint)
        try:
            numbers, relative = column_numbers(table, header, unit)
        except ValueRefused as refused:
            hint = f"column {header} of {table.source}: {refused.hint}"
            raise KeyRefused("file", refused.expected, refused.value, hint) from None
        if not numbers.size:
            raise KeyRefused("file", f"at least one value in column {header}", self.file)
        return [Amount(number, relative) for number in numbers.tolist()]

    def _distribution(self, numbers: Numbers, nominal: float) -> Array:
        return np.sort(np.array([number for key, number in numbers.items() if isinstance(key, int)]))

    def _truncated(self, base: Array, low: float, high: float) -> Distribution:
        inside = base[(base >= low) & (base <= high)]
        if not inside.size:
            key = "values" if self.file is None else "column"
            raise KeyRefused(key, "values within at_least and at_most", getattr(self, key))
        inside.setflags(write=False)
        return distributions.Sample(inside)


DistributionSpec = Annotated[
    NormalSpec | LognormalSpec | UniformSpec | TriangularSpec | SampleSpec,
    Field(discriminator="distribution"),
]


def _read(key: str, value: object, unit: str) -> Amount:
    """A number with the unit, or a share of the machine's value. Raises KeyRefused."""
    match = PERCENT.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        try:
            amount = Amount(quantity(value, unit), False)
        except ValueRefused as refused:
            hint = refused.hint or 'or in percent of the machine\'s value, such as "90 %"'
            raise KeyRefused(key, refused.expected, value, hint) from None
    elif key not in WIDTHS and match[1][0] in "+-":
        hint = 'e.g. "90 %"; for a deviation from it use plus_minus or sigma'
        raise KeyRefused(key, "percent of the machine's value, without a sign", value, hint)
    else:
        amount = Amount(float(match[1]) / 100.0, True)
    if key in WIDTHS and not amount.number > 0.0:
        raise KeyRefused(key, "> 0", value)
    return amount
