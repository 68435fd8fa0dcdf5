"""What a watch shows: the state of the monitor at one instant, and the recent past of the loads."""

from __future__ import annotations

import math
import threading
from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.monitor.monitor import Monitor

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
BUCKET, SECONDS = 0.02, 60.0  # s: a point of a curve, and the length of a curve


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

    Points are (number, [N per carriage]); the number counts the steps since the first sample. For several threads.
    """

    def __init__(self, period: float) -> None:
        self.per_bucket = max(1, round(BUCKET / period))
        self.step = self.per_bucket * period  # s
        self._points: deque[tuple[int, Array]] = deque(maxlen=max(100, round(SECONDS / self.step)))
        self._guard = threading.Lock()

    def add(self, periods: NDArray[np.int64], loads: Array) -> None:
        """Loads (n, carriages, 5) of some periods; -1 for those that are not known."""
        known = periods >= 0
        if not known.any():
            return
        buckets = periods[known] // self.per_bucket
        resultant = np.hypot(loads[known, :, 0], loads[known, :, 1])
        starts = np.flatnonzero(np.diff(buckets, prepend=buckets[0] - 1))
        largest = np.maximum.reduceat(resultant, starts)
        with self._guard:
            for number, values in zip(buckets[starts].tolist(), largest, strict=True):
                if self._points and self._points[-1][0] == number:
                    self._points[-1] = (number, np.maximum(self._points[-1][1], values))
                else:
                    self._points.append((number, values))

    def points(self, since: float = -1.0) -> list[tuple[float, list[float]]]:
        """Time [s] and loads [N] of each point from an instant on; the last point may still grow."""
        with self._guard:
            points = list(self._points)
        timed = ((number * self.step, values) for number, values in points)
        return [(time, values.tolist()) for time, values in timed if time >= since]
