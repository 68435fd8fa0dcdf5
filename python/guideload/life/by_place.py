"""Fatigue damage along the rails: each place is loaded by all carriages that pass it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError

SEGMENT = 0.01  # m, length of the segments of a rail
FEWEST, MOST = 50, 5000  # segments of a rail
WINDOW = 1.0  # m of rail over which the damage is compared


@dataclass(frozen=True, eq=False)
class RailDamage:
    """Damage along one rail in one record: the share of the life that its carriages spend there."""

    rail: str
    # (k + 1,) m, ends of the segments, as x of the cart at the start of the record plus the carriage's x
    edges: Array
    damage: Array  # (k,) 1, in each segment; the sum is the damage of all carriages of the rail

    @property
    def density(self) -> Array:
        """Damage per metre of rail, (k,) [1/m]."""
        return np.asarray(self.damage / np.diff(self.edges))

    @checked
    def worst_window(self, width: float = WINDOW) -> tuple[float, float, float]:
        """Ends [m] of the stretch of this width with the largest damage, and its share of the damage of the rail.

        width: m, above 0; at most the length of the rail counts. Raises ArgumentError for another one.
        """
        if not width > 0.0:
            raise ArgumentError(f"width: expected a length above 0 m, got {width:g}")
        length = float(self.edges[-1] - self.edges[0])
        width = min(width, length)
        total = np.concatenate([[0.0], np.cumsum(self.damage)])
        # The damage in a window is linear between positions at which one of its ends meets an edge.
        starts = np.clip(
            np.concatenate([self.edges, self.edges - width]), self.edges[0], self.edges[-1] - width
        )
        inside = np.interp(starts + width, self.edges, total) - np.interp(starts, self.edges, total)
        at = int(inside.argmax())
        share = float(inside[at] / total[-1]) if total[-1] > 0.0 else 0.0
        return float(starts[at]), float(starts[at]) + width, share


def rail_damage(rail: str, positions: Array, damage: Array) -> RailDamage:
    """The damage along a rail.

    positions: (carriages, n) m, of the carriages of the rail over time. damage: (carriages, n - 1), of each interval;
    it is spread evenly over the path of the carriage in the interval, so no damage is lost.
    """
    low, high = float(positions.min()), float(positions.max())
    if high <= low:
        high = low + SEGMENT
    count = int(np.clip(np.ceil((high - low) / SEGMENT), FEWEST, MOST))
    edges = np.linspace(low, high, count + 1)
    start = np.minimum(positions[:, :-1], positions[:, 1:]).ravel()
    end = np.maximum(positions[:, :-1], positions[:, 1:]).ravel()
    total = np.zeros(count)
    first = np.clip(np.searchsorted(edges, start, "right") - 1, 0, count - 1)
    last = np.clip(np.searchsorted(edges, end, "left") - 1, first, count - 1)
    amount, width = damage.ravel(), end - start
    for step in range(int((last - first).max(initial=0)) + 1):  # an interval crosses few segments
        here = first + step
        meets = here <= last
        here, share = here[meets], np.ones(int(meets.sum()))
        overlap = np.minimum(end[meets], edges[here + 1]) - np.maximum(start[meets], edges[here])
        np.divide(overlap, width[meets], out=share, where=width[meets] > 0.0)
        total += np.bincount(here, share * amount[meets], count)
    return RailDamage(rail, edges, total)
