"""Peaks between samples where a search may go wrong: brief contacts, ends of smooth stretches, forces of the drive."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import reference as ref
from machines import bouncing, having, link

from guideload import Machine, Motion, PointOfInterest, Study, peak_loads, run_study, simulate
from guideload.drive import drive_requirements

DENSE = 20_001  # instants


def soft_stop(clearance: float) -> Machine:
    """A mass on a spring along y, with a stop beside it."""
    spring = link("spring", point=(0.0, 0.0, 0.0), direction=(0.0, 1.0, 0.0), stiffness=1e8, damping=2e3)
    stop = bouncing(100.0, 1e7, 0.0, clearance_y=clearance, clearance_z=0.0)
    return having(stop, links=[spring], gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("step", [0.5e-3, 0.93e-3, 1e-3])
def test_a_contact_within_one_interval_has_its_peak(step: float) -> None:
    """After a step of the acceleration the mass moves by some 20 um."""
    time = np.arange(0.0, 0.03, step)
    motion = Motion(time, np.tile([0.0, -10.0, 0.0], (time.size, 1)))
    for clearance in np.linspace(17e-6, 19.8e-6, 15):
        machine = soft_stop(clearance)
        dense = simulate(machine, motion, times=np.linspace(0.0, time[-1], DENSE)).data["force"].sel(axis="y")
        found = peak_loads(machine, motion).largest[0, 1]
        assert found == pytest.approx(float(dense.max()), rel=1e-3, abs=1e-3), clearance
        assert found >= float(dense.max()) * (1.0 - 1e-12)


@pytest.mark.parametrize("seed", range(0, 120, 15))
def test_a_peak_is_the_load_at_its_time(seed: int) -> None:
    """Random clearances of each carriage, so that contacts are brief and graze."""
    for one in range(seed, seed + 15):
        rng = np.random.default_rng(one)
        cart = ref.cart(damping=10.0 ** rng.uniform(3.0, 5.0))
        clear = [
            having(
                each, clearance_y=10.0 ** rng.uniform(-7.0, -5.0), clearance_z=10.0 ** rng.uniform(-7.0, -5.0)
            )
            for each in cart.carriages
        ]
        machine, motion = having(cart, carriages=clear), ref.random_motion(one, count=60, wrench=True)
        peaks = peak_loads(machine, motion)
        sizes = peaks.largest[:, 6:].max(axis=0)
        for values, times in (
            (peaks.smallest, peaks.time_of_smallest),
            (peaks.largest, peaks.time_of_largest),
        ):
            at, index = np.unique(times[:, :6], return_inverse=True)
            assert motion.time[0] <= at[0] and at[-1] <= motion.time[-1]
            data = simulate(machine, motion, times=at).data
            loads = np.concatenate([data["force"].values, data["moment"].values], axis=2)
            for (carriage, row), instant in np.ndenumerate(index.reshape(-1, 6)):
                found, error = values[carriage, row], 1e-9 * sizes[row // 3]
                assert found == pytest.approx(loads[instant, carriage, row], rel=0.0, abs=error), one


@pytest.mark.parametrize("seed", range(0, 160, 20))
def test_no_value_in_between_passes_a_peak(seed: int) -> None:
    """Random machines, overdamped modes among them, on few and uneven samples, some with a jump."""
    for one in range(seed, seed + 20):
        rng = np.random.default_rng(one)
        machine = ref.random_machine(one, damping=float(rng.choice([1.0, 0.1, 0.02])), carriages=2)
        count = int(rng.integers(3, 40))
        time = np.cumsum(rng.uniform(2e-4, 3e-3, count))
        if one % 3 == 0:
            time[count // 2] = time[count // 2 - 1]
        wrench = rng.normal(size=(count, 6)) * [500.0, 800.0, 300.0, 90.0, 60.0, 120.0]
        motion = Motion(time, rng.normal(size=(count, 3)), wrench=wrench)
        peaks = peak_loads(machine, motion)
        instants = np.unique(np.concatenate([np.linspace(time[0], time[-1], 3001), time]))
        data = simulate(machine, motion, times=instants).data
        loads = np.concatenate([data["force"].values, data["moment"].values], axis=2)
        error = 1e-9 * np.repeat(peaks.largest[:, 6:].max(axis=0), 3)
        assert np.all(loads.max(axis=0) <= peaks.largest[:, :6] + error), one
        assert np.all(loads.min(axis=0) >= peaks.smallest[:, :6] - error), one
        assert np.all(data["resultant"].max("time") <= peaks.largest[:, 6] + error[0]), one


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear, ref.preloaded])
def test_a_study_finds_the_drive_force_that_a_process_force_asks_for(machine: Callable[[], Machine]) -> None:
    time = np.arange(0.0, 0.2, 4e-3)
    instants = np.linspace(0.0, time[-1], DENSE)
    for seed in range(4):
        wrench = np.zeros((time.size, 6))
        wrench[1:, :3] = 1500.0 * np.random.default_rng(seed).normal(size=(time.size - 1, 3))
        motion = Motion(time, np.zeros((time.size, 3)), wrench=wrench)
        cases = {"body.mass": [machine().body.mass]}
        found = run_study(
            Study(machine=machine(), motion=motion, cases=cases, quantities=("drive",), rtol=1e-9)
        )
        dense = simulate(machine(), motion, times=instants, rtol=1e-9).data["reaction"].sel(dof="x")
        size = float(np.abs(dense).max())
        assert found.column("max_drive_N")[0] >= float(dense.max()) - 1e-7 * size
        assert found.column("min_drive_N")[0] <= float(dense.min()) + 1e-7 * size


@pytest.mark.parametrize("end", np.arange(0.004, 0.012, 0.0005))
def test_a_maximum_beside_the_end_of_a_record_counts(end: float) -> None:
    """A step of the acceleration, after the overshoot of which the record ends."""
    machine = having(ref.cart(), points=[PointOfInterest(name="tool", at=(0.15, -1.0, 0.18))])
    time = np.array([0.0, end])
    motion = Motion.along_x(time, [2.2, 2.2], velocity=2.2 * time)
    result, dense = (simulate(machine, motion, times=times) for times in (None, np.linspace(0.0, end, DENSE)))
    assert drive_requirements(result).peak_force >= drive_requirements(dense).peak_force * (1.0 - 1e-9)
    for name, found in result.points().items():
        if str(name).startswith("peak_"):
            assert found.iloc[0] >= dense.points()[name].iloc[0] * (1.0 - 1e-9), name
