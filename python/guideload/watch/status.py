"""What a watch shows: the state of the monitor at one instant, and the recent past of the loads."""

from __future__ import annotations

import math
from collections import deque
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from guideload.base.arguments import checked
from guideload.base.arrays import Array, Integers
from guideload.base.atomic import atomic_write
from guideload.base.errors import ReadError, RunError, WriteError
from guideload.base.finite import finite_json
from guideload.monitor.monitor import Monitor

if TYPE_CHECKING:
    from typing_extensions import Self

RESULTANT, EQUIVALENT = 5, 6  # places in the extremes of `Monitor.totals`
BUCKET, SECONDS = 0.1, 60.0  # s: a point of a curve, and the length of a curve


class _State(BaseModel):
    model_config = ConfigDict(strict=True, frozen=True)  # no text is taken for a number


class InputState(_State):
    """What happened to the samples of a watch, and the number of malformed lines."""

    samples: int
    missing: int
    early: int
    jittering: int
    stuck: int
    jumps: int
    wraps: int
    counter_set: int
    restarts: int
    lost: int
    settling: int
    malformed: int


class CarriageState(_State):
    """Loads of a carriage after the last sample and since the start; None where a number is not known yet."""

    name: str
    Fy_N: float | None
    Fz_N: float | None
    largest_resultant_N: float | None
    time_of_largest_s: float | None
    largest_equivalent_N: float | None
    limit_exceeded: int
    above_limit_s: float
    life_used: float | None


class MonitorState(_State):
    """The state of a monitor at one instant; None where a number is not known yet."""

    machine: str
    time_s: float | None
    distance_m: float
    limit_N: float | None
    is_settling: bool
    samples_per_s: float
    carriages: list[CarriageState] = Field(min_length=1)
    input: InputState


def status(
    monitor: Monitor, period_now: int, loads: Array, malformed: int, per_second: float
) -> dict[str, Any]:
    """The state of a monitor, as numbers that JSON knows; None where a number is not known yet.

    period_now, loads: number of the period and loads (carriages, 5) after the last sample; -1 if they are not known.
    """
    totals, period = monitor.totals(), monitor.settings.period
    carriages = []
    for index, name in enumerate(monitor.carriages):
        largest, at = totals["largest"][index], totals["period_of_largest"][index]
        force = loads[index, :2].tolist() if period_now >= 0 else (None, None)
        carriages.append(
            {
                "name": name,
                "Fy_N": force[0],
                "Fz_N": force[1],
                "largest_resultant_N": _known(math.sqrt(max(0.0, largest[RESULTANT])), largest[RESULTANT]),
                "time_of_largest_s": _known(at[RESULTANT] * period, largest[RESULTANT]),
                "largest_equivalent_N": _known(largest[EQUIVALENT], largest[EQUIVALENT]),
                "limit_exceeded": totals["limit_exceeded"][index],
                "above_limit_s": totals["above_limit"][index] * period,
                "life_used": totals["life_used"][index],
            }
        )
    counts = {**totals, "malformed": malformed}
    return {
        "machine": monitor.machine.name,
        "time_s": period_now * period if period_now >= 0 else None,
        "distance_m": totals["distance"],
        "limit_N": monitor.settings.load_limit,
        "is_settling": monitor.is_settling,
        "samples_per_s": per_second,
        "carriages": carriages,
        "input": {name: counts[name] for name in InputState.model_fields},
    }


def _known(value: float, extreme: float) -> float | None:
    """A value that belongs to an extreme, None if there is no extreme yet."""
    return float(value) if math.isfinite(extreme) else None


class LoadCurves:
    """The largest resultant of Fy and Fz of each carriage in steps of `BUCKET` over the last `SECONDS`.

    Points are (number, [N per carriage]); the number counts the steps since the first sample.
    """

    def __init__(self, period: float) -> None:
        self.per_bucket = max(1, round(BUCKET / period))
        self.step = self.per_bucket * period  # s
        self._points: deque[tuple[int, Array]] = deque()

    def add(self, periods: Integers, loads: Array) -> None:
        """Loads (n, carriages, 5) of some periods; -1 for those that are not known."""
        known = periods >= 0
        if not known.any():
            return
        buckets = periods[known] // self.per_bucket
        resultant = np.hypot(loads[known, :, 0], loads[known, :, 1])
        starts = np.flatnonzero(np.diff(buckets, prepend=buckets[0] - 1))
        largest = np.maximum.reduceat(resultant, starts)
        for number, values in zip(buckets[starts].tolist(), largest, strict=True):
            if self._points and self._points[-1][0] == number:
                self._points[-1] = (number, np.maximum(self._points[-1][1], values))
            else:
                self._points.append((number, values))
        while (self._points[-1][0] - self._points[0][0]) * self.step >= SECONDS:
            self._points.popleft()

    @property
    def points(self) -> list[list[float]]:
        """Time [s] and loads [N, per carriage] of each point; the last one may still grow."""
        return [[number * self.step, *values.tolist()] for number, values in self._points]


class WatchState(_State):
    """What `guideload monitor watch -o` showed last: it writes this into its folder twice a second.

    written  s since 1970, UTC
    ended    whether the watch has ended; a killed watch leaves false, and an old `written`
    status   the state of the monitor, with the keys of `MonitorState`
    points   of the last minute: time [s] since the first sample, and for each carriage the largest resultant of Fy and
             Fz [N] since the point before
    """

    # Readers of a folder of Parquet files leave out names that begin with _.
    FILE: ClassVar[str] = "_state.json"

    written: float
    ended: bool
    status: Annotated[dict[str, Any], AfterValidator(lambda one: MonitorState(**one).model_dump())]
    points: list[list[float]]

    @model_validator(mode="after")
    def _same_carriages(self) -> Self:
        width = 1 + len(self.status["carriages"])
        if any(len(point) != width for point in self.points):
            raise ValueError(f"points: expected {width} numbers each")
        return self

    @classmethod
    @checked
    def read(cls, folder: str | PathLike[str]) -> Self:
        """The state in the folder of a watch. Raises ReadError if there is none, or if it is damaged."""
        path = Path(folder) / cls.FILE
        try:
            return cls.model_validate_json(path.read_bytes())
        except OSError as error:
            raise ReadError(
                f"{path}: cannot be read ({error.strerror}): expected the folder of a watch"
            ) from None
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            problem = f"{place}: {first['msg']}" if place else first["msg"].removeprefix("Value error, ")
            raise ReadError(f"{path}: expected the state of a watch ({problem})") from None

    def write(self, folder: Path) -> None:
        """Write the state. A failed write is ignored; the next follows in half a second."""
        with suppress(WriteError, RunError), atomic_write(folder / self.FILE) as draft:
            draft.write_text(finite_json(self.model_dump()), encoding="utf-8")
