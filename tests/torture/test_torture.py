"""Where methods fail, ours are right, or say that they refuse: every method on every scene of the torture set.

And `exact` on some more, which the torture page does not show.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import get_args

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray
from torture import DIGITS, RTOL, Scene
from torture_scenes import GAP, KICK, evenly, gap, pushes, scenes

from guideload import GuideloadError, Stability, sensitivities, simulate, stability
from guideload.base.methods import Method

Array = NDArray[np.float64]

SCENES = {scene.name: scene for scene in scenes()}


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
# For `exact` alone: many bounces, grazing by less and less, other chatter.
EXTRA = {
    scene.name: scene
    for scene in (
        Scene("a thousand impacts", "", {"y": gap(1e6)}, **pushes(KICK, (10.0, 0.0)), asked=evenly(10.0)),
        *(grazing(beyond) for beyond in (1e-9, 1e-12, 0.0, -1e-9)),
        HALVED,
        dropped("damped throughout", damping=300.0),
    )
}
# Error of `exact` over the largest load or displacement: the instant of an impact is rounded to 1e-16 of its time, and
# a stiff contact multiplies that; 2e-8 is reached after 4096 s. The others: ten times the tolerance, as everywhere.
MOST = dict.fromkeys(SCENES, 1e-8) | {"late contact": 1e-7} | dict.fromkeys(EXTRA, 1e-9)
# Contact changes beyond those of the closed form: pushed off an edge at the start, or touching by rounding.
UNCERTAIN = {"six decades at an edge": (0, 1), "grazing by 0": range(0, 101, 2)}
REFUSED = {
    ("row just opens", "exact"): "preloaded contact, which has no exact solution",
    ("light preload", "exact"): "preloaded contact, which has no exact solution",
    # A contact of 0.3 ms at 4096 s of an interval of 5000 s.
    ("late contact", "rk45"): "below 1e-9 of the interval between samples",
    ("late contact", "implicit"): "below 1e-9 of the interval between samples",
}


@pytest.mark.parametrize("name", SCENES | EXTRA)
def test_right_or_refused_and_each_event_found_once(name: str) -> None:
    """Contact changes are as many as the roots of the closed form, for each link that has the edge."""
    scene = (SCENES | EXTRA)[name]
    links = {"two edges in one place": 2}.get(name, 1)
    for method in get_args(Method) if name in SCENES else ("exact",):
        try:
            result = simulate(scene.machine, scene.motion, method, times=scene.times, rtol=RTOL)
        except GuideloadError as error:
            assert REFUSED[name, method] in str(error), method
            continue
        found = result.quantities["link_load"], result.quantities["displacement"][:, scene.axes]
        assert scene.error(*found) <= (MOST[name] if result.method == "exact" else 10.0 * RTOL), method
        if scene.by is None and method in ("exact", "rk45", "implicit"):
            # Without instants between the events, which could help to find them.
            ends = scene.motion.time[[0, -1]]
            run = simulate(scene.machine, scene.motion, method, times=ends, rtol=RTOL)
            more = run.data.attrs["contact_changes"] - links * sum(len(axis.events) for axis in scene.paths)
            assert more in UNCERTAIN.get(name, (0,)), method


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


@pytest.mark.parametrize("path", ["links[y].clearance", "links[z].stiffness", "links[z].damping"])
def test_derivatives_across_two_events_at_one_instant(path: str) -> None:
    """Against differences of the closed form, 1e-7 of the value apart: 1e-9 of rounding and of truncation."""
    scene = SCENES["two events at once"]
    thrown, flies = scene.corners[1], scene.corners[-1]
    times = np.concatenate([[0.0, thrown], np.linspace(thrown, flies, 98)])
    forces = np.zeros((times.size, 3))
    forces[:2] = scene.forces[0]
    sampled = replace(scene, corners=times, forces=forces, asked=times)
    found = sensitivities(sampled.machine, sampled.motion, of="link_load", to=[path]).d_link_load[0].values

    name, key = path[6], path.partition(".")[2]

    def loads(value: float) -> Array:
        springs = {
            link: {**keys, **({key: value} if link == name else {})} for link, keys in scene.springs.items()
        }
        moved = replace(sampled, springs=springs)
        return np.column_stack([one.at(times)[0] for one in moved.paths])

    value = scene.springs[name][key]
    low, high = value * (1.0 - 1e-7), value * (1.0 + 1e-7)
    with mpmath.workdps(DIGITS):
        expected = (loads(high) - loads(low)) / (high - low)
    assert np.abs(found - expected).max() <= 1e-6 * np.abs(expected).max()
