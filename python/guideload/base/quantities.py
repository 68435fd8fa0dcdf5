"""Arrays with named dimensions and units: the data of results, from which audit, report and files are made.

They hold what an xarray.Dataset holds and convert to one and back. Importing xarray and pandas takes longer than most
runs, so only users who work with a dataset pay for it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

DIMENSIONS = ("time", "carriage", "rail", "link", "axis", "dof")  # the order in which every array has them


class Quantity(NamedTuple):
    """An array, the names of its dimensions, and its attributes: units and long_name."""

    dims: tuple[str, ...]
    values: NDArray[Any]
    attrs: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Quantities:
    """Quantities by name, among them the coordinates by the names of their dimensions, and common attributes."""

    variables: dict[str, Quantity]
    attrs: dict[str, Any]

    def __contains__(self, name: str) -> bool:
        return name in self.variables

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The array of that name, its dimensions in the order of `DIMENSIONS`."""
        return self.variables[name].values

    def by_label(self, name: str) -> dict[str, NDArray[Any]]:
        """The array (..., label) of that name as an array per label of its last dimension."""
        dims, values, _ = self.variables[name]
        return dict(zip(self[dims[-1]].tolist(), np.moveaxis(values, -1, 0), strict=True))

    def is_coordinate(self, name: str) -> bool:
        """Whether a quantity labels the dimension of its own name."""
        return self.variables[name].dims == (name,)

    @classmethod
    def of_dataset(cls, data: xr.Dataset) -> Quantities:
        """The arrays of a dataset, which are not copied."""

        def place(dim: str) -> int:
            return DIMENSIONS.index(dim) if dim in DIMENSIONS else len(DIMENSIONS)

        variables = {}
        for name, variable in data.variables.items():
            ordered = variable.transpose(*sorted(map(str, variable.dims), key=place))
            variables[str(name)] = Quantity(tuple(map(str, ordered.dims)), ordered.values, variable.attrs)
        return cls(variables, data.attrs)

    def dataset(self) -> xr.Dataset:
        """The same as a dataset, which shares the arrays.

        The fast path takes arrays as they are; any other checks whether they are dask's, and where dask is installed
        imports all of it for that, in 0.2 s.
        """
        import xarray as xr

        variables = {name: xr.Variable(*each, fastpath=True) for name, each in self.variables.items()}
        coords = {name: variables.pop(name) for name in self.variables if self.is_coordinate(name)}
        data = xr.Dataset(variables, coords=coords)
        data.attrs = self.attrs
        return data


def quantities(rows: Iterable[tuple[str, tuple[str, ...], NDArray[Any], str, str]]) -> dict[str, Quantity]:
    """Quantities by name from rows of name, dimensions, values, units and name in words."""
    return {
        name: Quantity(dims, values, {"units": units, "long_name": text})
        for name, dims, values, units, text in rows
    }
