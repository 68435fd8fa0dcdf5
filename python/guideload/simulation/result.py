"""The result of a run: arrays with labels and units, peaks, audit, and files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from guideload.audit.audit import Audit
from guideload.audit.histories import Histories
from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, DoubtfulResult, GuideloadError, ValueRefused, shown
from guideload.base.finite import require_finite
from guideload.base.notebook import as_html
from guideload.base.number_text import counted, digits
from guideload.base.quantities import Quantities
from guideload.base.units import quantity
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.motion import Motion
from guideload.simulation import result_files
from guideload.simulation.bands import bands_of, drawn_loads, with_bands
from guideload.simulation.peaks import LargestLoad, peak_columns, resultants
from guideload.simulation.point_motion import Settling, point_columns, settling_of
from guideload.simulation.run import HISTORIES, Extremes, Run
from guideload.simulation.run_quantities import quantities_of
from guideload.simulation.start import StartState

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from guideload._core import Rule


class Result:
    """The loads of one run.

    machine         the machine
    method, reason  the integration method, and why it was chosen
    modes           the natural modes of the machine
    audit           figures and warnings that judge the result
    carriage_loads  (time, carriage, 6) force [N] and moment about the carriage centre [N m]
    data            xarray.Dataset of all quantities with labels and units
    quantities      the same quantities as plain arrays, without xarray

    Quantities: force, moment (loads of the carriages, moments about their centres), with elastic and damping parts;
    resultant (y-z), link_load, rail_force, rail_moment, reaction (of the held dofs; of x: the drive force);
    displacement, velocity, acceleration (of L in the travelling frame); of each point of [[points]] point_displacement,
    point_velocity, point_acceleration (in the travelling frame) and point_absolute_acceleration (with that of the
    cart), along the axes of the machine; and static values.
    A load is the force that the body exerts on its guide: weight makes y negative.
    If riders move: rider_position, rider_velocity and rider_acceleration along their directions, rider_force of their
    drives, and rider_wrench, which their motion adds to the forces on the body.
    Instants: the samples of the motion, and more between them where loads vibrate there; see `simulate`.
    `data.attrs["instants"]` says which. If instants were given: motion_acceleration and motion_wrench at motion_time,
    the samples of the motion, up to 200 000, so that a result that is read from a file can be judged.
    If the motion has an uncertainty: standard deviations force_sd, moment_sd, resultant_sd, moment_magnitude_sd,
    link_load_sd and cart_acceleration_sd, and the 95 % credible band of the peaks, peak_resultant_lower to
    peak_resultant_upper; `data.attrs["band_method"]` describes their computation.

    A result from a file, a pickle, a deepcopy or another process has all quantities, but not its run: `drawn_loads`
    then gives none, and `Life.band` is None. A shallow copy keeps the run.
    """

    _run: Run | None = None  # None: the result was read from a file

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

    def __copy__(self) -> Result:
        """A copy with the same run: it knows whatever the result knows."""
        copied = type(self).__new__(type(self))
        copied.__dict__ |= self.__dict__
        return copied

    def __reduce__(self) -> tuple[type[Result], tuple[Machine, xr.Dataset]]:
        return Result, (self.machine, self.data)

    @cached_property
    def data(self) -> xr.Dataset:
        """All quantities with labels and units."""
        return self.quantities.dataset()

    @cached_property
    def quantities(self) -> Quantities:
        """All quantities as plain arrays, with the names of their dimensions and units."""
        assert self._run is not None
        bands = bands_of(self._run, self.carriage_loads)
        return self._estimate if bands is None else with_bands(self._estimate, bands)

    @cached_property
    def _estimate(self) -> Quantities:
        """All quantities but the credible bands, which take longer than the run and are not needed by the audit."""
        assert self._run is not None
        return quantities_of(self._run, self.carriage_loads)

    @cached_property
    def carriage_loads(self) -> Array:
        """(time, carriage, 6) force [N] and moment about the carriage centre [N m]."""
        loads = np.concatenate([self._estimate["force"], self._estimate["moment"]], axis=2)
        loads.setflags(write=False)
        return loads

    @checked
    def history(self, name: str) -> Array | None:
        """A history of the cart, its drive or of L, without computing the other quantities; None if the run has none.

        Names: time, cart_position, cart_velocity, cart_acceleration, reaction, link_load, displacement, velocity,
        acceleration, as in `quantities`. Raises ArgumentError for others.
        """
        if name not in HISTORIES:
            raise ArgumentError(
                f"name: expected one of {', '.join(HISTORIES)}, got {shown(name)}; `quantities` has all others"
            )
        return self._estimate.get(name) if self._run is None else self._run.history(name)

    def extremes(self, rules: Sequence[Rule | None]) -> Extremes | None:
        """Smallest and largest loads of the carriages at any time, and their largest equivalent loads by these rules.

        rules: None where a carriage has no rule. The run is repeated. Returns None if instants were given, or if rails
        are not straight.
        """
        return None if self.whole_run is None else self.whole_run.extremes(rules=rules)

    @cached_property
    def whole_run(self) -> Run | None:
        """The run, if it can be computed at other instants too; else None."""
        run = self._run or _stored_run(self.machine, self._estimate)
        return run if run is not None and run.times is None and run.straightness_loads is None else None

    @checked
    def drawn_loads(self, count: int) -> Iterator[Array]:
        """Loads (time, carriage, 6) [N, N m] under `count` motions drawn from the uncertainty of the trace.

        Yields nothing without uncertainty, and nothing for a result without its run: of a file, a pickle or a deepcopy.
        """
        return iter(()) if self._run is None else drawn_loads(self._run, count)

    @cached_property
    def modes(self) -> Modes:
        """The natural modes of the machine."""
        return Modes.of(self.machine)

    @cached_property
    def audit(self) -> Audit:
        """Figures and warnings that judge model, samples and method of the result.

        Raises ArgumentError if the result reports no instant.
        """
        self.require_instants()
        again = None if self._run is None else self._run.link_loads_again
        return Audit.of(self.machine, self._estimate, self.modes, again)

    def raise_if_doubtful(self) -> None:
        """Raise DoubtfulResult if the result contradicts itself or cannot be predicted; see `Audit.doubts`."""
        if self.audit.doubts:
            raise DoubtfulResult(" ".join(self.audit.doubts))

    def __repr__(self) -> str:
        """Machine, method, largest load, and the doubts and warnings of the audit, which is computed if need be."""
        if not self._estimate["time"].size:
            return f"Result({self.machine.name!r}, method={self.method!r}, no instants)"
        try:
            grave = tuple(text for text in self.audit.warnings if text.startswith(("Doubtful", "Not judged")))
            doubts, warnings = grave, counted(len(self.audit.warnings), "warning")
            load = self.largest_load()
        except GuideloadError as error:  # a representation never fails
            doubts, warnings = (f"Doubtful: the audit failed: {error}",), ""
            load = self.largest_load(between=False)
        head = f"Result({self.machine.name!r}, method={self.method!r}, largest load {digits(load.size, 4)} N"
        return f"{head}, {' '.join(doubts) or warnings})"

    def _repr_html_(self) -> str:
        return as_html(repr(self), self.peaks())

    @checked
    def largest_load(self, between: bool = True) -> LargestLoad:
        """The largest load of the carriages, or of a machine without carriages of the links, with its place and time.

        between: between the reported instants too, where it is known as in `peaks`; takes about as long as the run.
        Raises ArgumentError if the result reports no instant.
        """
        self.require_instants()
        carriages, time, known = self.machine.carriages, self.history("time"), None
        assert time is not None
        sizes = resultants(self.carriage_loads)[0] if carriages else np.abs(self._estimate["link_load"])
        if between and carriages and "peak_resultant" in self._estimate:
            known = self._estimate["peak_resultant"], self._estimate["time_of_peak"]
        return LargestLoad.of([one.name for one in carriages or self.machine.links], time, sizes, known)

    def peaks(self) -> pd.DataFrame:
        """A row per carriage: peak resultant (y-z) and its time, static and dynamic resultant, peaks of the components.

        Names of columns end in the unit. A peak is the largest magnitude at any time, also between the reported
        instants; at given instants, and over rails that are not straight, it is the largest over the reported ones. A
        dynamic value is the largest |load - static load|. Raises ArgumentError if the result reports no instant.

        If the motion has an uncertainty: peak_lower_N and peak_upper_N, the 95 % credible band of the largest
        resultant under the true motion, at any time. The estimated motion is smoother than the true one, so its peak
        may be below the band. noise_share_percent: 1.96 standard deviations of the resultant at time_of_peak_s, over
        the peak.
        """
        import pandas as pd

        index = pd.Index(self.quantities["carriage"], name="carriage")
        return pd.DataFrame(self.peak_columns, index=index)

    @cached_property
    def peak_columns(self) -> dict[str, Array]:
        """The columns of `peaks` as plain arrays (carriage,)."""
        self.require_instants()
        return peak_columns(self.quantities)

    def points(self) -> pd.DataFrame:
        """A row per point of [[points]]: sag, and peaks of displacement, velocity and acceleration.

        Names of columns end in the unit. Sag: size of the displacement at rest. Peaks: the largest at any time,
        of displacement from the place at rest, of velocity and of acceleration in the travelling frame, and of the
        absolute acceleration; at given instants, and over rails that are not straight, the largest over the reported
        ones. Raises ArgumentError if the result reports no instant.
        """
        import pandas as pd

        names = [point.name for point in self.machine.points]
        return pd.DataFrame(self.point_columns, index=pd.Index(names, name="point", dtype=object))

    @cached_property
    def point_columns(self) -> dict[str, Array]:
        """The columns of `points` as plain arrays (point,); none without points."""
        self.require_instants()
        return point_columns(self._estimate, self.whole_run) if self.machine.points else {}

    @checked
    def settling(self, window: float | str | None = None) -> tuple[Settling, ...]:
        """The settling times of the points into a window after each move.

        window: m or text such as "10 um", for all points; by default each point's settle_window, and points without one
        are left out. The time runs from the last acceleration of the move until the point stays within the window
        around its place at rest, with the payloads and riders of the instant; process forces shift this place. Raises
        ArgumentError for an impossible window.
        """
        self.require_instants()
        try:
            size = None if window is None else quantity(window, "m")
        except ValueRefused as refused:
            raise ArgumentError(f"window: {refused}") from None
        return settling_of(self.machine, self._estimate, size)

    def require_instants(self) -> None:
        """Raise ArgumentError if the result reports no instant."""
        time = self.history("time")
        if time is None or not time.size:
            raise ArgumentError("times: the result reports no instant, so it has no peaks and no audit")

    @checked
    def to_netcdf(self, path: str | PathLike[str]) -> None:
        """Write all quantities as netCDF 4."""
        result_files.to_netcdf(self._to_write(), path)

    @checked
    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Write all quantities as Parquet: histories as columns, other quantities in the metadata."""
        result_files.to_parquet(self._to_write(), path)

    @checked
    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the histories as CSV, and all other quantities as JSON in a second file (same name, .json).

        For other programs; `load` does not read CSV.
        """
        result_files.to_csv(self._to_write(), path)

    def _to_write(self) -> Quantities:
        """All quantities, from `data` if it exists, because the user may have changed it. Raises NotFinite."""
        data = Quantities.of_dataset(self.data) if "data" in self.__dict__ else self.quantities
        for name, each in data.variables.items():
            require_finite(name, each.values)
        for name, value in data.attrs.items():
            require_finite(name, value)
        return data

    @classmethod
    @checked
    def load(cls, path: str | PathLike[str]) -> Result:
        """Read a result that `to_netcdf` or `to_parquet` wrote; the ending of its name decides the format.

        Raises ReadError if the file holds no result.
        """
        return cls(*result_files.read(path))


def _stored_run(machine: Machine, data: Quantities) -> Run | None:
    """The run whose samples the quantities of a file contain; None at given instants, and on rails not straight."""
    histories = Histories(machine, data)
    if not histories.has_motion or "motion_acceleration" in data or histories.foot_load is not None:
        return None
    start: StartState = "quasi-static" if histories.start == "quasi-static" else "rest"
    step = data.attrs.get("step_s")
    return Run(
        machine,
        Motion(histories.time, histories.cart_acceleration, wrench=data.get("wrench")),
        str(data.attrs["method"]),
        str(data.attrs["method_reason"]),
        float(data.attrs["rtol"]),
        None if step is None else float(step),
        None,
        start,
        histories.stretches_at(histories.time),
        travel=histories.travel,
    )
