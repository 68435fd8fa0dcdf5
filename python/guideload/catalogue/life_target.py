"""A life to be reached, in travel, hours, years or cycles, and the repetition of the motion that converts it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from guideload.base.config import number
from guideload.base.errors import ArgumentError, ValueRefused, shown
from guideload.base.number_text import number as number_text
from guideload.base.ranges import CYCLES, DISTANCE, TIME, YEARS
from guideload.base.units import NUMBER, quantity

HOUR = 3600.0  # s
CONTINUOUS = 8766.0  # hours of a year of continuous operation, of 365.25 days
EXPECTED = "a life in km, h, years or cycles"
WORDS = {"cycle": "cycles", "cycles": "cycles", "year": "years", "years": "years"}
RANGES = {"m": DISTANCE, "s": TIME, "cycles": CYCLES, "years": YEARS}


@dataclass(frozen=True)
class LifeTarget:
    """A life to be reached."""

    value: float  # in `unit`
    unit: str  # "m" of travel, "s" of operation, "years" of operation, or "cycles": repetitions of the motion

    @property
    def text(self) -> str:
        """In words: `20 000 km`, `10 000 h`, `10 years`, `5 000 000 cycles`."""
        scale, name = {"m": (1e-3, "km"), "s": (1.0 / HOUR, "h")}.get(self.unit, (1.0, self.unit))
        value = scale * self.value
        return f"{number_text(value)} {name.removesuffix('s') if value == 1.0 else name}"

    def __str__(self) -> str:
        """As in a file; `life_target` reads the same target from it."""
        return f"{self.value!r} {self.unit}"


def life_target(value: object) -> LifeTarget:
    """A life to be reached, of a file, an option or code: "20000 km", "10000 h", "10 years" or "5e6 cycles".

    Raises ValueRefused for another quantity, a number without unit, and a value outside its range.
    """
    if isinstance(value, LifeTarget):
        return value
    match = NUMBER.fullmatch(value if isinstance(value, str) else shown(value))
    text, written = match.groups() if match else ("", "")
    if word := WORDS.get(written):
        return LifeTarget(number(text, "1", above=0.0, within=RANGES[word]), word)
    for unit in ("m", "s") if written else ():
        try:
            quantity(value, unit)
        except ValueRefused:
            continue
        return LifeTarget(number(value, unit, above=0.0, within=RANGES[unit]), unit)
    choices = [f'"{one}"' for one in ("20000 km", "10000 h", "10 years", "5e6 cycles")]
    if match and not written:
        choices = [f'"{text} {unit}"' for unit in ("km", "h", "years", "cycles")]
    raise ValueRefused(EXPECTED, value, f"write {', '.join(choices[:-1])} or {choices[-1]}")


@dataclass(frozen=True)
class Repetition:
    """One repetition of the motion in operation: what converts between travel, hours, years and cycles."""

    distance: float  # m
    duration: float  # s, with the pause until the next one
    hours_per_year: float | None = None  # of operation; None: continuous operation

    @property
    def yearly_hours(self) -> float:
        """Hours of operation per year."""
        return CONTINUOUS if self.hours_per_year is None else self.hours_per_year

    def hours(self, life: float) -> float:
        """Hours of operation in which the machine travels `life` [m]; nan without travel.

        Raises ArgumentError for a negative life and for nan.
        """
        if self.distance > 0.0 and not life >= 0.0:
            raise ArgumentError(f"life: expected a travel of at least 0 m, got {life:g}")
        return life / self.distance * self.duration / HOUR if self.distance > 0.0 else math.nan

    def years(self, life: float) -> float:
        """Years in which the machine travels `life` [m]; nan without travel."""
        return self.hours(life) / self.yearly_hours

    def travel(self, target: LifeTarget) -> float:
        """The travel [m] of a life to be reached."""
        if target.unit == "m":
            return target.value
        yearly = self.yearly_hours * HOUR / self.duration
        cycles = {"cycles": 1.0, "s": 1.0 / self.duration, "years": yearly}
        return target.value * cycles[target.unit] * self.distance
