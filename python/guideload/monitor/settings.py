"""What a monitor needs to know of the controller and its encoder."""

from __future__ import annotations

from dataclasses import dataclass

from guideload.base.config import number
from guideload.base.errors import ArgumentError, ValueRefused
from guideload.base.ranges import ACCELERATION, LENGTH, PERIOD, PRELOAD

FRACTION = 16  # parts of a count in which the monitor computes positions
NOISE = 3.0  # counts: rounding of three positions in a second difference, and one count of noise
BITS = 31  # of a whole number of the monitor, with its sign


@dataclass(frozen=True)
class MonitorSettings:
    """Sampling, encoder and limits of a monitor.

    period            s, between two samples
    quantum           m of travel per count; negative if the counter counts backwards
    lag               samples after the instant whose loads come out; 0: the past alone
    counter_bits      width of the counter
    ticks             time stamps per period; 1 if the stamp is the number of the sample
    max_acceleration  m/s2 that the axis cannot exceed: a sample that asks for more is wrong
    most_missing      samples that may be missing in a row
    limit             N, of the equivalent load of every carriage; inf: none
    bin               N, width of a bin of the histogram

    Raises ArgumentError.
    """

    period: float
    quantum: float
    lag: int
    max_acceleration: float
    counter_bits: int = 32
    ticks: int = 1
    most_missing: int = 8
    limit: float = float("inf")
    bin: float = 500.0

    def __post_init__(self) -> None:
        quantities = {"period": PERIOD, "max_acceleration": ACCELERATION, "bin": PRELOAD, "limit": PRELOAD}
        if self.limit == float("inf"):
            del quantities["limit"]
        for name, within in quantities.items():
            try:
                number(getattr(self, name), within.unit, above=0.0, within=within)
            except ValueRefused as refused:
                raise ArgumentError(f"{name}: {refused}") from None
        try:
            number(self.quantum, "m", nonzero=True, within=LENGTH)
        except ValueRefused as refused:
            raise ArgumentError(f"quantum: {refused}; it is the travel of the cart per count") from None
        ranges = {"lag": (0, 200), "counter_bits": (8, 32), "ticks": (1, 2**24), "most_missing": (0, 64)}
        for name, (least, most) in ranges.items():
            value = getattr(self, name)
            if not least <= value <= most:
                raise ArgumentError(f"{name}: expected {least} to {most}, got {value!r}")
        if self.most_change * FRACTION >= 2**BITS:
            raise ArgumentError(
                f"max_acceleration: {self.max_acceleration:g} m/s2 is {self.most_change:.3g} counts per period "
                "squared, too many for the monitor: check period and quantum"
            )

    @property
    def most_change(self) -> float:
        """Largest change of the step from a period to the next, in counts."""
        return self.max_acceleration * self.period**2 / abs(self.quantum)

    @property
    def of_core(self) -> list[int]:
        """The settings of the input as an argument of `_core.Monitor`."""
        change = max(1, round(self.most_change * FRACTION))
        slack = round(NOISE * FRACTION)
        return [
            self.ticks,
            self.ticks // 20,
            self.counter_bits,
            change,
            slack,
            FRACTION,
            self.most_missing,
        ]
