"""The monitor of a machine, as Python sees it."""

from __future__ import annotations

import math
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from guideload._core import Monitor as CoreMonitor
from guideload.base.arguments import checked, require_unmasked
from guideload.base.arrays import Array, Integers
from guideload.base.errors import ArgumentError, SceneError
from guideload.life.criteria import Criteria, known_criteria
from guideload.life.equivalent_load import PLAIN_SUM
from guideload.machine.machine import Machine
from guideload.monitor.description import MonitorFile
from guideload.monitor.estimator import filter_taps
from guideload.monitor.settings import MonitorSettings

if TYPE_CHECKING:
    from typing_extensions import Self

MOST_CARRIAGES = 16


class Monitor(CoreMonitor):
    """The load monitor of a machine: from samples of its encoder to loads, one by one, as on a controller, in f64.

    machine, settings  as given
    taps               weights of the smoother, see `monitor.estimator`

    Raises SceneError for a machine that is not linear, whose rack pushes, or without carriages.
    """

    machine: Machine
    settings: MonitorSettings
    taps: Array

    def __new__(cls, machine: Machine, settings: MonitorSettings, taps: Array) -> Self:
        require_supported(machine)
        judged, roller = _rules(machine, settings)
        new = super().__new__(
            cls,
            machine.scene,
            groups=machine.links_of_carriages,
            centers=machine.carriage_places,
            judged=judged,
            period=settings.period,
            quantum=settings.travel_per_count,
            input=settings.of_core,
            taps=taps,
            lag=settings.lag,
            roller=roller,
        )
        new.machine, new.settings, new.taps = machine, settings, taps
        return new

    @classmethod
    @checked
    def from_toml(cls, file: str | PathLike[str]) -> Self:
        """The monitor of a file by `guideload monitor build`. Raises ConfigError, SceneError or ArgumentError."""
        described = MonitorFile.from_toml(file)
        machine = Machine.from_toml(Path(file).parent / described.machine)
        order, time_constant = described.smoother.order, described.smoother.time_constant
        return cls(machine, described.settings, filter_taps(order, time_constant, described.lag))

    @property
    def carriages(self) -> list[str]:
        """The names of the carriages, in the order of the loads."""
        return [carriage.name for carriage in self.machine.carriages]

    @checked
    def push(
        self, stamps: ArrayLike, counts: ArrayLike, until_limit: bool = False
    ) -> tuple[NDArray[np.uint32], Integers, Array]:
        """Take n samples, whole numbers: time stamps [ticks] and counts. Both may wrap around or be negative.

        Stamps are of a clock of 64 bits, or of one of 32 bits.

        until_limit: stop after the sample at which a carriage rises above its limit; the results end there, and the
        samples after it can be pushed next.

        Returns what became of each sample (n,): 0 used, 1 early, 2 suspect, 3 bridged, 4 counter set, 5 restarted; the
        number of the period of the loads after it (n,), -1 before the first; and the loads (n, carriages, 5): Fy, Fz
        [N], Mx, My, Mz [N m] about the carriage centre. Raises ArgumentError.
        """
        times = _whole("stamps", stamps)
        found = _whole("counts", counts).astype(np.uint32)
        if times.shape != found.shape:
            raise ArgumentError(
                f"stamps, counts: expected as many of one as of the other, got {times.size} and {found.size}"
            )
        taken, periods, loads = super().push(times, found, until_limit)
        return taken, periods, loads[: taken.size]

    def totals(self) -> dict[str, Any]:
        """Counts, extremes and sums over all samples, by name; lists have an entry per carriage.

        periods, settling         periods with loads; those of them soon after a restart, which count for no extreme
        samples, missing, ...     counts of what happened to the samples
        distance                  m
        smallest, largest         Fy, Fz, Mx, My, Mz, square of the resultant of Fy and Fz, equivalent load
        period_of_smallest, period_of_largest   the numbers of their periods
        power                     integral of the equivalent load to the exponent of the life over distance, N^p m
        histogram                 periods by bin of the equivalent load
        above_limit, limit_exceeded   periods above the limit, and number of exceedances
        life_used                 share of the rating life; None without ratings
        """
        return super().totals()


def _whole(name: str, values: ArrayLike) -> Integers:
    """Whole numbers, one row of them; those of 64 bits without a sign as their remainder."""
    require_unmasked(name, values)
    array = np.asarray(values)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        hint = "; times in s are np.round(t * ticks / period).astype(int)" if name == "stamps" else ""
        raise ArgumentError(
            f"{name}: expected a row of whole numbers, got {array.dtype} of shape {array.shape}{hint}"
        )
    return np.ascontiguousarray(array, np.int64)


Judged = tuple[tuple[Array, float, float, str], float, float, float]


def _rules(machine: Machine, settings: MonitorSettings) -> tuple[list[Judged], bool]:
    """Rule, limit, bin and capacity of each carriage, and whether they have rollers."""
    rated = {one.index: one for one in known_criteria(machine, machine.life)}
    rules = [_judged(rated.get(index), settings) for index in range(len(machine.carriages))]
    exponents = {exponent for _, exponent in rules}
    if len(exponents) > 1:
        raise SceneError(
            "monitor: the carriages have balls and rollers; a monitor has one exponent of the life"
        )
    if not exponents <= {3.0, 10.0 / 3.0}:
        raise SceneError(
            f"monitor: a monitor computes the life with the exponent 3 or 10/3, got {exponents.pop()!r}; write "
            'exponent = "10/3" for rollers, else compute the life with guideload life'
        )
    return [judged for judged, _ in rules], exponents == {10.0 / 3.0}


def _judged(criteria: Criteria | None, settings: MonitorSettings) -> tuple[Judged, float]:
    """Rule, limit, bin and capacity of a carriage, and its exponent. Without ratings: |Fy| + |Fz|, and no life."""
    limit = math.inf if settings.load_limit is None else settings.load_limit
    if criteria is None:
        return (PLAIN_SUM.of_core, limit, settings.bin, 0.0), 3.0
    for axis in criteria.rule.missing:
        raise criteria.unrated(axis, f"may carry a {axis} moment")
    capacity = float(criteria.life_under(1.0))  # of 1 N, so it is life times load^p
    return (criteria.rule.of_core, limit, settings.bin, capacity), criteria.rating.exponent


def require_supported(machine: Machine) -> None:
    """Refuse what a monitor does not compute."""
    machine.require_no_payloads("a load monitor")
    machine.require_standing_riders("a load monitor")
    if not machine.has_straight_rails:
        raise SceneError(
            "monitor: a rail is not straight, which a monitor does not know; leave its profile out"
        )
    if not 1 <= len(machine.carriages) <= MOST_CARRIAGES:
        got = len(machine.carriages)
        raise SceneError(f"monitor: expected 1 to {MOST_CARRIAGES} carriages, got {got}")
    if machine.model_level != "linear":
        raise SceneError(
            f"monitor: the machine is {machine.model_level}; contact changes would take a number of "
            "operations that has no bound. Give every carriage and link a single stiffness, such as the slope of its "
            "curve at the working load"
        )
    if machine.drive is not None and machine.drive.pressure_angle is not None:
        raise SceneError(
            "monitor: drive.pressure_angle: the push of the rack is not part of a monitor; leave it out of the file"
        )
