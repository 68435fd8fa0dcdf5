"""A table of a measured trace: named columns, and the numbers of its rows in the source."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Indices, Integers
from guideload.base.errors import TraceError, ValueRefused, shortened
from guideload.base.units import factor
from guideload.traces.format.dialect_detection import decimal_by_groups
from guideload.traces.format.headers import Header

LARGEST_NUMBER = 1e20  # in a trace: stamps and counts of 64 bits are smaller
SHOWN = 10  # rows named in an error; the count says how many there are
LISTED = 24  # columns named in an error


@dataclass(frozen=True, eq=False)
class Table:
    """Named columns of a source.

    row_word, numbers: name of a row and number of each sample's row in the source: the first sample of a CSV file with
    a header is in row 2, that of an array at index 0. named: False for bare arrays, whose values are SI. units: by
    column, from a row of units. clocks: time column by column, if channels have their own time. rate: Hz, if the source
    gives it in place of time columns. decimal: decimal sign in columns of text.
    """

    source: str
    columns: Mapping[str, Any]
    row_word: str
    numbers: Sequence[int] | Integers
    named: bool = True
    notes: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    clocks: Mapping[str, str] = field(default_factory=dict)
    rate: float | None = None
    decimal: str = "."

    @property
    def names(self) -> list[str]:
        return list(self.columns)

    @property
    def time_names(self) -> list[str]:
        """Columns whose headers say that they hold time stamps; dates may have a unit such as hh:mm:ss."""
        headers = {name: self.header(name) for name in self.columns}
        odd = {name for name, one in headers.items() if one.is_time_in_unknown_unit and self.is_stamped(name)}
        return [name for name, header in headers.items() if header.is_time or name in odd]

    def header(self, name: str) -> Header:
        return Header.of(name, self.units.get(name, ""))

    def require(self, name: str) -> None:
        """Raise TraceError unless there is such a column."""
        if name not in self.columns:
            raise TraceError(f"{self.source}: no column {name!r}; there are {listed(self.names)}")

    def factor(self, name: str, unit: str, header: Header | None = None, example: str = "") -> float:
        """Factor from the numbers of a column to a unit. Raises TraceError if the header gives no unit, or another one.

        header: instead of that of the table; example: a name for the message.
        """
        written = (header or self.header(name)).unit
        if not written:
            hint = f'write it into the header, as in "{example or name} [{unit}]"'
            raise TraceError(f"{self.source}: column {name}: the header gives no unit; {hint}")
        try:
            return factor(written, unit)
        except ValueRefused as error:
            raise TraceError(f"{self.source}: column {name}: {error}") from None

    def part(self, samples: Indices) -> Table:
        """The row numbers of some samples, without the columns: to name the rows in messages."""
        return replace(self, columns={}, numbers=np.asarray(self.numbers)[samples])

    def rows(self, samples: Iterable[int]) -> str:
        """Text that names the rows of these samples: the first ten numbers, and their count."""
        numbers = [int(self.numbers[int(sample)]) for sample in samples]
        word = self.row_word if self.row_word == "index" or len(numbers) == 1 else f"{self.row_word}s"
        return f"{word} {listed_rows(numbers)}"

    def is_row_number(self, name: str) -> bool:
        """Whether the column only counts its rows: 0, 1, 2, ... or 1, 2, 3, ..."""
        numbers = self.values(name).astype(float)
        return bool(numbers.size > 1 and numbers[0] in (0.0, 1.0) and np.all(np.diff(numbers) == 1.0))

    def is_stamped(self, name: str) -> bool:
        """Whether the column holds dates or times of day, not numbers."""
        return np.asarray(self.columns[name]).dtype.kind in "mM" or ":" in self.first_text(name)

    def first_text(self, name: str) -> str:
        """The first cell of a column that is text; "" if there is none."""
        column = np.asarray(self.columns[name])
        cells = column if column.dtype.kind in "OUT" else ()
        return next((str(cell) for cell in cells if isinstance(cell, str)), "")

    def values(self, name: str) -> NDArray[Any]:
        """A column as integers if all its cells are, else as float64 with NaN for cells without a number."""
        column = np.asarray(self.columns[name])
        if column.dtype.kind in "iu":
            return column
        if column.dtype.kind == "f":
            # Long doubles that become infinite are refused like other infinite cells.
            with np.errstate(over="ignore"):
                return column.astype(float, copy=False)
        if column.dtype.kind in "bcmMV":  # flags, complex numbers, times and records are no numbers
            return np.full(column.shape[0], np.nan)
        import pandas

        series = pandas.Series(self.columns[name], dtype=object)  # arrow refuses what is no text
        # Lists, flags and complex numbers are no cells.
        is_cell = series.map(
            lambda cell: isinstance(cell, str | Real | Decimal) and not isinstance(cell, bool)
        )
        plain = _plain(series.where(is_cell, None), self.decimal)
        return np.asarray(pandas.to_numeric(plain, errors="coerce").to_numpy(dtype=float, na_value=np.nan))

    def require_size(
        self, name: str, values: NDArray[Any], largest: float = LARGEST_NUMBER, unit: str = ""
    ) -> None:
        """Raise TraceError for larger numbers of a column. Cells that are infinite in the source are refused elsewhere.

        unit: SI unit of the values, after their conversion; "" for numbers of the source.
        """
        is_far = np.abs(values.astype(float)) > largest
        far = np.flatnonzero(is_far if unit else is_far & np.isfinite(values))
        if far.size:
            raise TraceError(
                f"{self.source}: column {name}: expected at most {largest:g}{unit and ' '}{unit}, got "
                f"{values[far[0]]:.6g} in {self.rows(far)}; check the unit, or cut the trace to a sound part"
            )

    def no_number(self, name: str, bad: Indices, hint: str) -> TraceError:
        """The error for these samples of a column: cells without a finite number.

        hint: the way out, unless the text of the first cell suggests another.
        """
        cell = np.asarray(self.columns[name])[int(bad[0])]
        text = shortened(str(cell))
        held = f'holds "{text}"' if isinstance(cell, str) else f"is empty or {text}"
        written = cell.strip() if isinstance(cell, str) else ""
        if self.decimal == "." and re.fullmatch(r"[+-]?\d+,\d+([eE][+-]?\d+)?", written):
            hint = "write numbers with a decimal point"
        elif re.fullmatch(r"[+-]?\d{1,3}([.,']\d{3})+([.,]\d+)?", written):
            sign = "comma" if self.decimal == "," else "point"
            hint = f"it may have groups of digits: write numbers with a decimal {sign} and no other sign"
        return TraceError(
            f"{self.source}: column {name}: expected finite numbers, got none in {self.rows(bad)}: "
            f"the first {held}; {hint}"
        )


def _plain(series: Any, decimal: str) -> Any:
    """A column of text (a series), its numbers rewritten with a decimal point and without digit groups.

    Groups of three digits are joined if one cell is unambiguous, with a decimal sign as well or with two groups; else
    ambiguous cells become empty. Cells that are not text are not changed.
    """
    is_text = series.map(lambda cell: isinstance(cell, str))
    cells = series[is_text].str.strip()
    group = "." if decimal == "," else ","
    doubtful = cells.str.contains(f"[{group}']")
    if doubtful.any():
        number = rf"[+-]?\d{{1,3}}([{group}'])\d{{3}}(\1\d{{3}})*(\{decimal}\d*)?"
        has_groups = any(decimal_by_groups(cell) == decimal for cell in cells[doubtful])
        if has_groups and all(re.fullmatch(number, cell) for cell in cells[doubtful]):
            cells = cells.str.replace(f"[{group}']", "", regex=True)
        else:
            cells = cells.mask(doubtful)
    plain = series.astype(object)
    plain[is_text] = cells.str.replace(",", ".", regex=False) if decimal == "," else cells
    return plain


def listed(names: Sequence[str], most: int = LISTED) -> str:
    """Names of columns for a message: the first ones, and their count."""
    rest = f", ... ({len(names)} in all)" if len(names) > most else ""
    return ", ".join(map(shortened, names[:most])) + rest


def listed_rows(numbers: Sequence[int]) -> str:
    """Numbers of rows for a message."""
    return listed([str(number) for number in numbers], SHOWN)


def unique(names: Sequence[str]) -> list[str]:
    """The names, repeated ones with a number: x, x.1, x.2."""
    counts: Counter[str] = Counter()
    result = []
    for name in names:
        result.append(f"{name}.{counts[name]}" if counts[name] else name)
        counts[name] += 1
    return result
