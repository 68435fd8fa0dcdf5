"""A duty cycle: loads, life and static safety of each load case, and of all together.

The damage of the cases adds up (linear damage rule): in a period a carriage travels sum n_i d_i and uses the share
sum n_i d_i / L_i of its life. So its life is that under the mean load over the distance of all cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arguments import checked, require_type
from guideload.base.arrays import Array, read_only
from guideload.base.errors import ArgumentError, LifeError
from guideload.base.number_text import digits
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.life_target import HOUR, Repetition
from guideload.duty.description import DutyFile
from guideload.life.carriage_life import CarriageLife
from guideload.life.life import Life, life_of
from guideload.life.rating_life import failure_probability, system_life
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.simulation.simulation import simulate

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class LoadCase:
    """A machine state and one cycle of its motion, which is repeated `cycles` times in each period."""

    name: str
    machine: Machine
    motion: Motion
    cycles: float

    def __post_init__(self) -> None:
        for name, hint in (("name", str), ("machine", Machine), ("motion", Motion), ("cycles", float)):
            require_type(name, getattr(self, name), hint)


def load_cases(file: str | PathLike[str]) -> tuple[tuple[LoadCase, ...], float]:
    """The load cases of a duty file, and its period [s]. Raises ConfigError, TraceError."""
    described = DutyFile.from_toml(file)
    folder = Path(file).parent
    cases = tuple(
        LoadCase(case.name, machine, case.reading.motion(folder / case.motion, machine), case.cycles)
        for case, machine in zip(described.cases, described.machines, strict=True)
    )
    return cases, described.period


@dataclass(frozen=True, eq=False)
class DutyCycle:
    """Life and static safety under several load cases together.

    cases   the load cases
    lives   life and static safety of each case, if it were the only one
    period  s, in which each case runs its cycles
    """

    cases: tuple[LoadCase, ...]
    lives: tuple[Life, ...]
    period: float

    @classmethod
    def from_toml(cls, file: str | PathLike[str]) -> DutyCycle:
        """The duty cycle of a TOML file, simulated. Raises ConfigError, TraceError, and what `duty_cycle` raises."""
        cases, period = load_cases(file)
        try:
            return duty_cycle(cases, period)
        except ArgumentError as error:
            raise ArgumentError(f"{file}: {error}") from None

    @property
    def conditions(self) -> LifeConditions:
        """How life and static safety are judged."""
        return self.lives[0].conditions

    @property
    def carriages(self) -> tuple[CarriageLife, ...]:
        """The carriages with ratings, as in the first case."""
        return self.lives[0].carriages

    @cached_property
    def distances(self) -> Array:
        """Travel of each case in a period (case,) [m]."""
        return read_only(
            np.array([case.cycles * life.distance for case, life in zip(self.cases, self.lives, strict=True)])
        )

    @cached_property
    def damage(self) -> Array:
        """Share of the life of each carriage that each case uses in a period (case, carriage)."""
        lives = np.array([[one.life for one in life.carriages] for life in self.lives])
        return read_only(self.distances[:, None] / lives)

    @cached_property
    def carriage_lives(self) -> Array:
        """Life of each carriage under all cases together (carriage,) [m]."""
        with np.errstate(divide="ignore"):
            return read_only(self.distances.sum() / self.damage.sum(axis=0))

    @cached_property
    def mean_loads(self) -> Array:
        """Mean load over the distance of all cases (carriage,) [N]."""
        exponents = np.array([one.rating.exponent for one in self.carriages])
        loads = np.array([[one.mean_load for one in life.carriages] for life in self.lives])
        shares = self.distances / self.distances.sum()
        return read_only((shares @ loads**exponents) ** (1.0 / exponents))

    @property
    def machine_life(self) -> float:
        """The life [m] that all carriages reach under all cases together."""
        return float(system_life(self.carriage_lives))

    @property
    def shares(self) -> Array:
        """Share of each case in the damage of all carriages (case,)."""
        total = self.damage.sum()
        return np.asarray(self.damage.sum(axis=1) / (total or 1.0))

    @property
    def worst(self) -> tuple[str, CarriageLife]:
        """The case with the smallest static safety, and the carriage."""
        found = [(life.weakest, case.name) for case, life in zip(self.cases, self.lives, strict=True)]
        one, name = min(found, key=lambda item: item[0].static.safety)
        return name, one

    @property
    def holds(self) -> bool:
        """Whether the machine reaches the required life, and every carriage the required static safety."""
        return (
            self.machine_life >= (self.wanted or 0.0)
            and self.worst[1].static.safety >= self.conditions.least_safety
        )

    @checked
    def hours(self, life: float) -> float:
        """Hours in which the machine travels `life` [m]."""
        return self.repetition.hours(life)

    @property
    def repetition(self) -> Repetition:
        """The mean cycle: travel and duration of a period, divided by its number of cycles of all cases."""
        cycles = sum(case.cycles for case in self.cases)
        return Repetition(
            float(self.distances.sum()) / cycles, self.period / cycles, self.conditions.hours_per_year
        )

    @property
    def wanted(self) -> float | None:
        """The required life as travel [m]; None if none is required."""
        return None if self.conditions.life is None else self.repetition.travel(self.conditions.life)

    @checked
    def failure_probability(self, travel: float) -> float:
        """Probability that a carriage fails by fatigue before `travel` [m] of all cases together."""
        return float(failure_probability(travel, self.machine_life, self.conditions.reliability))

    def table(self) -> pd.DataFrame:
        """A row per case and carriage: mean load, life if the case were the only one, safety, share of the damage."""
        import pandas as pd

        total = self.damage.sum(axis=0)
        rows = {
            (case.name, one.name): {
                "mean_load_N": one.mean_load,
                "life_km": 1e-3 * one.life,
                "static_safety": one.static.safety,
                "share_of_damage": self.damage[i, k] / (total[k] or 1.0),
            }
            for i, (case, life) in enumerate(zip(self.cases, self.lives, strict=True))
            for k, one in enumerate(life.carriages)
        }
        index = pd.MultiIndex.from_tuples(list(rows), names=["case", "carriage"])
        return pd.DataFrame(list(rows.values()), index=index)


@checked
def duty_cycle(cases: Sequence[LoadCase], period: float = HOUR) -> DutyCycle:
    """Simulate load cases, and judge them together by the table [life] of their machines.

    period: s, in which each case runs its cycles. Raises LifeError for a case without life. Raises ArgumentError if two
    cases have the same name, if the cycles take longer than the period, if carriages, products or conditions of life
    differ between cases, or if `cycles_per_hour` of [life] is not the number of cycles of all cases per hour.
    """
    if not len(cases):
        raise ArgumentError("cases: expected at least one load case")
    names = [case.name for case in cases]
    if len(set(names)) < len(names):
        raise ArgumentError(f"cases: expected a unique name of each case, got {', '.join(names)}")
    if not 0.0 < period < np.inf:
        raise ArgumentError(f"period: expected a time above 0 s, got {period:g}")
    lives = []
    for case in cases:
        if not 0.0 < case.cycles < np.inf:
            raise ArgumentError(f"case {case.name}: expected more than 0 cycles, got {case.cycles:g}")
        try:
            lives.append(life_of(simulate(case.machine, case.motion)))
        except LifeError as error:
            raise LifeError(f"case {case.name}: {error}") from None
    busy = sum(case.cycles * float(np.ptp(case.motion.time)) for case in cases)
    if busy > period * (1.0 + 1e-9):
        raise ArgumentError(
            f"the cycles of all cases take {digits(busy, 4)} s, longer than the period of {digits(period, 4)} s: lower "
            "the cycles, or give the period in which they run"
        )
    for case, life in zip(cases[1:], lives[1:], strict=True):
        _require_same_carriages(cases[0], lives[0], case, life)
    stated, hourly = lives[0].conditions.cycles_per_hour, sum(case.cycles for case in cases) * HOUR / period
    if stated is not None and not np.isclose(stated, hourly, rtol=1e-6):
        raise ArgumentError(
            f"cycles_per_hour: [life] states {stated:g}, but the cases run {hourly:g} cycles per hour together; leave "
            f"it out, or give each case change = {{ life = {{ cycles_per_hour = {hourly:.9g} }} }}"
        )
    return DutyCycle(tuple(cases), tuple(lives), float(period))


def _require_same_carriages(first: LoadCase, one: Life, case: LoadCase, other: Life) -> None:
    """Raise ArgumentError unless the damage of both cases adds up: the carriages must be the same."""
    for what, found in (
        ("carriages with ratings", [[c.name for c in life.carriages] for life in (one, other)]),
        ("products", [[c.product for c in life.carriages] for life in (one, other)]),
        ("f_C", [[c.contact_factor for c in life.carriages] for life in (one, other)]),
        ("conditions in the table [life]", [[one.conditions], [other.conditions]]),
    ):
        if found[0] != found[1]:
            raise ArgumentError(
                f"cases {first.name} and {case.name} have different {what}: the damage of cases adds up for the same "
                "carriages, judged the same way; make them equal"
            )
