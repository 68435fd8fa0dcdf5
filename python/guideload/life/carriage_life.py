"""Life and static safety of one carriage."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array
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

    power      (n - 1,) N^p m, integral of P^p over the path in each interval of the record
    distance   m, travel in the record
    mean_load  N, over distance
    life       m
    static     static safety
    record     the loads
    """

    power: Array
    distance: float
    mean_load: float
    life: float
    static: StaticSafety
    record: Record

    @cached_property
    def damage(self) -> Array:
        """Share of the life that each interval of the record costs (n - 1,)."""
        total = float(self.power.sum())
        return self.power * (self.distance / self.life / total if total else 0.0)

    @cached_property
    def factor_life(self) -> float:
        """Load factor f_W of the catalogues for the life: mean load over that of the quasi-static loads."""
        quasi_static = self.record.parts.quasi_static[:, self.index]
        exponent = self.rating.exponent
        mean = mean_load(*integrals(self.record.travel, quasi_static, self.rule, exponent), exponent)
        return self.mean_load / mean if mean else float("nan")

    @cached_property
    def factor_safety(self) -> float:
        """Load factor f_W of the catalogues for the static safety: peak over that of the quasi-static loads."""
        peak = float(self.static_rule(self.record.parts.quasi_static[:, self.index]).max())
        return self.static.peak / peak if peak else float("nan")

    @cached_property
    def rows(self) -> tuple[float, float] | None:
        """Largest load of the loaded row and smallest of the other one along y [N], if the law has two rows."""
        carriage = self.record.result.machine.carriages[self.index]
        if carriage.preload_y is None or carriage.rolling is None:
            return None
        # The more one row carries, the less does the other.
        loaded, other = row_loads(self.static.largest.sizes[1:2], carriage.preload_y, carriage.rolling)
        return float(loaded[0]), float(other[0])

    @cached_property
    def worst(self) -> WorstInstant:
        """Causes of the worst instant: the shares of the loads at the reported instant beside it.

        Between two instants quasi-static loads are linear, so that what P0 rises there is vibration.
        """
        record, largest = self.record, self.static.largest
        beside = np.searchsorted(record.travel.time, largest.time) - np.array([1, 0])
        beside = np.clip(beside, 0, record.travel.time.size - 1)
        loads = record.result.carriage_loads[beside, self.index]
        at = int(self.static_rule.without_preload(loads).argmax())
        instant, load = int(beside[at]), loads[at]
        parts = record.parts.at(instant, self.index)
        of_parts = self.static_rule.shares(load, np.stack(list(parts.values())))
        shares = dict(zip(parts, of_parts.tolist(), strict=True))
        shares["vibration"] += largest.bare - float(of_parts.sum())
        if self.static_rule.preload:
            shares["preload"] = largest.equivalent - largest.bare
        noise, data = float("nan"), record.result.quantities
        if "resultant_sd" in data:
            noise = COVER * float(data["resultant_sd"][instant, self.index])
        when = PHASES[record.phase[min(instant, record.phase.size - 1)]]
        return WorstInstant(largest.time, largest.equivalent, shares, noise, when)


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
        power=power,
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
