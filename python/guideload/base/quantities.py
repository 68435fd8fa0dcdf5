"""Arrays with named dimensions and units: the data of results, from which audit, report and files are made.

They convert to an xarray.Dataset and back. Importing xarray and pandas takes longer than most runs, so they are
imported only where a dataset is needed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

# Name, dimensions, values, units, long_name.
QuantityRow = tuple[str, tuple[str, ...], NDArray[Any], str, str]
# Order of the dimensions of every array.
DIMENSIONS = ("time", "motion_time", "carriage", "rail", "link", "point", "axis", "dof")


class Quantity(NamedTuple):
    """An array with the names of its dimensions and its attributes: `units` and `long_name`.

    `units` is one unit, as UDUNITS and pint read it. An array along `dof` has `units_of_dofs` in its place.
    """

    dims: tuple[str, ...]
    values: NDArray[Any]
    attrs: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Quantities:
    """Quantities by name, and attributes of the whole. A coordinate is a quantity with the name of its dimension.

    The arrays are read-only views.
    """

    variables: dict[str, Quantity]
    attrs: dict[str, Any]

    def __post_init__(self) -> None:
        for name, each in self.variables.items():
            values = each.values.view()
            values.setflags(write=False)
            self.variables[name] = each._replace(values=values)

    def __contains__(self, name: str) -> bool:
        return name in self.variables

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The array of a quantity."""
        return self.variables[name].values

    def get(self, name: str) -> NDArray[Any] | None:
        """The array of a quantity, None if there is none of this name."""
        return self.variables[name].values if name in self.variables else None

    def by_label(self, name: str) -> dict[str, NDArray[Any]]:
        """One array for each label of the last dimension of a quantity."""
        dims, values, _ = self.variables[name]
        return dict(zip(self[dims[-1]].tolist(), np.moveaxis(values, -1, 0), strict=True))

    def is_coordinate(self, name: str) -> bool:
        """Whether a quantity holds the labels of the dimension that has its name."""
        return self.variables[name].dims == (name,)

    @classmethod
    def of_dataset(cls, data: xr.Dataset) -> Quantities:
        """The quantities of a dataset; they share its arrays."""

        def place(dim: str) -> int:
            return DIMENSIONS.index(dim) if dim in DIMENSIONS else len(DIMENSIONS)

        variables = {}
        for name, variable in data.variables.items():
            ordered = variable.transpose(*sorted(map(str, variable.dims), key=place))
            variables[str(name)] = Quantity(tuple(map(str, ordered.dims)), ordered.values, variable.attrs)
        return cls(variables, data.attrs)

    def dataset(self) -> xr.Dataset:
        """An xarray.Dataset that shares the arrays.

        fastpath, because xarray otherwise imports dask, where it is installed, to check for dask arrays: 0.2 s.
        """
        import xarray as xr

        variables = {name: xr.Variable(*each, fastpath=True) for name, each in self.variables.items()}
        coords = {name: variables.pop(name) for name in self.variables if self.is_coordinate(name)}
        data = xr.Dataset(variables, coords=coords)
        data.attrs = self.attrs
        return data


def quantities(rows: Iterable[QuantityRow]) -> dict[str, Quantity]:
    """Quantities by name, from their rows."""
    return {
        name: Quantity(
            dims, values, {"units_of_dofs" if "dof" in dims else "units": units, "long_name": text}
        )
        for name, dims, values, units, text in rows
    }
