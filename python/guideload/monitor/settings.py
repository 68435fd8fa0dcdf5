"""What a monitor needs to know of the controller and its encoder."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator

from guideload.base.config import ConfigModel, in_range, optional, whole
from guideload.base.errors import ValueRefused
from guideload.base.ranges import ACCELERATION, FORCE, LENGTH, PERIOD

FRACTION = 16  # parts of a count in which the monitor computes positions
NOISE = 3.0  # counts: rounding of three positions in a second difference, and one count of noise
BITS = 31  # of a whole number of the monitor, with its sign
Load = Annotated[float, in_range(FORCE, above=0.0)]


class MonitorSettings(ConfigModel):
    """Sampling, encoder and limits of a monitor. Raises ConfigError."""

    period: Annotated[float, in_range(PERIOD, above=0.0)] = Field(
        description='time between two samples, e.g. "1 ms"'
    )
    travel_per_count: Annotated[float, in_range(LENGTH, nonzero=True)] = Field(
        description='travel of the cart per count, e.g. "20 um"; negative if the counter counts backwards'
    )
    lag: Annotated[int, whole(0, 200)] = Field(description="delay of the loads, in samples")
    encoder_bits: Annotated[int, whole(8, 32)] = optional("width of the counter", 32)
    ticks: Annotated[int, whole(1, 2**24)] = optional(
        "time stamps per period; 1 if the stamp is the number of the sample", 1
    )
    max_acceleration: Annotated[float, in_range(ACCELERATION, above=0.0)] = Field(
        description="largest acceleration the axis can have: a sample that asks for more is wrong"
    )
    most_missing: Annotated[int, whole(0, 64)] = optional("samples that may be missing in a row", 8)
    load_limit: Load | None = optional("limit of the equivalent load of every carriage")
    bin: Load = optional("width of a bin of the histogram of the equivalent load", 500.0)

    @field_validator("max_acceleration")
    @classmethod
    def _counts_it(cls, value: float, info: ValidationInfo) -> float:
        period, per_count = (info.data.get(key) for key in ("period", "travel_per_count"))
        if period is not None and per_count is not None:
            most = 2**BITS / FRACTION / change_in_counts(1.0, period, per_count)
            if value >= most:
                expected = f"less than {most:.3g} m/s2, the most that the monitor can count"
                raise ValueRefused(expected, value, "check period and travel_per_count")
        return value

    @property
    def most_change(self) -> float:
        """Largest change of the step from a period to the next, in counts."""
        return change_in_counts(self.max_acceleration, self.period, self.travel_per_count)

    @property
    def of_core(self) -> list[int]:
        """The settings of the input as an argument of `_core.Monitor`."""
        change = max(1, round(self.most_change * FRACTION))
        slack = round(NOISE * FRACTION)
        return [
            self.ticks,
            self.ticks // 20,
            self.encoder_bits,
            change,
            slack,
            FRACTION,
            self.most_missing,
        ]


def change_in_counts(acceleration: float, period: float, travel_per_count: float) -> float:
    """Change of the step from a period to the next, in counts, by an acceleration [m/s2]."""
    return acceleration * period**2 / abs(travel_per_count)
