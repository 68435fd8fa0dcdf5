"""Derivatives of histories and figures of runs: 50 digits, hostile damping and time stamps, adjoint against forward."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lives import PRODUCT, on_lines
from numpy.typing import NDArray
from precise_derivatives import differences, histories_of
from reference import (
    all_modes_critical,
    cart,
    cart_stiff,
    example,
    paper,
    piece,
    pulse,
    random_machine,
    random_motion,
)

from guideload import Machine, Motion, life_of, peak_loads, sensitivities, simulate
from guideload.base.errors import ArgumentError
from guideload.sensitivity import VariedMachine
from guideload.sensitivity.figures import CarriageQuantities

Array = NDArray[Any]
DIGITS_ASKED = 1e-12  # relative to the largest entry of each history; 1.2e-14 are found


def errors(machine: Machine, motion: Motion, path: str) -> dict[str, float]:
    """Largest error of the derivative of each history by a number, relative to its largest entry, from 50 digits."""
    varied = VariedMachine(machine, path)
    run = varied.run(motion, start="rest")
    exact = differences(machine, motion, path, varied.columns[0].value)
    mine = histories_of(run)
    found = {}
    for name, values in mine.items():
        if not values.size:
            continue  # no carriages
        wanted = exact[name].reshape(values.shape[1:])
        size = np.abs(wanted).max()
        found[name] = float(np.abs(values[0] - wanted).max() / size) if size else float(np.abs(values).max())
    return found


# Intervals that occur 48 times pass by propagators, others by series: motions of 60 samples, and shorter ones.
CASES: dict[str, tuple[Machine, Motion, str]] = {
    "mass": (paper(), random_motion(1, count=60, wrench=True), "body.mass"),
    "centre": (paper(("y", "rx", "rz")), random_motion(2, count=20), "body.center_of_mass.y"),
    "inertia": (paper(), random_motion(3, count=16), "body.inertia.xz"),
    "gravity": (paper(), random_motion(4, count=12), "gravity.y"),
    "rail": (paper(), random_motion(5, count=60, jumps=True), 'rails["1"].position.z'),
    "carriage": (paper(), random_motion(6, times="random"), "carriages[1a].x"),
    "length": (paper(), random_motion(7, count=20), "carriages[1a].length"),
    "stiffness": (cart(), random_motion(8, count=60), "carriages[2b].stiffness_y"),
    "damping": (cart_stiff(), random_motion(9, count=60), "carriages[1a].damping_y"),
    "critical": (all_modes_critical(), random_motion(10, count=60), "links[y1.0].damping"),
    "equal": (all_modes_critical(), random_motion(11, count=60, wrench=True), "links[z-1.0].stiffness"),
}


@pytest.mark.parametrize("case", CASES)
def test_histories_in_50_digits(case: str) -> None:
    found = errors(*CASES[case])
    assert max(found.values()) <= DIGITS_ASKED, found


def test_gradient_backwards_is_the_sum_of_the_histories() -> None:
    """Of every quantity, on even, ticking and jittering time stamps, at rest and under way."""
    rng = np.random.default_rng(0)
    machine = random_machine(3, carriages=2)
    to = [
        "body.mass",
        "links[0].stiffness",
        "links[1].point",
        "carriages[c0].damping",
        "gravity.y",
        "motion.scale",
    ]
    for times in ("uniform", "ticks", "random"):
        motion = random_motion(5, count=60, wrench=True, times=times, jumps=times != "random")
        varied = VariedMachine(machine, to, motion)
        values = varied.values * (1.0 + 0.1 * rng.uniform(-1.0, 1.0, varied.values.size))
        for start in ("rest", "quasi-static"):
            run = varied.run(motion, values, start=start)
            for quantity in (
                "carriage_loads",
                "link_loads",
                "displacement",
                "velocity",
                "acceleration",
                "reaction",
            ):
                forward = run.history(quantity)
                weights = rng.normal(size=forward.shape[1:])
                ahead = (forward * weights).reshape(len(values), -1).sum(axis=1)
                size = np.abs(forward * weights).reshape(len(values), -1).sum(axis=1)
                assert (np.abs(run.gradient(weights, quantity) - ahead) <= 1e-10 * size + 1e-300).all()


def test_quasi_static_start_and_factors_by_differences() -> None:
    machine, motion = cart(), random_motion(7, count=50, wrench=True)
    to = ["body.mass", "carriages[1a].stiffness_y", "carriages[2a].x", "motion.scale", "motion.force_scale"]
    varied = VariedMachine(machine, to, motion)
    run = varied.run(motion, start="quasi-static")
    loads, reaction = run.history("carriage_loads"), run.history("reaction")
    groups = machine.links_of_carriages, machine.carriage_places
    for k, column in enumerate(varied.columns):
        step = 1e-5 * (abs(column.value) or 1.0) * np.eye(len(to))[k]
        moved = machine.carriage_places.copy()
        ends = []
        for side in (1.0, -1.0):
            there = varied.run(motion, varied.values + side * step, start="quasi-static")
            if column.name.endswith(".x"):
                moved[2, 0] = column.value + side * step[k]
            ends.append((there.solution.group_loads(groups[0], moved, "total"), there.solution.reaction()))
        for mine, high, low in zip((loads[k], reaction[k]), *ends, strict=True):
            difference = (high - low) / (2.0 * step[k])
            assert np.abs(mine - difference).max() <= 1e-6 * max(np.abs(difference).max(), 1e-9)


@pytest.mark.parametrize("every", [1, 10], ids=["1 kHz", "100 Hz"])
def test_peak_is_that_at_any_time(every: int) -> None:
    """Its derivative is that of peaks of changed machines, also where the samples are far apart."""
    machine, motion = cart(), piece(pulse(), 4990, 5101)
    motion = Motion(motion.time[::every], motion.acceleration[::every])
    data = sensitivities(machine, motion, of="peak_resultant", to="carriages.*.stiffness_y")
    assert np.allclose(data["peak_resultant"], peak_loads(machine, motion).largest[:, 6], rtol=1e-12)

    def changed(index: int, factor: float) -> np.ndarray:
        each = list(machine.carriages)
        each[index] = each[index].model_copy(update={"stiffness_y": factor * each[index].stiffness_y})
        copy = machine.model_copy(update={"carriages": tuple(each)})
        return peak_loads(copy, motion).largest[:, 6]

    for k, value in enumerate(data["value"].to_numpy()):
        difference = (changed(k, 1.0 + 1e-4) - changed(k, 1.0 - 1e-4)) / (2e-4 * value)
        size = np.abs(data["d_peak_resultant"]).max().item()
        assert np.allclose(data["d_peak_resultant"][k], difference, rtol=1e-5, atol=1e-6 * size)
    assert data["d_peak_resultant"].attrs["units"] == "N per unit of the parameter"
    assert data["unit"].to_numpy().tolist() == ["N/m"] * 4
    assert data.attrs["notes"] == ""


def test_two_equal_peaks_have_no_derivative_if_the_load_changes_differently() -> None:
    """In space the same push by the drive's acceleration and, later, by a force: only the first one has the factor."""
    machine = Machine(**cart(4e5).model_dump() | {"gravity": (0.0, 0.0, 0.0)})
    time = np.arange(3000) * 1e-3
    first, second = (np.where((time > at) & (time < at + 0.01), 1.0, 0.0) for at in (0.1, 1.6))
    inertia = machine.scene.matrices()[0][0][:, 0]
    motion = Motion(time, np.outer(first, (1.0, 0.0, 0.0)), wrench=np.outer(second, -inertia))
    data = sensitivities(machine, motion, of="peak_resultant", to=["body.mass", "motion.scale"])
    assert np.isnan(data["d_peak_resultant"]).all()
    assert "peak_resultant of carriage 1a has no derivative: it is reached at 0.1" in data.attrs["notes"]
    twice = Motion.along_x(time, first + second)
    same = sensitivities(machine, twice, of="peak_resultant", to=["body.mass", "motion.scale"])
    assert np.allclose(same["d_peak_resultant"][1], same["peak_resultant"], rtol=1e-9)
    assert same.attrs["notes"] == ""


def test_mean_load_and_life_follow_the_loads() -> None:
    machine, motion = example()
    machine = Machine(**machine.model_dump() | {"products": [PRODUCT], "carriages": rated(machine)})
    to = ["body.mass", "carriages[1a].stiffness_y", "body.center_of_mass.z"]
    varied = VariedMachine(machine, to)
    figures = CarriageQuantities(varied.run(motion))
    (mean, d_mean), (life, d_life) = figures.mean_load(), figures.life()
    for k, column in enumerate(varied.columns):
        step = 1e-5 * column.value * np.eye(len(to))[k]
        high, low = (
            CarriageQuantities(varied.run(motion, varied.values + side * step)) for side in (1.0, -1.0)
        )
        for mine, name in ((d_mean, "mean_load"), (d_life, "life")):
            difference = (getattr(high, name)()[0] - getattr(low, name)()[0]) / (2.0 * step[k])
            assert np.allclose(mine[k], difference, rtol=2e-6)
    found = life_of(simulate(machine, motion))
    assert np.allclose(life, on_lines(found), rtol=1e-12)
    assert np.allclose(mean, [one.mean_load for one in found.carriages], rtol=1e-3)


def rated(machine: Machine) -> list[dict[str, Any]]:
    return [carriage.model_dump() | {"product": "20"} for carriage in machine.carriages]


def test_what_has_no_derivative_is_refused_with_the_way_out() -> None:
    machine, motion = cart(), random_motion(1, count=10)
    with pytest.raises(ArgumentError, match="of: expected names out of"):
        sensitivities(machine, motion, of="weight", to="body.mass")
    with pytest.raises(ArgumentError, match=r"expected a machine with \[\[points\]\]"):
        sensitivities(machine, motion, of="point_velocity", to="body.mass")
    with pytest.raises(ArgumentError, match="motion.scale"):
        VariedMachine(machine, "motion.scale", motion).run(motion, [0.0])
