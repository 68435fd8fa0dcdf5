"""The catalogue of quantities: what a run records, and the quantities that are computed from it.

A run records statistics over time of the loads of each carriage, in columns such as "max_Fy_N[1a]". A quantity is
computed from recorded columns: "peak_Fy_N" is the largest magnitude of "min_Fy_N" and "max_Fy_N".
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PlainValidator

from guideload.base.arrays import Array
from guideload.base.config import ConfigModel, number
from guideload.base.errors import ConfigError, Problem, ValueRefused
from guideload.catalogue.rating import Rating
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.study.description.refusals import problem_at, refused_at

Measure = tuple[str, int, str]  # recorded load, index of the carriage, statistic, see `_core.Batch`
Recorded = Literal["Fx", "Fy", "Fz", "Mx", "My", "Mz", "resultant", "load", "contact", "drive"]
Statistic = Literal["min", "time_of_min", "max", "time_of_max", "rms", "start"]
STATISTICS: tuple[Statistic, ...] = get_args(Statistic)
# A carriage has no links along x and, without width, resists no roll: Fx and Mx are then 0, recorded on request only.
USUAL: tuple[Recorded, ...] = ("Fy", "Fz", "Mx", "My", "Mz", "resultant", "load", "contact", "drive")
UNITS = {name: "N" for name in ("Fx", "Fy", "Fz")} | {name: "Nm" for name in ("Mx", "My", "Mz")}
UNITS |= {"resultant": "N", "drive": "N"}
PEAK, LIFE, CONTACT = "peak_resultant_N", "life_km", "contact_lost"


class Life(ConfigModel):
    """The life of a carriage: base * (rating / mean load)^exponent."""

    rating: Annotated[float, PlainValidator(partial(number, unit="N", above=0.0))] = Field(
        description='dynamic load rating of a carriage, e.g. "27.1 kN"'
    )
    base: Annotated[float, PlainValidator(partial(number, unit="m", above=0.0))] = Field(
        description='travel to which the rating refers, "50 km" or "100 km", from the catalogue'
    )

    def with_exponent(self, exponent: float) -> Rating:
        """The whole rating; the exponent is that of the mean load."""
        return Rating(value=self.rating, base=self.base, exponent=exponent)


@dataclass(frozen=True)
class Quantity:
    """A quantity of every sample: of each carriage, and of the machine, which has the value of its worst carriage.

    name        with the unit at its end: "peak_Fy_N"
    title       in tables and pictures
    sources     (load, statistic) of the recorded columns; the quantity is their largest magnitude
    in_summary  whether the summary contains it
    worse       np.minimum or np.maximum, the worse of two values; None for a time, or the load at the start
    """

    name: str
    title: str
    sources: tuple[tuple[str, str], ...]
    in_summary: bool = True
    worse: Any = np.maximum

    @property
    def of_machine(self) -> bool:
        """Whether it exists for the machine only, not for each carriage."""
        return self.sources[0][0] == "drive"

    @property
    def smallest_is_worst(self) -> bool:
        """Whether values below a limit exceed it, as for a life."""
        return self.worse is np.minimum

    @property
    def unit(self) -> str:
        """Its unit, "" if it has none."""
        return unit_of(self.name)

    def exceeds(self, values: Array, limit: float) -> NDArray[np.bool_]:
        """Whether values exceed a limit; for the limit NaN, whether contact is lost."""
        bound = 0.5 if np.isnan(limit) else limit
        return values < bound if self.smallest_is_worst else values > bound


def column_of(load: str, statistic: str) -> str:
    """The name of a recorded column, without the carriage. Raises KeyError for one that is never recorded."""
    if load in ("load", "contact"):
        return {("load", "mean"): "mean_load_N", ("contact", "lost"): CONTACT}[load, statistic]
    return f"{statistic}_{load}_{'s' if statistic.startswith('time') else UNITS[load]}"


def unit_of(name: str) -> str:
    """The unit at the end of a quantity's name, "" if it has none."""
    ends = re.search(r"_(Nm|N|km|s)$", name)
    return {"Nm": "N m"}.get(ends[1], ends[1]) if ends else ""


def _catalogue() -> dict[str, Quantity]:
    """All quantities by name: first those computed from recorded columns, then the recorded columns."""
    forces, moments, mean = ("Fx", "Fy", "Fz"), ("Mx", "My", "Mz"), (("load", "mean"),)

    def peak(load: str, title: str, in_summary: bool) -> Quantity:
        return Quantity(f"peak_{load}_{UNITS[load]}", title, ((load, "min"), (load, "max")), in_summary)

    def rms(load: str, title: str) -> Quantity:
        return Quantity(column_of(load, "rms"), f"rms {title}", ((load, "rms"),))

    quantities = [
        Quantity(PEAK, "peak resultant", (("resultant", "max"),)),
        *(peak(load, f"peak |{load}|", load in ("Fy", "Fz")) for load in (*forces, *moments)),
        Quantity("mean_load_N", "mean load", mean),
        Quantity(LIFE, "life", mean, worse=np.minimum),
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
            quantities.append(Quantity(column_of(load, statistic), words, ((load, statistic),), True, worse))
    return {quantity.name: quantity for quantity in quantities}


QUANTITIES = _catalogue()
RECORDED = {column_of(load, statistic) for load in UNITS for statistic in STATISTICS if statistic != "rms"}
# Quantities by their key in the table [limits], which is the name without the unit.
LIMITS = {
    re.sub(r"_(Nm|N|km)$", "", name): quantity
    for name, quantity in QUANTITIES.items()
    if name.startswith(("peak_", "rms_", "mean_", LIFE))
}


def measures_of(
    machine: Machine, motion: Motion, loads: Sequence[Recorded] | None, statistics: Sequence[Statistic]
) -> tuple[tuple[Measure, ...], tuple[str, ...]]:
    """The measures, and the names of their columns: "max_Fy_N[1a]", "contact_lost[1a]", "max_drive_N".

    loads: None for all of `USUAL` that the scene has. Raises ConfigError for a load that it does not have.
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
    statistics_of = {"load": ("mean",), "contact": ("lost",)}
    measures: list[Measure] = [
        (load, i, statistic)
        for i in range(len(machine.carriages))
        for load in recorded
        if load != "drive"
        for statistic in statistics_of.get(load, statistics)
    ]
    if "drive" in recorded:
        measures += [("drive", 0, statistic) for statistic in statistics]
    measures = list(dict.fromkeys(measures))  # a load or statistic may be given twice
    return tuple(measures), columns_of(measures, [carriage.name for carriage in machine.carriages])


def columns_of(measures: Sequence[Measure], carriages: Sequence[str]) -> tuple[str, ...]:
    """The names of the columns of measures; carriages: their names. Raises IndexError for another carriage."""
    return tuple(
        column_of(load, statistic) + ("" if load == "drive" else f"[{carriages[i]}]")
        for load, i, statistic in measures
    )


def limits_of(
    given: Mapping[str, object], measures: Sequence[Measure], life: Life | None
) -> dict[str, float]:
    """Limits by quantity, in its unit. Raises ConfigError with all that are unknown or not recorded.

    life: None if the study has no table [life], and thus no limit on the life.
    """
    problems: list[Problem] = []
    limits: dict[str, float] = {}
    recorded = {(load, statistic) for load, _, statistic in measures}
    for key, value in given.items():
        try:
            if key not in LIMITS:
                raise ValueRefused("a known limit", value, f"known are {', '.join(LIMITS)}")
            quantity = LIMITS[key]
            if quantity.name == LIFE and life is None:
                hint = "add [life] with rating and base"
                raise ValueRefused("no limit on a life without [life]", value, hint)
            limit = number(value, "m" if quantity.name == LIFE else quantity.unit, above=0.0)
            if not recorded.issuperset(quantity.sources):
                names = " and ".join(column_of(*source) for source in quantity.sources)
                hint = f"it takes {names}: add them to quantities and statistics"
                raise ValueRefused("a limit on a recorded quantity", value, hint)
            limits[quantity.name] = 1e-3 * limit if quantity.name == LIFE else limit
        except ValueRefused as refused:
            problems.append(problem_at(("limits", key), refused))
    if problems:
        raise ConfigError(problems)
    return limits
