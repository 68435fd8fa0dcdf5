"""Result files: netCDF and Parquet, which are read back, and CSV for other programs."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from itertools import product
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.atomic import atomic_write, with_ending
from guideload.base.errors import ReadError, shortened, shown
from guideload.base.finite import finite_json
from guideload.base.netcdf import read_netcdf, write_netcdf
from guideload.base.quantities import Quantities, Quantity
from guideload.machine.machine import Machine
from guideload.simulation.point_motion import DIMS as POINT_DIMS
from guideload.simulation.run import AXES

if TYPE_CHECKING:
    import pyarrow as pa
    import xarray as xr

METADATA_KEY = b"guideload"  # in a Parquet file
# In every result, with their dimensions.
REQUIRED = {
    "force": ("time", "carriage", "axis"),
    "moment": ("time", "carriage", "axis"),
    "resultant": ("time", "carriage"),
    "static_force": ("carriage", "axis"),
    "static_moment": ("carriage", "axis"),
}
LARGEST = 1e30  # far above any load; the audit's products of five numbers fit into a double


def to_netcdf(data: Quantities, path: str | PathLike[str]) -> None:
    """Write all quantities as netCDF 4."""
    with atomic_write(with_ending(path, ".nc")) as draft:
        write_netcdf(data, draft)


def to_parquet(data: Quantities, path: str | PathLike[str]) -> None:
    """Write histories as columns, and all other quantities as JSON in the metadata of the schema."""
    from pyarrow import parquet

    table = _columns(data).replace_schema_metadata({METADATA_KEY: finite_json(_rest(data))})
    with atomic_write(with_ending(path, ".parquet")) as draft:
        parquet.write_table(table, draft, write_page_checksum=True)


def to_csv(data: Quantities, path: str | PathLike[str]) -> None:
    """Write histories as columns, and all other quantities as JSON in a second file."""
    from pyarrow import csv

    path = with_ending(path, ".csv")
    second = path.with_suffix(".json")
    with atomic_write(second) as rest, atomic_write(path) as draft:
        csv.write_csv(_columns(data), draft)
        rest.write_text(finite_json(_rest(data), indent=1), encoding="utf-8")
        second.unlink(missing_ok=True)  # first: a kill never leaves the new file of one beside the old other


def read(path: str | PathLike[str]) -> tuple[Machine, xr.Dataset]:
    """The machine and the data of a result file, netCDF or Parquet.

    Raises ReadError if the file holds no result.
    """
    path = Path(path)
    try:
        data = _data(path)
        values: dict[str, Any] = json.loads(data.attrs["machine"])
        machine = Machine(**{key: value for key, value in values.items() if value is not None})
        _check(data, machine)
        return machine, data
    except MemoryError as error:
        raise MemoryError(f"{path}: not enough memory to read it, unless it is damaged: {error}") from None
    except Exception as error:  # of a dozen types, from HDF5, xarray, pyarrow, pydantic and the disk
        reason = f"no {error}" if isinstance(error, KeyError) else str(error) or type(error).__name__
        raise ReadError(
            f"{path}: expected a result that guideload wrote, got {shortened(reason, 400)}"
        ) from error


def _check(data: xr.Dataset, machine: Machine) -> None:
    """Raise ValueError unless the data are complete, finite and of this machine."""
    required = REQUIRED | (POINT_DIMS if machine.points else {})
    if missing := required.keys() - set(data.data_vars):
        raise ValueError(f"a file without {', '.join(sorted(missing))}")
    for name, dims in required.items():
        if set(data[name].dims) != set(dims):
            raise ValueError(f"{name} with the dimensions {', '.join(map(str, data[name].dims))}")
    for name, variable in {str(name): each for name, each in data.variables.items()}.items():
        if variable.dtype.kind in "fiu" and not np.all(np.abs(variable.values) < LARGEST):
            raise ValueError(f"{name} with numbers that are not finite or too large")
        if name in data.dims and variable.dtype.kind not in "fiuOUT":
            raise ValueError(f"{name} with values of the type {variable.dtype}")
    for label, expected in {
        "carriage": [carriage.name for carriage in machine.carriages],
        "axis": list(AXES),
        **({"point": [point.name for point in machine.points]} if machine.points else {}),
    }.items():
        if data[label].values.tolist() != expected:
            raise ValueError(
                f"the {label} labels {shown(data[label].values.tolist())}, not {shown(expected)}"
            )
    steps = np.diff(data["time"].values)
    if np.any(steps < 0.0):
        raise ValueError("times that go back")
    if np.any((steps > 0.0) & (steps < 1.0 / LARGEST)):
        raise ValueError(f"times less than {1.0 / LARGEST:g} s apart")


def _data(path: Path) -> xr.Dataset:
    if path.suffix == ".nc":
        return read_netcdf(path)
    if path.suffix == ".parquet":
        from pyarrow import parquet

        table = parquet.ParquetFile(path, page_checksum_verification=True).read()
        return _assembled(table, json.loads((table.schema.metadata or {})[METADATA_KEY])).dataset()
    also = ": CSV is for other programs" if path.suffix == ".csv" else ""
    raise ValueError(f"the ending {path.suffix!r}{also}; expected .nc or .parquet")


def _columns(data: Quantities) -> pa.Table:
    """The time, and a column `name[label,label]` for each entry of each history."""
    import pyarrow as pa

    columns = {"time": data["time"]}
    for name, (dims, values, _) in data.variables.items():
        if "time" in dims and not data.is_coordinate(name):
            flat = values.reshape(values.shape[0], math.prod(values.shape[1:]))
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
        "label_attributes": {name: data.variables[name].attrs for name in labels},
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
    attributes = rest.get("label_attributes", {})  # files of earlier versions have none
    variables |= {
        name: Quantity((name,), np.array(names), attributes.get(name, {})) for name, names in labels.items()
    }
    return Quantities(variables, rest["attributes"])
