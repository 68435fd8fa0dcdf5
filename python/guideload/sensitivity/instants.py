"""A run at any instants, with exact derivatives by numbers of the machine and by time."""

from __future__ import annotations

from dataclasses import dataclass, replace

from numpy.typing import ArrayLike

from guideload._core import VariedInstants
from guideload.base.arguments import real_array
from guideload.base.arrays import Array


@dataclass(frozen=True, eq=False)
class History:
    """A quantity at n instants: values (n,), derivatives (p, n) by p columns, and (n,) by time [1/s]."""

    values: Array
    by: Array
    slope: Array

    def from_rest(self, value: float, by: Array) -> History:
        """The change from a value at rest, whose derivatives by the columns are (p,)."""
        return replace(self, values=self.values - value, by=self.by - by[:, None])


class Instants:
    """The run of a linear machine at n instants.

    inputs        (n, 9) acceleration of the cart [m/s2] and external load about L [N, N m]
    input_slopes  (n, 9) their derivatives by time, behind an instant at which they have a kink
    """

    def __init__(self, instants: VariedInstants) -> None:
        self._instants = instants
        self.inputs, self.input_slopes = instants.inputs()

    def history(self, quantity: str, along: ArrayLike, part: str = "total") -> History:
        """The sum of the numbers of a quantity with factors `along`.

        quantity: as in `RunDerivatives.gradient`; along: an array of the shape of the quantity at one instant, such as
        (6,) for an acceleration. Loads and displacements contain those at rest.
        """
        factors = real_array("along", along).reshape(1, -1)
        values, slope, by = self._instants.histories(name_in_core(quantity), factors, part)
        return History(values[:, 0], by[:, :, 0], slope[:, 0])


def name_in_core(quantity: str) -> str:
    """The name of a quantity in the core."""
    return {"carriage_loads": "group_loads", "displacement": "position"}.get(quantity, quantity)
