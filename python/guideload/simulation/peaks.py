"""The largest loads of the carriages, from the core without histories, or from the histories of a result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array
from guideload.base.quantities import Quantities
from guideload.motion.uncertainty import COVER
from guideload.simulation.run import AXES, Run


@dataclass(frozen=True, eq=False)
class Peaks:
    """Extremes of the loads of the carriages, and their times [s]; each array is (carriage, 8).

    Columns: Fx Fy Fz [N], Mx My Mz [N m] about the carriage centre, resultant of Fy and Fz [N], magnitude of
    the moment [N m].
    """

    carriages: tuple[str, ...]
    smallest: Array
    largest: Array
    time_of_smallest: Array
    time_of_largest: Array


def peaks_of(run: Run) -> Peaks:
    """The extremes of a run, from the histories of its loads."""
    loads = run.carriage_loads()
    across, moment = np.hypot(loads[:, :, 1], loads[:, :, 2]), np.linalg.norm(loads[:, :, 3:], axis=2)
    values = np.concatenate([loads, across[:, :, None], moment[:, :, None]], axis=2)
    low, high = values.argmin(axis=0), values.argmax(axis=0)
    names = tuple(carriage.name for carriage in run.machine.carriages)
    return Peaks(names, values.min(axis=0), values.max(axis=0), run.time[low], run.time[high])


def peak_columns(data: Quantities) -> dict[str, Array]:
    """The columns of `Result.peaks`, each (carriage,)."""
    resultant, static = data["resultant"], data["static_force"]
    at, peak = resultant.argmax(axis=0), resultant.max(axis=0)
    force, moment = np.abs(data["force"]).max(axis=0), np.abs(data["moment"]).max(axis=0)
    dynamic, dynamic_moment = data["force"] - static, data["moment"] - data["static_moment"]
    columns = {
        "peak_resultant_N": peak,
        "time_of_peak_s": data["time"][at],
        "static_resultant_N": np.hypot(static[:, 1], static[:, 2]),
        "dynamic_resultant_N": np.hypot(dynamic[:, :, 1], dynamic[:, :, 2]).max(axis=0),
        "dynamic_moment_Nm": np.linalg.norm(dynamic_moment, axis=2).max(axis=0),
    }
    columns |= {f"peak_F{axis}_N": force[:, i] for i, axis in enumerate(AXES)}
    columns |= {f"peak_M{axis}_Nm": moment[:, i] for i, axis in enumerate(AXES)}
    if "resultant_sd" in data:
        noise = 100.0 * COVER * data["resultant_sd"][at, np.arange(at.size)]
        columns["peak_lower_N"] = data["peak_resultant_lower"]
        columns["peak_upper_N"] = data["peak_resultant_upper"]
        columns["noise_share_percent"] = np.divide(noise, peak, out=np.zeros_like(peak), where=peak > 0.0)
    return columns
