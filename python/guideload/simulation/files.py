"""Results as files, and back: netCDF whole, Parquet and CSV with a column per quantity and label."""

from __future__ import annotations

import json
from collections.abc import Iterable
from itertools import product
from os import PathLike
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import numpy as np
import pyarrow as pa
import xarray as xr

from guideload.base.atomic import atomic_write
from guideload.base.errors import GuideloadError, TraceError, ValueRefused
from guideload.machine.machine import Machine

KEY = b"guideload"  # of the metadata in a Parquet file


def write_netcdf(data: xr.Dataset, path: str | PathLike[str]) -> None:
    """netCDF 4; variables and attributes as in `data`.

    Byte for byte what xarray writes, but by h5netcdf itself: where dask is installed xarray would import the whole of
    it, to see whether arrays are dask's.
    """
    with atomic_write(_ending(path, ".nc")) as draft, h5netcdf.File(draft, "w") as file:
        file.attrs.update(data.attrs)
        for variable in data.variables.values():
            for dim, size in variable.sizes.items():
                if dim not in file.dimensions:
                    file.dimensions[dim] = size
        for name, variable in data.variables.items():
            values = variable.values
            kind = h5py.string_dtype() if values.dtype.kind in "OUT" else values.dtype
            empty = np.nan if values.dtype.kind == "f" else None
            written = file.create_variable(name, variable.dims, kind, fillvalue=empty)
            written.attrs.update(variable.attrs)
            written[...] = values


def write_parquet(data: xr.Dataset, path: str | PathLike[str]) -> None:
    """Histories as columns, the rest as JSON in the metadata of the schema."""
    from pyarrow import parquet  # here and below, as a run needs one of the formats only

    table = _columns(data).replace_schema_metadata({KEY: json.dumps(_rest(data))})
    with atomic_write(_ending(path, ".parquet")) as draft:
        parquet.write_table(table, draft)


def write_csv(data: xr.Dataset, path: str | PathLike[str]) -> None:
    """Histories as columns, the rest as JSON beside it."""
    from pyarrow import csv

    with atomic_write(_ending(path, ".csv")) as draft, atomic_write(Path(path).with_suffix(".json")) as rest:
        csv.write_csv(_columns(data), draft)
        rest.write_text(json.dumps(_rest(data), indent=1), encoding="utf-8")


def _ending(path: str | PathLike[str], ending: str) -> Path:
    """`path`, which must end so, or `Result.load` would not know what to read."""
    path = Path(path)
    if path.suffix != ending:
        raise ValueRefused(f"a file name that ends in {ending}", str(path))
    return path


def read(path: str | PathLike[str]) -> tuple[Machine, xr.Dataset]:
    """The machine and the data of a result, from any of the three. Raises TraceError if the file holds none."""
    path = Path(path)
    try:
        data = _data(path)
        missing = {"force", "moment", "resultant", "static_force", "static_moment"} - set(data.data_vars)
        if missing:
            raise ValueError(f"one without {', '.join(sorted(missing))}")
        return _machine(data), data
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
        return xr.load_dataset(path, engine="h5netcdf")
    if path.suffix == ".parquet":
        from pyarrow import parquet

        table = parquet.read_table(path)
        return _assembled(table, json.loads((table.schema.metadata or {})[KEY]))
    if path.suffix == ".csv":
        rest = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        return _assembled(_numbers(path), rest)
    raise ValueError(f"the ending {path.suffix!r}: expected .nc, .parquet or .csv")


def _numbers(path: Path) -> pa.Table:
    """The columns of a CSV file, whole numbers too as float64."""
    from pyarrow import csv

    with csv.open_csv(path) as reader:
        names = reader.schema.names
    options = csv.ConvertOptions(column_types=dict.fromkeys(names, pa.float64()))
    return csv.read_csv(path, convert_options=options)


def _machine(data: xr.Dataset) -> Machine:
    values: dict[str, Any] = json.loads(data.attrs["machine"])
    return Machine(**{key: value for key, value in values.items() if value is not None})


def _columns(data: xr.Dataset) -> pa.Table:
    """A column `name[label,label]` for each entry of each history, after the time."""
    columns = {"time": data["time"].values}
    for name, variable in data.data_vars.items():
        if "time" in variable.dims:
            flat = variable.values.reshape(variable.sizes["time"], -1)
            names = _labels(*[variable[dim].values for dim in variable.dims if dim != "time"])
            columns |= {f"{name}{label}": flat[:, i] for i, label in enumerate(names)}
    return pa.table({name: np.ascontiguousarray(values) for name, values in columns.items()})


def _labels(*labels: Iterable[Any]) -> list[str]:
    """`[label,label]` of each entry of a history, in the order of its array; nothing if it has one entry."""
    return [f"[{','.join(str(label) for label in row)}]" if row else "" for row in product(*labels)]


def _rest(data: xr.Dataset) -> dict[str, Any]:
    """All but the histories: attributes, labels, static values."""
    return {
        "attributes": data.attrs,
        "labels": {str(name): coord.values.tolist() for name, coord in data.coords.items() if name != "time"},
        "quantities": {
            str(name): {
                "dims": list(variable.dims),
                "attributes": variable.attrs,
                **({} if "time" in variable.dims else {"values": variable.values.tolist()}),
            }
            for name, variable in data.variables.items()
            if name == "time" or name in data.data_vars
        },
    }


def _assembled(table: pa.Table, rest: dict[str, Any]) -> xr.Dataset:
    """The inverse of `_columns` and `_rest`."""
    labels = rest["labels"]
    time = table.column("time").to_numpy()
    data = xr.Dataset(coords={"time": ("time", time, rest["quantities"].pop("time")["attributes"]), **labels})
    for name, quantity in rest["quantities"].items():
        dims = quantity["dims"]
        if "values" in quantity:
            sizes = [len(labels[dim]) for dim in dims]
            values = np.array(quantity["values"], dtype=np.float64).reshape(sizes)
        else:
            shape = [time.size, *[len(labels[dim]) for dim in dims[1:]]]
            columns = [f"{name}{label}" for label in _labels(*[labels[dim] for dim in dims[1:]])]
            values = np.empty((time.size, len(columns)))
            for i, column in enumerate(columns):
                values[:, i] = table.column(column).to_numpy()
            values = values.reshape(shape)
        data[name] = (dims, values, quantity["attributes"])
    data.attrs = rest["attributes"]
    return data
