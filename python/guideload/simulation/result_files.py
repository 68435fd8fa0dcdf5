"""Writing and reading of results: netCDF, or Parquet and CSV with a column for each label of a history."""

from __future__ import annotations

import json
from collections.abc import Iterable
from itertools import product
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.atomic import atomic_write
from guideload.base.errors import GuideloadError, TraceError, ValueRefused
from guideload.base.quantities import Quantities, Quantity
from guideload.machine.machine import Machine

if TYPE_CHECKING:
    import pyarrow as pa
    import xarray as xr

METADATA_KEY = b"guideload"  # in a Parquet file
REQUIRED = {"force", "moment", "resultant", "static_force", "static_moment"}  # in every result


def write_netcdf(data: Quantities, path: str | PathLike[str]) -> None:
    """Write netCDF 4, the same bytes as xarray, but without importing xarray."""
    import h5netcdf
    import h5py

    with atomic_write(_ending(path, ".nc")) as draft, h5netcdf.File(draft, "w") as file:
        file.attrs.update(data.attrs)
        for dims, values, _ in data.variables.values():
            for dim, size in zip(dims, values.shape, strict=True):
                if dim not in file.dimensions:
                    file.dimensions[dim] = size
        for name, (dims, values, attrs) in data.variables.items():
            kind = h5py.string_dtype() if values.dtype.kind in "OUT" else values.dtype
            empty = np.nan if values.dtype.kind == "f" else None
            written = file.create_variable(name, dims, kind, fillvalue=empty)
            written.attrs.update(attrs)
            written[...] = values


def write_parquet(data: Quantities, path: str | PathLike[str]) -> None:
    """Write histories as columns, and all other quantities as JSON in the metadata of the schema."""
    from pyarrow import parquet

    table = _columns(data).replace_schema_metadata({METADATA_KEY: json.dumps(_rest(data))})
    with atomic_write(_ending(path, ".parquet")) as draft:
        parquet.write_table(table, draft)


def write_csv(data: Quantities, path: str | PathLike[str]) -> None:
    """Write histories as columns, and all other quantities as JSON in a second file."""
    from pyarrow import csv

    second = Path(path).with_suffix(".json")
    with atomic_write(second) as rest, atomic_write(_ending(path, ".csv")) as draft:
        csv.write_csv(_columns(data), draft)
        rest.write_text(json.dumps(_rest(data), indent=1), encoding="utf-8")
        second.unlink(
            missing_ok=True
        )  # so that a kill never leaves the new file of one with the old one of the other


def _ending(path: str | PathLike[str], ending: str) -> Path:
    """`path`. Raises ValueRefused if it has another ending, from which `Result.load` knows the format."""
    path = Path(path)
    if path.suffix != ending:
        raise ValueRefused(f"a file name that ends in {ending}", str(path))
    return path


def read(path: str | PathLike[str]) -> tuple[Machine, xr.Dataset]:
    """The machine and the data of a result file of any of the three formats.

    Raises TraceError if the file holds no result.
    """
    import pyarrow as pa

    path = Path(path)
    try:
        data = _data(path)
        if missing := REQUIRED - set(data.data_vars):
            raise ValueError(f"a file without {', '.join(sorted(map(str, missing)))}")
        values: dict[str, Any] = json.loads(data.attrs["machine"])
        return Machine(**{key: value for key, value in values.items() if value is not None}), data
    except (
        AttributeError,
        LookupError,
        TypeError,
        ValueError,
        OSError,
        GuideloadError,
        pa.ArrowException,
    ) as error:
        raise TraceError(f"{path}: expected a result that guideload wrote, got {error}") from error


def _data(path: Path) -> xr.Dataset:
    if path.suffix == ".nc":
        import xarray as xr

        return xr.load_dataset(path, engine="h5netcdf")
    if path.suffix == ".parquet":
        from pyarrow import parquet

        table = parquet.read_table(path)
        return _assembled(table, json.loads((table.schema.metadata or {})[METADATA_KEY])).dataset()
    if path.suffix == ".csv":
        rest = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        return _assembled(_numbers(path), rest).dataset()
    raise ValueError(f"the ending {path.suffix!r}: expected .nc, .parquet or .csv")


def _numbers(path: Path) -> pa.Table:
    """The columns of a CSV file, all as float64."""
    import pyarrow as pa
    from pyarrow import csv

    with csv.open_csv(path) as reader:
        names = reader.schema.names
    options = csv.ConvertOptions(column_types=dict.fromkeys(names, pa.float64()))
    return csv.read_csv(path, convert_options=options)


def _columns(data: Quantities) -> pa.Table:
    """The time, and a column `name[label,label]` for each entry of each history."""
    import pyarrow as pa

    columns = {"time": data["time"]}
    for name, (dims, values, _) in data.variables.items():
        if "time" in dims and not data.is_coordinate(name):
            flat = values.reshape(values.shape[0], -1)
            labels = _labels(*[data[dim] for dim in dims[1:]])
            columns |= {f"{name}{label}": flat[:, i] for i, label in enumerate(labels)}
    return pa.table({name: np.ascontiguousarray(values) for name, values in columns.items()})


def _labels(*labels: Iterable[Any]) -> list[str]:
    """`[label,label]` for each entry of a history, in the order of its array; empty for a scalar history."""
    return [f"[{','.join(str(label) for label in row)}]" if row else "" for row in product(*labels)]


def _rest(data: Quantities) -> dict[str, Any]:
    """All but the values of the histories: attributes, labels, static values."""
    labels = [name for name in data.variables if data.is_coordinate(name) and name != "time"]
    return {
        "attributes": data.attrs,
        "labels": {name: data[name].tolist() for name in labels},
        "quantities": {
            name: {
                "dims": list(dims),
                "attributes": attrs,
                **({} if "time" in dims else {"values": values.tolist()}),
            }
            for name, (dims, values, attrs) in data.variables.items()
            if name not in labels
        },
    }


def _assembled(table: pa.Table, rest: dict[str, Any]) -> Quantities:
    """The quantities that `_columns` and `_rest` were made from."""
    labels = rest["labels"]
    time = table.column("time").to_numpy()
    variables = {}
    for name, quantity in rest["quantities"].items():
        dims = quantity["dims"]
        if "values" in quantity:
            values = np.array(quantity["values"], dtype=np.float64)
            values = values.reshape([len(labels[dim]) for dim in dims])
        else:
            columns = [
                table.column(f"{name}{label}") for label in _labels(*[labels[dim] for dim in dims[1:]])
            ]
            values = np.empty((time.size, len(columns)))
            for i, column in enumerate(columns):
                values[:, i] = column.to_numpy()
            values = values.reshape([time.size, *[len(labels[dim]) for dim in dims[1:]]])
        variables[name] = Quantity(tuple(dims), values, quantity["attributes"])
    variables |= {name: Quantity((name,), np.array(names), {}) for name, names in labels.items()}
    return Quantities(variables, rest["attributes"])
