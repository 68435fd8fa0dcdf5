"""The largest loads of the carriages: at any time, from the core, or at the reported instants of a result."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array, read_only
from guideload.base.quantities import Quantities, QuantityRow
from guideload.machine.machine import Machine
from guideload.motion.uncertainty import COVER
from guideload.simulation.run import AXES, Run

RESULTANT = 6  # of Fy and Fz, among the columns of `Peaks`
TIE = 1e-9  # relative difference of the peaks of symmetric carriages, of which the first counts: rounding
MOST_STEPS = 2_000_000  # of a run that is made again for its extremes: some seconds


@dataclass(frozen=True, eq=False)
class Peaks:
    """Extremes of the loads of the carriages, and their times [s]; each array is (carriage, 8).

    Columns: Fx Fy Fz [N], Mx My Mz [N m] about the carriage centre, resultant of Fy and Fz [N], magnitude of
    the moment [N m]. The smallest magnitudes are those at the samples.
    """

    carriages: tuple[str, ...]
    smallest: Array
    largest: Array
    time_of_smallest: Array
    time_of_largest: Array

    @classmethod
    def of(cls, machine: Machine, arrays: Sequence[Array]) -> Peaks:
        """The arrays in their order here, with the names of the carriages."""
        return cls(tuple(carriage.name for carriage in machine.carriages), *arrays)


@dataclass(frozen=True)
class LargestLoad:
    """The largest resultant of Fy and Fz of a carriage; of a machine without carriages the largest load of a link."""

    size: float  # N
    time: float  # s
    instant: int  # index of the reported instant, of those beside the time the one with the larger load
    index: int  # of the carriage or link
    name: str

    @classmethod
    def of(
        cls, names: Sequence[str], time: Array, sizes: Array, known: tuple[Array, Array] | None = None
    ) -> LargestLoad:
        """From the loads (time, name) [N]; known: peaks [N] at any time and their times [s], each (name,)."""
        peaks, times = known or (sizes.max(axis=0), time[sizes.argmax(axis=0)])
        index = int(np.argmax(peaks >= (1.0 - TIE) * peaks.max()))
        at = float(times[index])
        first, end = max(int(np.searchsorted(time, at)) - 1, 0), int(np.searchsorted(time, at, "right")) + 1
        instant = first + int(sizes[first:end, index].argmax())
        return cls(float(peaks[index]), at, instant, index, names[index])


def resultants(loads: Array) -> tuple[Array, Array]:
    """Resultant of Fy and Fz [N] and magnitude of the moment [N m] of loads (..., 6)."""
    return np.hypot(loads[..., 1], loads[..., 2]), np.linalg.norm(loads[..., 3:], axis=-1)


def peaks_of(run: Run) -> Peaks:
    """The extremes of a run, at any time if they are known, else at the reported instants."""
    extremes = run.extremes()
    if extremes is not None:
        return Peaks.of(run.machine, extremes[:4])
    loads = run.carriage_loads()
    values = np.concatenate([loads, np.stack(resultants(loads), axis=2)], axis=2)
    low, high = values.argmin(axis=0), values.argmax(axis=0)
    arrays = values.min(axis=0), values.max(axis=0), run.time[low], run.time[high]
    return Peaks.of(run.machine, arrays)


def peak_rows(run: Run) -> Iterator[QuantityRow]:
    """The quantities of the largest loads at any time, if they are known and a second run is short."""
    if run.solution.steps + run.solution.rejected > MOST_STEPS:
        return
    extremes = run.extremes(dynamic=True)
    if extremes is None:
        return
    smallest, largest, _, times, _ = extremes
    count = len(run.machine.carriages)
    of, along, when = ("carriage",), ("carriage", "axis"), "at any time"
    size = np.maximum(np.abs(smallest), np.abs(largest))[:count]
    text = f"largest magnitude of the load of the carriage {when}"
    yield "peak_force", along, size[:, :3], "N", text
    text = f"largest magnitude of the moment about the carriage centre {when}"
    yield "peak_moment", along, size[:, 3:6], "N m", text
    yield "peak_resultant", of, largest[:count, RESULTANT], "N", f"largest resultant load in y and z {when}"
    yield "time_of_peak", of, times[:count, RESULTANT], "s", "time of the largest resultant load"
    text = f"largest resultant in y and z of the load less the static one {when}"
    yield "peak_dynamic_resultant", of, largest[count:, RESULTANT], "N", text
    text = f"largest magnitude of the moment less the static one {when}"
    yield "peak_dynamic_moment", of, largest[count:, 7], "N m", text


def peak_columns(data: Quantities) -> dict[str, Array]:
    """The columns of `Result.peaks`, each (carriage,)."""
    resultant, static = data["resultant"], data["static_force"]
    at, peak = resultant.argmax(axis=0), resultant.max(axis=0)
    columns = {"peak_resultant_N": peak, "time_of_peak_s": data["time"][at]}
    columns["static_resultant_N"] = np.hypot(static[:, 1], static[:, 2])
    if "peak_resultant" in data:
        columns |= {"peak_resultant_N": data["peak_resultant"], "time_of_peak_s": data["time_of_peak"]}
        dynamic, dynamic_moment = data["peak_dynamic_resultant"], data["peak_dynamic_moment"]
        force, moment = data["peak_force"], data["peak_moment"]
    else:
        beyond = np.concatenate([data["force"] - static, data["moment"] - data["static_moment"]], axis=2)
        dynamic, dynamic_moment = (each.max(axis=0) for each in resultants(beyond))
        force, moment = np.abs(data["force"]).max(axis=0), np.abs(data["moment"]).max(axis=0)
    columns |= {"dynamic_resultant_N": dynamic, "dynamic_moment_Nm": dynamic_moment}
    columns |= {f"peak_F{axis}_N": force[:, i] for i, axis in enumerate(AXES)}
    columns |= {f"peak_M{axis}_Nm": moment[:, i] for i, axis in enumerate(AXES)}
    if "resultant_sd" in data:
        noise = 100.0 * COVER * data["resultant_sd"][at, np.arange(at.size)]
        # The band is that of the reported instants, between which the load may rise a little more.
        rise = columns["peak_resultant_N"] - peak
        columns["peak_lower_N"] = data["peak_resultant_lower"] + rise
        columns["peak_upper_N"] = data["peak_resultant_upper"] + rise
        columns["noise_share_percent"] = np.divide(noise, peak, out=np.zeros_like(peak), where=peak > 0.0)
    return {name: read_only(column) for name, column in columns.items()}
