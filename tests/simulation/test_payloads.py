"""Payloads that come and go: the law of a change, closed forms, and results that agree with those of fixed masses."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import reference as ref
from machines import with_carriages
from oscillator import step_response

from guideload import Machine, Motion, simulate
from guideload.base.errors import ArgumentError, ConfigError
from guideload.machine.payloads import Payload

INERTIA = ((1.5, 0.0, 0.0), (0.0, 1.2, 0.0), (0.0, 0.0, 0.9))


def payload(**values: Any) -> Payload:
    given = {"name": "part", "mass": 90.0, "center_of_mass": (0.3, 0.25, -0.1), "inertia": INERTIA}
    return Payload(**(given | values))


def add_payloads(machine: Machine, *payloads: Payload) -> Machine:
    return machine.model_copy(update={"payloads": payloads})


def test_a_payload_picked_up_at_rest_gives_the_step_response_of_the_textbook():
    part = payload(mass=5.0, center_of_mass=(0.0, 0.0, 0.0), times=[(0.1, 9.0)])
    spring = ref.translating(20.0, [("y", (0.0, 1.0, 0.0), 8e4, 200.0)])
    still = Motion.along_x(np.arange(1001) / 1000.0, np.zeros(1001))
    result = simulate(add_payloads(spring, part), still)
    time, load = result.quantities["time"], result.quantities["link_load"][:, 0]
    elastic = result.quantities["link_load_elastic"][:, 0]
    after = np.flatnonzero(time == 0.1)[1]
    k, g = 8e4, 9.80665
    place, _ = step_response((25.0, k, 200.0), time[after:] - 0.1, -5.0 * g)
    expected = k * place - 20.0 * g
    np.testing.assert_allclose(elastic[after:], expected, rtol=0.0, atol=1e-10 * 25.0 * g)
    np.testing.assert_allclose(load[:after], -20.0 * g, rtol=1e-12)


@pytest.mark.parametrize(
    "machine", [ref.cart(), ref.cart_clear(), ref.preloaded()], ids=["linear", "clear", "preload"]
)
def test_stretches_are_runs_of_machines_with_fixed_masses(machine: Machine):
    motion = ref.piece(ref.cycle(), 500, 1200)
    part = payload(times=[(0.75, 1.0)])
    result = simulate(add_payloads(machine, part), motion, rtol=1e-10)
    data, time = result.quantities, result.quantities["time"]
    grip, release = (int(np.flatnonzero(time == at)[1]) for at in (0.75, 1.0))
    alone = simulate(machine, motion, rtol=1e-10, times=time).quantities
    # Before the first change it is the run without payload.
    size = np.abs(alone["link_load"]).max()
    np.testing.assert_allclose(
        data["link_load"][:grip], alone["link_load"][:grip], rtol=0.0, atol=1e-9 * size
    )
    # Position is continuous; what velocities do is a law of the core (rust/core/tests/laws/start.rs).
    for at in (grip, release):
        np.testing.assert_allclose(
            data["displacement"][at], data["displacement"][at - 1], rtol=0.0, atol=1e-15
        )


@pytest.mark.parametrize("error", [0.0, 1e-12, 2e-6])
def test_quasi_static_loads_are_those_of_the_machine_that_carries_the_payload(error: float):
    """Without the mounting error of a carriage; the weight of a payload is a change of the quasi-static load."""
    machine = with_carriages(ref.cart(), "1a", mounting_error=(error, 0.0))
    part, time = payload(times=[(0.5, 1.5)]), np.arange(2001) / 1000.0
    result = simulate(add_payloads(machine, part), Motion.along_x(time, np.zeros(2001)))
    scenes = [one.scene for one in (add_payloads(ref.cart(), part).with_payloads(["part"]), ref.cart())]
    groups = machine.links_of_carriages, machine.carriage_places
    laden, bare = (np.linalg.norm(one.static_group_loads(*groups)[:, 1:3], axis=1) for one in scenes)
    models = result.audit.simpler_models
    np.testing.assert_allclose(models.quasi_static, np.maximum(laden, bare), rtol=1e-9)
    change = np.abs(np.subtract(*(one.static_link_loads() for one in scenes)))
    np.testing.assert_allclose(models.quasi_static_dynamic, change, atol=1e-9 * laden.max())


def test_the_verification_solves_all_stretches_again():
    machine = add_payloads(ref.preloaded(), payload(times=[(0.7, 1.1)]))
    result = simulate(machine, ref.piece(ref.cycle(), 500, 1400))
    look = result.audit.verification
    assert look is not None and not isinstance(look, str) and look.agrees


def test_payloads_that_stay_all_the_time_are_part_of_the_body():
    machine, motion = ref.cart(), ref.cycle()
    always = add_payloads(machine, payload(times=[(-1.0, 1e3)]))
    fixed = always.with_payloads(["part"])
    one, other = simulate(always, motion).quantities, simulate(fixed, motion).quantities
    for name in ("force", "moment", "reaction", "static_force", "displacement"):
        np.testing.assert_array_equal(one[name], other[name])


def test_places_of_the_cart_give_the_times():
    time = np.arange(4001) / 1000.0
    place = 0.5 * (1.0 - np.cos(np.pi * time / 2.0))  # there and back in 4 s
    acceleration = 0.5 * (np.pi / 2.0) ** 2 * np.cos(np.pi * time / 2.0)
    motion = Motion.along_x(time, acceleration, position=place)
    by_place = payload(picked_at={"x": 0.5, "travel": "+x"}, released_at={"x": 0.5, "travel": "-x"})
    result = simulate(add_payloads(ref.cart(), by_place), motion)
    changes = json.loads(str(result.quantities.attrs["payload_changes"]))
    assert [names for _, names in changes] == [[], ["part"], []]
    np.testing.assert_allclose([at for at, _ in changes], [0.0, 1.0, 3.0], atol=1e-9)
    never = payload(picked_at={"x": 2.0})
    with pytest.raises(ArgumentError, match=r"picked_at: the cart never reaches x = 2 m.*from 0 to 1 m"):
        simulate(add_payloads(ref.cart(), never), motion)
    with pytest.raises(ArgumentError, match="no position of the cart; give times instead"):
        simulate(add_payloads(ref.cart(), by_place), ref.cycle())


@pytest.mark.parametrize(
    ("travel", "begins"), [("any", [0.0, 3.0]), ("+x", [0.0, 3.0]), ("-x", [0.0, 2.0, 3.0])]
)
def test_a_place_where_the_motion_starts_is_reached_at_the_start(travel: str, begins: list[float]):
    """Unless the cart leaves it against the direction: then when it comes back."""
    time = np.arange(4001) / 1000.0
    angle = np.pi * time / 2.0  # from 0.5 m to 1 m, back through 0.5 m at 2 s to 0 at 3 s
    there = {"velocity": np.pi / 4.0 * np.cos(angle), "position": 0.5 + 0.5 * np.sin(angle)}
    motion = Motion.along_x(time, -((np.pi / 2.0) ** 2) * 0.5 * np.sin(angle), **there)
    place = {"x": 0.5, "travel": travel}
    part = payload(picked_at=place, released_at={"x": 1e-6, "travel": "-x"})
    got = simulate(add_payloads(ref.cart(), part), motion).quantities
    changes = json.loads(str(got.attrs["payload_changes"]))
    np.testing.assert_allclose([at for at, _ in changes], begins, atol=2e-3)
    assert changes[-2][1] == ["part"]
    timed = payload(times=[(-1.0 if len(begins) == 2 else changes[1][0], changes[-1][0])])
    same = simulate(add_payloads(ref.cart(), timed), motion).quantities
    np.testing.assert_array_equal(got["force"], same["force"])
    still = Motion.along_x([0.0, 1.0], [0.0, 0.0], position=[0.5, 0.5])
    stays = simulate(add_payloads(ref.cart(), payload(picked_at=place)), still).quantities
    assert json.loads(str(stays.attrs["payload_changes"])) == [[0.0, ["part"]]]


def test_a_payload_that_the_machine_does_not_have_is_refused():
    machine = add_payloads(ref.cart(), payload(name="Workpiece", times=[(0.0, 1.0)]))
    with pytest.raises(ArgumentError, match='got "workpiece"; it has Workpiece'):
        machine.with_payloads(["workpiece"])
    with pytest.raises(ArgumentError, match=r'got "part"; it has no \[\[payloads\]\]'):
        machine.with_payloads([]).with_payloads(["part"])
    assert machine.with_payloads(["Workpiece"]).body.mass == ref.cart().body.mass + 90.0


def test_simultaneous_changes_keep_what_stays():
    first, second = payload(name="a", times=[(-1.0, 0.8)]), payload(name="b", mass=50.0, times=[(0.8, 9.0)])
    machine = add_payloads(ref.cart(), first, second)
    data = simulate(machine, ref.piece(ref.cycle(), 500, 1200)).quantities
    after = int(np.flatnonzero(data["time"] == 0.8)[1])
    (kept, *_), _ = ref.cart().scene.matrices()
    (joined, *_), _ = machine.with_payloads(["b"]).scene.matrices()
    free = [1, 2, 3, 4, 5]
    momentum = (kept @ data["velocity"][after - 1])[free]
    np.testing.assert_allclose(
        (joined @ data["velocity"][after])[free], momentum, rtol=0.0, atol=1e-12 * np.abs(momentum).max()
    )


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "either times or picked_at"),
        ({"times": [(2.0, 1.0)]}, "times: expected times that end after they begin"),
        ({"times": [(1.0, 2.0), (1.5, 3.0)]}, "times: expected times that are apart"),
        ({"times": [(1.0, 2.0)], "released_at": {"x": 1.0}}, "no released_at beside times"),
    ],
)
def test_impossible_payloads_are_refused(values: dict[str, Any], words: str):
    with pytest.raises(ConfigError, match=words):
        payload(**values)


def test_times_outside_the_motion_are_refused():
    machine = add_payloads(ref.cart(), payload(times=[(20.0, 30.0)]))
    with pytest.raises(
        ArgumentError, match=r"payloads.part.times: expected times within the motion, 0 to 7.061 s"
    ):
        simulate(machine, ref.cycle())
