"""Contacts of one mass beyond those of the torture set: many bounces, grazing by less and less, other chatter.

The loads are known in closed form, as there (`tests/helpers/torture.py`).
"""

from __future__ import annotations

from math import sqrt

import pytest
from torture import Scene
from torture_scenes import GAP, KICK, evenly, gap, pushes

from guideload import Stability, simulate, stability


def grazing(beyond: float) -> Scene:
    """Fifty swings from rest to (1 + beyond) of the clearance: in contact for 6e-7 s, or never."""
    springs = {"y": gap(1e8), "y spring": {"stiffness": 1e4}}
    force = 0.5 * 1e4 * GAP * (1.0 + beyond)
    return Scene(f"grazing by {beyond:g}", "", springs, **pushes((3.125, force)), asked=evenly(3.0))


def dropped(name: str, **damping: object) -> Scene:
    """Lifted off its contact, dropped, bouncing until it stays."""
    lifted = pushes((5e-3, 25.0), (0.3, 0.0))
    return Scene(name, "", {"y": gap(1e7, **damping)}, **lifted, asked=evenly(0.3, 61), gravity=-9.80665)


HALVED = dropped("restitution 0.5", damping=2.0 * 0.215 * sqrt(1e7), damping_in_contact=True)
SCENES = [
    Scene("a thousand impacts", "", {"y": gap(1e6)}, **pushes(KICK, (10.0, 0.0)), asked=evenly(10.0)),
    *(grazing(beyond) for beyond in (1e-9, 1e-12, 0.0, -1e-9)),
    HALVED,
    dropped("damped throughout", damping=300.0),
]


@pytest.mark.parametrize("scene", SCENES, ids=[scene.name for scene in SCENES])
def test_exact_finds_each_contact_and_the_loads_of_the_closed_form(scene: Scene) -> None:
    """1e-9: the instant of each impact is rounded to 1e-16 of the time, and a thousand of these add up."""
    result = simulate(scene.machine, scene.motion, "exact", times=scene.times)
    assert (
        scene.error(result.quantities["link_load"], result.quantities["displacement"][:, scene.axes]) <= 1e-9
    )
    counted = simulate(scene.machine, scene.motion, "exact").data.attrs["contact_changes"]
    if scene.name == "grazing by 0":  # by rounding a swing may touch
        assert counted % 2 == 0 and counted <= 100
    else:
        assert counted == len(scene.paths[0].events)


@pytest.mark.parametrize("method", ["rk45", "implicit"])
def test_chatter_costs_the_other_methods_bounded_work(method: str) -> None:
    result = simulate(HALVED.machine, HALVED.motion, method, times=HALVED.times, rtol=1e-8)
    error = HALVED.error(result.quantities["link_load"], result.quantities["displacement"][:, HALVED.axes])
    assert error <= 1e-4
    assert result.data.attrs["steps"] <= 100 * (HALVED.times.size + len(HALVED.paths[0].events))


def test_step_limits_are_those_with_all_links_in_contact() -> None:
    machines = [dropped("contact", clearance=clearance, damping=100.0).machine for clearance in (1e-6, 0.0)]
    of_loose, of_tight = map(stability, machines)
    assert isinstance(of_loose, Stability) and isinstance(of_tight, Stability)
    assert of_loose.longest_steps == pytest.approx(of_tight.longest_steps)
