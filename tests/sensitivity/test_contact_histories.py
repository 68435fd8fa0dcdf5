"""Derivatives across contact changes: 50 digits, a mass on a one-sided spring in closed form, grazing, ties in time."""

from __future__ import annotations

from functools import partial
from typing import Any

import mpmath
import numpy as np
import pytest
from machines import one_mass
from precise_contacts import precise_contacts
from precise_derivatives import assert_near, central_differences, differences, histories_of
from reference import random_motion, two_carriages

from guideload import Body, Link, Machine, Motion, peak_loads, sensitivities, simulate
from guideload.base.errors import ArgumentError
from guideload.motion.motion import with_instants
from guideload.sensitivity import VariedMachine, rank_influences

# Relative to the largest entry of each history; 2e-11 are found. A change is located to 1e-13 of the deflections, and
# during the delay the derivatives follow the segment before it.
DIGITS_ASKED = 1e-9


def shaken(seed: int, size: float = 8.0, count: int = 20) -> Motion:
    motion = random_motion(seed, count=count)
    return Motion(motion.time, size * motion.acceleration)


CLEAR = {"clearance_y": 5e-6, "clearance_z": 2e-6}
CURVE = [["0 um", "0 N"], ["20 um", "1 kN"], ["24 um", "2 kN"], ["60 um", "30 kN"]]
CASES: dict[str, tuple[Machine, Motion, str]] = {
    # 59 whole intervals on the segments of rest: by propagators.
    "clearance": (two_carriages(**CLEAR), shaken(1, 2.0, 80), "carriages[1a].clearance_y"),
    "damper": (two_carriages(**CLEAR, damping_in_contact=True), shaken(1), "carriages[1a].clearance_y"),
    "mass": (two_carriages(**CLEAR, damping_in_contact=True), shaken(2), "body.mass"),
    "place": (two_carriages(**CLEAR, damping_in_contact=True), shaken(3), "carriages[1a].x"),
    "curve": (
        two_carriages(stiffness_y=None, curve_y=CURVE, clearance_z=2e-6),
        shaken(1, 4.0),
        "carriages[2a].length",
    ),
    "sides": (
        two_carriages(stiffness_y={"positive": 3e7, "negative": 1.2e8}, clearance_y=2e-6),
        shaken(1),
        "carriages[2a].stiffness_y.negative",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_histories_in_50_digits(case: str) -> None:
    machine, motion, path = CASES[case]
    varied = VariedMachine(machine, path)
    run = varied.run(motion, start="rest")
    compute = partial(precise_contacts, machine.scene.static_position())
    assert simulate(machine, motion, start="rest").data.attrs["contact_changes"] >= 3
    exact = differences(machine, motion, path, varied.columns[0].value, compute)
    for name, mine in histories_of(run).items():
        wanted = exact[name].reshape(mine.shape[1:])
        assert np.abs(mine[0] - wanted).max() <= DIGITS_ASKED * np.abs(wanted).max(), name


# ---- a mass that lifts off a one-sided spring

MASS, STIFFNESS, CLEARANCE, PUSH, GRAVITY = 100.0, 4e6, 1e-4, 14.0, 10.0
END = 0.0084


def hanging(damping: float = 0.0) -> Machine:
    """The mass on a link with clearance."""
    law = {"stiffness": STIFFNESS, "clearance": CLEARANCE, "damping": damping}
    return one_mass(MASS, GRAVITY, **law, damping_in_contact=damping > 0.0)


def pushed(time: Any, push: float = PUSH) -> Motion:
    """A constant acceleration of the frame downwards, which pushes the body up."""
    return Motion(time, np.tile([0.0, -push, 0.0], (len(time), 1)))


def flight(mass: Any, stiffness: Any, clearance: Any) -> tuple[Any, Any]:
    """Place and speed at END: on the spring until the deflection is -clearance, then in free flight in it."""
    w, rest = mpmath.sqrt(stiffness / mass), -clearance - mass * GRAVITY / stiffness
    reach = mass * PUSH / stiffness
    lift = mpmath.acos(1 - (-clearance - rest) / reach) / w
    speed, rate, left = reach * w * mpmath.sin(w * lift), PUSH - GRAVITY, END - lift
    place = -clearance + speed * left + rate * left**2 / 2
    assert lift < END and place < clearance
    return place, speed + rate * left


def test_a_mass_that_lifts_off_in_closed_form() -> None:
    to = ["body.mass", "links[spring].stiffness", "links[spring].clearance"]
    run = VariedMachine(hanging(), to).run(pushed([0.0, 0.004, END]), start="rest")
    values = (MASS, STIFFNESS, CLEARANCE)
    with mpmath.workdps(30):
        for k in range(3):
            order = tuple(int(i == k) for i in range(3))
            for part, mine in enumerate((run.history("displacement"), run.history("velocity"))):
                wanted = float(mpmath.diff(lambda *x, part=part: flight(*x)[part], values, order))
                assert mine[k, -1, 1] == pytest.approx(wanted, rel=1e-10)


def test_a_contact_that_grazes_its_edge_has_a_derivative() -> None:
    """Almost losing contact and losing it for an instant give the same derivatives, with a damper that jumps."""
    time = np.linspace(0.0, 0.06, 61)
    damping = 2000.0
    ratio = damping / (2.0 * np.sqrt(MASS * STIFFNESS))
    overshoot = 1.0 + np.exp(-np.pi * ratio / np.sqrt(1.0 - ratio**2))
    machine = hanging(damping)
    touch = GRAVITY / overshoot  # the push whose overshoot just takes the load away
    found, to = [], ["links[spring].damping", "links[spring].clearance"]
    for push in (touch * (1.0 - 1e-9), touch * (1.0 + 1e-9)):
        run = VariedMachine(machine, to).run(pushed(time, push), start="rest")
        found.append((run.history("displacement")[:, :, 1], run.history("velocity")[:, :, 1]))
    for before, after in zip(*found, strict=True):
        # The flight lasts some 4e-5 of a period.
        assert np.abs(after - before).max() <= 1e-3 * np.abs(before).max()


def test_contacts_that_change_at_one_instant() -> None:
    """Two equal links side by side: a change of one of them alone parts the instants."""
    links = [
        Link(
            name=name,
            point=(0.0, 0.0, z),
            direction=(0.0, 1.0, 0.0),
            stiffness=STIFFNESS,
            clearance=CLEARANCE,
            damping=2000.0,
            damping_in_contact=True,
        )
        for name, z in (("a", -0.3), ("b", 0.3))
    ]
    body = Body(mass=MASS, center_of_mass=(0.0, 0.0, 0.0), inertia=8.0 * np.eye(3))
    machine = Machine(body=body, links=links, free=("y", "rx"), gravity=(0.0, -GRAVITY, 0.0))
    varied = VariedMachine(machine, ["links[a].stiffness", "links[a].damping"])
    motion = pushed(np.linspace(0.0, END, 4))
    run = varied.run(motion, start="rest")
    (wanted,) = central_differences(
        varied, lambda values: [varied.run(motion, values, start="rest").solution.velocity()], 1e-6
    )
    assert_near(run.history("velocity"), wanted, 1e-5)


# ---- figures, and what is refused


def test_figures_follow_the_histories() -> None:
    machine, motion = two_carriages(**CLEAR), shaken(5, 4.0, 120)
    to = ["body.mass", "carriages[1a].clearance_y", "carriages[2a].stiffness_y"]
    data = sensitivities(machine, motion, of="peak_resultant", to=to)
    run = VariedMachine(machine, to).run(motion)
    loads = run.solution.group_loads(machine.links_of_carriages, machine.carriage_places, "total")
    peaks = peak_loads(machine, motion)
    assert np.allclose(data["peak_resultant"], peaks.largest[:, 6], rtol=1e-12)
    for i, time in enumerate(peaks.time_of_largest[:, 6]):
        at = with_instants(motion, np.array([time]))
        k = int(np.searchsorted(at.time, time))
        at_peak = sensitivities(machine, at, of="resultant", to=to)["d_resultant"][:, k, i]
        assert np.allclose(data["d_peak_resultant"][:, i], at_peak, rtol=1e-6)
    forward = (run.history("carriage_loads") * 2.0 * loads).sum(axis=(1, 2, 3))
    assert np.allclose(run.gradient(2.0 * loads), forward, rtol=1e-9)
    found = rank_influences(machine, motion, "peak_resultant")
    assert np.isfinite(found.changes).all()
    assert any("clearance" in column.name for column in found.columns)


@pytest.mark.parametrize("start", ["rest", "quasi-static"])
def test_either_start_by_differences(start: Any) -> None:
    machine, motion = two_carriages(**CLEAR, damping_in_contact=True), shaken(6, 4.0, 200)
    to = ["carriages[1a].clearance_y", "carriages[1a].stiffness_y", "body.mass", "motion.scale"]
    varied = VariedMachine(machine, to, motion)
    mine = varied.run(motion, start=start).history("displacement")
    (wanted,) = central_differences(
        varied, lambda values: [varied.run(motion, values, start=start).solution.position()], 1e-6
    )
    assert_near(mine, wanted, 1e-6)


def test_what_has_no_derivative_is_refused_with_the_way_out() -> None:
    w = np.sqrt(STIFFNESS / MASS)
    lift = np.arccos(1.0 - GRAVITY / PUSH) / w
    varied = VariedMachine(hanging(), "body.mass")
    with pytest.raises(ArgumentError, match=r"links\[0\] makes or loses contact just at the sample"):
        varied.run(pushed([0.0, lift, END]), start="rest")
