"""Machines that cannot rest are refused on every way; those that can are not."""

from __future__ import annotations

from pathlib import Path

import command_line
import numpy as np
import pytest

from guideload import Body, Carriage, Machine, Motion, Rail, SceneError, peak_loads, simulate

SHARED = Path(__file__).parents[2].parent / "shared" / "data" / "no_equilibrium.toml"
MOTION = Motion(np.linspace(0.0, 0.1, 11), np.zeros((11, 3)))


def between_carriages(other_side: float) -> Machine:
    """A body beside two carriages, of which one presses down only and one up only but for a share of the stiffness."""
    stiff, soft = 2e8, other_side * 2e8
    rails = [Rail(name="left", position=(0.0, -0.25)), Rail(name="right", position=(0.0, 0.25))]
    sides = {"left": {"positive": soft, "negative": stiff}, "right": {"positive": stiff, "negative": soft}}
    keys = {"length": 0.04, "stiffness_z": 2e8, "damping_y": 1e4, "damping_z": 1e4}
    carriages = [
        Carriage(name=rail, rail=rail, x=x, stiffness_y=sides[rail], **keys)
        for rail, x in (("left", 0.3), ("right", -0.3))
    ]
    body = Body(mass=800.0, center_of_mass=(-0.01, 1.6, -1.4), inertia=np.diag([90.0, 120.0, 75.0]).tolist())
    return Machine(body=body, rails=rails, carriages=carriages, free=("y", "z", "rx", "ry", "rz"))


LEAVES = r"no static equilibrium: the weight is more than the links bear against rotation about \(-?0\.\d+"


def test_every_way_refuses_a_machine_without_a_rest_position() -> None:
    machine = between_carriages(0.0)
    with pytest.raises(SceneError, match=LEAVES):
        machine.scene  # noqa: B018
    for method in ("auto", "exact", "exponential", "rk45", "implicit"):
        for run in (simulate, peak_loads):
            with pytest.raises(SceneError, match=LEAVES):
                run(machine, MOTION, method)


def test_links_that_resist_a_little_on_the_other_side_hold_it() -> None:
    machine = between_carriages(1e-3)
    loads = machine.scene.static_link_loads()
    assert loads[[0, 2, 4, 6]].sum() == pytest.approx(-800.0 * 9.80665, rel=1e-9)


@pytest.mark.skipif(not SHARED.exists(), reason="needs the machine no_equilibrium.toml beside the repository")
def test_a_machine_file_that_rested_far_away_is_refused() -> None:
    with pytest.raises(SceneError, match=LEAVES):
        peak_loads(Machine.from_toml(SHARED), MOTION)
    assert "no static equilibrium" in command_line.refused("check", SHARED)
