"""Tables of traces from files (text, Parquet, NumPy, MATLAB) and from memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from guideload.base.arguments import require_unmasked
from guideload.base.arrays import errors_name
from guideload.base.errors import ArgumentTypeError, TraceError, UnreadableTrace, no_file, shortened
from guideload.traces.format.matlab import read_matlab
from guideload.traces.format.table import Table
from guideload.traces.format.text_table import read_text

if TYPE_CHECKING:
    import pandas

    TableLike: TypeAlias = str | Path | Mapping[str, Any] | NDArray[Any] | pandas.DataFrame | Table

# Formats by suffix; all others are text.
BINARY = {".parquet": "Parquet", ".npy": "NumPy", ".npz": "NumPy", ".mat": "MATLAB"}


def load_table(source: TableLike) -> Table:
    """A table from a .csv (or any text), .parquet, .npy, .npz or .mat file, a mapping, a data frame or an array."""
    if isinstance(source, Table):
        return source
    if isinstance(source, str | Path):
        return _file(Path(source))
    if isinstance(source, np.ndarray):
        return _array(source, "array")
    if isinstance(source, Mapping):
        return _mapping(source, "table")
    import pandas

    if isinstance(source, pandas.DataFrame):
        return table_of_frame(source, "table", "index", 0)
    raise ArgumentTypeError(
        f"table: expected a path, a table or an array, got a value of type {type(source).__name__}"
    )


def _file(path: Path) -> Table:
    if path.is_dir():
        raise UnreadableTrace(f"{path}: is a folder; give the file of the trace in it")
    if not path.is_file():
        raise UnreadableTrace(f"{path}: {no_file(path)}")
    program = BINARY.get(path.suffix.lower())
    if program is None:
        try:
            with errors_name(path.name):
                return read_text(path)
        except OSError as error:
            raise UnreadableTrace(f"{path}: cannot be read: {error.strerror}") from None
    with damage_named(path, program):
        if program == "Parquet":
            import pandas

            return table_of_frame(pandas.read_parquet(path), path.name, "row", 1)
        loaded, notes = read_matlab(path) if program == "MATLAB" else (_numpy(path), ())
    table = _array(loaded, path.name) if isinstance(loaded, np.ndarray) else _mapping(loaded, path.name)
    return replace(table, notes=notes)


@contextmanager
def damage_named(path: Path, program: str) -> Iterator[None]:
    """Turn the errors of a binary file that cannot be read into one that names the file and the way out."""
    try:
        yield
    except TraceError:
        raise
    except MemoryError as error:
        raise MemoryError(
            f"{path.name}: not enough memory to read it, unless it is damaged: {error}"
        ) from None
    except Exception as error:  # of a dozen types, from pyarrow, pandas, NumPy, zipfile, zlib and the disk
        reason = shortened(f"{type(error).__name__}: {error}")
        hint = "it is damaged or of another kind; export or copy it again"
        raise UnreadableTrace(f"{path.name}: not a {program} file: {reason}; {hint}") from None


@np.errstate(over="raise")  # for sizes that do not fit into an integer
def _numpy(path: Path) -> NDArray[Any] | dict[str, Any]:
    """The array of a `.npy` file, or the arrays of an `.npz` file by name. Nothing in them is unpickled."""
    with path.open("rb") as file:
        if file.peek(6).startswith(b"\x93NUMPY"):
            # A memory map, because it compares the size in the header with that of the file before it allocates.
            return np.array(np.lib.format.open_memmap(path, mode="r"))
        with np.load(file, allow_pickle=False) as members:
            return dict(members)


def table_of_frame(frame: pandas.DataFrame, source: str, word: str, first: int) -> Table:
    """The table of a data frame; an index of time stamps, or with a name, becomes a column.

    word, first: name of a row in messages, and the number of the first one.
    """
    import pandas

    index = frame.index
    if isinstance(index, pandas.DatetimeIndex | pandas.TimedeltaIndex) and index.name is None:
        frame = frame.rename_axis("time")
    frame = frame.reset_index(drop=frame.index.name is None)
    columns = {str(name): _plain(frame[name]) for name in frame.columns}
    return Table(source, columns, word, range(first, first + len(frame)))


def _plain(series: Any) -> Any:
    """A column as a NumPy array; missing numbers become NaN, and stamps with a zone UTC."""
    import pandas

    if isinstance(series.dtype, pandas.DatetimeTZDtype):
        series = series.dt.tz_convert("UTC").dt.tz_localize(None)
    if pandas.api.types.is_numeric_dtype(series.dtype) and series.hasnans:
        return series.to_numpy(dtype=float, na_value=np.nan)
    return series.to_numpy()


def _mapping(mapping: Mapping[str, Any], source: str) -> Table:
    for name, values in mapping.items():
        require_unmasked(str(name), values)
    columns = {str(name): np.asarray(values) for name, values in mapping.items()}
    shapes = {name: values.shape for name, values in columns.items()}
    if not shapes or any(len(shape) != 1 for shape in shapes.values()) or len(set(shapes.values())) > 1:
        raise TraceError(f"{source}: expected columns of one dimension and equal length, got {shapes}")
    return Table(source, columns, "index", range(next(iter(shapes.values()))[0]))


def _array(array: NDArray[Any], source: str) -> Table:
    if array.dtype.names:
        return _mapping({name: array[name] for name in array.dtype.names}, source)
    require_unmasked(source, array)
    if array.ndim not in (1, 2):
        raise TraceError(f"{source}: expected shape (samples,) or (samples, columns), got {array.shape}")
    columns = {str(i): column for i, column in enumerate(np.atleast_2d(array.T))}
    return Table(source, columns, "index", range(len(array)), named=False)
