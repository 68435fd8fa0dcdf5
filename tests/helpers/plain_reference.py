"""Link and carriage loads of a machine by NumPy and SciPy alone, from the values of its file.

No code of guideload is used: links, laws, matrices, rest position and integration are written out here. A step of
DOP853 holds every link on the segment of its law that it is on, so that the right-hand side is smooth; it ends where
the first link leaves its segment.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

Array = NDArray[np.float64]
DOFS = ("x", "y", "z", "rx", "ry", "rz")
RTOL = 1e-12  # of a step of DOP853
LOOKS = np.linspace(0.0, 1.0, 9)[1:]  # shares of a step at which the segments are looked at
MOST_STEPS = 60_000


class NoReference(Exception):
    """The scene has no reference: many rest positions, or too much work."""


@dataclass(frozen=True)
class Spring:
    """A law as segments between its edges; its slope is that of a given segment."""

    edges: Array  # m, ascending
    slopes: Array  # N/m, (segments,)
    offsets: Array  # N at 0 m, of the line of each segment
    rows: tuple[float, float, float] | None = (
        None  # K, d0, n of a preloaded law, whose segments are told by its rows
    )

    def segment(self, d: float) -> int:
        return int(np.searchsorted(self.edges, d))

    def slope(self, d: float, segment: int) -> float:
        if self.rows is None:
            return float(self.slopes[segment])
        k, d0, n = self.rows
        left = max(d0 + d, 0.0) ** (n - 1.0) if segment > 0 else 0.0
        right = max(d0 - d, 0.0) ** (n - 1.0) if segment < 2 else 0.0
        return k * n * (left + right)


def spring(values: dict[str, Any], suffix: str, share: float) -> Spring:
    """The law of the keys with a suffix, all forces times `share`."""
    curve, stiffness = values.get(f"curve{suffix}"), values.get(f"stiffness{suffix}")
    preload, play = values.get(f"preload{suffix}"), values.get(f"clearance{suffix}", 0.0)
    if curve is not None:
        points = np.array(curve, dtype=float)
        if not points[0].any():
            points = np.vstack((-points[:0:-1], points))
        slopes = np.diff(points[:, 1]) / np.diff(points[:, 0])
        offsets = points[:-1, 1] - slopes * points[:-1, 0]
        return Spring(points[1:-1, 0], share * slopes, share * offsets)
    if preload is not None:
        n = {"ball": 3.0 / 2.0, "roller": 10.0 / 9.0}[values["rolling"]]
        d0 = 2.0 * n * preload / stiffness
        return Spring(np.array([-d0, d0]), np.zeros(3), np.zeros(3), (share * preload / d0**n, d0, n))
    both = stiffness if isinstance(stiffness, dict) else {"positive": stiffness, "negative": stiffness}
    up, down = share * both["positive"], share * both["negative"]
    if play == 0.0 and up == down:
        return Spring(np.zeros(0), np.array([up]), np.zeros(1))
    return Spring(
        np.array([-play, play]), np.array([down, 0.0, up]), np.array([down * play, 0.0, -up * play])
    )


class PlainMachine:
    """Matrices, links and carriages from the values of a machine file, in SI numbers."""

    def __init__(self, values: dict[str, Any]) -> None:
        body = values["body"]
        mass, center = body["mass"], np.array(body["center_of_mass"])
        self.gravity = np.array(values.get("gravity", (0.0, -9.80665, 0.0)))
        cross = _cross_matrix(center)
        inertia = np.array(body["inertia"])
        if body.get("inertia_about", "center_of_mass") == "center_of_mass":
            inertia = inertia - mass * cross @ cross
        self.mass = np.block([[mass * np.eye(3), -mass * cross], [mass * cross, inertia]])
        self.weight = np.concatenate((mass * self.gravity, np.cross(center, mass * self.gravity)))
        self.free = [DOFS.index(dof) for dof in values.get("free", ("y", "z", "rx", "ry", "rz"))]
        points, directions, self.springs, damping, in_contact, self.carriage = [], [], [], [], [], []
        rails = {rail["name"]: rail["position"] for rail in values.get("rails", ())}
        self.centers = []
        for i, carriage in enumerate(values.get("carriages", ())):
            middle = np.array([carriage["x"], *rails[carriage["rail"]]])
            self.centers.append(middle)
            for end in (-0.5, 0.5):
                for axis, suffix in ((1, "_y"), (2, "_z")):
                    points.append(middle + [end * carriage["length"], 0.0, 0.0])
                    directions.append(np.eye(3)[axis])
                    self.springs.append(spring(carriage, suffix, 0.5))
                    damping.append(0.5 * carriage[f"damping{suffix}"])
                    play = carriage.get(f"clearance{suffix}", 0.0)
                    in_contact.append(carriage.get("damping_in_contact", False) and play > 0.0)
                    self.carriage.append(i)
        for link in values.get("links", ()):
            points.append(np.array(link["point"]))
            directions.append(np.array(link["direction"]) / np.linalg.norm(link["direction"]))
            self.springs.append(spring(link, "", 1.0))
            damping.append(link["damping"])
            in_contact.append(link.get("damping_in_contact", False))
            self.carriage.append(-1)
        self.points, self.directions = np.array(points), np.array(directions)
        self.rows = np.hstack((self.directions, np.cross(self.points, self.directions)))[:, self.free]
        self.damping, self.in_contact = np.array(damping), np.array(in_contact)
        self.factor, self.opening, self.power = np.array([s.rows or (0.0, 0.0, 1.0) for s in self.springs]).T
        self.preloaded = bool(self.factor.any())

    def laws(self, segments: Array) -> tuple[Array, ...]:
        """Of each link on its segment: slope, offset, damping, and the factors of its two preloaded rows."""
        on = list(zip(self.springs, segments, strict=True))
        acting = ~self.in_contact | (segments != 1)
        return (
            np.array([s.slopes[at] for s, at in on]),
            np.array([s.offsets[at] for s, at in on]),
            np.where(acting, self.damping, 0.0),
            np.where(segments > 0, self.factor, 0.0),
            np.where(segments < 2, self.factor, 0.0),
        )

    def elastic(self, d: Array, laws: tuple[Array, ...]) -> Array:
        slope, offset, _, left, right = laws
        line = slope * d + offset
        if not self.preloaded:
            return line
        rows = [np.maximum(self.opening + side, 0.0) ** self.power for side in (d, -d)]
        return line + left * rows[0] - right * rows[1]

    def segments(self, d: Array) -> NDArray[np.int64]:
        return np.array([s.segment(at) for s, at in zip(self.springs, d, strict=True)])

    def rest(self) -> Array:
        """Position of the free dofs at rest, by Newton's method with halved steps on a convex energy."""
        q, weight = np.zeros(len(self.free)), self.weight[self.free]
        tangent = np.zeros((q.size, q.size))

        def residual(at: Array) -> Array:
            d = self.rows @ at
            return weight - self.rows.T @ self.elastic(d, self.laws(self.segments(d)))

        steepest = np.array([max(s.slope(0.0, k) for k in range(s.slopes.size)) for s in self.springs])
        nominal = self.rows.T * steepest @ self.rows
        for _ in range(500):
            d, force = self.rows @ q, residual(q)
            if np.abs(force).max() <= 1e-13 * np.abs(weight).max():
                break
            slopes = [s.slope(*a) for s, *a in zip(self.springs, d, self.segments(d), strict=True)]
            tangent = self.rows.T * slopes @ self.rows
            step = np.linalg.solve(tangent + 1e-9 * nominal, force)
            while residual(q + step) @ step < -0.9 * (force @ step) and np.abs(step).max() > 1e-18:
                step *= 0.5  # the energy rises again beyond: too far
            q = q + step
        d = self.rows @ q
        slopes = [s.slope(*a) for s, *a in zip(self.springs, d, self.segments(d), strict=True)]
        tangent = self.rows.T * slopes @ self.rows
        size = np.sqrt(np.diag(nominal))
        if np.abs(residual(q)).max() > 1e-10 * np.abs(weight).max():
            raise NoReference("no rest position found")
        if np.linalg.eigvalsh(tangent / np.outer(size, size))[0] < 1e-6:
            raise NoReference("the rest position is not the only one")
        return q

    def loads(self, time: Array, acceleration: Array, wrench: Array | None = None) -> tuple[Array, Array]:
        """Link loads (time, links) [N] and carriage loads (time, carriage, 6), force and moment about its centre."""
        inputs = np.hstack((acceleration, np.zeros((time.size, 6)) if wrench is None else wrench))
        states = _Integration(self).run(time, inputs)
        link_loads = np.array([self.link_loads(state, self.laws(segments)) for state, segments in states])
        force = link_loads[:, :, None] * self.directions
        carriages = np.zeros((time.size, len(self.centers), 6))
        for i, center in enumerate(self.centers):
            of = np.array(self.carriage) == i
            carriages[:, i, :3] = force[:, of].sum(axis=1)
            carriages[:, i, 3:] = np.cross(self.points[of] - center, force[:, of]).sum(axis=1)
        return link_loads, carriages

    def link_loads(self, state: Array, laws: tuple[Array, ...]) -> Array:
        n = len(self.free)
        return self.elastic(self.rows @ state[:n], laws) + laws[2] * (self.rows @ state[n:])


class _Integration:
    """DOP853 from sample to sample and from edge to edge."""

    def __init__(self, machine: PlainMachine) -> None:
        self.machine = machine
        free = machine.free
        self.inverse = np.linalg.inv(machine.mass[np.ix_(free, free)])
        self.from_input = np.hstack((-machine.mass[free, :3], np.eye(6)[free]))
        self.state = np.concatenate((machine.rest(), np.zeros(len(free))))
        self.on = machine.segments(machine.rows @ self.state[: len(free)])
        self.steps = 0

    def run(self, time: Array, inputs: Array) -> list[tuple[Array, NDArray[np.int64]]]:
        states = [(self.state, self.on.copy())]
        for k in range(time.size - 1):
            if time[k + 1] > time[k]:
                self.interval(time[k], time[k + 1], inputs[k], inputs[k + 1])
            states.append((self.state, self.on.copy()))
        return states

    def interval(self, start: float, end: float, first: Array, last: Array) -> None:
        machine, n = self.machine, len(self.machine.free)
        outer = machine.weight[machine.free] + self.from_input @ first
        rise = self.from_input @ (last - first) / (end - start)

        def rate(t: float, state: Array) -> Array:
            pull = machine.rows.T @ machine.link_loads(state, laws)
            return np.concatenate((state[n:], self.inverse @ (outer + (t - start) * rise - pull)))

        t, guess = start, None
        while t < end:
            laws = machine.laws(self.on)
            step = min(guess, end - t) if guess else None
            atol = 1e-14 * max(float(np.abs(self.state).max()), 1e-6)
            solver = DOP853(rate, t, self.state, end, rtol=RTOL, atol=atol, first_step=step)
            while solver.status == "running":
                self.steps += 1
                if self.steps > MOST_STEPS:
                    raise NoReference("too many steps")
                if solver.step() is not None or solver.status == "failed":
                    raise NoReference("a step failed")
                left = self.first_to_leave(solver)
                guess = solver.h_abs
                if left is not None:
                    t, self.state = left[0], left[1]
                    self.on[left[2]] += left[3]
                    break
                t, self.state = solver.t, solver.y

    def first_to_leave(self, solver: Any) -> tuple[float, Array, int, int] | None:
        """Instant and state at which the first link leaves its segment in the last step, the link and its direction."""
        machine, n, dense = self.machine, len(self.machine.free), solver.dense_output()
        start, length = solver.t_old, solver.t - solver.t_old
        looks = start + LOOKS * length
        d = machine.rows @ dense(looks)[:n]  # (links, looks)
        first: tuple[float, int, int] | None = None
        for link, spring_ in enumerate(machine.springs):
            edges, on = spring_.edges, self.on[link]
            for direction, at in ((-1, on - 1), (1, on)):
                if not 0 <= at < edges.size:
                    continue
                beyond = direction * (d[link] - edges[at])
                if not (beyond > 0.0).any():
                    continue

                def gap(t: float, link: int = link, edge: float = edges[at], sign: int = direction) -> float:
                    return float(sign * (machine.rows[link] @ dense(t)[:n] - edge))

                late = int((beyond > 0.0).argmax())
                early = looks[late - 1] if late else start
                instant = (
                    brentq(gap, early, looks[late], xtol=1e-300, rtol=1e-15) if gap(early) < 0.0 else early
                )
                if first is None or instant < first[0]:
                    first = instant, link, direction
        return None if first is None else (first[0], dense(first[0]), first[1], first[2])


def _cross_matrix(r: Array) -> Array:
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
