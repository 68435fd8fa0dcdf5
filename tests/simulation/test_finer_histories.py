"""The instants of a result: between coarse samples its histories show the vibration that the peaks come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import lives
import numpy as np
import pytest
import reference as ref
from machines import with_carriages
from moves import BRISK, integrals

from guideload import Life, LongRun, Machine, Motion, Study, life_of, peak_loads, run_study, simulate
from guideload.cli.inputs import EXAMPLES
from guideload.drive import drive_requirements
from guideload.drive.requirements import rms
from guideload.life.mean_load import load_bows
from guideload.plots import load_density
from guideload.simulation.finer_histories import MOST_BOW, _bows_little
from guideload.simulation.instants import fastest_vibration
from guideload.simulation.result import Result

CORNERS = np.array([0.1, 0.12, 0.5, 0.52, 1.0, 1.02, 1.4, 1.42])  # s, samples at 100 Hz and its multiples
ACCELERATION = np.array([0.0, 2.2, 2.2, 0.0, 0.0, -2.2, -2.2, 0.0])  # m/s2
END = 2.0  # s
DENSE = 20_000  # Hz


def sampled(rate: int, size: float = 1.0) -> Motion:
    """A move; velocity and position are the integrals of the acceleration."""
    time = np.arange(int(END * rate) + 1) / rate
    acceleration = size * np.interp(time, CORNERS, ACCELERATION)
    position, velocity, _ = (of(time) for of in integrals(time, acceleration))
    return Motion.along_x(time, acceleration, velocity=velocity, position=position, exact=True)


def missed(result: Result, dense: Result) -> float:
    """Largest distance of a link load from the lines between the instants, over the largest dynamic load."""
    time, loads, static = (dense.quantities[name] for name in ("time", "link_load", "static_link_load"))
    at, values = result.quantities["time"], result.quantities["link_load"]
    lines = np.column_stack([np.interp(time, at, each) for each in values.T])
    return float(np.abs(lines - loads).max() / np.abs(loads - static).max())


MACHINES = [ref.cart, ref.preloaded, lives.cart]


@pytest.mark.parametrize("machine", [*MACHINES, ref.cart_clear])
def test_the_samples_are_among_the_instants(machine: Callable[[], Machine]) -> None:
    motion = sampled(100)
    result, at_samples = simulate(machine(), motion), simulate(machine(), motion, times=motion.time)
    time = result.quantities["time"]
    assert time.size > 2 * motion.time.size and np.isin(motion.time, time).all()
    assert np.array_equal(at_samples.quantities["time"], motion.time)
    loads = result.quantities["link_load"][np.searchsorted(time, motion.time)]
    size = np.abs(loads).max()
    np.testing.assert_allclose(loads, at_samples.quantities["link_load"], rtol=0.0, atol=1e-5 * size)


@pytest.mark.parametrize("machine", MACHINES)
def test_lines_between_the_instants_show_the_vibration(machine: Callable[[], Machine]) -> None:
    """Everywhere within the bow that is allowed; lines between the samples miss a tenth and more."""
    motion = sampled(100)
    dense = simulate(machine(), motion, times=np.arange(int(END * 10_000) + 1) / 10_000)
    assert missed(simulate(machine(), motion), dense) <= 1.05 * MOST_BOW
    assert missed(simulate(machine(), motion, times=motion.time), dense) > 10.0 * MOST_BOW


@pytest.mark.parametrize("radians", [2.0, 3.0, 6.0, 12.0, 16.0])
def test_lines_show_the_vibration_however_long_the_intervals_are(radians: float) -> None:
    """Intervals of up to three periods of the fastest vibration, after a step of each force and moment."""
    machine = ref.cart()
    time = radians / fastest_vibration(machine) * np.arange(30)
    for component in range(1, 6):
        wrench = np.zeros((time.size, 6))
        wrench[3:, component] = 3000.0
        motion = Motion(time, np.zeros((time.size, 3)), wrench=wrench)
        dense = simulate(machine, motion, times=np.linspace(0.0, time[-1], 200 * time.size))
        assert missed(simulate(machine, motion), dense) <= 1.05 * MOST_BOW, component


@cache
def figures(rate: int) -> dict[str, np.ndarray]:
    result = simulate(lives.cart(), sampled(rate))
    carriages = life_of(result).carriages
    return {
        "mean load": np.array([each.mean_load for each in carriages]),
        "safety": np.array([each.static.safety for each in carriages]),
        "drive": np.array([drive_requirements(result).peak_force]),
    }


@pytest.mark.parametrize("rate", [100, 200, 1000])
def test_life_safety_and_drive_do_not_depend_on_the_samples(rate: int) -> None:
    for name, error in (("mean load", 1e-6), ("safety", 1e-3), ("drive", 1e-12)):
        assert np.abs(figures(rate)[name] / figures(DENSE)[name] - 1.0).max() < error, name


@pytest.mark.parametrize("machine", [*MACHINES, ref.cart_clear])
def test_bows_are_those_of_the_loads_between_the_instants(machine: Callable[[], Machine]) -> None:
    """The mean load of an interval, by many instants in it, less the mean of both ends."""
    cart, motion = machine(), sampled(1000)
    times = np.unique(motion.time[:-1, None] + 1e-3 * np.linspace(0.0, 1.0, 21))
    loads, first = simulate(cart, motion, times=times).carriage_loads, np.searchsorted(times, motion.time)
    areas = 0.5 * (loads[1:] + loads[:-1]) * np.diff(times)[:, None, None]
    means = np.add.reduceat(areas, first[:-1], axis=0) / np.diff(motion.time)[:, None, None]
    bows = means - 0.5 * (loads[first[1:]] + loads[first[:-1]])
    error = np.abs(load_bows(simulate(cart, motion, times=motion.time)) - bows)
    if machine is ref.cart_clear:  # where contact changes the load bends inside the interval
        assert error.sum() < 0.05 * np.abs(bows).sum()
    else:
        assert error.max() < 0.01 * np.abs(bows).max()


@pytest.mark.parametrize("size", [0.3, 0.1, 0.02, 1e-6])
@pytest.mark.parametrize("rate", [500, 700, 1000, 1500])
def test_changes_of_velocity_overlook_no_bow(rate: int, size: float) -> None:
    """Where they say that samples are enough, the elastic loads between the samples say so too, also under noise."""
    machine, motion = ref.cart(), sampled(rate)
    rng = np.random.default_rng(5)
    shaken = motion.acceleration + size * rng.normal(size=motion.acceleration.shape)
    run = simulate(machine, Motion(motion.time, shaken), times=motion.time)._run
    assert run is not None
    samples = replace(run, times=None)
    changes = np.abs(np.diff(samples.solution.velocity(), axis=0)).max(axis=0)
    assert np.allclose(
        samples.solution.largest_velocity_change(), changes, rtol=1e-9, atol=1e-12 * changes.max()
    )
    if not _bows_little(samples):
        return
    middle = 0.5 * (motion.time[:-1] + motion.time[1:])
    loads, between = samples.link_loads("elastic"), replace(run, times=middle).link_loads("elastic")
    bows = between - 0.5 * (loads[:-1] + loads[1:])
    dynamic = np.abs(loads - machine.scene.static_link_loads()).max()
    assert np.abs(bows).max() <= MOST_BOW * dynamic


def test_a_load_that_follows_noise_has_no_bow() -> None:
    """A stiff machine: the load bends at each sample and is straight between them."""
    time = np.arange(2001) / 1000.0
    noise = np.random.default_rng(3).normal(size=time.size)
    machine = ref.cart(5e6, stiffness_y=1.2e12, stiffness_z=1.2e12)
    result = simulate(machine, Motion.along_x(time, noise), times=time)
    changes = np.diff(result.carriage_loads, axis=0)
    assert np.abs(load_bows(result)).max() < 0.01 * np.abs(changes).max()


def test_the_life_of_a_result_that_was_saved_is_the_same(tmp_path: Path) -> None:
    result = simulate(lives.cart(), sampled(200))
    result.to_netcdf(tmp_path / "run.nc")
    saved = life_of(Result.load(tmp_path / "run.nc"))
    assert [one.life for one in saved.carriages] == [one.life for one in life_of(result).carriages]


@pytest.mark.parametrize("machine", MACHINES)
def test_no_instants_are_added_where_samples_are_enough(machine: Callable[[], Machine]) -> None:
    motion = sampled(2000)
    assert np.array_equal(simulate(machine(), motion).quantities["time"], motion.time)


@pytest.mark.parametrize("machine", [*MACHINES, ref.cart_clear])
def test_none_are_added_where_nothing_moves(machine: Callable[[], Machine]) -> None:
    motion = sampled(100, 0.0)
    assert np.array_equal(simulate(machine(), motion).quantities["time"], motion.time)


def test_they_are_where_loads_vibrate() -> None:
    """A move of a second in a record of five minutes."""
    record = sampled(100)
    time = np.arange(30_001) / 100.0
    acceleration = np.interp(time - 177.0, record.time, record.acceleration[:, 0], left=0.0, right=0.0)
    added = np.setdiff1d(simulate(lives.cart(), Motion.along_x(time, acceleration)).quantities["time"], time)
    assert 100 < added.size < 3000 and 177.0 < added.min() and added.max() < 182.0


@pytest.mark.parametrize("machine", [lives.cart, ref.cart, ref.preloaded])
def test_a_motion_of_corners_and_jumps_shows_all(machine: Callable[[], Machine]) -> None:
    """Intervals of a hundred periods."""
    time, acceleration = [0.0, 0.5, 0.5, 1.0, 1.0, 1.5], [0.0, 0.0, 2.2, 2.2, 0.0, 0.0]
    shown = simulate(machine(), Motion.along_x(time, acceleration))
    dense = np.arange(15_001) / 10_000
    stamps = np.insert(dense, [5000, 10_000], [0.5, 1.0])
    jumping = np.insert(np.where((dense >= 0.5) & (dense < 1.0), 2.2, 0.0), [5000, 10_000], [0.0, 2.2])
    peaks = peak_loads(machine(), Motion.along_x(stamps, jumping)).largest[:, 6]
    size = peaks.max()
    np.testing.assert_allclose(shown.peak_columns["peak_resultant_N"], peaks, rtol=0.0, atol=1e-5 * size)
    np.testing.assert_allclose(shown.quantities["resultant"].max(axis=0), peaks, rtol=0.0, atol=3e-3 * size)


def test_a_spectrum_shows_them_at_their_frequency() -> None:
    """A short move in a long record at 100 Hz: a vibration at 60 Hz is not one of 40 Hz."""
    time = np.arange(3001) / 100.0
    move = sampled(100).acceleration[:, 0]
    motion = Motion.along_x(time, np.pad(move, (500, time.size - 500 - move.size)))
    coarse, dense = (
        simulate(lives.cart(), motion),
        simulate(lives.cart(), motion, times=np.arange(30_001) / 1e3),
    )
    assert np.median(np.diff(coarse.quantities["time"])) == pytest.approx(0.01)
    for at in (40.0, 61.0):

        def near(result: Result, at: float = at) -> float:
            frequency, density = load_density(result)
            return float(density[np.abs(frequency - at) < 3.0].sum())

        assert near(coarse) == pytest.approx(near(dense), rel=0.05)


def test_a_record_in_blocks_has_them_too() -> None:
    machine, motion = lives.cart(), sampled(100)
    run = LongRun(machine)
    run.add(motion)
    whole = life_of(simulate(machine, motion))
    np.testing.assert_allclose(run.mean_loads, [each.mean_load for each in whole.carriages], rtol=1e-12)


# Keys of all carriages, and the error of the mean load of a study that is allowed.
LAWS: dict[str, tuple[dict[str, Any], float]] = {
    "linear": ({}, 1e-7),
    "preloaded": ({"preload_y": 3e3, "preload_z": 3e3, "rolling": "ball"}, 1e-7),
    "clear": ({"clearance_y": 8e-6, "clearance_z": 5e-6}, 1e-6),
}


@cache
def dense_life(law: str) -> Life:
    return life_of(simulate(with_carriages(lives.cart(), **LAWS[law][0]), sampled(DENSE), rtol=1e-9))


@pytest.mark.parametrize("rate", [100, 200, 1000])
@pytest.mark.parametrize("law", LAWS)
def test_the_mean_load_is_that_of_the_motion(law: str, rate: int) -> None:
    keys, error = LAWS[law]
    machine, motion = with_carriages(lives.cart(), **keys), sampled(rate)
    study = Study(machine=machine, motion=motion, cases={"body.mass": [machine.body.mass]}, rtol=1e-9)
    found, life = run_study(study), life_of(simulate(machine, motion, rtol=1e-9))
    for one, single in zip(dense_life(law).carriages, life.carriages, strict=True):
        varied = found.column(f"mean_load_N[{one.name}]")[0]
        assert varied == pytest.approx(one.mean_load, rel=error)
        assert single.mean_load == pytest.approx(one.mean_load, rel=1e-6)


def test_a_vibration_into_a_long_pause_is_as_visible_as_into_a_short_one() -> None:
    """The instants follow the vibration until it has died away: the squared force has the same integral."""
    machine = Machine.from_toml(EXAMPLES / "manipulator.toml")
    time = BRISK.times(1000.0)
    time = time[time <= BRISK.corners()[0][7] + 0.02]  # the move there, and 20 ms of its vibration
    position, velocity, acceleration = BRISK.motion(time)
    found = []
    for pause in (60.0, 64 * 3600.0):
        velocities, accelerations = (np.append(values, 0.0) for values in (velocity, acceleration))
        motion = Motion.along_x(np.append(time, time[-1] + pause), accelerations, velocity=velocities)
        run = drive_requirements(simulate(machine, motion))
        assert run.time.size < 20_000
        found.append(rms(run.time, run.force - run.holding_force) ** 2 * (motion.time[-1] - motion.time[0]))
    assert found[1] == pytest.approx(found[0], rel=1e-6)
