"""The catalogue of quantities: what a run records, and the quantities that are computed from it.

A run records statistics over time of the loads of each carriage, in columns such as "max_Fy_N[1a]". A quantity is
computed from recorded columns: "peak_Fy_N" is the largest magnitude of "min_Fy_N" and "max_Fy_N".
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from guideload.base.arrays import Array, Flags
from guideload.base.config import number
from guideload.base.errors import ConfigError, Problem, ValueRefused, problem_at, refused_at
from guideload.catalogue.life_target import Repetition, life_target
from guideload.life.rating_life import system_life
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.simulation.drive_force import has_friction

Measure = tuple[str, int, str]  # recorded load, index of the carriage, statistic, see `_core.Batch`
Recorded = Literal["Fx", "Fy", "Fz", "Mx", "My", "Mz", "resultant", "load", "contact", "drive"]
Statistic = Literal["min", "time_of_min", "max", "time_of_max", "rms", "start"]
STATISTICS: tuple[Statistic, ...] = get_args(Statistic)
# A carriage has no links along x and, without width, resists no roll: Fx and Mx are then 0, recorded on request only.
USUAL: tuple[Recorded, ...] = ("Fy", "Fz", "Mx", "My", "Mz", "resultant", "load", "contact", "drive")
UNITS = {name: "N" for name in ("Fx", "Fy", "Fz")} | {name: "Nm" for name in ("Mx", "My", "Mz")}
UNITS |= {"resultant": "N", "drive": "N"}
PEAK, LIFE, SAFETY, CONTACT = "peak_resultant_N", "life_km", "static_safety", "contact_lost"
MEAN_LOAD, PEAK_LOAD = ("load", "mean"), ("load", "max")  # of the equivalent load, for life and static safety


@dataclass(frozen=True)
class Quantity:
    """A quantity of every sample: of each carriage, and of the machine."""

    name: str  # with the unit at its end: "peak_Fy_N"
    title: str  # in tables and pictures
    # (load, statistic) of the recorded columns; the quantity is their largest magnitude, life and static safety follow
    # from it
    sources: tuple[tuple[str, str], ...]
    in_summary: bool = True  # whether the summary contains it
    # the value of two carriages together, as np.maximum, the worse one; of lives that of both; None for a time, or the
    # load at the start, which the machine does not have
    worse: Any = np.maximum
    smallest_is_worst: bool = False  # whether values below a limit exceed it

    @property
    def of_machine(self) -> bool:
        """Whether it exists for the machine only, not for each carriage."""
        return self.sources[0][0] == "drive"

    @property
    def is_rated(self) -> bool:
        """Whether only carriages with ratings have it."""
        return self.name in (LIFE, SAFETY)

    @property
    def unit(self) -> str:
        """Its unit, "" if it has none."""
        return quantity_unit(self.name)

    def limit(self, value: object, repetition: Repetition | None) -> float:
        """A limit in its unit; that of a life in travel, hours, years or cycles. Raises ValueRefused."""
        if self.name != LIFE:
            return number(value, self.unit or "1", above=0.0)
        return 1e-3 * (repetition or Repetition(np.nan, np.nan)).travel(life_target(value))

    def exceeds(self, values: Array, limit: float) -> Flags:
        """Whether values exceed a limit; for the limit NaN, whether contact is lost."""
        bound = 0.5 if np.isnan(limit) else limit
        return values < bound if self.smallest_is_worst else values > bound


def require_limit(quantity: Quantity, machine: Machine, limit: object) -> None:
    """Raise ValueRefused for a limit on the force of the drive where friction adds to it, which a study leaves out."""
    if quantity.of_machine and has_friction(machine):
        raise ValueRefused(
            f"no limit on {quantity.title} of a machine with friction",
            limit,
            "a study has this force without friction, which `guideload run` adds; to limit it so, take the friction "
            'off the limit and state none: [friction] with coefficient = 0 and seal = "0 N" alone',
        )


def column_name(load: str, statistic: str) -> str:
    """The name of a recorded column, without the carriage. Raises KeyError for one that is never recorded."""
    if load in ("load", "contact"):
        names = {MEAN_LOAD: "mean_load_N", PEAK_LOAD: "peak_equivalent_load_N", ("contact", "lost"): CONTACT}
        return names[load, statistic]
    return f"{statistic}_{load}_{'s' if statistic.startswith('time') else UNITS[load]}"


def quantity_unit(name: str) -> str:
    """The unit at the end of a quantity's name, "" if it has none."""
    ends = re.search(r"_(Nm|N|km|s)$", name)
    return {"Nm": "N m"}.get(ends[1], ends[1]) if ends else ""


def _catalogue() -> dict[str, Quantity]:
    """All quantities by name: first those computed from recorded columns, then the recorded columns."""
    forces, moments = ("Fx", "Fy", "Fz"), ("Mx", "My", "Mz")

    def peak(load: str, title: str, in_summary: bool) -> Quantity:
        return Quantity(f"peak_{load}_{UNITS[load]}", title, ((load, "min"), (load, "max")), in_summary)

    def rms(load: str, title: str) -> Quantity:
        return Quantity(column_name(load, "rms"), f"rms {title}", ((load, "rms"),))

    quantities = [
        Quantity(PEAK, "peak resultant", (("resultant", "max"),)),
        *(peak(load, f"peak |{load}|", load in ("Fy", "Fz")) for load in (*forces, *moments)),
        Quantity("mean_load_N", "mean load", (MEAN_LOAD,)),
        Quantity("peak_equivalent_load_N", "peak equivalent load", (PEAK_LOAD,), False),
        Quantity(LIFE, "life", (MEAN_LOAD,), worse=lambda *both: system_life(both), smallest_is_worst=True),
        Quantity(SAFETY, "static safety", (PEAK_LOAD,), worse=np.minimum, smallest_is_worst=True),
        *(rms(load, load) for load in ("resultant", *forces, *moments)),
        Quantity(CONTACT, "contact lost", (("contact", "lost"),)),
        peak("drive", "peak drive force", True),
        rms("drive", "drive force"),
    ]
    for load in UNITS:
        title = "drive force" if load == "drive" else load
        for statistic, words, worse in (
            ("min", f"smallest {title}", np.minimum),
            ("max", f"largest {title}", np.maximum),
            ("time_of_min", f"time of the smallest {title}", None),
            ("time_of_max", f"time of the largest {title}", None),
            ("start", f"{title} at the start", None),
        ):
            quantities.append(
                Quantity(column_name(load, statistic), words, ((load, statistic),), True, worse)
            )
    return {quantity.name: quantity for quantity in quantities}


QUANTITIES = _catalogue()
RECORDED = {column_name(load, statistic) for load in UNITS for statistic in STATISTICS if statistic != "rms"}
# Quantities by their key in the table [limits], which is the name without the unit.
LIMITS = {
    re.sub(r"_(Nm|N|km)$", "", name): quantity
    for name, quantity in QUANTITIES.items()
    if name.startswith(("peak_", "rms_", "mean_", LIFE, SAFETY))
}


def recorded_measures(
    machine: Machine,
    motion: Motion,
    loads: Sequence[Recorded] | None,
    statistics: Sequence[Statistic],
    rated: bool = False,
) -> tuple[Measure, ...]:
    """The measures.

    loads: None for all of `USUAL` that the scene has. rated: whether the largest equivalent load is recorded for the
    static safety. Raises ConfigError for a load that the scene does not have.
    """
    missing: dict[str, str] = {}
    if motion.velocity is None:
        missing["load"] = "the mean load is weighted with distance, and this motion has no velocity"
    if "x" in machine.free:
        missing["drive"] = "x is free, so the drive's force is that of a link"
    for i, load in enumerate(loads or ()):
        if load in missing:
            raise refused_at(("quantities", i), "a quantity of this scene", load, missing[load])
    resists_roll = any(carriage.resists_roll for carriage in machine.carriages)
    usual = [load for load in USUAL if load != "Mx" or resists_roll]
    recorded = [load for load in loads or usual if load not in missing]
    statistics_of = {"load": ("mean", "max") if rated else ("mean",), "contact": ("lost",)}
    measures: list[Measure] = [
        (load, i, statistic)
        for i in range(len(machine.carriages))
        for load in recorded
        if load != "drive"
        for statistic in statistics_of.get(load, statistics)
    ]
    if "drive" in recorded:
        measures += [("drive", 0, statistic) for statistic in statistics]
    return tuple(dict.fromkeys(measures))  # a load or statistic may be given twice


def checked_limits(
    given: Mapping[str, object],
    measures: Sequence[Measure],
    machine: Machine,
    unrated: str,
    repetition: Repetition | None,
) -> dict[str, float]:
    """Limits by quantity, in its unit; of life and static safety, if not given, those that the machine is to reach.

    unrated: why there is neither life nor static safety, or empty. repetition: of the motion, where there is a life.
    Raises ConfigError with all that are unknown, not recorded or of a force that lacks the friction of the machine.
    """
    problems: list[Problem] = []
    limits: dict[str, float] = {}
    recorded = {(load, statistic) for load, _, statistic in measures}
    for key, value in given.items():
        try:
            if key not in LIMITS:
                raise ValueRefused("a known limit", value, f"known are {', '.join(LIMITS)}")
            quantity = LIMITS[key]
            if quantity.is_rated and unrated:
                raise ValueRefused(f"no limit on {quantity.title} without a rating", value, unrated)
            limit = quantity.limit(value, repetition)
            require_limit(quantity, machine, value)
            if not recorded.issuperset(quantity.sources):
                names = " and ".join(column_name(*source) for source in quantity.sources)
                hint = f"it takes {names}: add them to quantities and statistics"
                hint = 'add "load" to quantities' if quantity.sources[0][0] == "load" else hint
                raise ValueRefused("a limit on a recorded quantity", value, hint)
            limits[quantity.name] = limit
        except ValueRefused as refused:
            problems.append(problem_at(("limits", key), refused))
    if problems:
        raise ConfigError(problems)
    if PEAK_LOAD in recorded:
        limits.setdefault(SAFETY, machine.life.least_safety)
        if machine.life.life is not None:
            limits.setdefault(LIFE, QUANTITIES[LIFE].limit(machine.life.life, repetition))
    return limits


def contact_words(machine: Machine) -> str:
    """Words for `contact_lost` on a machine: of a preloaded carriage, one row is open."""
    laws = [law for carriage in machine.carriages for law in carriage.laws if law.kind != "linear"]
    preloaded = [law.kind == "preloaded" for law in laws]
    if not any(preloaded):
        return "contact lost"
    return "a row open" if all(preloaded) else "contact lost or a row open"
