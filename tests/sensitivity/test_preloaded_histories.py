"""Derivatives of histories with preloaded links: against a complex step, and against differences of tight runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from machines import with_carriages
from numpy.typing import NDArray
from precise_derivatives import assert_near, central_differences
from reference import preloaded, random_motion, two_carriages
from scipy.integrate import solve_ivp

from guideload import Body, Link, Machine, Motion, sensitivities
from guideload.base.errors import ArgumentError, RunError
from guideload.sensitivity import VariedMachine

Array = NDArray[Any]

# ---- two preloaded links side by side, in complex numbers

NUMBERS = {"mass": 100.0, "stiffness": 4e6, "preload": 300.0, "z": -0.3}
PATHS = {
    "mass": "body.mass",
    "stiffness": "links[a].stiffness",
    "preload": "links[a].preload",
    "z": "links[a].point.z",
}
INERTIA, DAMPING, GRAVITY = 8.0, 900.0, 4.0
TIME = np.linspace(0.0, 0.03, 13)


def pair(rolling: str = "ball") -> Machine:
    law = {"stiffness": NUMBERS["stiffness"], "preload": NUMBERS["preload"], "rolling": rolling}
    links = [
        Link(name=name, point=(0.0, 0.0, z), direction=(0.0, 1.0, 0.0), damping=DAMPING, **law)
        for name, z in (("a", NUMBERS["z"]), ("b", 0.3))
    ]
    body = Body(mass=NUMBERS["mass"], center_of_mass=(0.0, 0.0, 0.0), inertia=INERTIA * np.eye(3))
    return Machine(body=body, links=links, free=("y", "rx"), gravity=(0.0, -GRAVITY, 0.0))


def pushes(size: float) -> Array:
    return size * np.sin(2.0 + 400.0 * TIME)


def complex_step(size: float, exponent: float, name: str) -> Array:
    """Derivative of (y, rx, y', rx') by a number, at the samples: the imaginary part for an imaginary change."""
    step = 1e-30
    numbers: dict[str, complex] = {**NUMBERS, name: NUMBERS[name] * (1.0 + step * 1j)}
    base = NUMBERS["stiffness"], NUMBERS["preload"]
    laws = [(numbers["stiffness"], numbers["preload"], numbers["z"]), (*base, 0.3)]

    def force(x: complex, k: complex, preload: complex) -> tuple[complex, complex]:
        opening = 2.0 * exponent * preload / k
        scale, rows = preload / opening**exponent, (opening + x, opening - x)
        powers = [row**exponent if row.real > 0.0 else 0.0 for row in rows]
        slopes = [exponent * row ** (exponent - 1.0) if row.real > 0.0 else 0.0 for row in rows]
        return scale * (powers[0] - powers[1]), scale * sum(slopes)

    def pull(q: Array) -> tuple[Array, Array]:
        out, slope = np.zeros(2, complex), np.zeros((2, 2), complex)
        for k, preload, z in laws:
            d = np.array([1.0, -z])
            load, rate = force(d @ q, k, preload)
            out, slope = out + load * d, slope + rate * np.outer(d, d)
        return out, slope

    mass, weight = np.array([numbers["mass"], INERTIA]), np.array([-GRAVITY * numbers["mass"], 0.0])
    rest = np.zeros(2, complex)
    for _ in range(40):
        load, slope = pull(rest)
        rest = rest + np.linalg.solve(slope, weight - load)

    def rate(t: float, parts: Array) -> Array:
        """Real part, and imaginary part over the step, so that the step control sees both."""
        x = parts[:4] + step * 1j * parts[4:]
        outer = weight - mass * np.array([np.interp(t, TIME, pushes(size)), 0.0])
        drag = sum(DAMPING * np.array([1.0, -z]) * (np.array([1.0, -z]) @ x[2:]) for *_, z in laws)
        out = np.concatenate([x[2:], (outer - pull(x[:2])[0] - drag) / mass])
        return np.concatenate([out.real, out.imag / step])

    states = [np.concatenate([rest.real, [0.0, 0.0], rest.imag / step, [0.0, 0.0]])]
    for ends in zip(TIME[:-1], TIME[1:], strict=True):
        states.append(solve_ivp(rate, ends, states[-1], method="DOP853", rtol=1e-12, atol=1e-16).y[:, -1])
    return np.array(states)[:, 4:] / NUMBERS[name]


@pytest.mark.parametrize(
    ("size", "rolling"), [(3.0, "ball"), (3.0, "roller"), (14.0, "ball"), (14.0, "roller")]
)
def test_two_links_by_a_complex_step(size: float, rolling: str) -> None:
    machine = pair(rolling)
    acceleration = np.zeros((TIME.size, 3))
    acceleration[:, 1] = pushes(size)
    run = VariedMachine(machine, list(PATHS.values())).run(Motion(TIME, acceleration), start="rest")
    exponent = {"ball": 1.5, "roller": 10.0 / 9.0}[rolling]
    opening = 2.0 * exponent * NUMBERS["preload"] / NUMBERS["stiffness"]
    assert (np.abs(run.solution.position()[:, 1]).max() > opening) == (size > 3.0)
    for k, name in enumerate(PATHS):
        wanted = complex_step(size, exponent, name)
        for mine, column in ((run.history("displacement"), 0), (run.history("velocity"), 2)):
            for dof, index in ((1, 0), (3, 1)):
                size_of = np.abs(wanted[:, column : column + 2]).max()
                assert np.abs(mine[k, :, dof] - wanted[:, column + index]).max() <= 1e-9 * size_of


@pytest.mark.parametrize("gravity", [0.0, 1e-3])
def test_a_preload_that_no_load_bends_at_rest(gravity: float) -> None:
    """Near the middle of the law the terms of its derivative cancel; their rounding shortened the steps without end."""
    machine = pair().model_copy(update={"gravity": (0.0, -gravity, 0.0)})
    acceleration = np.zeros((TIME.size, 3))
    acceleration[3:, 1] = pushes(3.0)[3:]
    varied = VariedMachine(machine, ["links[a].preload"])
    motion = Motion(TIME, acceleration)
    found = varied.run(motion, start="rest").history("displacement")
    (wanted,) = central_differences(
        varied, lambda values: [varied.run(motion, values, start="rest").solution.position()], 1e-3
    )
    assert_near(found, wanted, 1e-4)  # the square of a step of 1e-3, and rounding


def test_an_interval_too_long_for_the_fastest_mode_is_refused_at_once() -> None:
    motion = Motion([0.0, 1e6], np.ones((2, 3)))
    with pytest.raises(RunError, match="steps or more"):
        VariedMachine(pair(), ["links[a].preload"]).run(motion, start="rest")


def test_a_motion_whose_many_samples_take_too_many_steps_is_refused_at_once() -> None:
    """By the decay of an overdamped mode; each interval alone would be short enough."""
    machine = with_carriages(preloaded(), damping_y=1e12)
    motion = Motion(1e-3 * np.arange(2000), np.ones((2000, 3)))
    with pytest.raises(RunError, match="steps or more"):
        VariedMachine(machine, ["body.mass"]).run(motion, start="rest")


def test_gradient_and_peak_follow_the_histories() -> None:
    machine = pair()
    acceleration = np.zeros((TIME.size, 3))
    acceleration[:, 1] = pushes(20.0)
    run = VariedMachine(machine, list(PATHS.values())).run(Motion(TIME, acceleration), start="rest")
    weights = np.random.default_rng(0).normal(size=(TIME.size, 2))
    forward = (run.history("link_loads") * weights).sum(axis=(1, 2))
    assert np.allclose(run.gradient(weights, "link_loads"), forward, rtol=1e-12)


def test_a_damper_that_acts_only_in_contact_is_refused() -> None:
    laws = {"preload_y": 900.0, "rolling": "ball", "clearance_z": 2e-6, "damping_in_contact": True}
    machine = two_carriages(**laws)
    with pytest.raises(ArgumentError, match="damping_in_contact = false"):
        sensitivities(machine, random_motion(1, count=4), of="force", to="body.mass")
