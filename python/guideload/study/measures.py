"""What a study keeps of each sample: the columns of its tables, and the limits that are asked of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal, get_args

from pydantic import Field, PlainValidator

from guideload.base.config import ConfigModel, number
from guideload.base.errors import ConfigError, Problem, ValueRefused, shown
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion

Measure = tuple[str, int, str]  # quantity, index of the carriage, statistic, see `_core.Batch`
Quantity = Literal[
    "Fx", "Fy", "Fz", "Mx", "My", "Mz", "resultant", "load", "contact", "drive"
]  # of a carriage but for the last
Statistic = Literal["min", "time_of_min", "max", "time_of_max", "rms", "start"]
STATISTICS: tuple[Statistic, ...] = get_args(Statistic)
# A carriage has no links along x, so Fx and Mx are 0: they are there for the asking.
USUAL: tuple[Quantity, ...] = ("Fy", "Fz", "My", "Mz", "resultant", "load", "contact", "drive")
UNITS = {
    "Fx": "N",
    "Fy": "N",
    "Fz": "N",
    "Mx": "N m",
    "My": "N m",
    "Mz": "N m",
    "resultant": "N",
    "drive": "N",
}


def measures_of(
    machine: Machine, motion: Motion, quantities: Sequence[Quantity] | None, statistics: Sequence[Statistic]
) -> tuple[tuple[Measure, ...], tuple[str, ...]]:
    """The measures, and their columns: "max_Fy_N[1a]", "mean_load_N[1a]", "contact_lost[1a]", "max_drive_N".

    quantities: None for the `USUAL` ones that there are. Raises ConfigError for one that there is not.
    """
    missing: dict[str, str] = {}
    if motion.velocity is None:
        missing["load"] = "the mean load is weighted with distance, and this motion tells no velocity"
    if "x" in machine.free:
        missing["drive"] = "x is free, so the drive's force is that of a link"
    for i, quantity in enumerate(quantities or ()):
        if quantity in missing:
            place = ("quantities", i)
            problem = Problem(
                place, quantity, "a quantity of this scene", missing[quantity], None, shown(quantity)
            )
            raise ConfigError([problem])
    found: dict[str, Measure] = {}
    wanted = [quantity for quantity in quantities or USUAL if quantity not in missing]
    for i, carriage in enumerate(machine.carriages):
        for quantity in wanted:
            if quantity == "load":
                found[f"mean_load_N[{carriage.name}]"] = (quantity, i, "mean")
            elif quantity == "contact":
                found[f"contact_lost[{carriage.name}]"] = (quantity, i, "lost")
            elif quantity != "drive":
                for statistic in statistics:
                    found[f"{column(statistic, quantity)}[{carriage.name}]"] = (quantity, i, statistic)
    if "drive" in wanted:
        found |= {column(statistic, "drive"): ("drive", 0, statistic) for statistic in statistics}
    return tuple(found.values()), tuple(found)


def column(statistic: str, quantity: str) -> str:
    """The name of a column, without its carriage."""
    unit = "s" if statistic.startswith("time") else UNITS[quantity].replace(" ", "")
    return f"{statistic}_{quantity}_{unit}"


# ---- limits


@dataclass(frozen=True)
class Limit:
    """A limit on the largest magnitude among some columns of a sample, or on the life that they make.

    name: "peak_resultant"; value in SI `unit`; of: the columns, by carriage ("" for the drive).
    """

    name: str
    value: float
    unit: str
    of: tuple[tuple[str, tuple[str, ...]], ...]


# Of each limit: unit, and the columns that count.
LIMITS: dict[str, tuple[str, tuple[str, ...]]] = {
    "mean_load": ("N", ("mean_load_N",)),
    **{f"rms_{name}": (unit, (column("rms", name),)) for name, unit in UNITS.items()},
    **{f"peak_{name}": (unit, (column("min", name), column("max", name))) for name, unit in UNITS.items()},
    "peak_resultant": ("N", (column("max", "resultant"),)),
    "life": ("m", ("mean_load_N",)),
}


def limits_of(given: Mapping[str, object], columns: Sequence[str], life: Life | None) -> tuple[Limit, ...]:
    """The limits of a study. Raises ConfigError with all that are unknown, or not kept, or no limit.

    life: what lives are counted from; None if the study has none, and no limit on them.
    """
    problems: list[Problem] = []
    limits: list[Limit] = []
    for name, value in given.items():
        try:
            if name not in LIMITS:
                raise ValueRefused("a known limit", value, f"known are {', '.join(LIMITS)}")
            if name == "life" and life is None:
                raise ValueRefused(
                    "no limit on a life without [life]", value, "add [life] with rating and base"
                )
            unit, names = LIMITS[name]
            limit = number(value, unit, above=0.0)
            of: dict[str, tuple[str, ...]] = {}
            for whole in columns:
                stem, _, label = whole.partition("[")
                if stem in names:
                    of[label.removesuffix("]")] = (*of.get(label.removesuffix("]"), ()), whole)
            if not of or any(len(found) < len(names) for found in of.values()):
                hint = f"it takes {' and '.join(names)}: add them to quantities and statistics"
                raise ValueRefused("a limit on what is kept", value, hint)
            limits.append(Limit(name, limit, unit, tuple(of.items())))
        except ValueRefused as refused:
            place = ("limits", name)
            problems.append(Problem(place, value, refused.expected, refused.hint, None, shown(value)))
    if problems:
        raise ConfigError(problems)
    return tuple(limits)


class Life(ConfigModel):
    """What the life of a carriage is counted from: base * (rating / mean load)^exponent."""

    rating: Annotated[float, PlainValidator(partial(number, unit="N", above=0.0))] = Field(
        description='dynamic load rating of a carriage, e.g. "27.1 kN"'
    )
    base: Annotated[float, PlainValidator(partial(number, unit="m", above=0.0))] = Field(
        description='the distance that the rating is for, "50 km" or "100 km"; the catalogue tells which'
    )
