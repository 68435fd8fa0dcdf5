"""Numbers and lists of names as text: the formats that the audit, reports and pictures share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def load_in_table(value: float) -> str:
    """A load without its unit: no decimals from 100 N up, one below; never -0.0."""
    text = f"{value:.{0 if abs(value) >= 100 else 1}f}"
    return text.removeprefix("-") if float(text) == 0 else text


def load_with_unit(value: float, unit: str = "N") -> str:
    """A load for pictures: `-12 258 N`; one decimal below 100, three digits below 1, `0` below 1e-6."""
    size = abs(value)
    if size < 1e-6:
        digits = "0"
    elif size < 1:
        digits = f"{value:.3g}"
    else:
        digits = f"{value:,.{0 if size >= 100 else 1}f}"
    return digits.replace(",", "\N{NARROW NO-BREAK SPACE}").replace("-", "\N{MINUS SIGN}") + f" {unit}"


def load_in_sentence(value: float) -> str:
    """A load with three digits: `812 N` or, from 1000 N up, `1.23 kN`."""
    return f"{value:.3g} N" if value < 1e3 else f"{1e-3 * value:.3g} kN"


def percent(part: float) -> str:
    """A fraction as percentage with two digits: `3.1 %`; `0 %` up to 1e-9, which is rounding."""
    return f"{float(f'{100 * part:.2g}') if part > 1e-9 else 0:g} %"


def scientific(value: float, decimals: int = 0) -> str:
    """`1e-6`, or with one decimal `1.2e-6`: the exponent has no leading zeros."""
    mantissa, exponent = f"{value:.{decimals}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def milliseconds(seconds: float, digits: int = 3) -> str:
    """A time in ms without its unit: `digits` significant digits, but all digits before the decimal point."""
    return f"{1e3 * seconds:.{digits}g}" if 1e3 * seconds < 10.0**digits else f"{1e3 * seconds:.0f}"


def counted(count: int, noun: str) -> str:
    """`1 sample`, `2 samples`."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def joined(names: Iterable[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    *head, last = names
    return f"{', '.join(head)} and {last}" if head else last


def first_names(names: Sequence[str], most: int = 2) -> str:
    """`a`, `a, b`, `a, b and 3 more`."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
