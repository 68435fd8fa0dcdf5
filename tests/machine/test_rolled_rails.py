"""Rolled rails: the same machine turned in space has the same loads in the carriages' own axes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from guideload.base.arrays import Array
from guideload.life.life import life_of
from guideload.machine.components import Body, Rail
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.simulation.result import Result
from guideload.simulation.simulation import peak_loads, simulate
from guideload.study import Study, run_study

CENTER, GRAVITY = np.array([0.08, -0.3, 0.05]), np.array([0.0, -9.80665, 0.0])
INERTIA = np.array([[44.0, 1.5, -0.8], [1.5, 42.0, 2.2], [-0.8, 2.2, 40.0]])
FORCE = np.array([0.0, 300.0, -500.0])
LINEAR = {"stiffness_y": 5.5e7, "stiffness_z": 4.0e7}
LAWS: dict[str, dict[str, Any]] = {
    "linear": LINEAR,
    "width": {**LINEAR, "width": 0.03},
    "sided": {"stiffness_y": {"positive": 4e7, "negative": 6e7}, "stiffness_z": 4e7, "clearance_z": 2e-6},
    "preloaded": {**LINEAR, "preload_y": 4e3, "preload_z": 3e3, "rolling": "ball"},
}
RATED = {
    "name": "p",
    "maker": "m",
    "edition": "e",
    "type": "ball",
    "dynamic": {"value": 2e4, "base": 5e4},
    "static": 3e4,
    "static_moments": {"roll": 300.0, "pitch": 250.0, "yaw": 200.0},
    "lift_factor": 1.2,
    "side_factor": 1.3,
}


def turned(vector: Array, roll: float) -> Array:
    """A vector turned about x by roll, y towards z."""
    x, y, z = vector
    c, s = np.cos(roll), np.sin(roll)
    return np.array([x, c * y - s * z, s * y + c * z])


def gantry(law: dict[str, Any], roll: float) -> Machine:
    """A machine on two rails, with all its parts turned about x."""
    axes = np.column_stack([turned(axis, roll) for axis in np.eye(3)])
    body = Body(mass=125.0, center_of_mass=turned(CENTER, roll), inertia=(axes @ INERTIA @ axes.T).tolist())
    rails, carriages = [], []
    for name, z in (("1", -0.5), ("2", 0.5)):
        rails.append(Rail(name=name, position=turned(np.array([0.0, -0.05, z]), roll)[1:], roll=roll))
        for end, x in (("a", -0.4), ("b", 0.4)):
            keys = {"length": 0.12, "damping_y": 1e4, "damping_z": 3e3, "product": "p", **law}
            carriages.append({"name": name + end, "rail": name, "x": x, **keys})
    return Machine(
        body=body, rails=rails, carriages=carriages, products=[RATED], gravity=turned(GRAVITY, roll)
    )


def motion(roll: float) -> Motion:
    time = np.linspace(0.0, 0.2, 201)
    acceleration = 5.0 * np.sin(40.0 * time)
    velocity = 0.125 * (1.0 - np.cos(40.0 * time))
    forced = Motion.along_x(time, acceleration, velocity=velocity)
    return forced.with_force(turned(np.array([0.1, 0.2, -0.1]), roll), turned(FORCE, roll))


def both(law: str, roll: float) -> tuple[Result, Result]:
    upright, rolled = (simulate(gantry(LAWS[law], angle), motion(angle), rtol=1e-12) for angle in (0.0, roll))
    return upright, rolled


@pytest.mark.parametrize("law", ["linear", "width", "sided"])
@pytest.mark.parametrize("degrees", [-45.0, 30.0, 90.0, 180.0])
def test_loads_of_the_turned_machine_are_the_same_in_the_rails_axes(law: str, degrees: float) -> None:
    roll = np.radians(degrees)
    upright, rolled = both(law, roll)
    scale = np.abs(upright.carriage_loads).max()
    assert rolled.carriage_loads == pytest.approx(upright.carriage_loads, abs=1e-12 * scale)
    assert "force_global" not in upright.quantities
    for name in ("force", "moment"):
        ours, theirs = upright.quantities[name], rolled.quantities[f"{name}_global"]
        expected = np.stack(turned(np.moveaxis(ours, -1, 0), roll), axis=-1)
        assert theirs == pytest.approx(expected, abs=1e-12 * scale)
    for name in ("resultant", "static_force", "static_moment", "rail_force", "rail_moment"):
        assert rolled.quantities[name] == pytest.approx(upright.quantities[name], abs=1e-12 * scale)


def test_preloaded_laws_turn_too() -> None:
    """Within the tolerance of rk45, not rounding."""
    upright, rolled = both("preloaded", np.radians(30.0))
    scale = np.abs(upright.carriage_loads).max()
    assert rolled.carriage_loads == pytest.approx(upright.carriage_loads, abs=1e-8 * scale)


def test_opposed_rails_tell_lift_and_press_in_their_own_axes() -> None:
    """The same load lifts the carriages of a rail that hangs upside down and presses those of an upright one."""
    upright = gantry(LAWS["linear"], 0.0)
    rails = [
        rail.model_copy(update={"roll": roll})
        for rail, roll in zip(upright.rails, ("0 deg", "180 deg"), strict=True)
    ]
    opposed = simulate(upright.model_copy(update={"rails": rails}), motion(0.0)).carriage_loads
    usual = simulate(upright, motion(0.0)).carriage_loads
    sign = np.ones_like(usual)
    sign[:, 2:, [1, 2, 4, 5]] = -1.0
    assert opposed == pytest.approx(sign * usual, abs=1e-9 * np.abs(usual).max())


def test_life_peaks_and_studies_use_the_axes_of_the_carriage() -> None:
    roll = np.radians(90.0)
    upright, rolled = both("width", roll)
    lives = [[one.life for one in life_of(result).carriages] for result in (upright, rolled)]
    assert lives[1] == pytest.approx(lives[0], rel=1e-9)
    causes = [[one.factor_life for one in life_of(result).carriages] for result in (upright, rolled)]
    assert causes[1] == pytest.approx(causes[0], rel=1e-9)
    peaks = [peak_loads(upright.machine, motion(0.0)), peak_loads(rolled.machine, motion(roll))]
    for name in ("smallest", "largest"):
        one, other = (getattr(each, name) for each in peaks)
        assert other == pytest.approx(one, rel=1e-9, abs=1e-9 * np.abs(one).max())
    entry = {"path": "carriages.*.stiffness_y", "distribution": "uniform", "plus_minus": "20 %"}
    tables = [
        run_study(
            Study(machine=result.machine, motion=motion(angle), samples=8, seed=3, vary=[entry])
        ).table()
        for result, angle in ((upright, 0.0), (rolled, roll))
    ]
    recorded = [name for name in tables[0] if name.startswith(("min_", "max_", "rms_", "mean_"))]
    for name in recorded:
        assert tables[1][name].values == pytest.approx(tables[0][name].values, rel=1e-8, abs=1e-6), name
