"""Contacts of one mass against closed forms: bouncing in a gap, grazing, chatter, the first impact.

Between contact changes a mass in a gap is free and in contact it is an oscillator, so all is known in closed form.
`pytest -s tests/test_contacts.py` prints what is reached.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
import reference as ref
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from guideload import Link, Machine, Motion, Stability, simulate, stability

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gap:
    """A mass that moves along y, with `clearance` to either side and a contact beyond, and perhaps a spring."""

    mass: float  # kg
    stiffness: float  # N/m, of the contact
    clearance: float  # m
    damping: float = 0.0  # N s/m, of the contact
    in_contact: bool = False  # whether that acts in contact only
    spring: float = 0.0  # N/m, in parallel, without clearance
    gravity: float = 0.0  # m/s2, along y

    def machine(self) -> Machine:
        common: dict[str, Any] = {"point": (0, 0, 0), "direction": (0, 1, 0)}
        play = {"clearance": self.clearance, "damping_in_contact": self.in_contact} if self.clearance else {}
        contact = Link(name="contact", stiffness=self.stiffness, damping=self.damping, **play, **common)
        spring = [Link(name="spring", stiffness=self.spring, damping=0.0, **common)] if self.spring else []
        body = ref.body(mass=self.mass, center_of_mass=(0.0, 0.0, 0.0))
        return Machine(body=body, links=[contact, *spring], free=("y",), gravity=(0.0, self.gravity, 0.0))

    def zone(self, position: float) -> int:
        return int(np.sign(position)) if abs(position) > self.clearance else 0

    def generator(self, zone: int, force: float) -> Array:
        """A of (y, v, 1)' = A (y, v, 1) while in a zone (-1, 0, 1) under a constant force [N]."""
        k = self.spring + (self.stiffness if zone else 0.0)
        b = self.damping if zone or not self.in_contact else 0.0
        shift = self.stiffness * self.clearance * zone
        rest = (force + shift) / self.mass + self.gravity
        return np.array([[0.0, 1.0, 0.0], [-k / self.mass, -b / self.mass, rest], [0.0, 0.0, 0.0]])

    def energy(self, position: Array, velocity: Array) -> Array:
        """J, of motion, contact and spring."""
        depth = np.maximum(np.abs(position) - self.clearance, 0.0)
        elastic = self.stiffness * depth**2 + self.spring * position**2
        return np.asarray(0.5 * (self.mass * velocity**2 + elastic) - self.mass * self.gravity * position)


def by_events(gap: Gap, start: float, pieces: list[tuple[float, float]], step: float) -> tuple[Array, int]:
    """Positions every `step` s from rest at `start` [m], and the number of contact changes.

    pieces: (duration [s], force [N]), durations whole numbers of steps. Every zone is linear: its exponential,
    and changes located on it to rounding. A change is looked for in sixteenths of a step.
    """
    state, zone, changes = np.array([start, 0.0, 1.0]), gap.zone(start), 0
    positions = [start]
    sixteenth = cache(lambda zone, force: expm(gap.generator(zone, force) * step / 16.0))
    for duration, force in pieces:
        for _ in range(16 * round(duration / step)):
            rest, there = step / 16.0, sixteenth(zone, force) @ state
            while (left := gap.zone(there[0])) != zone:
                rates, edge = gap.generator(zone, force), gap.clearance * (zone or left)

                def beyond(t: float, rates: Array = rates, state: Array = state, edge: float = edge) -> float:
                    return float((expm(rates * t) @ state)[0] - edge)

                begin = 1e-9 * rest  # off the edge that it stands on after a change
                at = 0.0  # rounding put it beyond already
                if beyond(begin) * beyond(rest) < 0.0:
                    at = brentq(beyond, begin, rest, xtol=1e-18, rtol=1e-15)
                state, rest = expm(rates * at) @ state, rest - at
                state[0] = edge
                zone, changes = (0 if zone else left), changes + 1
                there = expm(gap.generator(zone, force) * rest) @ state
            state = there
            positions.append(state[0])
    return np.array(positions)[::16], changes


def pushed(pieces: list[tuple[float, float]], step: float) -> Motion:
    """Constant forces along y, one after the other, sampled every `step` s, with jumps between them."""
    times, forces, begin = [], [], 0
    for duration, force in pieces:
        count = round(duration / step)
        times.append((begin + np.arange(count + 1)) * step)
        forces.append(np.full(count + 1, force))
        begin += count
    time = np.concatenate(times)
    wrench = np.zeros((time.size, 6))
    wrench[:, 1] = np.concatenate(forces)
    return Motion(time, np.zeros((time.size, 3)), wrench=wrench)


def run(gap: Gap, motion: Motion, method: str = "exact", **options: Any) -> tuple[Array, Array, int]:
    """Positions and velocities at the samples, and the number of contact changes."""
    data = simulate(gap.machine(), motion, method, **options).data
    position, velocity = (data[name].values[:, 1] for name in ("displacement", "velocity"))
    return position, velocity, int(data.attrs["contact_changes"])


# ---- a mass that bounces between two contacts

BALL = Gap(mass=1.0, stiffness=1e6, clearance=1e-3)
SPEED = 0.1  # m/s, after 100 N for 1 ms
KICK = (1e-3, 100.0)


def bouncing(since: Array) -> Array:
    """Position at times after it passed the middle upwards [s]: constant speed, half a sine in contact."""
    omega, flight = sqrt(BALL.stiffness / BALL.mass), BALL.clearance / SPEED
    half = 2.0 * flight + pi / omega
    turn, rest = np.divmod(since, half)
    contact = BALL.clearance + SPEED / omega * np.sin(omega * (rest - flight))
    inside = np.where(rest < flight, SPEED * rest, SPEED * (half - rest))
    there = np.where((rest > flight) & (rest < flight + pi / omega), contact, inside)
    return np.where(turn % 2 == 0, there, -there)


@pytest.mark.parametrize(
    ("method", "rtol", "seconds", "allowed"),
    [("exact", 1e-6, 10.0, 1e-9), ("rk45", 1e-9, 0.5, 1e-5), ("implicit", 1e-9, 0.5, 1e-5)],
)
def test_a_mass_bounces_in_its_gap(method: str, rtol: float, seconds: float, allowed: float) -> None:
    """Period 4 c / v + 2 pi / ω, no energy lost, every contact counted. allowed: error, of the clearance."""
    motion = pushed([KICK, (seconds, 0.0)], 1e-3)
    position, velocity, changes = run(BALL, motion, method, rtol=rtol)
    late = slice(2, None)  # after the kick
    passed = 1e-3 - 0.5 * 1e-3  # s: at 1 ms it is 0.05 mm from the middle
    since = motion.time[late] - passed
    error = np.abs(position[late] - bouncing(since)).max() / BALL.clearance
    energy = BALL.energy(position[late], velocity[late])
    drift = np.abs(energy / (0.5 * BALL.mass * SPEED**2) - 1.0).max()
    print(f"\n{method}: position {error:.1e} of the clearance, energy {drift:.1e}, {changes} changes", end="")
    assert error <= allowed
    assert drift <= allowed
    flight, touch = BALL.clearance / SPEED, pi / sqrt(BALL.stiffness / BALL.mass)
    half = 2.0 * flight + touch
    entered = np.floor((since[-1] - flight) / half) + 1
    left = np.floor((since[-1] - flight - touch) / half) + 1
    assert changes == entered + left


@pytest.mark.parametrize("method", ["exact", "rk45", "implicit"])
def test_the_first_impact_peaks_at_the_textbook_load(method: str) -> None:
    """v sqrt(k m) half a contact after the first touch, whatever the samples: here all contact lies between two."""
    arrival = 0.5e-3 + BALL.clearance / SPEED
    middle = arrival + 0.5 * pi / sqrt(BALL.stiffness / BALL.mass)
    time = np.array([0.0, 1e-3, 1e-3, 0.02])
    wrench = np.zeros((4, 6))
    wrench[:2, 1] = 100.0
    motion = Motion(time, np.zeros((4, 3)), wrench=wrench)
    times = [1e-3, arrival - 1e-9, middle, 0.02]
    data = simulate(BALL.machine(), motion, method, rtol=1e-9, times=times).data
    load = data["link_load"].values[:, 0]
    peak = SPEED * sqrt(BALL.stiffness * BALL.mass)
    assert load[2] == pytest.approx(peak, rel=1e-6)
    assert np.abs(load[[0, 1, 3]]).max() <= 1e-6 * peak
    assert data.attrs["contact_changes"] == 2


# ---- grazing


@pytest.mark.parametrize("beyond", [1e-9, 1e-12, 0.0, -1e-9])
def test_a_mass_that_just_touches(beyond: float) -> None:
    """q = F / k (1 - cos ω t) reaches 2 F / k = (1 + beyond) of the clearance: in contact for 6e-7 s, or never."""
    gap = Gap(mass=1.0, stiffness=1e6, clearance=1e-4, spring=1e4)
    force = 0.5 * gap.spring * gap.clearance * (1.0 + beyond)
    periods, omega = 50, 100.0
    motion = pushed([(periods * 2.0 * pi / omega // 1e-3 * 1e-3, force)], 1e-3)
    position, _, changes = run(gap, motion)
    linear = force / gap.spring * (1.0 - np.cos(omega * motion.time))
    # In contact the force is 2e-7 of the spring's: nothing to see in the motion.
    assert np.abs(position - linear).max() <= 1e-6 * gap.clearance
    if beyond > 1e-10:
        assert changes == 2 * periods
    elif beyond < -1e-10:
        assert changes == 0
    else:
        assert changes % 2 == 0 and changes <= 2 * periods


# ---- chatter


CHATTER = {
    "restitution 0.9": Gap(1.0, 1e8, 1e-3, 2.0 * 0.0335 * 1e4, in_contact=True, gravity=-9.80665),
    "restitution 0.5": Gap(1.0, 1e7, 1e-3, 2.0 * 0.215 * sqrt(1e7), in_contact=True, gravity=-9.80665),
    "damped throughout": Gap(1.0, 1e7, 1e-3, 300.0, gravity=-9.80665),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CHATTER)
def test_a_mass_dropped_on_a_stiff_contact_chatters_to_rest(name: str) -> None:
    """Lifted off, dropped, bouncing until it stays: each contact as by events, in bounded work."""
    gap = CHATTER[name]
    start = -gap.clearance + gap.mass * gap.gravity / gap.stiffness
    pieces = [(5e-3, 25.0), (0.3, 0.0)]
    expected, changes = by_events(gap, start, pieces, 2.5e-4)
    position, _, counted = run(gap, pushed(pieces, 2.5e-4))
    found = np.delete(position, round(5e-3 / 2.5e-4))  # the jump is there twice
    error = np.abs(found - expected).max() / np.abs(expected - start).max()
    print(f"\n{name}: {changes} contact changes, {counted} counted, error {error:.1e}", end="")
    assert error <= 1e-8
    assert counted == changes


@pytest.mark.parametrize("method", ["rk45", "implicit"])
def test_chatter_costs_the_other_methods_bounded_work(method: str) -> None:
    gap = CHATTER["restitution 0.5"]
    pieces = [(5e-3, 25.0), (0.3, 0.0)]
    exact, _, changes = run(gap, pushed(pieces, 2.5e-4))
    data = simulate(gap.machine(), pushed(pieces, 2.5e-4), method, rtol=1e-8).data
    error = np.abs(data["displacement"].values[:, 1] - exact).max() / np.abs(exact - exact[0]).max()
    print(f"\n{method}: error {error:.1e}, {data.attrs['steps']} steps", end="")
    assert error <= 1e-4
    assert data.attrs["steps"] <= 100 * (data.sizes["time"] + changes)


# ---- step limits of scenes with contacts


def test_step_limits_are_those_with_all_links_in_contact() -> None:
    loose = Gap(mass=1.0, stiffness=1e8, clearance=1e-6, damping=100.0)
    tight = Gap(mass=1.0, stiffness=1e8, clearance=0.0, damping=100.0)
    of_loose, of_tight = (stability(gap.machine()) for gap in (loose, tight))
    assert isinstance(of_loose, Stability)
    assert of_loose.longest_steps == pytest.approx(of_tight.longest_steps)
