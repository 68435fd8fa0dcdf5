"""A table of a measured trace: read from a file or taken from memory, and its columns told apart by their
headers."""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from guideload.errors import TraceError, ValueRefused, shortened
from guideload.units import factor

if TYPE_CHECKING:
    import pandas

    TableLike: TypeAlias = str | Path | Mapping[str, Any] | NDArray[Any] | pandas.DataFrame

Array = NDArray[np.float64]
SHOWN = 10  # rows named in an error; the count says how many there are
OPENING = 65536  # characters of a text file that are searched for its first line, and for what is no text
LISTED = 24  # columns named in an error

# What a column can be, and its SI unit. Counts become a position.
KINDS = {"position": "m", "counts": "m", "velocity": "m/s", "motor_speed": "rad/s"}

# Unit suffixes of headers, longest first; brackets may hold any unit.
SUFFIXES = {
    "mm_per_s": "mm/s",
    "rad_per_s": "rad/s",
    "m_per_s": "m/s",
    "counts": "counts",
    "rad_s": "rad/s",
    "radps": "rad/s",
    "ticks": "counts",
    "count": "counts",
    "mm_s": "mm/s",
    "mmps": "mm/s",
    "m_s": "m/s",
    "mps": "m/s",
    "rpm": "rpm",
    "cnt": "counts",
    "inc": "counts",
    "min": "min",
    "mm": "mm",
    "um": "um",
    "cm": "cm",
    "ms": "ms",
    "us": "us",
    "ns": "ns",
    "s": "s",
    "m": "m",
}
CONTROL = re.compile(r"[\x00-\x08\x0e-\x19\x1b-\x1f]")  # in no text; a last Ctrl-Z (1a) is in some of DOS
TIME_WORDS = {"t", "time", "times", "timestamp", "time_stamp", "elapsed", "elapsed_time", "zeit"}
POSITION_WORDS = ("position", "pos")
VELOCITY_WORDS = ("velocity", "vel", "speed")
MEASURED_WORDS = {"meas", "measured", "actual", "act", "feedback", "fbk", "ist"}
WANTED_WORDS = {
    "ref",
    "reference",
    "cmd",
    "command",
    "commanded",
    "setpoint",
    "set",
    "target",
    "demand",
    "desired",
    "soll",
}


@dataclass(frozen=True)
class Header:
    """A column's name taken apart: words in lower case, and its unit ("" if the header tells none)."""

    words: tuple[str, ...]
    unit: str

    @classmethod
    def of(cls, name: str) -> Header:
        bracket = re.fullmatch(r"\s*(.*?)\s*[\[(]\s*(.*?)\s*[\])]\s*", name)
        if bracket:
            base, unit = bracket.groups()
            unit = "counts" if unit.lower() in ("counts", "count", "cnt", "inc", "ticks") else unit
        else:
            base, unit = name.strip(), ""
            for suffix, meant in SUFFIXES.items():
                if base.lower().endswith(f"_{suffix}"):
                    base, unit = base[: -len(suffix) - 1], meant
                    break
        spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", base)
        return cls(tuple(re.findall(r"[a-zäöü]+|\d+", spaced.lower())), unit)

    @property
    def kind(self) -> str:
        """The kind of column that the unit tells, or ""."""
        if self.unit == "counts":
            return "counts"
        return kind_of_unit(self.unit) if self.unit else ""

    @property
    def word_kind(self) -> str:
        """The kind that the words tell, where there is no unit; or ""."""
        if any(word in POSITION_WORDS for word in self.words):
            return "position"
        if any(word in VELOCITY_WORDS for word in self.words):
            return "motor_speed" if "motor" in self.words else "velocity"
        return ""

    @property
    def is_time(self) -> bool:
        return "_".join(self.words) in TIME_WORDS and (not self.unit or _converts(self.unit, "s"))


def kind_of_unit(unit: str) -> str:
    """position, velocity or motor_speed according to the unit's dimension; "" for anything else."""
    for kind in ("position", "velocity", "motor_speed"):
        if _converts(unit, KINDS[kind]):
            return kind
    return ""


def _converts(unit: str, target: str) -> bool:
    try:
        factor(unit, target)
    except ValueRefused:
        return False
    return True


@dataclass(frozen=True, eq=False)
class Table:
    """Named columns as they stand in the source.

    row_word and first_row say how the source counts: an editor shows the first sample of a CSV file with a
    header as row 2, an array has it at index 0. named: False for bare arrays, whose values are SI.
    """

    source: str
    columns: Mapping[str, Any]
    row_word: str
    first_row: int
    named: bool = True
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        return list(self.columns)

    def rows(self, samples: Iterable[int]) -> str:
        """The rows of these samples, named as the source counts them: the first ten and the count."""
        numbers = [self.first_row + int(sample) for sample in samples]
        text = ", ".join(str(number) for number in numbers[:SHOWN])
        word = self.row_word if self.row_word == "index" or len(numbers) == 1 else f"{self.row_word}s"
        return f"{word} {text}" + (f", ... ({len(numbers)} in all)" if len(numbers) > SHOWN else "")

    def is_row_number(self, name: str) -> bool:
        """Whether the column only counts its rows: 0, 1, 2, ... or 1, 2, 3, ..."""
        import pandas

        numbers = pandas.to_numeric(pandas.Series(self.columns[name]), errors="coerce").to_numpy(float)
        return bool(numbers.size > 1 and numbers[0] in (0.0, 1.0) and np.all(np.diff(numbers) == 1.0))

    def numbers(self, name: str) -> Array:
        """A column as float64. Raises TraceError naming the rows that hold no finite number."""
        import pandas

        column = pandas.Series(self.columns[name])
        if pandas.api.types.is_datetime64_any_dtype(column):
            column = (column - column.iloc[0]) / pandas.Timedelta(
                seconds=1
            )  # an empty stamp stays one, as NaN
        numbers: Array = pandas.to_numeric(column, errors="coerce").to_numpy(dtype=float, na_value=np.nan)
        bad = np.flatnonzero(~np.isfinite(numbers))
        if bad.size == 0:
            return numbers
        cell = column.iloc[int(bad[0])]
        text = shortened(str(cell))
        held = f"is empty or {text}" if pandas.isna(cell) or not isinstance(cell, str) else f'holds "{text}"'
        hint = "remove the rows or cut the trace there; nothing is filled in silently"
        if isinstance(cell, str) and re.fullmatch(r"[+-]?\d+,\d+([eE][+-]?\d+)?", cell.strip()):
            hint = "write numbers with a decimal point"
        raise TraceError(
            f"{self.source}: column {name}: expected finite numbers, got none in {self.rows(bad)}: "
            f"the first {held}; {hint}"
        )


def load_table(source: TableLike) -> Table:
    """A table from a .csv (or any text), .parquet, .npy or .npz file, a mapping, a data frame or an array."""
    if isinstance(source, str | Path):
        path = Path(source)
        if path.is_dir():
            raise TraceError(f"{path}: is a folder; give the file of the trace in it")
        if not path.is_file():
            raise TraceError(f"{path}: no such file")
        suffix = path.suffix.lower()
        if suffix == ".parquet":
            import pandas

            try:
                return _frame(pandas.read_parquet(path), path.name, "row", 1)
            except (OSError, ValueError) as error:
                raise TraceError(f"{path.name}: not a Parquet file: {shortened(str(error))}") from None
        if suffix in (".npy", ".npz"):
            try:
                loaded = np.load(path, allow_pickle=False)
            except (OSError, ValueError, EOFError) as error:
                raise TraceError(f"{path.name}: not a NumPy file: {shortened(str(error))}") from None
            if isinstance(loaded, np.ndarray):
                return _array(loaded, path.name)
            with loaded:
                return _mapping({name: loaded[name] for name in loaded.files}, path.name)
        return _text(path)
    if isinstance(source, np.ndarray):
        return _array(source, "array")
    if isinstance(source, Mapping):
        return _mapping(source, "table")
    import pandas

    if isinstance(source, pandas.DataFrame):
        return _frame(source, "table", "index", 0)
    raise TraceError(f"trace: expected a path, a table or an array, got {type(source).__name__}")


def _frame(frame: pandas.DataFrame, source: str, word: str, first: int) -> Table:
    frame = frame.reset_index(drop=True)
    return Table(source, {str(name): frame[name] for name in frame.columns}, word, first)


def _mapping(mapping: Mapping[str, Any], source: str) -> Table:
    columns = {str(name): np.asarray(values) for name, values in mapping.items()}
    shapes = {name: values.shape for name, values in columns.items()}
    if not shapes or any(len(shape) != 1 for shape in shapes.values()) or len(set(shapes.values())) > 1:
        raise TraceError(f"{source}: expected columns of one dimension and equal length, got {shapes}")
    return Table(source, columns, "index", 0)


def _array(array: NDArray[Any], source: str) -> Table:
    if array.dtype.names:
        return _mapping({name: array[name] for name in array.dtype.names}, source)
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim != 2:
        raise TraceError(f"{source}: expected shape (samples,) or (samples, columns), got {array.shape}")
    return Table(source, {str(i): array[:, i] for i in range(array.shape[1])}, "index", 0, named=False)


def _text(path: Path) -> Table:
    """A CSV file; the separator is the one of ; tab , that stands most often in the first line."""
    import pandas

    encoding, top = _opening(path)
    separator = max((";", "\t", ","), key=top.count)
    cells = next(csv.reader([top], delimiter=separator), [])
    bare = bool(cells) and all(_is_number(cell) for cell in cells)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pandas.errors.ParserWarning)
            # Empty lines are kept so that row numbers stay those of an editor; index_col=False so that a row
            # longer than the header is an error and not an index.
            frame = pandas.read_csv(
                path,
                sep=separator,
                header=None if bare else 0,
                index_col=False,
                skip_blank_lines=False,
                skipinitialspace=True,
                low_memory=False,
                encoding=encoding,
            )
    except (ValueError, pandas.errors.ParserWarning, UnicodeDecodeError) as error:
        raise TraceError(f"{path.name}: not a readable CSV table: {shortened(str(error))}") from None
    notes: tuple[str, ...] = ()
    filled = np.flatnonzero(frame.notna().any(axis=1).to_numpy())
    last = int(filled[-1]) + 1 if filled.size else 0
    if last < len(frame):
        notes = (f"{len(frame) - last} empty lines at the end",)
        frame = frame.iloc[:last]
    names = (
        [str(i + 1) for i in range(frame.shape[1])] if bare else [str(name).strip() for name in frame.columns]
    )
    # pandas calls a column without a header "Unnamed: 0".
    names = [re.sub(r"^Unnamed: \d+$", f"column {i + 1}", name) for i, name in enumerate(names)]
    columns = {name: frame.iloc[:, i] for i, name in enumerate(names)}
    return Table(path.name, columns, "row", 1 if bare else 2, notes=notes)


def _opening(path: Path) -> tuple[str, str]:
    """Encoding and first line of a text file. Raises TraceError for a file that is none, or empty."""
    content = path.read_bytes()
    if content.startswith(b"PK\x03\x04") or content.startswith(b"\xd0\xcf\x11\xe0"):
        raise TraceError(
            f"{path.name}: not a text table but an Excel workbook (or another archive); export the sheet as CSV"
        )
    if content.startswith((b"\xff\xfe", b"\xfe\xff")) or _looks_like_utf_16(content[:4096]):
        raise TraceError(f"{path.name}: text in UTF-16, expected UTF-8; save it as UTF-8")
    if not content.strip(b"\xef\xbb\xbf \t\r\n"):
        raise TraceError(
            f"{path.name}: the file is empty; expected a line of column names and a line for each sample, as in "
            '"time_s,position_mm"'
        )
    for encoding in ("utf-8-sig", "cp1252"):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        opening = text[:OPENING]
        if not CONTROL.search(opening):
            return encoding, opening.splitlines()[0]
    raise TraceError(
        f"{path.name}: not a text table (it holds bytes that are no text); export it as CSV, or save it as UTF-8"
    )


def _looks_like_utf_16(content: bytes) -> bool:
    """Without a mark at its start: every other byte of Western text is then NUL."""
    return any(content[start::2].count(0) > 0.4 * len(content[start::2]) for start in (0, 1)) and (
        content.count(0) < 0.6 * len(content)
    )


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def listed(names: Sequence[str]) -> str:
    """Names of columns as an error gives them."""
    return ", ".join(names[:LISTED]) + (f", ... ({len(names)} in all)" if len(names) > LISTED else "")


def choose_column(table: Table, candidates: Sequence[str]) -> tuple[str, str]:
    """The one column of several that is measured while all others are wanted values, and a note that says so.

    Raises TraceError with the columns and how to choose where that does not tell.
    """
    if len(candidates) == 1:
        return candidates[0], f"column {candidates[0]}, the only one that fits"
    words = {name: set(Header.of(name).words) for name in candidates}
    measured = [name for name in candidates if words[name] & MEASURED_WORDS]
    rest = [name for name in candidates if name not in measured]
    if len(measured) == 1 and all(words[name] & WANTED_WORDS for name in rest):
        return measured[0], f"column {measured[0]}: measured, {', '.join(rest)} not"
    count = f"{len(candidates)} columns could be meant" if candidates else "no column tells what it is"
    others = [name for name in table.names if not Header.of(name).is_time]
    telling = [name for name in others if Header.of(name).word_kind]
    raise TraceError(
        f"{table.source}: {count}: {listed(candidates or telling or others)}; "
        "choose one, as in column=NAME, unit='mm/s', kind='velocity' "
        "(--column NAME --unit mm/s --kind velocity)"
    )


def partner_of(name: str, names: Sequence[str]) -> str | None:
    """The column that holds the velocity of the position `name`, or the reverse: the same header but for that
    word."""

    def swapped(text: str, old: Sequence[str], new: str) -> str:
        words = Header.of(text).words
        return " ".join(new if word in old else word for word in words)

    words = Header.of(name).words
    for own, other in ((POSITION_WORDS, VELOCITY_WORDS), (VELOCITY_WORDS, POSITION_WORDS)):
        if any(word in own for word in words):
            goal = swapped(name, own, "*")
            found = [
                other_name
                for other_name in names
                if any(word in other for word in Header.of(other_name).words)
                and swapped(other_name, other, "*") == goal
            ]
            if len(found) == 1:
                return found[0]
    return None
