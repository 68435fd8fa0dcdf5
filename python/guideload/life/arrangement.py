"""How many carriages run on a rail, and which of them side by side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from guideload.machine.machine import Machine

CONTACT_FACTORS = (1.0, 0.81, 0.72, 0.66, 0.61)  # f_C of 1 to 5 carriages side by side on one rail
SIDE_BY_SIDE = (
    1.1  # carriages whose centres are at most this many carriage lengths apart count as side by side
)


class Arrangement(NamedTuple):
    """The place of a carriage among those on its rail."""

    on_rail: int  # number of carriages on its rail
    side_by_side: int  # number of carriages in its row of carriages side by side; 1 without neighbour

    @property
    def alone(self) -> bool:
        """Whether it is the only carriage on its rail."""
        return self.on_rail == 1

    @property
    def contact_factor(self) -> float:
        """f_C of catalogues."""
        return CONTACT_FACTORS[min(self.side_by_side, len(CONTACT_FACTORS)) - 1]


def arrangements(machine: Machine) -> tuple[Arrangement, ...]:
    """The arrangement of each carriage; carriages whose product has no length count as apart."""
    places = machine.carriage_centers[:, 0]
    reach = [
        SIDE_BY_SIDE * (product.carriage_length or 0.0) if product else 0.0
        for product in machine.product_of_carriage
    ]
    found = []
    for i, rail in enumerate(machine.rail_of_carriage):
        mates = sorted(np.flatnonzero(machine.rail_of_carriage == rail), key=lambda j: float(places[j]))
        rows: list[list[int]] = []
        for j in mates:
            near = rows and places[j] - places[rows[-1][-1]] <= max(reach[j], reach[rows[-1][-1]])
            rows[-1].append(int(j)) if near else rows.append([int(j)])
        found.append(Arrangement(len(mates), next(len(row) for row in rows if i in row)))
    return tuple(found)
