"""Credible bands of loads and peaks, from the uncertainty of the acceleration.

`Uncertainty` is the distribution of the deviation of the acceleration from its estimate; a Monte Carlo sample of the
motion is the estimate plus a drawn deviation. For a linear scene the covariance of the loads is computed exactly, and
the bands of the peaks from samples. For any other scene, and where a rack pushes, every sample is simulated: the push
is |F| times a factor, which is not linear in the motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from guideload._core import Solution, draw_peaks, load_spread
from guideload.base.arrays import Array
from guideload.base.cores import cores
from guideload.base.methods import METHODS
from guideload.base.quantities import Quantities, quantities
from guideload.motion.uncertainty import COVER, TAIL, Uncertainty
from guideload.simulation.peaks import resultants
from guideload.simulation.rack_push import with_rack_push_at_stamps
from guideload.simulation.run import Run

SEED = 1
LINEAR_SAMPLES = 200  # of the motion, for the peaks of a linear scene
MOST_DEVIATION = 6.0  # standard deviations; none of some hundred samples deviates more
# For other scenes: limits of the number of samples, number of samples in memory at a time, and number of steps of rk45
# of all samples together, or of others of the same cost, which take some seconds.
MOST_SAMPLES, FEWEST_SAMPLES, IN_MEMORY = 40, 8, 8
STEPS = 4_000_000
RUNS_OF_A_PUSH = 5  # solutions of each sample until the push of a rack has settled


@dataclass(frozen=True, eq=False)
class CredibleBands:
    """Standard deviations at m instants, and the 95 % credible band of each carriage's peak.

    acceleration  (m,) m/s2, of L along x
    loads         (m, carriage, 6) force [N] and moment about the carriage centre [N m]
    resultants    (m, carriage, 2) resultant of Fy and Fz [N], and magnitude of the moment [N m]
    links         (m, link) N, load along the link
    lower, upper  (carriage,) N, ends of the band of the largest resultant; nan without instants
    method        method of computation, in words
    samples       number of Monte Carlo samples of the motion
    """

    acceleration: Array
    loads: Array
    resultants: Array
    links: Array
    lower: Array
    upper: Array
    method: str
    samples: int


def bands_of(run: Run, carriage_loads: Array) -> CredibleBands | None:
    """The credible bands of a run, from its loads (time, carriage, 6); None if the motion has no uncertainty."""
    if run.motion.uncertainty is None:
        return None
    others = (run.stretches, run.travel, run.motion_without_push)
    if run.machine.scene.model_level == "linear" and all(each is None for each in others):
        return _through_linear_scene(run, run.motion.uncertainty, np.ascontiguousarray(carriage_loads))
    return _by_samples(run, run.motion.uncertainty, carriage_loads)


def with_bands(data: Quantities, bands: CredibleBands) -> Quantities:
    """The quantities of a run together with its credible bands."""
    along_x = np.zeros((data["time"].size, 3))
    along_x[:, 0] = bands.acceleration
    vectors, scalars = ("time", "carriage", "axis"), ("time", "carriage")
    sd = "standard deviation, from the uncertainty of the motion, of the"
    peak = "end of the 95 % credible band of the largest resultant of the carriage"
    added = quantities(
        [
            ("force_sd", vectors, bands.loads[:, :, :3], "N", f"{sd} load of the carriage"),
            ("moment_sd", vectors, bands.loads[:, :, 3:], "N m", f"{sd} moment about the carriage centre"),
            ("resultant_sd", scalars, bands.resultants[:, :, 0], "N", f"{sd} resultant load in y and z"),
            (
                "moment_magnitude_sd",
                scalars,
                bands.resultants[:, :, 1],
                "N m",
                f"{sd} magnitude of the moment",
            ),
            ("link_load_sd", ("time", "link"), bands.links, "N", f"{sd} load along the link"),
            ("cart_acceleration_sd", ("time", "axis"), along_x, "m/s^2", f"{sd} acceleration of the cart"),
            ("peak_resultant_lower", ("carriage",), bands.lower, "N", f"lower {peak}"),
            ("peak_resultant_upper", ("carriage",), bands.upper, "N", f"upper {peak}"),
        ]
    )
    attributes = {"band_method": bands.method, "band_samples": bands.samples, "band_seed": SEED}
    return Quantities(data.variables | added, data.attrs | attributes)


def _through_linear_scene(run: Run, uncertainty: Uncertainty, loads: Array) -> CredibleBands:
    machine = run.machine
    motion = uncertainty.for_core(run.motion.time)
    groups = machine.links_of_carriages, machine.carriage_places
    quasi_static = run.start == "quasi-static"
    standard_deviations = load_spread(
        machine.scene, *motion, run.time, loads, *groups, quasi_static=quasi_static
    )
    of_loads = standard_deviations[1]
    lower = upper = np.full(loads.shape[1], np.nan)
    if run.time.size:
        resultant, reach = resultants(loads)[0], MOST_DEVIATION * resultants(of_loads)[0]
        can_be_peak = resultant + reach >= np.max(resultant - reach, axis=0)
        peaks = draw_peaks(
            machine.scene,
            *motion,
            run.time,
            loads,
            can_be_peak,
            *groups,
            LINEAR_SAMPLES,
            SEED,
            cores(),
            quasi_static=quasi_static,
        )
        lower, upper = np.quantile(peaks, (TAIL, 1.0 - TAIL), axis=1)
    method = (
        "covariance of the estimated acceleration, carried through the linear scene exactly, resultants to first "
        f"order; peaks: 2.5 and 97.5 % quantiles of {LINEAR_SAMPLES} Monte Carlo samples of the motion"
    )
    return CredibleBands(*standard_deviations, lower, upper, method, LINEAR_SAMPLES)


def _by_samples(run: Run, uncertainty: Uncertainty, loads: Array) -> CredibleBands:
    steps = run.solution.steps + run.solution.rejected
    if run.motion_without_push is not None:
        steps *= RUNS_OF_A_PUSH
    count = int(
        np.clip(STEPS / max(1.0, METHODS[run.method].cost) // max(steps, 1), FEWEST_SAMPLES, MOST_SAMPLES)
    )
    estimates = _histories(run, run.solution, loads)
    squares = [np.zeros_like(estimate) for estimate in estimates]
    peaks = np.full((count, loads.shape[1]), np.nan)
    for i, solution in enumerate(_drawn_solutions(run, uncertainty, count)):
        histories = _histories(run, solution, run.carriage_loads(solution=solution))
        for square, history, estimate in zip(squares, histories, estimates, strict=True):
            square += (history - estimate) ** 2
        if run.time.size:
            peaks[i] = histories[2][:, :, 0].max(axis=0)
    acceleration, of_loads, of_sizes, links = (np.sqrt(square / count) for square in squares)
    mean, half = peaks.mean(axis=0), COVER * peaks.std(axis=0, ddof=1)
    kind = (
        run.machine.scene.model_level
        if run.travel is None
        else "one with moving riders, whose motion is taken as known"
    )
    if run.motion_without_push is not None:
        kind += ", each with its own push of the rack"
    method = (
        f"{count} Monte Carlo samples of the motion run through the scene, which is {kind}: "
        f"rms distance from the loads of the estimate; peaks: mean over the samples -+ {COVER} standard deviations"
    )
    lower, upper = np.maximum(mean - half, 0.0), mean + half
    return CredibleBands(acceleration, of_loads, of_sizes, links, lower, upper, method, count)


def drawn_loads(run: Run, count: int) -> Iterator[Array]:
    """Loads (time, carriage, 6) [N, N m] under drawn motions, one motion at a time; none without uncertainty."""
    if run.motion.uncertainty is not None:
        for solution in _drawn_solutions(run, run.motion.uncertainty, count):
            yield run.carriage_loads(solution=solution)


def _drawn_solutions(run: Run, uncertainty: Uncertainty, count: int) -> Iterator[Solution]:
    """The solutions under drawn motions: the estimated acceleration plus a drawn deviation, and the push of a rack."""
    motion = run.motion_without_push or run.motion
    for deviation in _deviations(motion.time, uncertainty, count):
        acceleration = motion.acceleration.copy()
        acceleration[:, 0] += deviation
        yield with_rack_push_at_stamps(
            replace(run, motion=replace(motion, acceleration=acceleration))
        ).solution


def _histories(run: Run, solution: Solution, loads: Array) -> tuple[Array, Array, Array, Array]:
    """`acceleration`, `loads`, `resultants` and `links` of one motion, in the shapes of `CredibleBands`."""
    sizes = np.stack(resultants(loads), axis=2)
    return solution.inputs()[:, 0], loads, sizes, run.link_loads(solution=solution)


def _deviations(time: Array, uncertainty: Uncertainty, count: int) -> Iterator[Array]:
    """Drawn deviations (n,) [m/s2] at the stamps of a motion; only `IN_MEMORY` are drawn at a time."""
    rng = np.random.default_rng(SEED)
    for first in range(0, count, IN_MEMORY):
        for drawn in uncertainty.draws(min(IN_MEMORY, count - first), rng):
            yield drawn if uncertainty.time is None else np.interp(time, uncertainty.time, drawn)
