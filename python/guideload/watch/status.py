"""What a watch shows: the state of the monitor at one instant, and the recent past of the loads."""

from __future__ import annotations

import json
import math
from collections import deque
from contextlib import suppress
from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.atomic import atomic_write
from guideload.base.errors import ReadError, RunError, WriteError
from guideload.base.finite import finite_json
from guideload.monitor.monitor import Monitor

if TYPE_CHECKING:
    from typing_extensions import Self

RESULTANT, EQUIVALENT = 5, 6  # places in the extremes of `Monitor.totals`
INPUT = (
    "samples",
    "missing",
    "early",
    "jittering",
    "stuck",
    "jumps",
    "wraps",
    "counter_set",
    "restarts",
    "lost",
    "settling",
)
BUCKET, SECONDS = 0.1, 60.0  # s: a point of a curve, and the length of a curve
NUMBER = (int, float, type(None))
# The keys of the state of a carriage, and of a machine, with their types.
CARRIAGE = {"name": str} | dict.fromkeys(
    (
        *("Fy_N", "Fz_N", "largest_resultant_N", "time_of_largest_s", "largest_equivalent_N"),
        *("limit_exceeded", "above_limit_s", "life_used"),
    ),
    NUMBER,
)
MACHINE = {"machine": str, "is_settling": bool, "carriages": list, "input": dict} | dict.fromkeys(
    ("time_s", "distance_m", "limit_N", "samples_per_s"), NUMBER
)


def status(
    monitor: Monitor, period_now: int, loads: Array, malformed: int, per_second: float
) -> dict[str, Any]:
    """The state of a monitor, as numbers that JSON knows; None where a number is not known yet.

    period_now, loads: number of the period and loads (carriages, 5) after the last sample; -1 if they are not known.
    """
    totals, period = monitor.totals(), monitor.settings.period
    limit = monitor.settings.limit
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
    return {
        "machine": monitor.machine.name,
        "time_s": period_now * period if period_now >= 0 else None,
        "distance_m": totals["distance"],
        "limit_N": limit if math.isfinite(limit) else None,
        "is_settling": monitor.is_settling,
        "samples_per_s": per_second,
        "carriages": carriages,
        "input": {name: totals[name] for name in INPUT} | {"malformed": malformed},
    }


def _known(value: float, extreme: float) -> float | None:
    """A value that belongs to an extreme, None if there is no extreme yet."""
    return float(value) if math.isfinite(extreme) else None


class Curves:
    """The largest resultant of Fy and Fz of each carriage in steps of `BUCKET` over the last `SECONDS`.

    Points are (number, [N per carriage]); the number counts the steps since the first sample.
    """

    def __init__(self, period: float) -> None:
        self.per_bucket = max(1, round(BUCKET / period))
        self.step = self.per_bucket * period  # s
        self._points: deque[tuple[int, Array]] = deque(maxlen=max(100, round(SECONDS / self.step)))

    def add(self, periods: NDArray[np.int64], loads: Array) -> None:
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

    @property
    def points(self) -> list[list[float]]:
        """Time [s] and loads [N, per carriage] of each point; the last one may still grow."""
        return [[number * self.step, *values.tolist()] for number, values in self._points]


@dataclass(frozen=True)
class WatchState:
    """What `guideload monitor watch -o` showed last: it writes this into its folder twice a second.

    written  s since 1970, UTC
    ended    whether the watch has ended in order; one that is killed only ceases to write
    status   the state of the monitor: machine, time_s, distance_m, limit_N, is_settling, samples_per_s, carriages
             (for each its name, loads now, largest loads, limit, life) and input (what happened to the samples)
    points   of the last minute: time [s] since the first sample, and for each carriage the largest resultant of Fy and
             Fz [N] since the point before
    """

    FILE: ClassVar[str] = (
        "_state.json"  # readers of a folder of Parquet files leave out names that begin with _
    )

    written: float
    ended: bool
    status: dict[str, Any]
    points: list[list[float]]

    @classmethod
    @checked
    def read(cls, folder: str | PathLike[str]) -> Self:
        """The state in the folder of a watch. Raises ReadError if there is none, or if it is damaged."""
        path = Path(folder) / cls.FILE
        try:
            found = cls(**json.loads(path.read_text(encoding="utf-8")))
        except OSError as error:
            raise ReadError(
                f"{path}: cannot be read ({error.strerror}): expected the folder of a watch"
            ) from None
        except (ValueError, TypeError) as error:
            raise ReadError(f"{path}: expected the state of a watch ({error})") from None
        if (wrong := found._wrong) is not None:
            raise ReadError(f"{path}: expected the state of a watch, with a valid {wrong}")
        return found

    def write(self, folder: Path) -> None:
        """Write the state. That it cannot be written ends no watch: the next one comes soon."""
        with suppress(WriteError, RunError), atomic_write(folder / self.FILE) as draft:
            draft.write_text(finite_json(asdict(self)), encoding="utf-8")

    @property
    def _wrong(self) -> str | None:
        """The first part that is not of its type."""
        status = self.status if isinstance(self.status, dict) else {}
        parts: list[tuple[str, dict[str, Any], Any]] = [
            ("status", MACHINE, status),
            ("input", dict.fromkeys((*INPUT, "malformed"), int), status.get("input")),
        ]
        carriages = status.get("carriages")
        found = status.get("carriages")
        carriages = found if isinstance(found, list) and found else [None]
        parts += [("carriage", CARRIAGE, one) for one in carriages]
        for name, keys, one in parts:
            if not isinstance(one, dict) or set(one) != set(keys):
                return name
            for key, kind in keys.items():
                if not isinstance(one[key], kind):
                    return key
        width = 1 + len(carriages)
        numbers = isinstance(self.points, list) and all(
            isinstance(point, list) and len(point) == width and all(isinstance(x, int | float) for x in point)
            for point in self.points
        )
        return None if numbers and isinstance(self.written, int | float) else "points"
