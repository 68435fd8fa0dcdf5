"""The result of a run: arrays with labels and units, peaks, audit, and files that read back."""

from __future__ import annotations

from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from guideload.audit.audit import Audit
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.base.quantities import Quantities
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.simulation import result_files
from guideload.simulation.bands import bands_of, with_bands
from guideload.simulation.peaks import peak_columns
from guideload.simulation.run import Run
from guideload.simulation.run_quantities import quantities_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class Result:
    """The loads of one run.

    `machine` is the machine, `method` the method that solved it and `reason` why it was taken, `modes` its natural
    modes, `audit` the figures and warnings that judge the result, `carriage_loads` the plain array, and `data` an
    xarray.Dataset with all quantities over time, carriage, rail, link, dof and axis, each with its units:
    force, moment (of the carriages on their guides, moments about the carriage centres), their elastic and
    damping parts, resultant (y-z), link_load, rail_force, rail_moment, reaction (of the held dofs; held x:
    the drive force), displacement, velocity, acceleration (of L in the carriage frame), and static values.
    `quantities` holds the same as plain arrays and needs no xarray.
    A load is the force that the body exerts on its guide: weight makes y negative.
    Of a motion that has an uncertainty, `data` also holds the standard deviations force_sd, moment_sd,
    resultant_sd, moment_magnitude_sd, link_load_sd and cart_acceleration_sd, and the 95 % credible bands of the
    peaks, peak_resultant_lower and peak_resultant_upper; `data.attrs["band_method"]` says how they were computed.
    """

    _run: Run

    def __init__(self, machine: Machine, data: xr.Dataset) -> None:
        self.machine = machine
        self.method, self.reason = str(data.attrs["method"]), str(data.attrs["method_reason"])
        arrays = Quantities.of_dataset(data)
        self.__dict__ |= {"data": data, "quantities": arrays, "_estimate": arrays}

    @classmethod
    def of_run(cls, run: Run) -> Result:
        """The result of a run; its arrays are computed when first used."""
        result = cls.__new__(cls)
        result.machine, result.method, result.reason = run.machine, run.method, run.reason
        result._run = run
        result.__dict__["carriage_loads"] = run.carriage_loads()
        return result

    def __reduce__(self) -> tuple[type[Result], tuple[Machine, xr.Dataset]]:
        return Result, (self.machine, self.data)

    @cached_property
    def data(self) -> xr.Dataset:
        """All quantities with labels and units."""
        return self.quantities.dataset()

    @cached_property
    def quantities(self) -> Quantities:
        """All quantities as plain arrays, with the names of their dimensions and units."""
        bands = bands_of(self._run, self.carriage_loads)
        return self._estimate if bands is None else with_bands(self._estimate, bands)

    @cached_property
    def _estimate(self) -> Quantities:
        """All but the credible bands, which cost more than the run and which the audit does not need."""
        return quantities_of(self._run, self.carriage_loads)

    @cached_property
    def carriage_loads(self) -> Array:
        """(time, carriage, 6) force [N] and moment about the carriage centre [N m]."""
        return np.concatenate([self._estimate["force"], self._estimate["moment"]], axis=2)

    @cached_property
    def modes(self) -> Modes:
        """The natural modes of the machine."""
        return Modes.of(self.machine)

    @cached_property
    def audit(self) -> Audit:
        """Figures and warnings that judge the result: whether its model, samples and method suit the scene.

        Raises ArgumentError if the result reports no instant.
        """
        self._require_instants()
        return Audit.of(self.machine, self._estimate, self.modes)

    def peaks(self) -> pd.DataFrame:
        """A row per carriage: peak resultant (y-z), when, its static and dynamic part, and peak components.

        Columns end in their unit. Peaks are largest magnitudes over the reported instants; a dynamic part is
        the magnitude of load less static load. Raises ArgumentError if the result reports no instant.

        If the motion has an uncertainty: peak_lower_N and peak_upper_N, the 95 % credible band of the largest
        resultant under the true motion, at whatever time. The estimate is smoother than the true motion, so its peak
        may lie below the band. noise_share_percent: 1.96 standard deviations of the resultant at time_of_peak_s, over
        the peak.
        """
        import pandas as pd

        index = pd.Index(self.quantities["carriage"], name="carriage")
        return pd.DataFrame(self.peak_columns, index=index)

    @cached_property
    def peak_columns(self) -> dict[str, Array]:
        """The columns of `peaks` as plain arrays (carriage,)."""
        self._require_instants()
        return peak_columns(self.quantities)

    def _require_instants(self) -> None:
        if not self._estimate["time"].size:
            raise ArgumentError("times: the result reports no instant, so it has no peaks and no audit")

    def to_netcdf(self, path: str | PathLike[str]) -> None:
        """Write all quantities as netCDF 4."""
        result_files.write_netcdf(self._to_write(), path)

    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Write all quantities as Parquet: a column per history and label, the rest in the metadata."""
        result_files.write_parquet(self._to_write(), path)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the histories as CSV, and all other quantities as JSON beside it (same name, .json)."""
        result_files.write_csv(self._to_write(), path)

    def _to_write(self) -> Quantities:
        """All quantities; those of `data` if it exists, because the user may have changed it."""
        return Quantities.of_dataset(self.data) if "data" in self.__dict__ else self.quantities

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Result:
        """Read a result back from a file of `to_netcdf`, `to_parquet` or `to_csv`, by the ending of its name.

        Raises TraceError if the file is none of these.
        """
        return cls(*result_files.read(path))
