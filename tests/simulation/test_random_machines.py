"""Random machine files of every mixture of laws against an independent reference; `tests/fuzz/scenes.py` runs more."""

import numpy as np
import pytest
import random_machines
from oscillator import step_response
from plain_reference import NoReference, PlainMachine
from scenes import GOAL, errors


@pytest.mark.parametrize("first", range(0, 60, 10))
def test_loads_of_random_machines_keep_their_tolerance(tmp_path, first):
    compared = 0
    for seed in range(first, first + 10):
        try:
            found = errors(seed, tmp_path, rtols=(1e-6,))
        except NoReference:
            continue
        compared += 1
        assert max(found.values()) <= GOAL, (seed, found)
    assert compared >= 8


def test_the_reference_obeys_a_textbook_oscillator():
    """m z'' + b z' + k z = F from t = 0 on, at rest before: the step response of a damped oscillator."""
    mass, k, b, force = 3.0, 1.2e4, 40.0, 7.0
    link = {"name": "z", "point": [0, 0, 0], "direction": [0, 0, 1], "stiffness": k, "damping": b}
    machine = PlainMachine(
        {
            "free": ["z"],
            "gravity": [0.0, 0.0, 0.0],
            "body": {"mass": mass, "center_of_mass": [0, 0, 0], "inertia": np.eye(3).tolist()},
            "links": [link],
        }
    )
    time = np.linspace(0.0, 0.4, 60)
    wrench = np.zeros((60, 6))
    wrench[:, 2] = force
    loads, _ = machine.loads(time, np.zeros((60, 3)), wrench)
    place, speed = step_response((mass, k, b), time, force)
    assert loads[:, 0] == pytest.approx(k * place + b * speed, abs=1e-9 * force)


def test_random_machines_hold_every_law():
    machines = [random_machines.values(seed) for seed in range(60)]
    keys = {key for machine in machines for carriage in machine["carriages"] for key in carriage}
    assert keys >= {"clearance_y", "curve_z", "preload_y", "stiffness_z", "damping_in_contact"}
    assert any(machine["links"] for machine in machines)
