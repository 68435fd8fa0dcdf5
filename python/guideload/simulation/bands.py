"""What a trace leaves open about the loads: standard deviations of the histories, and bands of the peaks.

The acceleration deviates from its estimate as `Uncertainty` has it. A linear scene carries the covariance of that to
the loads exactly; the peaks are those of draws, each the estimate plus a deviation. Through any other scene draws
are run one by one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from guideload._core import Solution, draw_peaks, load_spread
from guideload.base.arrays import Array
from guideload.base.cores import cores
from guideload.motion.uncertainty import COVER, TAIL, Uncertainty
from guideload.simulation.run import Run

if TYPE_CHECKING:
    import xarray as xr

    from guideload.simulation.dataset import Variable

SEED = 1  # of all draws
DRAWS = 200  # of the peaks of a linear scene
FARTHEST = 6.0  # standard deviations that no draw of some hundred goes beyond
# Through a scene that is not linear: most and fewest draws, how many are held at a time, and steps of all draws that
# take some seconds.
MOST_RUNS, FEWEST_RUNS, HELD = 40, 8, 8
STEPS = {"exact": 4_000_000, "rk45": 4_000_000, "implicit": 1_000_000}


@dataclass(frozen=True, eq=False)
class Bands:
    """Standard deviations at m instants, and the 95 % band of each carriage's peak.

    acceleration  (m,) m/s2, of the cart along x
    loads         (m, carriage, 6) force [N] and moment about the carriage centre [N m]
    sizes         (m, carriage, 2) resultant of Fy and Fz [N], and magnitude of the moment [N m]
    links         (m, link) N, of the loads along the links
    lower, upper  (carriage,) N, of the largest resultant over the instants; nan if there is none
    method        how all this was obtained, in words
    draws         number of motions drawn
    """

    acceleration: Array
    loads: Array
    sizes: Array
    links: Array
    lower: Array
    upper: Array
    method: str
    draws: int


def bands_of(run: Run, carriage_loads: Array) -> Bands | None:
    """The bands of a run, of which the caller has the loads (time, carriage, 6); None if its motion is certain."""
    if run.motion.uncertainty is None:
        return None
    if run.machine.scene.model_level == "linear":
        return _of_linear(run, run.motion.uncertainty, np.ascontiguousarray(carriage_loads))
    return _of_draws(run, run.motion.uncertainty, carriage_loads)


def with_bands(data: xr.Dataset, bands: Bands) -> xr.Dataset:
    """The labelled arrays of a run and its bands."""
    from guideload.simulation.dataset import (
        labelled,  # xarray takes longer to import than the bands to compute
    )

    along_x = np.zeros((data.sizes["time"], 3))
    along_x[:, 0] = bands.acceleration
    of_carriages, of_one = ("time", "carriage", "axis"), ("time", "carriage")
    text = "standard deviation, by what the trace leaves open, of the"
    peak = "end of the 95 % band of the largest resultant of the carriage"
    variables: tuple[Variable, ...] = (
        ("force_sd", of_carriages, bands.loads[:, :, :3], "N", f"{text} load of the carriage"),
        ("moment_sd", of_carriages, bands.loads[:, :, 3:], "N m", f"{text} moment about the carriage centre"),
        ("resultant_sd", of_one, bands.sizes[:, :, 0], "N", f"{text} resultant load in y and z"),
        ("moment_magnitude_sd", of_one, bands.sizes[:, :, 1], "N m", f"{text} magnitude of the moment"),
        ("link_load_sd", ("time", "link"), bands.links, "N", f"{text} load along the link"),
        ("cart_acceleration_sd", ("time", "axis"), along_x, "m/s2", f"{text} acceleration of the cart"),
        ("peak_resultant_lower", ("carriage",), bands.lower, "N", f"lower {peak}"),
        ("peak_resultant_upper", ("carriage",), bands.upper, "N", f"upper {peak}"),
    )
    data = data.assign(labelled(variables))
    data.attrs |= {"band_method": bands.method, "band_draws": bands.draws, "band_seed": SEED}
    return data


def _of_linear(run: Run, left_open: Uncertainty, loads: Array) -> Bands:
    machine = run.machine
    stamps = run.motion.time if left_open.time is None else left_open.time
    motion = left_open.model, left_open.derivative, left_open.unit, stamps
    groups = machine.links_of_carriages, machine.carriage_centers
    acceleration, of_loads, sizes, links = load_spread(machine.scene, *motion, run.time, loads, *groups)
    lower = upper = np.full(loads.shape[1], np.nan)
    if run.time.size:
        resultant = np.hypot(loads[:, :, 1], loads[:, :, 2])
        reach = FARTHEST * np.hypot(of_loads[:, :, 1], of_loads[:, :, 2])
        can_be_peak = resultant + reach >= np.max(resultant - reach, axis=0)
        peaks = draw_peaks(
            machine.scene, *motion, run.time, loads, can_be_peak, *groups, DRAWS, SEED, cores()
        )
        lower, upper = np.quantile(peaks, (TAIL, 1.0 - TAIL), axis=1)
    method = (
        "covariance of the estimated acceleration, carried through the linear scene exactly, resultants to first "
        f"order; peaks: 2.5 and 97.5 % quantiles over {DRAWS} drawn motions"
    )
    return Bands(acceleration, of_loads, sizes, links, lower, upper, method, DRAWS)


def _of_draws(run: Run, left_open: Uncertainty, loads: Array) -> Bands:
    steps = run.solution.steps + run.solution.rejected
    count = int(np.clip(STEPS[run.method] // max(steps, 1), FEWEST_RUNS, MOST_RUNS))
    nominal = _Histories.of(run, run.solution, loads)
    squares = [np.zeros_like(part) for part in nominal.parts]
    peaks = np.full((count, loads.shape[1]), np.nan)
    for i, drawn in enumerate(_drawn(run, left_open, count)):
        for square, part, estimate in zip(squares, drawn.parts, nominal.parts, strict=True):
            square += (part - estimate) ** 2
        if run.time.size:
            peaks[i] = drawn.sizes[:, :, 0].max(axis=0)
    acceleration, of_loads, sizes, links = (np.sqrt(square / count) for square in squares)
    middle, spread = peaks.mean(axis=0), COVER * peaks.std(axis=0, ddof=1)
    method = (
        f"{count} drawn motions run through the scene, which is {run.machine.scene.model_level}: rms distance from "
        f"the loads of the estimate; peaks: mean of the draws' peaks -+ {COVER} of their standard deviations"
    )
    return Bands(
        acceleration, of_loads, sizes, links, np.maximum(middle - spread, 0.0), middle + spread, method, count
    )


@dataclass(frozen=True, eq=False)
class _Histories:
    """What bands are given of, of one motion."""

    acceleration: Array
    loads: Array
    sizes: Array
    links: Array

    @classmethod
    def of(cls, run: Run, solution: Solution, loads: Array) -> _Histories:
        sizes = np.stack(
            [np.hypot(loads[:, :, 1], loads[:, :, 2]), np.linalg.norm(loads[:, :, 3:], axis=2)], axis=2
        )
        return cls(solution.inputs()[:, 0], loads, sizes, solution.link_loads("total"))

    @property
    def parts(self) -> tuple[Array, Array, Array, Array]:
        return self.acceleration, self.loads, self.sizes, self.links


def _drawn(run: Run, left_open: Uncertainty, count: int) -> Iterator[_Histories]:
    """The histories of drawn motions, one after the other."""
    machine, motion = run.machine, run.motion
    instants = None if run.time is motion.time else run.time
    for deviation in _deviations(motion.time, left_open, count):
        acceleration = motion.acceleration.copy()
        acceleration[:, 0] += deviation
        solution = machine.scene.solve(
            motion.time,
            acceleration,
            motion.wrench,
            method=run.method,
            rtol=run.rtol,
            step=run.step,
            times=instants,
        )
        loads = solution.group_loads(machine.links_of_carriages, machine.carriage_centers, "total")
        yield _Histories.of(run, solution, loads)


def _deviations(time: NDArray[np.float64], left_open: Uncertainty, count: int) -> Iterator[Array]:
    """(n,) m/s2 at the stamps of a motion, drawn some at a time, for long traces are large."""
    rng = np.random.default_rng(SEED)
    for first in range(0, count, HELD):
        for drawn in left_open.draws(min(HELD, count - first), rng):
            yield drawn if left_open.time is None else np.interp(time, left_open.time, drawn)
