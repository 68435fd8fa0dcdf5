"""Derivatives of histories and figures of runs: 50 digits, hostile damping and time stamps, adjoint against forward."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lives import PRODUCT, on_lines
from machines import with_carriages
from numpy.typing import NDArray
from precise_derivatives import assert_near, central_differences, differences, histories_of
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
    two_carriages,
)

from guideload import Machine, Motion, life_of, peak_loads, sensitivities, simulate
from guideload.base.errors import ArgumentError
from guideload.sensitivity import VariedMachine
from guideload.sensitivity.figures import CarriageQuantities

Array = NDArray[Any]


def stronger(factor: float) -> Motion:
    """A random motion times a factor, of a cart at a constant speed."""
    motion = random_motion(1, count=20)
    return Motion(motion.time, factor * motion.acceleration, velocity=0.5 + 0.0 * motion.acceleration)


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
            for quantity in QUANTITIES:
                forward = run.history(quantity)
                weights = rng.normal(size=forward.shape[1:])
                ahead = (forward * weights).reshape(len(values), -1).sum(axis=1)
                size = np.abs(forward * weights).reshape(len(values), -1).sum(axis=1)
                assert (np.abs(run.gradient(weights, quantity) - ahead) <= 1e-10 * size + 1e-300).all()


PRELOADED = {"preload_y": 900.0, "rolling": "ball"}


QUANTITIES = ("carriage_loads", "link_loads", "displacement", "velocity", "acceleration", "reaction")
LINEAR = ["body.mass", "carriages[1a].stiffness_y", "carriages[1a].x", "motion.scale", "motion.force_scale"]
CLEAR = [
    "body.mass",
    "body.center_of_mass.z",
    "carriages[1a].x",
    "carriages[1a].preload_y",
    "carriages[2a].clearance_z",
    "carriages[2a].damping_z",
    "motion.scale",
]


@pytest.mark.parametrize(
    ("machine", "motion", "to", "start", "rtol"),
    [
        (cart(), random_motion(7, count=50, wrench=True), LINEAR, "quasi-static", 1e-6),
        (two_carriages(**PRELOADED, clearance_z=2e-6), stronger(12.0), CLEAR, "rest", 1e-5),
        (two_carriages(**PRELOADED, clearance_z=2e-6), stronger(12.0), CLEAR, "quasi-static", 1e-5),
    ],
    ids=["linear under way", "preload and clearance", "preload and clearance under way"],
)
def test_all_quantities_by_differences(
    machine: Machine, motion: Motion, to: list[str], start: Any, rtol: float
) -> None:
    varied = VariedMachine(machine, to, motion)

    def quantities(values: Array) -> list[Array]:
        solution, places = varied.run(motion, values, start=start).solution, machine.carriage_places.copy()
        places[0, 0] = values[to.index("carriages[1a].x")]
        loads = (
            solution.group_loads(machine.links_of_carriages, places, "total"),
            solution.link_loads("total"),
        )
        return [
            *loads,
            solution.position(),
            solution.velocity(),
            solution.acceleration(),
            solution.reaction(),
        ]

    run = varied.run(motion, start=start)
    assert (run.solution.contact_changes > 0) == (to is CLEAR)
    for name, wanted in zip(QUANTITIES, central_differences(varied, quantities, 1e-5), strict=True):
        assert_near(run.history(name), wanted, rtol, 0.0 if name in ("displacement", "velocity") else 1e-9)


@pytest.mark.parametrize("every", [1, 10], ids=["1 kHz", "100 Hz"])
def test_peak_is_that_at_any_time(every: int) -> None:
    """Its derivative is that of peaks of changed machines, also where the samples are far apart."""
    machine, motion = cart(), piece(pulse(), 4990, 5101)
    motion = Motion(motion.time[::every], motion.acceleration[::every])
    data = sensitivities(machine, motion, of="peak_resultant", to="carriages.*.stiffness_y")
    assert np.allclose(data["peak_resultant"], peak_loads(machine, motion).largest[:, 6], rtol=1e-12)

    def changed(index: int, factor: float) -> np.ndarray:
        one = machine.carriages[index]
        copy = with_carriages(machine, one.name, stiffness_y=factor * one.stiffness_y)
        return peak_loads(copy, motion).largest[:, 6]

    for k, value in enumerate(data["value"].to_numpy()):
        difference = (changed(k, 1.0 + 1e-4) - changed(k, 1.0 - 1e-4)) / (2e-4 * value)
        size = np.abs(data["d_peak_resultant"]).max().item()
        assert np.allclose(data["d_peak_resultant"][k], difference, rtol=1e-5, atol=1e-6 * size)
    assert data["d_peak_resultant"].attrs == {"units_of_numerator": "N"}  # per `unit`, which differs
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


def rated(machine: Machine, **first: Any) -> Machine:
    """The machine with a product of its carriages; first: keys of the first one."""
    carriages = [carriage.model_dump() | {"product": "20"} for carriage in machine.carriages]
    carriages[0] |= first
    return Machine(**machine.model_dump() | {"products": [PRODUCT], "carriages": carriages})


PRELOADS = "carriages[1a].preload_y", "carriages[2a].preload_y", "carriages[1a].preload_z"


@pytest.mark.parametrize(
    ("machine", "motion", "to", "step", "rtol", "atol"),
    [
        (*example(), ["body.mass", "carriages[1a].stiffness_y", "body.center_of_mass.z"], 1e-5, 2e-6, 0.0),
        (
            two_carriages(**PRELOADED, preload_z=600.0),
            stronger(12.0),
            {"mass": "body.mass", "y": PRELOADS[:2], "z": PRELOADS[2]},
            1e-4,
            1e-5,
            1e-7,
        ),
    ],
    ids=["linear", "preloaded"],
)
def test_mean_load_and_life_follow_the_loads(
    machine: Machine, motion: Motion, to: Any, step: float, rtol: float, atol: float
) -> None:
    """A preload acts on the loads, and on what the loaded row carries under them."""
    machine = rated(machine, **{"preload_y": 700.0} if isinstance(to, dict) else {})
    varied = VariedMachine(machine, to)

    def computed(values: Array) -> list[Array]:
        figures = CarriageQuantities(varied.run(motion, values))
        return [figures.mean_load()[0], figures.life()[0]]

    figures = CarriageQuantities(varied.run(motion))
    (mean, d_mean), (life, d_life) = figures.mean_load(), figures.life()
    for mine, wanted in zip((d_mean, d_life), central_differences(varied, computed, step), strict=True):
        assert np.allclose(mine, wanted, rtol=rtol, atol=atol * np.abs(wanted).max(axis=1, keepdims=True))
    assert np.isfinite(life).all()
    if isinstance(to, dict):
        assert [column.form for column in varied.columns] == ["value", "factor", "value"]
        assert (mean > 700.0).all()
    else:
        found = life_of(simulate(machine, motion))
        assert np.allclose(life, on_lines(found), rtol=1e-12)
        assert np.allclose(mean, [one.mean_load for one in found.carriages], rtol=1e-3)


def test_what_has_no_derivative_is_refused_with_the_way_out() -> None:
    machine, motion = cart(), random_motion(1, count=10)
    with pytest.raises(ArgumentError, match="of: expected names out of"):
        sensitivities(machine, motion, of="weight", to="body.mass")
    with pytest.raises(ArgumentError, match=r"expected a machine with \[\[points\]\]"):
        sensitivities(machine, motion, of="point_velocity", to="body.mass")
    with pytest.raises(ArgumentError, match="motion.scale"):
        VariedMachine(machine, "motion.scale", motion).run(motion, [0.0])
