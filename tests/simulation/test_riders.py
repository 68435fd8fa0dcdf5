"""Runs with riders against an independent high-precision solution, and the laws of riders."""

from __future__ import annotations

from dataclasses import replace

import lives
import numpy as np
import pytest
from machines import having
from moves import integrals
from reference import cart, cart_clear, cart_stiff
from rider_reference import Riding
from scipy.integrate import solve_ivp

from guideload import Machine, Motion, life_of, peak_loads, simulate
from guideload.base.errors import ArgumentError, ConfigError
from guideload.machine.payloads import Payload
from guideload.machine.riders import Rider

SLIDE = Rider(
    name="slide",
    mass=180.0,
    center_of_mass=(0.1, 0.3, -0.2),
    inertia=((9.0, 1.0, 0.5), (1.0, 12.0, -0.7), (0.5, -0.7, 15.0)),
    direction=(0.2, -0.1, 2.0),
)
ARM = Rider(
    name="arm",
    mass=60.0,
    center_of_mass=(0.2, -0.3, 0.1),
    inertia=np.diag([3.0, 4.0, 5.0]).tolist(),
    direction=(0, 1, 0),
)


def gantry(*riders: Rider, damping: float = 5e4) -> Machine:
    machine = cart() if damping == 5e4 else cart_stiff()
    return machine.model_copy(update={"riders": riders or (SLIDE,)})


def swing(size: float, rate: float, start: float = 0.0, count: int = 601) -> Motion:
    """A motion whose acceleration is linear between its stamps."""
    time = np.arange(count) / 1000.0
    acceleration = size * rate**2 * np.sin(rate * time)
    place, speed, _ = (of(time) for of in integrals(time, acceleration))
    return Motion.along_x(time, acceleration, velocity=speed, position=start + place)


def exactly(motion: Motion):
    """Travel, speed and acceleration of a motion from rest at any time, by the cubic of each interval."""
    place, *rates = integrals(motion.time, motion.acceleration[:, 0])
    return lambda t: (motion.position[0, 0] + float(place(t)), *(float(of(t)) for of in rates))


def reference(
    machine: Machine, motion: Motion, riders: dict[str, Motion], method: str = "DOP853"
) -> tuple[Riding, np.ndarray]:
    """States (time, 2 n) at the stamps, interval by interval, as the right-hand side has kinks at them."""
    rider_at = [exactly(riders[rider.name]) for rider in machine.riders]

    def acceleration(t: float) -> np.ndarray:
        return np.array([np.interp(t, motion.time, motion.acceleration[:, axis]) for axis in range(3)])

    riding = Riding(machine, rider_at, acceleration)
    states = [riding.start()]
    size = np.abs(states[0]).max()
    for begin, end in zip(motion.time[:-1], motion.time[1:], strict=True):
        found = solve_ivp(riding.rate, (begin, end), states[-1], method=method, rtol=1e-12, atol=1e-14 * size)
        states.append(found.y[:, -1])
    return riding, np.array(states)


def test_two_riders_against_dop853():
    machine, motion = gantry(SLIDE, ARM), swing(0.002, 30.0, count=101)
    riders = {"slide": swing(0.02, 15.0, 0.1, count=101), "arm": swing(0.01, 25.0, count=101)}
    riding, states = reference(machine, motion, riders)
    want = riding.link_loads(states)
    scale = np.abs(want).max()
    reactions = np.array([riding.reaction(t, y) for t, y in zip(motion.time, states, strict=True)])
    for method in ("auto", "rk45", "implicit"):
        result = simulate(machine, motion, method, riders=riders, rtol=1e-10)
        assert np.abs(result.quantities["link_load"] - want).max() < 1e-9 * scale, method
        off = np.abs(result.quantities["reaction"] - reactions).max()
        assert off < 1e-8 * np.abs(reactions).max(), method
        loose = simulate(machine, motion, method, riders=riders).quantities["link_load"]
        assert np.abs(loose - want).max() < 3e-6 * scale, method


def test_riders_that_stand_still_are_a_part_of_the_body():
    away = 0.4
    machine, motion = gantry(), swing(0.002, 30.0)
    still = Motion.along_x([0.0, 1.0], [0.0, 0.0], velocity=[0.0, 0.0], position=[away, away])
    merged = cart().model_copy(
        update={"body": gantry(SLIDE.model_copy(update={"position": away})).whole_body}
    )
    got, want = simulate(machine, motion, riders={"slide": still}), simulate(merged, motion)
    assert got.method == want.method == "exact"
    for name in ("link_load", "reaction", "displacement"):
        difference = np.abs(got.quantities[name] - want.quantities[name]).max()
        assert difference <= 1e-12 * np.abs(want.quantities[name]).max()


def test_forces_of_a_rider_across_are_those_of_newton():
    """A slide along z on a cart that holds z pushes with m s''; its drive feels the same."""
    rider = SLIDE.model_copy(update={"direction": (0.0, 0.0, 1.0)})
    machine = gantry(rider).with_free(("rx", "ry", "rz"))
    result = simulate(machine, swing(0.0, 1.0), riders={"slide": swing(0.02, 15.0)})
    data = result.quantities
    links = data["force"][:, :, 2].sum(axis=1)
    push = data["rider_acceleration"][:, 0] * rider.mass
    wrench = data["rider_wrench"][:, 2]
    assert np.allclose(
        data["rider_force"][:, 0], push, atol=0.02 * np.abs(push).max()
    )  # the body shakes a little
    assert np.abs(push).max() > 500.0
    momentum = data["reaction"][:, 2] - links + wrench
    mass = machine.scene.matrices()[0][0]
    assert np.allclose(momentum, data["acceleration"] @ mass[2], atol=1e-9 * np.abs(push).max())


def test_union_of_stamps_keeps_jumps_and_travel():
    """A trapezoid of the rider and a cart with stamps of its own: as with all stamps on one fine grid."""
    time = np.array([0.0, 0.05, 0.05, 0.15, 0.15, 0.3])
    rider = Motion.along_x(time, [0.0, 0.0, 4.0, 4.0, -4.0, -4.0])
    coarse = Motion.along_x([0.0, 0.1, 0.3], [0.0, 2.0, -1.0])
    fine_time = np.sort(np.concatenate([np.arange(301) / 1000.0, [0.05, 0.15]]))
    fine = Motion.along_x(
        fine_time, np.interp(fine_time, coarse.time, coarse.acceleration[:, 0]), bandwidth=np.inf
    )
    instants = np.linspace(0.0, 0.3, 77)
    a, b = (
        simulate(gantry(), motion, "rk45", riders={"slide": rider}, rtol=1e-11, times=instants)
        for motion in (coarse, fine)
    )
    scale = np.abs(a.quantities["link_load"]).max()
    assert np.abs(a.quantities["link_load"] - b.quantities["link_load"]).max() < 1e-8 * scale
    assert a.quantities["rider_position"][-1, 0] == pytest.approx(
        0.5 * 4 * 0.1**2 + 0.4 * 0.15 - 0.5 * 4 * 0.15**2, abs=1e-12
    )
    assert a.quantities["rider_velocity"][-1, 0] == pytest.approx(-0.2, abs=1e-12)


def test_peaks_life_and_safety_do_not_depend_on_the_samples():
    """A trapezoid of the cart at 50 Hz and at 2 kHz; a slide moves during the first 0.2 s."""
    machine = having(
        lives.cart(), riders=(SLIDE.model_copy(update={"mass": 15.0, "inertia": np.eye(3).tolist()}),)
    )
    slide = {"slide": swing(2e-4, 10.0 * np.pi, count=201)}
    corners = np.array([0.0, 0.24, 0.26, 0.44, 0.48, 0.68, 0.7, 1.0])

    def figures(rate: float) -> dict[str, np.ndarray]:
        time = np.arange(round(rate) + 1) / rate
        acceleration = np.interp(time, corners, [0.0, 0.0, 5.0, 5.0, -5.0, -5.0, 0.0, 0.0])
        place, speed, _ = (of(time) for of in integrals(time, acceleration))
        cart = Motion.along_x(time, acceleration, velocity=speed, position=place)
        result = simulate(machine, cart, riders=slide)
        lives_of = life_of(result).carriages
        return {
            "peak": peak_loads(machine, cart, riders=slide).largest,
            "history": result.quantities["resultant"].max(axis=0),
            "safety": np.array([each.static.safety for each in lives_of]),
            "mean load": np.array([each.mean_load for each in lives_of]),
        }

    coarse, dense = figures(50.0), figures(2000.0)
    # As of a machine without riders: peaks are those at any time, histories bow by 1 % of the dynamic load at most.
    for name, error in (("peak", 1e-5), ("history", 5e-3), ("safety", 1e-5), ("mean load", 1e-5)):
        scale = np.abs(dense[name]).max()
        assert np.abs(coarse[name] - dense[name]).max() < error * scale, name


def test_a_moving_rider_on_contacts_has_no_exact_solution_at_any_rate():
    machine = cart_clear().model_copy(update={"riders": (SLIDE,)})
    coarse = Motion.along_x([0.0, 0.2, 0.4, 0.6], [0.0, 2.0, -2.0, 0.0])
    with pytest.raises(ArgumentError, match="a rider moves"):
        simulate(machine, coarse, "exact", riders={"slide": swing(0.02, 15.0)})


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m, x: simulate(m, x, "exact", riders={"slide": swing(0.02, 15.0)}), "a rider moves"),
        (lambda m, x: simulate(m, x, "exponential", riders={"slide": swing(0.02, 15.0)}), 'expected "rk45"'),
        (lambda m, x: simulate(m, x, riders={"arm": x}), "expected a rider of the machine"),
        (lambda m, x: simulate(gantry(SLIDE.model_copy(update={"motion": "a.csv"})), x), "has the motion"),
        (lambda m, x: simulate(m, x, riders={"slide": x.with_force([0, 0, 0], [1, 0, 0])}), "without forces"),
        (
            lambda m, x: simulate(m, x, riders={"slide": Motion.along_x([0.0, 0.2], [0.0, 1.0])}),
            "its motion ends before that of the cart",
        ),
    ],
)
def test_refusals_name_the_rider_and_the_way_out(call, words):
    with pytest.raises(ArgumentError, match=words):
        call(gantry(), swing(0.002, 30.0))


def test_riders_of_a_machine_file_are_checked():
    with pytest.raises(ConfigError, match=r"direction.*other than zero"):
        Rider(**(SLIDE.model_dump() | {"direction": (0.0, 0.0, 0.0)}))
    assert Rider(**(SLIDE.model_dump() | {"direction": (0.0, 0.0, 1e-170)})).direction == (0.0, 0.0, 1.0)
    with pytest.raises(ConfigError, match="unique name"):
        Machine(**(cart().model_dump() | {"riders": [SLIDE.model_dump(), SLIDE.model_dump()]}))


def test_a_quasi_static_start_counts_the_inertia_force_of_a_rider():
    machine = gantry().model_copy(update={"gravity": (0.0, 0.0, 0.0)})  # at rest nothing turns the direction
    time, rate = np.linspace(0.0, 0.1, 101), 3.0
    still = Motion.along_x(time, np.zeros(101))
    moving = Motion.along_x(
        time, np.full(101, rate), velocity=rate * time, position=0.2 + rate * time**2 / 2.0
    )
    got = simulate(machine, still, riders={"slide": moving}, start="quasi-static")
    there = SLIDE.at(0.2)
    force = -there.mass * rate * np.array(SLIDE.direction) / np.linalg.norm(SLIDE.direction)
    wrench = np.tile(np.hstack([force, np.cross(there.center_of_mass, force)]), (101, 1))
    begun = machine.model_copy(update={"riders": (SLIDE.model_copy(update={"position": 0.2}),)})
    pushed = replace(still, wrench=wrench)
    want = simulate(begun, pushed, start="quasi-static").quantities["link_load"][0]
    assert np.abs(got.quantities["link_load"][0] - want).max() < 1e-12 * np.abs(want).max()


def test_what_is_not_computed_together_with_moving_riders():
    machine, motion, riders = gantry(), swing(0.002, 30.0), {"slide": swing(0.02, 15.0)}
    wavy = machine.rails[0].model_copy(update={"straightness": ((-5.0, 0.0, 0.0), (5.0, 1e-5, 0.0))})
    inertia = np.eye(3).tolist()
    part = Payload(name="part", mass=9.0, center_of_mass=(0, 0, 0), inertia=inertia, times=((0.1, 0.2),))
    for also, words in (
        ({"base": {"compliance": (1e-12 * np.eye(6)).tolist()}}, "an elastic base; put its compliance into"),
        ({"rails": (wavy, *machine.rails[1:])}, "rails that are not straight; take the largest error"),
        ({"payloads": (part,)}, "moving riders knows no payloads"),
    ):
        other = machine.model_copy(update=also)
        with pytest.raises(ArgumentError, match=words):
            simulate(other, motion, riders=riders)
        simulate(other, motion)  # riders that stand still are a part of the body


def test_rider_and_cart_share_their_clock():
    """Dates of both count from one instant: the run is that of stamps in seconds; else no run pretends that they do."""
    machine, motion, slide = gantry(), swing(0.002, 30.0, count=301), swing(0.02, 15.0, 0.1, count=501)
    wanted = simulate(machine, motion, riders={"slide": replace(slide, time=np.round(slide.time - 0.05, 9))})
    noon = np.datetime64("2026-01-31T12:00:00.000", "ns")
    dated, early = (
        replace(one, origin=at) for one, at in ((motion, noon), (slide, noon - np.timedelta64(50, "ms")))
    )
    scale = np.abs(wanted.quantities["force"]).max()
    for one in (early, replace(slide, time=np.round(slide.time - 0.05, 9))):
        found = simulate(machine, dated, riders={"slide": one})
        difference = np.abs(found.quantities["force"] - wanted.quantities["force"]).max()
        assert difference <= 1e-6 * scale
    with pytest.raises(
        ArgumentError, match=r"stamps count from the date 2026-01-31T11:59:59.95\d*, .* from zero"
    ):
        simulate(machine, motion, riders={"slide": early})
    tomorrow = replace(slide, origin=noon + np.timedelta64(1, "D"))
    with pytest.raises(ArgumentError, match="from 86400 to 86400.5 s, that of the cart from 0 to 0.3 s"):
        simulate(machine, dated, riders={"slide": tomorrow})
