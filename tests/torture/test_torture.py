"""Where methods fail, ours are right, or say that they refuse: every method on every scene of the torture set."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray
from torture import DIGITS, RTOL
from torture_scenes import scenes

from guideload import GuideloadError, sensitivities, simulate
from guideload.base.methods import Method

Array = NDArray[np.float64]

SCENES = {scene.name: scene for scene in scenes()}
# Error of `exact` over the largest load or displacement: the instant of an impact is rounded to 1e-16 of its time, and
# a stiff contact multiplies that; 2e-8 is reached after 4096 s. The others: ten times the tolerance, as everywhere.
MOST, LATE = 1e-8, {"late contact": 1e-7}
REFUSED = {
    ("row just opens", "exact"): "preloaded contact, which has no exact solution",
    ("light preload", "exact"): "preloaded contact, which has no exact solution",
    # A contact of 0.3 ms at 4096 s of an interval of 5000 s.
    ("late contact", "rk45"): "below 1e-9 of the interval between samples",
    ("late contact", "implicit"): "below 1e-9 of the interval between samples",
}


@pytest.mark.parametrize("name", SCENES)
def test_right_or_refused_and_each_event_found_once(name: str) -> None:
    """Contact changes are as many as the roots of the closed form, for each link that has the edge."""
    scene = SCENES[name]
    links = {"two edges in one place": 2}.get(name, 1)
    starts_on_edge = name == "six decades at an edge"  # and is pushed off it: counted or not
    for method in get_args(Method):
        try:
            result = simulate(scene.machine, scene.motion, method, times=scene.times, rtol=RTOL)
        except GuideloadError as error:
            assert REFUSED[name, method] in str(error), method
            continue
        found = result.quantities["link_load"], result.quantities["displacement"][:, scene.axes]
        assert scene.error(*found) <= (LATE.get(name, MOST) if result.method == "exact" else 10.0 * RTOL), (
            method
        )
        if scene.by is None and method in ("exact", "rk45", "implicit"):
            counted = simulate(scene.machine, scene.motion, method, rtol=RTOL).data.attrs["contact_changes"]
            more = counted - links * sum(len(axis.events) for axis in scene.paths)
            assert more in {0, int(starts_on_edge)}, method


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
