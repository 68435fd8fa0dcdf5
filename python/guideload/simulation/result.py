"""What a run gives: labelled arrays with units, peaks, and files that read back."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.simulation.run import AXES, Run

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from guideload.audit.audit import Audit


@dataclass(frozen=True, eq=False)
class Peaks:
    """Extremes of the loads of the carriages, each array (carriage, 8), and their times [s].

    Columns: Fx Fy Fz [N], Mx My Mz [N m] about the carriage centre, resultant of Fy and Fz [N], magnitude of
    the moment [N m].
    """

    carriages: tuple[str, ...]
    smallest: Array
    largest: Array
    time_of_smallest: Array
    time_of_largest: Array


class Result:
    """The loads of one run.

    `machine` is the machine, `method` what solved it and `reason` why, `modes` its natural modes, `audit` what
    the result is worth, `carriage_loads` the plain array, and `data` an xarray.Dataset with all quantities over
    time, carriage, rail, link, dof and axis, each with its units:
    force, moment (of the carriages on their guides, moments about the carriage centres), their elastic and
    damping parts, resultant (y-z), link_load, rail_force, rail_moment, reaction (of the held dofs; held x:
    the drive force), displacement, velocity, acceleration (of L in the carriage frame), and static values.
    A load is the force that the body exerts on its guide: weight makes y negative.
    Of a motion that has an uncertainty, `data` also holds the standard deviations force_sd, moment_sd,
    resultant_sd, moment_magnitude_sd, link_load_sd and cart_acceleration_sd, and the 95 % bands of the peaks
    peak_resultant_lower and peak_resultant_upper; `data.attrs["band_method"]` tells how they were found.
    """

    def __init__(self, machine: Machine, data: xr.Dataset) -> None:
        self.machine = machine
        self.method, self.reason = str(data.attrs["method"]), str(data.attrs["method_reason"])
        self.__dict__["data"] = self.__dict__["_estimate"] = data

    @classmethod
    def of_run(cls, run: Run) -> Result:
        """The result of a run; its labelled arrays are made when first asked for."""
        result = cls.__new__(cls)
        result.machine, result.method, result.reason = run.machine, run.method, run.reason
        result._run = run
        result.__dict__["carriage_loads"] = run.carriage_loads()
        return result

    _run: Run

    def __reduce__(self) -> tuple[type[Result], tuple[Machine, xr.Dataset]]:
        return Result, (self.machine, self.data)

    @cached_property
    def data(self) -> xr.Dataset:
        """All quantities with labels and units."""
        from guideload.simulation.bands import bands_of, with_bands

        with ThreadPoolExecutor(1) as beside:  # while xarray is imported
            found = beside.submit(bands_of, self._run, self.carriage_loads)
            estimate = self._estimate
        bands = found.result()
        return estimate if bands is None else with_bands(estimate, bands)

    @cached_property
    def _estimate(self) -> xr.Dataset:
        """All but the bands, which cost more than the run."""
        from guideload.simulation.dataset import (
            dataset,  # xarray takes longer to import than most runs to compute
        )

        return dataset(self._run, self.carriage_loads)

    @cached_property
    def carriage_loads(self) -> Array:
        """(time, carriage, 6) force [N] and moment about the carriage centre [N m]."""
        return np.concatenate([self._estimate["force"].values, self._estimate["moment"].values], axis=2)

    @cached_property
    def modes(self) -> Modes:
        """The natural modes of the machine."""
        return Modes.of(self.machine)

    @cached_property
    def audit(self) -> Audit:
        """Whether the model was no more than the scene needs, and no less: figures and warnings.

        Raises ArgumentError if the result reports no instant.
        """
        from guideload.audit.audit import Audit  # reads the labelled arrays

        self._require_instants()
        return Audit.of(self.machine, self._estimate, self.modes)

    def peaks(self) -> pd.DataFrame:
        """A row per carriage: peak resultant (y-z), when, its static and dynamic part, and peak components.

        Columns end in their unit. Peaks are largest magnitudes over the reported instants; a dynamic part is
        the magnitude of load less static load. Raises ArgumentError if the result reports no instant.

        If the motion has an uncertainty: peak_lower_N and peak_upper_N, the 95 % band of the true motion's peak,
        whenever that is; it tends to lie higher than the estimate's where noise is large, which the estimate has not.
        noise_share_percent: 1.96 standard deviations of the resultant at time_of_peak_s, over the peak.
        """
        import pandas as pd

        self._require_instants()
        data = self.data
        resultant = data["resultant"].values
        static = np.hypot(*data["static_force"].values[:, 1:].T)
        at = resultant.argmax(axis=0)
        peak = resultant.max(axis=0)
        force, moment = np.abs(data["force"].values).max(axis=0), np.abs(data["moment"].values).max(axis=0)
        dynamic = data["force"].values - data["static_force"].values
        dynamic_moment = data["moment"].values - data["static_moment"].values
        table = {
            "peak_resultant_N": peak,
            "time_of_peak_s": data["time"].values[at],
            "static_resultant_N": static,
            "dynamic_resultant_N": np.hypot(dynamic[:, :, 1], dynamic[:, :, 2]).max(axis=0),
            "dynamic_moment_Nm": np.linalg.norm(dynamic_moment, axis=2).max(axis=0),
        }
        table |= {f"peak_F{axis}_N": force[:, i] for i, axis in enumerate(AXES)}
        table |= {f"peak_M{axis}_Nm": moment[:, i] for i, axis in enumerate(AXES)}
        if "resultant_sd" in data:
            from guideload.motion.uncertainty import COVER

            noise = 100.0 * COVER * data["resultant_sd"].values[at, np.arange(at.size)]
            table["peak_lower_N"] = data["peak_resultant_lower"].values
            table["peak_upper_N"] = data["peak_resultant_upper"].values
            table["noise_share_percent"] = np.divide(noise, peak, out=np.zeros_like(peak), where=peak > 0.0)
        return pd.DataFrame(table, index=pd.Index(data["carriage"].values, name="carriage"))

    def _require_instants(self) -> None:
        if not self._estimate.sizes["time"]:
            raise ArgumentError("times: the result reports no instant, so it has no peaks and no audit")

    def to_netcdf(self, path: str | PathLike[str]) -> None:
        """Write all of it as netCDF 4."""
        from guideload.simulation import files

        files.write_netcdf(self.data, path)

    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Write all of it as Parquet: a column per history and label, the rest in the metadata."""
        from guideload.simulation import files

        files.write_parquet(self.data, path)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the histories as CSV, and what is not a history as JSON beside it (same name, .json)."""
        from guideload.simulation import files

        files.write_csv(self.data, path)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Result:
        """Read a result back from what `to_netcdf`, `to_parquet` or `to_csv` wrote, told by its ending.

        Raises TraceError if the file is none of these.
        """
        from guideload.simulation import files

        return cls(*files.read(path))
