"""Structure in series with a carriage: k/(1 + k c), curves and clearances formed exactly, and the damping."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from machines import body
from scipy.optimize import brentq

from guideload._core import Law
from guideload.base.errors import ConfigError
from guideload.machine.components import Carriage, Rail
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.motion import Motion
from guideload.simulation.simulation import simulate
from guideload.study import Study

COMPLIANCE = 4e-9  # m/N
KEYS = {
    "name": "a",
    "rail": "1",
    "x": 0.0,
    "length": 0.1,
    "damping_y": 6e3,
    "damping_z": 5e3,
    "stiffness_z": 1e8,
}


def carriage(**keys: Any) -> Carriage:
    return Carriage(**{**KEYS, **keys})


def on_it(one: Carriage, **changes: Any) -> Machine:
    """50 kg on one carriage, centred in L."""
    block = body(mass=50.0, center_of_mass=(0.0, 0.0, 0.0), inertia=np.eye(3))
    return Machine(body=block, rails=[Rail(name="1", position=(0.0, 0.0))], carriages=[one], **changes)


@pytest.mark.parametrize(
    "keys",
    [
        {"stiffness_y": 2e8},
        {"stiffness_y": {"positive": 1.5e8, "negative": 3e8}},
        {"stiffness_y": 2e8, "clearance_y": 3e-6},
        {"curve_y": ((0.0, 0.0), (1e-5, 2e3), (3e-5, 9e3))},
        {"curve_y": ((-2e-5, -6e3), (0.0, 0.0), (5e-6, 0.0), (3e-5, 9e3))},
    ],
)
def test_deflections_of_carriage_and_structure_add_at_the_same_force(keys: dict[str, Any]) -> None:
    """F(d) of the series law solves F = F_carriage(d - c F), here by bisection."""
    alone, together = (carriage(**keys, **more).laws[0] for more in ({}, {"compliance_y": COMPLIANCE}))

    def force(law: Law, deflection: float) -> float:
        return float(law.force(np.array([deflection]))[0])

    for deflection in np.linspace(-6e-5, 6e-5, 25):
        largest = abs(deflection) / COMPLIANCE
        expected = brentq(
            lambda f, d=deflection: force(alone, d - COMPLIANCE * f) - f,
            -largest - 1.0,
            largest + 1.0,
            xtol=1e-9,
            rtol=1e-14,
        )
        assert force(together, deflection) == pytest.approx(expected, rel=1e-11, abs=1e-8)


def test_series_stiffness_frequency_and_tilting_of_a_machine() -> None:
    """k/(1 + k c) along y; the distances of stated stiffnesses are those of the carriage alone."""
    stiffness, roll = 2e8, 3e4
    one = carriage(stiffness_y=stiffness, compliance_y=COMPLIANCE, stiffness_roll=roll)
    machine = on_it(one, free=("y",))
    series = stiffness / (1.0 + stiffness * COMPLIANCE)
    assert Modes.of(machine).frequency == pytest.approx(np.sqrt(series / 50.0) / (2.0 * np.pi), rel=1e-12)
    (_, _, matrix), _ = machine.scene.matrices()
    assert matrix[3, 3] == pytest.approx(roll * series / stiffness, rel=1e-12)


def test_damping_is_that_of_a_maxwell_chain_to_first_order() -> None:
    """Spring and damper of the carriage in series with the structure's spring: the exact decay of a light mass."""
    stiffness, damping, mass = 2e8, 2e2, 50.0
    one = carriage(stiffness_y=stiffness, damping_y=damping, compliance_y=COMPLIANCE)
    machine = on_it(one, free=("y",))
    # State: body y, v and the carriage's deflection e; structure force (y - e)/c = k e + b e'.
    flow = np.array(
        [
            [0.0, 1.0, 0.0],
            [-1.0 / COMPLIANCE / mass, 0.0, 1.0 / COMPLIANCE / mass],
            [1.0 / COMPLIANCE / damping, 0.0, -(stiffness + 1.0 / COMPLIANCE) / damping],
        ]
    )
    pair = [value for value in np.linalg.eigvals(flow) if value.imag > 0.0][0]
    ours = [value for value in Modes.of(machine).eigenvalues if value.imag > 0.0][0]
    assert ours.real == pytest.approx(pair.real, rel=1e-5)  # second order: (b omega/k)^2 = 4e-6
    assert ours.imag == pytest.approx(pair.imag, rel=1e-5)


def test_preloaded_laws_are_refused_with_the_way_out() -> None:
    with pytest.raises(ConfigError, match=r"no compliance_y beside preload_y.*curve_y"):
        carriage(stiffness_y=2e8, preload_y=2e3, rolling="ball", compliance_y="4 um/kN")


def test_studies_refuse_a_stiffness_in_series_and_vary_its_damping() -> None:
    machine = on_it(carriage(stiffness_y=2e8, compliance_y="4 um/kN", width="30 mm"))
    time = np.linspace(0.0, 0.02, 41)
    motion = Motion.along_x(time, np.sin(300.0 * time))

    def study(key: str) -> Study:
        entry = {"path": f"carriages.*.{key}", "distribution": "uniform", "plus_minus": "10 %"}
        return Study(machine=machine, motion=motion, samples=4, seed=1, vary=[entry])

    with pytest.raises(
        ConfigError, match=r"takes the law with the structure, 1.11111e\+08 N/m, in place of compliance_y"
    ):
        study("stiffness_y")
    plan = study("damping_y").plan()
    damping = {target: (constant, terms) for target, constant, terms in plan.changes}
    nominal = machine.link_table().damping
    for (name, link, _), (constant, terms) in damping.items():
        assert name == "damping"
        assert constant + sum(factor * 6e3 for _, factor in terms) == pytest.approx(nominal[link], rel=1e-14)
    assert simulate(machine, motion).audit.force_balance.holds
