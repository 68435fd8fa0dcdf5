"""The table [life] of a machine file: how life and static safety are judged."""

from __future__ import annotations

from typing import Annotated, Literal, get_args

from pydantic import PlainSerializer, PlainValidator, StrictBool, WithJsonSchema

from guideload.base.config import ConfigModel, in_range, number, optional
from guideload.base.errors import ValueRefused
from guideload.base.ranges import CYCLES, FACTOR, REDUCTION, YEARLY
from guideload.catalogue.life_target import HOUR, LifeTarget, Repetition, life_target

RuleName = Literal["sum", "thk", "hiwin", "hiwin_mg", "iko", "rexroth", "thomson"]
RULES: tuple[RuleName, ...] = get_args(RuleName)
Application = Literal["normal", "vibration and shock", "strong shock"]
# Guidance for the static safety by application (ISO 14728-2 and the makers' tables).
LEAST_SAFETY: dict[Application, float] = {"normal": 1.0, "vibration and shock": 2.0, "strong shock": 3.0}

Target = Annotated[
    LifeTarget,
    PlainValidator(life_target),
    PlainSerializer(str, return_type=str),
    WithJsonSchema({"type": "string"}),
]
Factor = Annotated[float, in_range(FACTOR, above=0.0)]
Reduction = Annotated[float, in_range(REDUCTION, above=0.0)]


def _probability(value: object) -> float:
    result = number(value, "1", above=0.0)
    if result >= 1.0:
        raise ValueRefused("a probability below 1", value, "0.9 is the reliability of the rating")
    return result


class LifeConditions(ConfigModel):
    """How life and static safety are judged."""

    rule: RuleName = optional("rule of the equivalent load; sum is on the safe side", "sum")
    preload_in_life: StrictBool = optional(
        "whether the preload counts, if it is known; false: as the maker prints the rule", True
    )
    reliability: Annotated[float, PlainValidator(_probability)] = optional(
        "probability that the life is reached", 0.9
    )
    hardness_factor: Reduction = optional("f_H, 1 for raceways of 58 to 64 HRC", 1.0)
    temperature_factor: Reduction = optional("f_T, 1 up to 100 C", 1.0)
    contact_factor: Reduction | None = optional(
        "f_C of carriages side by side on a rail; by default 1, 0.81, 0.72, 0.66, 0.61 for 1 to 5"
    )
    load_factor: Factor = optional("f_W; 1, because simulated loads contain the dynamics already", 1.0)
    application: Application = optional(
        "kind of use, which sets the least static safety: 1, 2 or 3", "normal"
    )
    life: Target | None = optional(
        "life to be reached, in travel, hours of operation, years or cycles (repetitions of the motion), "
        'e.g. "20000 km", "10000 h", "10 years", "5e6 cycles"'
    )
    safety: Factor | None = optional("static safety to be reached, instead of that of the use")
    cycles_per_hour: Annotated[float, in_range(CYCLES, above=0.0)] | None = optional(
        "repetitions of the motion per hour; by default it repeats at once"
    )
    hours_per_year: Annotated[float, in_range(YEARLY, above=0.0)] | None = optional(
        "operating hours, e.g. 4000 for two shifts; by default 8766, continuous operation"
    )

    @property
    def least_safety(self) -> float:
        """The static safety to be reached."""
        return LEAST_SAFETY[self.application] if self.safety is None else self.safety

    def repetition(self, distance: float, duration: float) -> Repetition:
        """The repetition in operation of a motion that travels `distance` [m] in `duration` [s]."""
        if self.cycles_per_hour is not None:
            duration = HOUR / self.cycles_per_hour
        return Repetition(distance, duration, self.hours_per_year)
