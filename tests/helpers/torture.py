"""The torture set: small scenes in which integration methods fail, with what their loads really are.

A scene is one mass on springs along its axes, so each axis is an oscillator by itself: linear between two edges of its
laws, with a closed form there, evaluated in 60 digits. The instants of events are roots of it; a bound of the second
derivative proves that none is left out. Preloaded springs have a closed form in quadratures.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import factorial
from typing import Any

import numpy as np
import reference as ref
from mpmath import mp, mpf
from numpy.typing import NDArray
from reference import Numbers, PreciseLink

from guideload import Link, Machine, Motion

Array = NDArray[np.float64]
DIGITS = 60
AXES = ("x", "y", "z")
EDGE = mpf(10) ** -40  # m, m/s, m/s2: less than this from an edge is on it
SHORTEST = mpf(10) ** -12  # of an interval that is searched for events
RTOL = 1e-6  # that every method is asked for


@dataclass(frozen=True, eq=False)
class Scene:
    """A mass of 1 kg under piecewise linear forces, and the instants at which its link loads are asked."""

    name: str
    hard: str  # what makes it hard
    springs: dict[str, dict[str, Any]]  # keys of each link, by a name that begins with its axis
    corners: Array  # (corner,) s; two at one time are a jump
    forces: Array  # (corner, 3) N
    asked: Array  # (time,) s
    gravity: float = 0.0  # m/s2 along y
    by: Callable[[Scene], tuple[Array, Array, Array]] | None = None  # its own instants, and the truth there

    @cached_property
    def machine(self) -> Machine:
        free = sorted({name[0] for name in self.springs})
        links = []
        for name, keys in self.springs.items():
            direction = [float(axis == name[0]) for axis in AXES]
            links.append(Link(name=name, point=(0, 0, 0), direction=direction, **{"damping": 0.0, **keys}))
        return Machine(
            name=self.name,
            body=ref.body(mass=1.0, center_of_mass=(0, 0, 0)),
            links=links,
            free=free,
            gravity=(0.0, self.gravity, 0.0),
        )

    @cached_property
    def motion(self) -> Motion:
        wrench = np.hstack([self.forces, np.zeros_like(self.forces)])
        return Motion(self.corners, np.zeros_like(self.forces), wrench=wrench)

    @cached_property
    def paths(self) -> list[Axis]:
        """The path along each axis that is free; none where a scene has a reference of its own."""
        if self.by is not None:
            return []
        with mp.workdps(DIGITS):
            links = ref.links_of(mp, self.machine)
            return [Axis(self, axis, [links[i] for i in self.on(axis)]) for axis in self.axes]

    @cached_property
    def own(self) -> tuple[Array, Array, Array] | None:
        with mp.workdps(DIGITS // 2):
            return None if self.by is None else self.by(self)

    @cached_property
    def times(self) -> Array:
        """(time,) s: the instants asked, and the middle between any two events, so that no contact is unseen."""
        if self.own:
            return self.own[0]
        middles = [(a + b) / 2 for axis in self.paths for a, b in pairwise(axis.events)]
        times = np.unique([*self.asked, *map(float, middles)])
        nearest = self.corners[np.abs(times[:, None] - self.corners).argmin(axis=1)]
        return np.where(np.abs(times - nearest) <= 1e-13 * self.corners[-1], nearest, times)

    @cached_property
    def truth(self) -> tuple[Array, Array]:
        """Link loads (time, link) [N] and displacements (time, axis) [m]."""
        if self.own:
            return self.own[1:]
        with mp.workdps(DIGITS):
            loads = np.empty((self.times.size, len(self.springs)))
            positions = np.empty((self.times.size, len(self.axes)))
            for i, (axis, path) in enumerate(zip(self.axes, self.paths, strict=True)):
                loads[:, self.on(axis)], positions[:, i] = path.at(self.times)
            return loads, positions

    @cached_property
    def axes(self) -> list[int]:
        return [AXES.index(dof) for dof in self.machine.free]

    def on(self, axis: int) -> list[int]:
        """Indices of the links along an axis."""
        return [i for i, name in enumerate(self.springs) if name[0] == AXES[axis]]

    def error(self, *found: Array) -> float:
        """Largest difference of a link load or a displacement over the largest one; infinite where one is no number."""
        off = max(
            np.abs(one - true).max() / np.abs(true).max() for one, true in zip(found, self.truth, strict=True)
        )
        return float(off) if np.isfinite(off) else np.inf


# ---- closed form of one axis


@dataclass(frozen=True)
class Path:
    """y(s) = p0 + p1 s + p2 s^2 + p3 s^3 + Re sum of c exp(r s), the solution under a linear force on one zone."""

    powers: Sequence[Any]
    waves: Sequence[tuple[Any, Any]]  # c, r

    @classmethod
    def of(cls, y: Any, v: Any, k: Any, b: Any, force: Any, rise: Any) -> Path:
        """The solution of y'' + b y' + k y = force + rise s from y, v on."""
        if k:
            slope = rise / k
            start = (force - b * slope) / k
            root = mp.sqrt(mp.mpc(b * b / 4 - k))
            assert root, "critically damped: not among the scenes"
            one, other = -b / 2 + root, -b / 2 - root
            c = ((v - slope) - other * (y - start)) / (one - other)
            # The second wave of a vibration is the conjugate of the first.
            waves = [(2 * c, one)] if mp.im(root) else [(c, one), (y - start - c, other)]
            return cls([start, slope], waves)
        if b:
            square = rise / (2 * b)
            slope = (force - 2 * square) / b
            c = (slope - v) / b
            return cls([y - c, slope, square], [(c, -b)])
        return cls([y, v, force / 2, rise / 6], [])

    @cached_property
    def derivatives(self) -> list[tuple[Numbers, Any]]:
        """Of each wave: c r^order for the orders 0 to 3, and r."""
        return [([c * r**order for order in range(4)], r) for c, r in self.waves]

    def at(self, s: Any, order: int = 0) -> Any:
        """The derivative of an order."""
        value = mpf(0)
        for n in range(len(self.powers) - 1, order - 1, -1):
            value = value * s + self.powers[n] * (factorial(n) // factorial(n - order))
        for rates, r in self.derivatives:
            value += mp.re(rates[order] * mp.exp(r * s))
        return value

    def bend(self, a: Any, b: Any) -> Any:
        """A bound of |y''| from a to b."""
        powers = [*self.powers, 0, 0][:4]
        poly = max(abs(2 * powers[2] + 6 * powers[3] * s) for s in (a, b))
        return poly + mp.fsum(
            abs(rates[2]) * mp.exp(max(mp.re(r) * a, mp.re(r) * b)) for rates, r in self.derivatives
        )


class Axis:
    """One axis of a scene: its zones between edges, and its path through them."""

    def __init__(self, scene: Scene, axis: int, links: list[PreciseLink]) -> None:
        self.links = links
        for link in links:
            if len(set(link.pieces)) == 1:  # a linear spring has no edge
                link.pieces, link.edges = link.pieces[:1], []
        self.edges = sorted({edge for link in links for edge in link.edges})
        self.weight = mpf(scene.gravity) if axis == 1 else mpf(0)
        corners = [mpf(float(t)) for t in scene.corners]
        forces = [mpf(float(f)) for f in scene.forces[:, axis]]
        self.legs: list[tuple[Any, Path, int]] = []  # start, path from there on, zone
        self.events: list[Any] = []  # s
        y, v = self.rest(), mpf(0)
        for (t, end), (force, next_force) in zip(pairwise(corners), pairwise(forces), strict=True):
            over, rise = None, (next_force - force) / (end - t) if end > t else 0
            while t < end:
                zone = self.zone(y, v, force, rise)
                path = self.path(zone, y, v, force, rise)
                if self.legs and zone != self.legs[-1][2]:
                    self.events.append(t)
                self.legs.append((t, path, zone))
                length, over = self.exit(path, zone, end - t)
                y, v = path.at(length), path.at(length, 1)
                t, force = t + length, force + rise * length
                y = y if over is None else over

    def at(self, times: Array) -> tuple[Array, Array]:
        """Link loads (time, link) [N] and displacements (time,) [m]."""
        starts = [start for start, *_ in self.legs]
        loads, positions = np.empty((times.size, len(self.links))), np.empty(times.size)
        for i, time in enumerate(map(mpf, times.tolist())):
            start, path, zone = self.legs[max(bisect_right(starts, time) - 1, 0)]
            y, v = path.at(time - start), path.at(time - start, 1)
            positions[i] = y
            loads[i] = [a + k * y + b * v for a, k, b in self.segments(zone)]
        return loads, positions

    def segments(self, zone: int) -> list[tuple[Any, Any, Any]]:
        """Of each link on a zone: a, k and b of its load a + k y + b v."""
        low = self.edges[zone - 1] if zone else (self.edges[0] - 1 if self.edges else mpf(0))
        high = self.edges[zone] if zone < len(self.edges) else low + 1
        found = []
        for link in self.links:
            segment = link.segment((low + high) / 2)
            found.append((*link.pieces[segment], link.damping_on(segment)))
        return found

    def path(self, zone: int, y: Any, v: Any, force: Any, rise: Any) -> Path:
        a, k, b = (mp.fsum(column) for column in zip(*self.segments(zone), strict=True))
        return Path.of(y, v, k, b, force + self.weight - a, rise)

    def rest(self) -> Any:
        """The position in which the links bear the weight; in the middle of a gap without weight."""
        if not self.weight:
            return mpf(0)
        for zone in range(len(self.edges) + 1):
            a, k, _ = (mp.fsum(column) for column in zip(*self.segments(zone), strict=True))
            if k:
                y = (self.weight - a) / k
                if sum(edge <= y for edge in self.edges) == zone:
                    return y
        raise AssertionError("no position of rest")

    def zone(self, y: Any, v: Any, force: Any, rise: Any) -> int:
        """The zone of a state; on an edge that into which it moves, or is pushed, or will be."""
        near = next((edge for edge in self.edges if abs(y - edge) <= EDGE), None)
        if near is None:
            return sum(edge <= y for edge in self.edges)
        below = self.edges.index(near)
        a, _, b = (mp.fsum(column) for column in zip(*self.segments(below), strict=True))
        k = mp.fsum(k for _, k, _ in self.segments(below))
        rates = (v, force + self.weight - a - k * near - b * v, rise)
        ahead = next((rate for rate in rates if abs(rate) > EDGE), mpf(0))
        return below + (ahead > 0)

    def exit(self, path: Path, zone: int, length: Any) -> tuple[Any, Any]:
        """When the path leaves its zone, and over which edge; the length and None if it does not."""
        found, over = length, None
        for beyond, sign in ((zone, -1), (zone - 1, 1)):
            if 0 <= beyond < len(self.edges):
                edge = self.edges[beyond]

                def room(s: Any, order: int = 0, edge: Any = edge, sign: int = sign) -> Any:
                    return sign * (path.at(s, order) - (edge if order == 0 else 0))

                if all(abs(room(mpf(0), order)) <= EDGE for order in range(4)):
                    continue  # it stays on the edge
                s = first_root(room, path.bend, SHORTEST * length, found)
                if s is not None:
                    found, over = s, edge
        return found, over


def first_root(room: Callable[..., Any], bend: Callable[[Any, Any], Any], begin: Any, end: Any) -> Any | None:
    """The first instant from begin to end at which `room` becomes negative; None if it never does."""
    if end <= begin:
        return None
    stack = [(begin, room(begin), end, room(end))]
    while stack:
        a, at_a, b, at_b = stack.pop()
        width = b - a
        most = bend(a, b)
        if min(at_a, at_b) > most * width**2 / 8:
            continue
        middle = (a + b) / 2
        if abs(room(middle, 1)) > most * width / 2 or width <= begin:  # monotone, or too short to matter
            if at_b >= 0:
                continue
            return root(room, a, b)
        at_middle = room(middle)
        stack += [(middle, at_middle, b, at_b), (a, at_a, middle, at_middle)]
    return None


def root(room: Callable[..., Any], low: Any, high: Any) -> Any:
    """Where `room` becomes negative: Newton's method, by halves where that leaves the interval."""
    s, least = (low + high) / 2, mpf(10) ** (5 - DIGITS) * high
    while high - low > least:
        value = room(s)
        low, high = (s, high) if value >= 0 else (low, s)
        change = value / (room(s, 1) or 1)
        if abs(change) < least:
            return s - change
        s -= change
        if not low < s < high:
            s = (low + high) / 2
    return s


# ---- a preloaded spring, without damping, after a step of the force


def released(scene: Scene) -> tuple[Array, Array, Array]:
    """Instants of ten swings of a preloaded spring from 0 under a constant force, loads and displacements there.

    The time to a displacement is a quadrature of the energy.
    """
    (keys,) = scene.springs.values()
    n = {"ball": mpf(3) / 2, "roller": mpf(10) / 9}[keys["rolling"]]
    force, preload = mpf(float(scene.forces[-1, 1])), mpf(keys["preload"])
    opening = 2 * n * preload / mpf(keys["stiffness"])
    factor = preload / opening**n

    def rows(d: Any, power: Any, sign: int) -> Any:
        return factor * ((opening + d) ** power + sign * max(opening - d, mpf(0)) ** power)

    def room(d: Any) -> Any:
        """v^2/2 = what the force did less what the spring holds."""
        return force * d - (rows(d, n + 1, 1) - 2 * factor * opening ** (n + 1)) / (n + 1)

    turn = opening
    while room(turn) > 0:
        turn *= 2
    turn = mp.findroot(room, (turn / 4, turn), solver="anderson", tol=mpf(10) ** -50)
    if room(opening) > 0:
        turn = max(turn, opening)

    def rate(angle: Any) -> Any:
        """ds/dangle on turn sin^2(angle), which takes away both ends at which the mass stands still."""
        angle = min(max(angle, mpf(10) ** -9), mp.pi / 2 - mpf(10) ** -9)  # 0/0 at the ends
        return turn * mp.sin(2 * angle) / mp.sqrt(2 * room(turn * mp.sin(angle) ** 2))

    opens = [mp.asin(mp.sqrt(opening / turn))] if opening < turn else []
    angles = sorted({mp.pi / 2 * i / 12 for i in range(13)} | set(opens))
    since = [mpf(0)]
    for pair in pairwise(angles):
        since.append(since[-1] + mp.quad(rate, pair))
    period, deflections = 2 * since[-1], [turn * mp.sin(angle) ** 2 for angle in angles]
    swing = [(s, d) for s, d in zip(since, deflections, strict=True)]
    swing += [(period - s, d) for s, d in swing[-2:0:-1]]
    times, places = zip(*[(turns * period + s, d) for turns in range(10) for s, d in swing], strict=True)
    loads = [rows(d, n, -1) for d in places]
    return (
        np.array(times, dtype=float),
        np.array(loads, dtype=float)[:, None],
        np.array(places, dtype=float)[:, None],
    )
