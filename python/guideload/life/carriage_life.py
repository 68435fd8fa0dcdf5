"""Life and static safety of one carriage."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array, read_only
from guideload.base.number_text import digits
from guideload.life.causes import PHASES, WorstInstant
from guideload.life.criteria import Criteria
from guideload.life.equivalent_load import AXES, row_loads
from guideload.life.mean_load import integrals, mean_load
from guideload.life.record import Record
from guideload.life.static_safety import LargestLoads, StaticSafety, static_safety
from guideload.motion.uncertainty import COVER

SMALL_MOMENT = 1e-6  # N m per N of load: a smaller moment without rating is rounding


@dataclass(frozen=True, eq=False)
class CarriageLife(Criteria):
    """Life and static safety of one carriage; damage, factors, rows and causes are computed when first used.

    Its criteria, and in addition:
    """

    power: Array  # (n - 1,) N^p m, integral of P^p over the path in each interval of the record
    distance: float  # m, travel in the record
    mean_load: float  # N, over distance
    life: float  # m
    static: StaticSafety
    record: Record  # the loads

    @cached_property
    def damage(self) -> Array:
        """Share of the life that each interval of the record costs (n - 1,)."""
        total = float(self.power.sum())
        return read_only(self.power * (self.distance / self.life / total if total else 0.0))

    def mean_under(self, loads: Array) -> float:
        """Mean load [N] over the travel of the record under other loads of the carriage (time, 6) [N, N m]."""
        exponent = self.rating.exponent
        return mean_load(*integrals(self.record.travel, loads, self.rule, exponent), exponent)

    @cached_property
    def factor_life(self) -> float:
        """Load factor f_W of catalogues for the life: mean load over the mean load of the quasi-static loads."""
        mean = self.mean_under(self.record.parts.quasi_static[:, self.index])
        return self.mean_load / mean if mean else float("nan")

    @cached_property
    def factor_safety(self) -> float:
        """Load factor f_W of catalogues for the static safety: P0 over the largest P0 of the quasi-static loads."""
        peak = float(self.static_rule(self.record.parts.quasi_static[:, self.index]).max())
        return self.static.peak / peak if peak else float("nan")

    @cached_property
    def rows(self) -> tuple[float, float] | None:
        """Largest load of the loaded row and smallest load of the other row along y [N]; None without two rows."""
        carriage = self.record.result.machine.carriages[self.index]
        if carriage.preload_y is None or carriage.rolling is None:
            return None
        # The more one row carries, the less does the other.
        loaded, other = row_loads(self.static.largest.sizes[1:2], carriage.preload_y, carriage.rolling)
        return float(loaded[0]), float(other[0])

    @cached_property
    def worst(self) -> WorstInstant:
        """Causes of the worst instant. Quasi-static parts are linear between two instants; the rest is vibration."""
        record, largest = self.record, self.static.largest
        first, last, share = self._beside(largest.time)

        def then(values: Array) -> Array:
            return np.asarray((1.0 - share) * values[first] + share * values[last])

        load = then(record.result.carriage_loads[:, self.index])
        parts = {cause: then(part[:, self.index]) for cause, part in record.parts.items()}
        of_parts = self.static_rule.shares(load, np.stack(list(parts.values())))
        shares = dict(zip(parts, of_parts.tolist(), strict=True))
        shares["vibration"] += largest.bare - float(of_parts.sum())
        if self.static_rule.preload:
            shares["preload"] = largest.equivalent - largest.bare
        noise, data = float("nan"), record.result.quantities
        if "resultant_sd" in data:
            noise = COVER * float(then(data["resultant_sd"][:, self.index]))
        when = PHASES[record.phase[min(first, record.phase.size - 1)]]
        return WorstInstant(largest.time, largest.equivalent, shares, noise, when)

    def _beside(self, time: float) -> tuple[int, int, float]:
        """Indices of the instants before and after a time, and how far it is from the first to the last, 0 to 1.

        At a jump of the motion, which has two instants: the one with the larger load, twice.
        """
        times = self.record.travel.time
        first, end = (int(np.searchsorted(times, time, side)) for side in ("left", "right"))
        if end > first + 1:
            loads = self.static_rule.without_preload(self.record.result.carriage_loads[first:end, self.index])
            first += int(loads.argmax())
            return first, first, 0.0
        last = min(max(first, 1), times.size - 1)
        return last - 1, last, float((time - times[last - 1]) / (times[last] - times[last - 1]))


def carriage_life(record: Record, criteria: Criteria, largest: LargestLoads) -> CarriageLife:
    """Life and static safety of the carriage with these criteria and largest loads.

    Raises LifeError if the product lacks a rated moment that the rule counts.
    """
    loads = np.ascontiguousarray(record.result.carriage_loads[:, criteria.index])
    for axis in criteria.unrated_moments:
        _require_small(loads, axis, criteria)
    exponent = criteria.rating.exponent
    bows = record.bows[:, criteria.index]
    power, path = integrals(record.travel, loads, criteria.rule, exponent, bows)
    mean = mean_load(power, path, exponent)
    return CarriageLife(
        **vars(criteria),
        power=read_only(power),
        distance=float(path.sum()),
        mean_load=mean,
        life=float(criteria.life_under(mean)),
        static=static_safety(largest, criteria.product, criteria.contact_factor),
        record=record,
    )


def _require_small(loads: Array, axis: str, criteria: Criteria) -> None:
    """Raise LifeError if the carriage carries a moment about an axis for which its product has no rating."""
    moment = float(np.abs(loads[:, 3 + AXES.index(axis)]).max())
    if moment > SMALL_MOMENT * float(np.abs(loads[:, :3]).max()):
        raise criteria.unrated(axis, f"carries a {axis} moment of up to {digits(moment)} N m")
