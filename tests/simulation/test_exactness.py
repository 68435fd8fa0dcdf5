"""Method exact against the reference in 70 digits: relative errors of the loads at most 1e-11.

`pytest -s tests/simulation/test_exactness.py` prints what is reached.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
import reference as ref
from numpy.typing import NDArray
from oscillator import step_response
from reference import DOFS, Reference

from guideload import Machine, Motion, simulate

Array = NDArray[np.float64]
REQUIRED = 1e-11

# What a double-precision run can reach here is set by the rounding of M, K and the modes: about 1e-16 times the
# number of radians a mode turns, times how much nearly parallel links amplify. Scenes reach 1e-15 to 1e-12.


def errors(machine: Machine, motion: Motion, exact: Reference) -> dict[str, float]:
    """Largest difference over the largest value, of each load; `dynamic`: over the largest change from rest."""
    data = simulate(machine, motion, "exact", times=motion.time).data
    load = data["link_load"].values
    found = {
        "link": relative(load, exact.link_load),
        "dynamic": np.abs(load - exact.link_load).max()
        / np.abs(exact.link_load - exact.static_link_load).max(),
        "static": relative(data["static_link_load"].values, exact.static_link_load),
        "reaction": relative(data["reaction"].values[:, :3], exact.reaction[:, :3]),
        "reaction moment": relative(data["reaction"].values[:, 3:], exact.reaction[:, 3:]),
    }
    if exact.carriage.size:
        found["force"] = relative(data["force"].values, exact.carriage[:, :, :3])
        found["moment"] = relative(data["moment"].values, exact.carriage[:, :, 3:])
    return found


def relative(got: Array, expected: Array) -> float:
    assert got.shape == expected.shape
    scale = float(np.abs(expected).max())
    difference = float(np.abs(got - expected).max())
    return difference if scale == 0.0 else difference / scale


def require(name: str, found: dict[str, float]) -> None:
    print(f"\n{name}: " + ", ".join(f"{key} {value:.1e}" for key, value in found.items()), end="")
    assert max(found.values()) <= REQUIRED, f"{name}: {found}"


# ---- the reference itself


@pytest.mark.parametrize("scene", [ref.cart_stiff, ref.paper])
def test_the_reference_has_50_digits(scene: Callable[[], Machine]) -> None:
    motion = ref.piece(ref.cycle(), 600, 700)
    coarse, fine = (ref.precise(scene(), motion, digits) for digits in (ref.DIGITS, ref.DIGITS + 30))
    for name in ("link_load", "reaction"):
        differences = [
            abs(a - b)
            for row, other in zip(coarse[name], fine[name], strict=True)
            for a, b in zip(row, other, strict=True)
        ]
        largest = max(abs(x) for row in fine[name] for x in row)
        assert max(differences) <= largest * 1e-50


def test_the_reference_obeys_a_textbook_oscillator() -> None:
    """m q'' + b q' + k q = -m a under a constant a from t = 0."""
    mass, k, b, a = 1250.0, 5e7, 4e4, 2.0
    machine = ref.translating(mass, [("y", (0.0, 1.0, 0.0), k, b)])
    time = np.arange(400) / 1000.0
    motion = Motion(time, np.tile([0.0, a, 0.0], (time.size, 1)))
    expected = step_response((mass, k, b), time, -mass * a)[0] - mass * 9.80665 / k
    # The closed form in double precision: 1e-16 of 80 rad.
    assert np.abs(ref.reference(machine, motion).displacement[:, 1] - expected).max() <= 1e-13 * mass * a / k


# ---- the yardstick and the example


@pytest.mark.parametrize("motion", [ref.cycle, ref.noisy, ref.pulse])
@pytest.mark.parametrize("scene", [ref.cart, ref.cart_stiff, ref.paper])
def test_yardstick_scenes(scene: Callable[[], Machine], motion: Callable[[], Motion]) -> None:
    start = 4950 if motion is ref.pulse else 560
    part = ref.piece(motion(), start, start + 150)
    machine = scene()
    require(f"{scene.__name__}, {motion.__name__}", errors(machine, part, ref.reference(machine, part)))


@pytest.mark.parametrize("free", [("y", "z", "rx", "ry", "rz"), ("rx", "ry", "rz")])
def test_the_packaged_example(free: Sequence[str]) -> None:
    machine, motion = ref.example()
    machine = machine.with_free(free)
    part = ref.piece(motion, 550, 1050)  # rest, jerk, acceleration
    require(f"example, {' '.join(free)}", errors(machine, part, ref.reference(machine, part)))


# ---- random scenes


def one_mode_critical(seed: int, mode: int) -> Machine:
    """Damping beta K with beta = 2 / omega: one mode is critically damped, to rounding."""
    machine = ref.random_machine(seed, free=DOFS)
    beta = 2.0 / float(machine.scene.modes()[0][mode])
    links = [link.model_copy(update={"damping": beta * link.stiffness}) for link in machine.links]
    return machine.model_copy(update={"links": links})


# Random machines (or how one is made from a seed) and random motions; their seed is the place in this table.
SCENES: dict[str, tuple[dict[str, Any] | Callable[[int], Machine], dict[str, Any]]] = {
    "damped, 1 axis": ({}, {"axes": 1}),
    "damped, 3 axes": ({}, {}),
    "damped, all free": ({"free": DOFS}, {}),
    "damped, with carriages": ({"free": DOFS[1:], "carriages": 3}, {"wrench": True}),
    "undamped, some free": ({"damping": 0.0}, {}),
    "undamped, all free": ({"damping": 0.0, "free": DOFS}, {}),
    "undamped, 1.5 s": ({"damping": 0.0, "free": DOFS}, {"count": 1500, "axes": 1}),
    "overdamped, some free": ({"damping": 300.0}, {}),
    "overdamped, all free": ({"damping": 1e3, "free": DOFS}, {}),
    # 2 sqrt(k m) = 5e5, exactly
    "defective, one dof": (lambda _: ref.translating(1250.0, [("y", (0, 1, 0), 5e7, 5e5)]), {}),
    "defective, six dofs": (lambda _: ref.all_modes_critical(), {"wrench": True}),
    "defective to rounding, first mode": (lambda seed: one_mode_critical(seed, 0), {}),
    "defective to rounding, fourth mode": (lambda seed: one_mode_critical(seed, 3), {}),
    "stiffness spread 1e6": ({"stiffness": (1e3, 1e9), "free": DOFS}, {}),
    "stiffness spread 1e8": ({"stiffness": (1e2, 1e10), "free": DOFS}, {}),
    "stiffness spread 1e8, undamped": ({"stiffness": (1e2, 1e10), "damping": 0.0}, {}),
    "times all different": ({}, {"times": "random"}),
    "times of a device clock": ({"free": DOFS}, {"times": "ticks", "count": 60}),
    "jumps": ({"damping": 0.1}, {"times": "ticks", "jumps": True, "count": 60}),
    "process forces, jumps, times all different": (
        {"free": DOFS},
        {"wrench": True, "times": "random", "jumps": True},
    ),
}


def machine_of(name: str) -> Machine:
    seed, (make, _) = list(SCENES).index(name) + 1, SCENES[name]
    return make(seed) if callable(make) else ref.random_machine(seed, **make)


@pytest.mark.parametrize("name", SCENES)
def test_random_scenes(name: str) -> None:
    machine, motion = machine_of(name), ref.random_motion(list(SCENES).index(name) + 1, **SCENES[name][1])
    require(name, errors(machine, motion, ref.reference(machine, motion)))


def test_the_random_scenes_are_what_they_are_called() -> None:
    for name in SCENES:
        machine = machine_of(name)
        eigenvalues = np.asarray(machine.scene.modes()[3])
        ratios = -eigenvalues.real / np.abs(eigenvalues)
        if name.startswith("undamped"):
            assert np.abs(ratios).max() < 1e-12
        if name.startswith("overdamped"):
            assert ratios.min() > 0.99
        if name in ("defective, one dof", "defective, six dofs"):
            assert eigenvalues.size == 2 * len(machine.free)
            # A double eigenvalue splits by the square root of rounding.
            assert np.ptp(eigenvalues.real) <= 1e-7 * np.abs(eigenvalues).max()
            assert np.abs(eigenvalues.imag).max() <= 1e-7 * np.abs(eigenvalues).max()
