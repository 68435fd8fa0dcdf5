"""Runs at any instants: those of a run with further samples there, derivatives by time, instants that are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from reference import cart, random_motion

from guideload import Motion, simulate
from guideload.base.errors import ArgumentError
from guideload.sensitivity import RunDerivatives, VariedMachine

Array = NDArray[Any]
ROUNDING = 1e-12  # relative to the largest number of a history; 3e-14 are found
TO = {"y": "carriages.*.stiffness_y", "mass": "body.mass", "damping": "carriages.*.damping_z"}
NUMBERS = {
    "carriage_loads": 24,
    "link_loads": 16,
    "displacement": 6,
    "velocity": 6,
    "acceleration": 6,
    "reaction": 6,
}


def moves() -> Motion:
    """Accelerations and external loads at 101 even stamps."""
    return random_motion(12, count=101, wrench=True)


def run_of(motion: Motion) -> RunDerivatives:
    return VariedMachine(cart(), TO).run(motion)


def close(found: Array, wanted: Array) -> None:
    assert found == pytest.approx(wanted, abs=ROUNDING * np.abs(wanted).max())


def other_clock(motion: Motion) -> Array:
    """Stamps that recur in the intervals of the motion, for propagators, and some that do not, for series."""
    first, last = motion.time[[0, -1]]
    even = np.linspace(first, last, 2 * motion.time.size - 1) + 0.3 * (motion.time[1] - first)
    return np.sort(np.concatenate([even[even <= last], np.random.default_rng(0).uniform(first, last, 20)]))


@pytest.mark.parametrize("quantity", NUMBERS)
def test_instants_are_those_of_a_run_with_samples_there(quantity: str) -> None:
    motion = moves()
    time = other_clock(motion)
    stamps = np.unique(np.concatenate([motion.time, time]))
    assert motion.wrench is not None
    acceleration, wrench = (
        np.array([np.interp(stamps, motion.time, column) for column in of.T]).T
        for of in (motion.acceleration, motion.wrench)
    )
    finer = run_of(Motion(time=stamps, acceleration=acceleration, wrench=wrench))
    along = np.random.default_rng(1).standard_normal(NUMBERS[quantity])
    found, there = run_of(motion).at(time).history(quantity, along), np.searchsorted(stamps, time)
    by = finer.history(quantity).reshape(len(TO), stamps.size, -1)[:, there] @ along
    values = finer.at(stamps).history(quantity, along).values[there]
    close(found.by, by)
    close(found.values, values)


def test_instants_at_the_samples_are_the_samples() -> None:
    """Also where the excitation jumps, behind the jump, and at the last one."""
    motion = random_motion(5, count=60, jumps=True)
    run, machine = run_of(motion), cart()
    last_of_equal = np.append(np.diff(motion.time) > 0.0, True)
    time = motion.time[last_of_equal]
    along = np.ones(24)
    found = run.at(time).history("carriage_loads", along)
    loads = run.solution.group_loads(machine.links_of_carriages, machine.carriage_places, "total")
    close(found.values, loads.reshape(motion.time.size, 24)[last_of_equal] @ along)
    close(found.by, run.history("carriage_loads").reshape(len(TO), -1, 24)[:, last_of_equal] @ along)


def test_slopes_are_derivatives_by_time() -> None:
    motion = moves()
    run, step = run_of(motion), 1e-7
    time = other_clock(motion)
    to_sample = np.abs(time[:, None] - motion.time).min(axis=1)
    time = time[to_sample > 2.0 * step]
    for quantity, count in NUMBERS.items():
        along = np.random.default_rng(2).standard_normal(count)
        earlier, now, later = (run.at(time + shift).history(quantity, along) for shift in (-step, 0.0, step))
        slope = (later.values - earlier.values) / (2.0 * step)
        # Loads of some 1e4 N have a rounding of 1e-12 N, over a step of 1e-7 s.
        assert now.slope == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())
    at = run.at(time)
    unit = np.eye(6)[1]
    close(at.history("displacement", unit).slope, at.history("velocity", unit).values)
    close(at.history("velocity", unit).slope, at.history("acceleration", unit).values)


def test_values_are_those_of_simulate() -> None:
    motion = moves()
    result = simulate(cart(), motion, "exact", times=motion.time)
    found = run_of(motion).at(motion.time).history("acceleration", [0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    close(found.values, result.quantities["acceleration"][:, 1])


def test_a_record_that_begins_under_way_does_not_ring() -> None:
    """A constant acceleration from before the first stamp leaves the machine in its quasi-static place."""
    motion = Motion.along_x(np.arange(50) * 1e-3, np.full(50, 2.0), recorded=True)
    found = run_of(motion).at(np.linspace(0.0, 0.049, 70)).history("displacement", np.ones(6))
    assert np.ptp(found.values) < 1e-12 * abs(found.values).max()
    assert np.ptp(found.by, axis=1).max() < 1e-9 * abs(found.by).max()


@pytest.mark.parametrize("after_start", [[-1.0], [1e9], [0.02, 0.01]])
def test_instants_outside_the_motion_or_not_in_order_are_refused(after_start: list[float]) -> None:
    motion = moves()
    with pytest.raises(ArgumentError, match=r"times\[\d\]: expected .* s, ascending, got"):
        run_of(motion).at(motion.time[0] + np.array(after_start))
