"""Numbers and lists of names as text: the one place where the package formats numbers for readers.

Every number passes through `_finite`: what is not finite is written as a word, never as `nan` or `inf`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial, wraps
from typing import Concatenate, ParamSpec

P = ParamSpec("P")

NARROW_SPACE = "\N{NARROW NO-BREAK SPACE}"  # between thousands, from 10 000 on
PLAIN_FROM, PLAIN_TO = 1e-4, 1e7  # smaller and larger numbers are written with an exponent


def _finite(show: Callable[Concatenate[float, P], str]) -> Callable[Concatenate[float, P], str]:
    """Decorator: `unknown` for NaN and `unlimited` for infinity, in place of what `show` would write."""

    @wraps(show)
    def written(value: float, /, *args: P.args, **kwargs: P.kwargs) -> str:
        if math.isfinite(value):
            return show(value, *args, **kwargs)
        return "unknown" if math.isnan(value) else "unlimited"

    return written


@_finite
def fixed(value: float, decimals: int = 0) -> str:
    """A number with this many decimals and readable thousands; never -0.0."""
    text = f"{value:,.{decimals}f}"
    if float(text.replace(",", "")) == 0.0:
        text = text.removeprefix("-")
    return text.replace(",", NARROW_SPACE if abs(value) >= 9999.5 else "")


@_finite
def digits(value: float, count: int = 3) -> str:
    """A number with this many significant digits, and all digits before the decimal point; no zeros at the end."""
    rounded = float(f"{value:.{count}g}")
    if rounded != 0.0 and not PLAIN_FROM <= abs(rounded) < PLAIN_TO:
        mantissa, _, exponent = f"{value:.{count - 1}e}".partition("e")
        return f"{mantissa.rstrip('0').rstrip('.') if count > 1 else mantissa}e{int(exponent)}"
    before = math.floor(math.log10(abs(rounded))) + 1 if rounded else 1
    text = fixed(value, max(count - before, 0))
    return text.rstrip("0").rstrip(".") if "." in text else text


def _distinct(value: float, limit: float, count: int) -> int:
    """Significant digits, `count` or more, with which a value differs from a limit; 1e-9 of it is rounding."""
    while abs(value - limit) > 1e-9 * abs(limit) and f"{value:.{count - 1}e}" == f"{limit:.{count - 1}e}":
        count += 1
    return count


@_finite
def beside(value: float, limit: float) -> str:
    """A number with three digits, or with so many that it differs from a limit: `0.9996` beside 1."""
    return digits(value, _distinct(value, limit, 3))


def number(value: float) -> str:
    """A number that someone gave: up to six digits."""
    return digits(value, 6)


def vector(numbers: Iterable[float]) -> str:
    """Numbers that someone gave in brackets: `(0, 300, 0)`."""
    return f"({', '.join(map(number, numbers))})"


def seconds(value: float) -> str:
    """An instant of a record in s without its unit: to milliseconds."""
    return fixed(value, 3)


def load_in_table(value: float) -> str:
    """A load without its unit: no decimals from 100 N up, one below; never -0.0."""
    return fixed(value, 0 if abs(value) >= 100 else 1)


def load_with_unit(value: float, unit: str = "N") -> str:
    """A load for pictures: `-12 258 N`; one decimal below 100, three digits below 1, `0` below 1e-6."""
    size = abs(value)
    text = "0" if size < 1e-6 else digits(value) if size < 1 else load_in_table(value)
    return text.replace("-", "\N{MINUS SIGN}") + f" {unit}"


@_finite
def load_in_sentence(value: float) -> str:
    """A load with three digits: `812 N` or, from 1000 N up, `1.23 kN`."""
    return f"{digits(value)} N" if value < 1e3 else f"{digits(1e-3 * value)} kN"


@_finite
def length_in_table(value: float) -> str:
    """A length or rate with three digits and the zeros at its end: `0.120`, `1.20`, `12.0`, `120`."""
    size = abs(value)
    return fixed(value, 0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3)


@_finite
def percent(part: float) -> str:
    """A fraction as percentage with two digits, more beside 100 %: `3.1 %`; `0 %` up to 1e-9, which is rounding."""
    value = 100.0 * part if part > 1e-9 else 0.0
    count = _distinct(value, 100.0, 2)
    return f"{float(f'{value:.{count}g}'):.{max(count, 6)}g} %"


def signed(value: float, kind: str = "3 digits") -> str:
    """A number with its sign: `+4.13`, `-0.2`; of the kind `percent` `+12 %`."""
    return f"{'-' if value < 0 else '+'}{KINDS[kind](abs(value))}"


@_finite
def scientific(value: float, decimals: int = 0) -> str:
    """`1e-6`, or with one decimal `1.2e-6`: the exponent has no leading zeros."""
    mantissa, exponent = f"{value:.{decimals}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def milliseconds(seconds: float, count: int = 3) -> str:
    """A time in ms without its unit: `count` significant digits, but all digits before the decimal point."""
    return digits(1e3 * seconds, count)


@_finite
def rounded(value: float) -> str:
    """A life without its unit, with three digits: `43.7`, `2 340 000`."""
    return digits(value) if abs(value) < 99.95 else fixed(float(f"{value:.2e}"))


def kilometres(metres: float) -> str:
    """A life in km without its unit: `12 800`, `43.7`."""
    return rounded(1e-3 * metres)


def between(low: float, high: float, kind: str = "3 digits") -> str:
    """`3.1 to 4.2`."""
    return f"{KINDS[kind](low)} to {KINDS[kind](high)}"


# How the numbers of a column of a table are written: by the kind of quantity, or by the format.
KINDS: dict[str, Callable[[float], str]] = {
    "load": load_in_table,  # N or N m
    "length": length_in_table,
    "life": kilometres,  # from m
    "hours": rounded,
    "3 decimals": seconds,
    "milliseconds": milliseconds,  # from s
    "factor": partial(fixed, decimals=2),
    "percent": percent,  # from a fraction
    "whole": fixed,
    "number": number,
    "1 decimal": partial(fixed, decimals=1),
    **{f"{count} digits": partial(digits, count=count) for count in (2, 3, 4)},
}
KINDS |= {f"signed {kind}": partial(signed, kind=kind) for kind in KINDS}


def counted(count: int, noun: str) -> str:
    """`1 sample`, `2 samples`."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def joined(names: Iterable[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    *head, last = names
    return f"{', '.join(head)} and {last}" if head else last


def first_names(names: Sequence[str]) -> str:
    """`a`, `a, b`, `a, b and 3 more`."""
    more = f" and {len(names) - 2} more" if len(names) > 2 else ""
    return ", ".join(names[:2]) + more


def capitalised(text: str) -> str:
    """The text with a capital first letter; the others stay."""
    return text[:1].upper() + text[1:]
