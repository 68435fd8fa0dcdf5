"""Life, static safety and their causes, of every carriage, rail and the machine, under the loads of a result."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import repeat
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arguments import checked
from guideload.base.notebook import as_html
from guideload.base.number_text import fixed, kilometres
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.life_target import Repetition
from guideload.life.bands import LifeBand, life_bands
from guideload.life.by_place import RailDamage, rail_damage
from guideload.life.carriage_life import CarriageLife, carriage_life
from guideload.life.causes import phase_shares
from guideload.life.criteria import criteria_of
from guideload.life.largest_loads import largest_loads
from guideload.life.limits import left_out, limit_notes, load_notes
from guideload.life.rating_life import failure_probability, system_life
from guideload.life.record import Record
from guideload.simulation.result import Result

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False, repr=False)
class Life:
    """Life and static safety under the loads of one record, which repeats.

    carriages        life of each carriage that names a product with ratings
    rails            m, life of all carriages of a rail together, by rail
    machine          m, life of all carriages together
    repetition       of the record in operation: its travel and duration
    conditions       how it is judged
    left_out         names of the carriages without ratings
    record           the result, and the loads in parts

    Phases, places, notes and the band are computed when first used.
    """

    carriages: tuple[CarriageLife, ...]
    rails: dict[str, float]
    machine: float
    repetition: Repetition
    conditions: LifeConditions
    left_out: tuple[str, ...]
    record: Record

    @cached_property
    def phases(self) -> dict[str, float]:
        """Share of the damage by phase of the cycle."""
        return phase_shares(self.record.phase, np.stack([one.damage for one in self.carriages]))

    @cached_property
    def places(self) -> tuple[RailDamage, ...]:
        """Damage along each rail; none if the position of the cart is unknown."""
        position = self.record.result.history("cart_position")
        if position is None:
            return ()
        centers = self.record.result.machine.carriage_centers[:, 0]
        by_rail: dict[str, list[CarriageLife]] = {}
        for one in self.carriages:
            by_rail.setdefault(one.rail, []).append(one)
        return tuple(
            rail_damage(
                rail,
                np.stack([position[:, 0] + centers[one.index] for one in group]),
                np.stack([one.damage for one in group]),
            )
            for rail, group in by_rail.items()
        )

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Limits of the formulas that are passed, and what was left out."""
        record = self.record
        position = record.result.history("cart_position")
        return (
            *limit_notes(record.result.machine, self.carriages, record.travel, position),
            *load_notes(record, self.carriages),
            *self._note_on_preload(),
        )

    @cached_property
    def with_preload(self) -> Life | None:
        """The same life with the preload counted; None if it is counted already, or if no carriage has preload."""
        if self.conditions.preload_in_life or not any(one.preload for one in self.carriages):
            return None
        return life_of(self.record.result, self.conditions.model_copy(update={"preload_in_life": True}))

    def _note_on_preload(self) -> Iterator[str]:
        if (counted := self.with_preload) is not None:
            yield (
                f"with the preload, all carriages together last {kilometres(counted.machine)} km instead of "
                f"{kilometres(self.machine)} km, and the smallest static safety is "
                f"{fixed(counted.weakest.static.safety, 2)} instead of {fixed(self.weakest.static.safety, 2)}"
            )

    @property
    def shortest(self) -> CarriageLife:
        """The carriage with the shortest life."""
        return min(self.carriages, key=lambda one: one.life)

    @property
    def weakest(self) -> CarriageLife:
        """The carriage with the smallest static safety."""
        return min(self.carriages, key=lambda one: one.static.safety)

    @checked
    def hours(self, life: float) -> float:
        """Hours of operation in which the machine travels `life` [m]."""
        return self.repetition.hours(life)

    @checked
    def years(self, life: float) -> float:
        """Years in which the machine travels `life` [m], of `hours_per_year` or of continuous operation."""
        return self.repetition.years(life)

    @property
    def distance(self) -> float:
        """Travel in the record [m]."""
        return self.repetition.distance

    @property
    def wanted(self) -> float | None:
        """The required life as travel [m]; None if none is required."""
        target = self.conditions.life
        return None if target is None else self.repetition.travel(target)

    @checked
    def failure_probability(self, travel: float) -> float:
        """Probability that a carriage of the machine fails by fatigue before `travel` [m]: 1 - R^((travel/L)^1.5)."""
        return float(failure_probability(travel, self.machine, self.conditions.reliability))

    @property
    def holds(self) -> bool:
        """Whether the machine reaches the required life, and every carriage the required static safety."""
        wanted, safety = self.wanted or 0.0, self.weakest.static.safety
        return self.machine >= wanted and safety >= self.conditions.least_safety

    @cached_property
    def band(self) -> LifeBand | None:
        """95 % credible band of the lives from the uncertainty of the trace; None if it has none.

        None as well for a result without its run: from a file, a pickle or a deepcopy. It simulates drawn motions, so
        it takes longer than everything else.
        """
        return life_bands(self.record, self.carriages)

    def __repr__(self) -> str:
        return f"<Life of {self.record.result.machine.name}: {kilometres(self.machine)} km, all carriages together>"

    def _repr_html_(self) -> str:
        return as_html(repr(self), self.table())

    def table(self) -> pd.DataFrame:
        """A row per carriage; names of columns end in the unit."""
        import pandas as pd

        rows = [
            {
                "rail": one.rail,
                "product": one.product.name,
                "mean_load_N": one.mean_load,
                "life_km": 1e-3 * one.life,
                "life_hours": self.hours(one.life),
                "static_safety": one.static.safety,
                "peak_equivalent_load_N": one.static.peak,
                "time_of_peak_s": one.worst.time,
                "load_factor_life": one.factor_life,
                "load_factor_safety": one.factor_safety,
                **{f"{cause.replace(' ', '_')}_N": share for cause, share in one.worst.shares.items()},
            }
            for one in self.carriages
        ]
        return pd.DataFrame(rows, index=pd.Index([one.name for one in self.carriages], name="carriage"))


@checked
def life_of(result: Result, conditions: LifeConditions | None = None) -> Life:
    """Life and static safety of the carriages of a result whose products have ratings.

    conditions: by default those of the machine, the table [life] of its file. The record is one cycle, which repeats.
    The run is repeated to find the largest loads at any time; over rails that are not straight, they are the largest at
    the reported instants.
    Raises LifeError if no carriage has a product with dynamic and static rating, if the velocity of the cart is unknown
    or always zero, or if the product lacks a rated moment that the rule counts.
    """
    machine = result.machine
    conditions = conditions or machine.life
    rated = criteria_of(machine, conditions)
    record = Record.of(result)
    largest = largest_loads(result, rated)
    carriages = tuple(map(carriage_life, repeat(record), rated, largest))
    by_rail: dict[str, list[float]] = {}
    for one in carriages:
        by_rail.setdefault(one.rail, []).append(one.life)
    return Life(
        carriages=carriages,
        rails={rail: float(system_life(lives)) for rail, lives in by_rail.items()},
        machine=float(system_life([one.life for one in carriages])),
        repetition=conditions.repetition(carriages[0].distance, float(np.ptp(record.travel.time))),
        conditions=conditions,
        left_out=left_out(machine, rated),
        record=record,
    )
