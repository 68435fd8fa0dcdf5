"""Mounting errors of rails and carriages: displacements of the feet of links, which load a machine at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from machines import having, with_carriages
from reference import cart, cart_clear, preloaded

from guideload import Machine
from guideload.reports.machine import machine_report


def mounted(machine: Machine, rail: Any = (0.0, 0.0), carriage: Any = (0.0, 0.0)) -> Machine:
    """The machine with mounting errors of its rail 2 and its carriage 2b."""
    rails = (having(one, mounting_error=rail) if one.name == "2" else one for one in machine.rails)
    return with_carriages(having(machine, rails=tuple(rails)), "2b", mounting_error=carriage)


@pytest.mark.parametrize("make", [cart, cart_clear, preloaded])
def test_a_rail_that_is_too_high_everywhere_turns_the_body(make: Any) -> None:
    """Two straight rails of unequal height are one tilted plane: no load, and a rotation by height over distance."""
    straight, high = make(), mounted(make(), rail=(70e-6, 0.0))
    np.testing.assert_allclose(high.static_carriage_loads, straight.static_carriage_loads, atol=1e-6)
    turned = high.scene.static_position() - straight.scene.static_position()
    assert turned[3] == pytest.approx(-70e-6 / 0.7, rel=1e-6)
    # The rails are at y = 50 mm, where the rotation moves nothing along z.
    np.testing.assert_allclose(turned, [0, 35e-6, 5e-6, -1e-4, 0, 0], atol=1e-10)


def test_a_carriage_that_is_too_high_twists_the_body() -> None:
    """Four equal springs at the corners of a rectangle: one foot by e makes +-k e/4 at each corner."""
    error = 20e-6
    high = mounted(cart(), carriage=(error, 0.0))
    change = high.static_carriage_loads - cart().static_carriage_loads
    vertical = 1.2e8 * error / 4.0
    # Each carriage is itself two springs 120 mm apart, so it resists the pitch of the body a little.
    np.testing.assert_allclose(change[:, 1], vertical * np.array([-1.0, 1.0, 1.0, -1.0]), rtol=0.02)
    assert change[:, 1].sum() == pytest.approx(0.0, abs=1e-8 * vertical)


@pytest.mark.parametrize("roll", [np.pi / 2.0, -0.4])
def test_a_machine_that_is_turned_as_a_whole_has_the_same_loads(roll: float) -> None:
    """The error of a carriage turns with its rail; that of a rail is along the axes of the machine."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(roll), -np.sin(roll)], [0.0, np.sin(roll), np.cos(roll)]])
    machine = mounted(cart(), rail=(20e-6, -5e-6), carriage=(15e-6, 8e-6))
    body, rails = machine.body, [*machine.rails]
    for i, rail in enumerate(rails):
        place, error = (turn[1:, 1:] @ each for each in (rail.position, rail.mounting_error))
        rails[i] = having(rail, position=tuple(place), mounting_error=tuple(error), roll=roll)
    inertia = turn @ np.array(body.inertia) @ turn.T
    turned = having(
        machine,
        body=having(body, center_of_mass=tuple(turn @ body.center_of_mass), inertia=inertia.tolist()),
        gravity=tuple(turn @ machine.gravity),
        rails=tuple(rails),
    )
    wanted = machine.static_carriage_loads
    np.testing.assert_allclose(turned.static_carriage_loads, wanted, atol=1e-9 * np.abs(wanted).max())


def test_errors_of_rail_and_carriage_add_up() -> None:
    table = mounted(cart(), rail=("20 um", "-5 um"), carriage=(1e-6, 2e-6)).link_table()
    of = {name: offset for name, offset in zip(table.names, table.offsets, strict=True)}
    assert of["2b:-y"] == of["2b:+y"] == pytest.approx(21e-6)
    assert of["2b:+z"] == pytest.approx(-3e-6)
    assert of["2a:+y"] == 20e-6
    assert of["1a:-y"] == of["1b:+z"] == 0.0


def test_the_report_tells_mounting_errors() -> None:
    report = machine_report(mounted(cart(), rail=(20e-6, -5e-6), carriage=(0.0, 3e-6))).text()
    assert "mounting errors (y, z): rail 2 (20, -5) um, carriage 2b (0, 3) um" in report
    assert "mounting errors" not in machine_report(cart()).text()
