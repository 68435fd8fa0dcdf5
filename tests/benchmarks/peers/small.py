"""The scenes of the torture set for other solvers, each called twice.

plain   one call over the whole motion, with the laws and forces as they are: what most users write
events  legs from corner to corner of the force and from event to event, as each documentation advises: within a leg
        the equations are smooth, its guards end it at the edge of the zone, and the state is put on the edge

All are asked for RTOL, with absolute tolerances of RTOL times the largest displacement and speed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from torture import RTOL, Scene

Array = NDArray[np.float64]
STEPS = 1_000_000  # that a solver may take
EVENTS = 2_000  # more than three times those of any scene
RK4_STEPS = 400_000  # of the fixed step


@dataclass(frozen=True)
class Guard:
    """The leg ends when sign (x[axis] - edge) becomes negative; `zone` is then that of the axis."""

    axis: int
    edge: float
    sign: int
    zone: int


@dataclass(frozen=True, eq=False)
class Leg:
    """x' = rate(t, x) from t to end, smooth; a solver ends it at the first guard that becomes negative."""

    rate: Callable[[float, Array], Array]
    jacobian: Callable[[float, Array], Array]
    guards: Sequence[Guard]
    t: float
    end: float
    x: Array
    size: Array
    asked: Array  # instants, ascending, after t
    terms: tuple[Array, Array]  # where the leg is linear: A and (c, c') of x' = A x + c + c' (t - t0)


Ended = tuple[Array, float, Array, int | None]  # states at the instants reached, end, state there, guard
Solve = Callable[[Leg], Ended]


@dataclass(frozen=True, eq=False)
class Equations:
    """A scene in floating point. x: displacements of its axes, then their speeds."""

    scene: Scene

    @cached_property
    def n(self) -> int:
        return len(self.scene.axes)

    @cached_property
    def size(self) -> Array:
        """(2n,) displacement and speed by which tolerances count: the largest, or those that make the largest load."""
        loads, places = self.scene.truth
        speed = np.abs(np.diff(places, axis=0) / np.diff(self.scene.times)[:, None]).max()
        stiffest = np.max([table[:, 1:].max(axis=0) for table in self.tables] or [[0.0, 0.0]], axis=0)
        by_load = np.abs(loads).max() / np.maximum(stiffest, 1e-300)
        return np.repeat(np.minimum([np.abs(places).max(), speed], by_load), self.n)

    @cached_property
    def edges(self) -> list[Array]:
        return [np.array(axis.edges, dtype=float) for axis in self.scene.paths] or [np.empty(0)]

    @cached_property
    def tables(self) -> list[Array]:
        """Of each axis (zone, 3): a, k, b of its load a + k y + b v, with the weight in a."""
        found = []
        for axis in self.scene.paths:
            rows = [np.sum(np.array(axis.segments(i), float), axis=0) for i in range(len(axis.edges) + 1)]
            found.append(np.array(rows) - [float(axis.weight), 0.0, 0.0])
        return found

    @cached_property
    def preloaded(self) -> tuple[float, float, float] | None:
        """Power, opening and factor of a preloaded spring."""
        if self.scene.by is None:
            return None
        (keys,) = self.scene.springs.values()
        n = {"ball": 1.5, "roller": 10.0 / 9.0}[keys["rolling"]]
        opening = 2.0 * n * keys["preload"] / keys["stiffness"]
        return n, opening, keys["preload"] / opening**n

    @cached_property
    def start(self) -> Array:
        return np.array([float(axis.rest()) for axis in self.scene.paths] or [0.0])

    def pieces(self) -> list[tuple[float, float, Array, Array]]:
        """Of each interval between corners: its ends [s], force at its start [N] and rise [N/s]."""
        corners, forces = self.scene.corners, self.scene.forces[:, self.scene.axes]
        return [
            (t, end, f, (g - f) / (end - t))
            for (t, end), (f, g) in zip(pairwise(corners.tolist()), pairwise(forces), strict=True)
            if end > t
        ]

    def zones(self, y: Array) -> list[int]:
        return [int((edges <= one).sum()) for edges, one in zip(self.edges, y, strict=True)]

    def spring(self, y: Array, v: Array, zones: Sequence[int]) -> Array:
        """(n,) N."""
        if self.preloaded:
            n, opening, factor = self.preloaded
            ahead, behind = np.maximum(opening + y, 0.0), np.maximum(opening - y, 0.0)
            return np.asarray(factor * (ahead**n - behind**n))
        rows = np.array([table[zone] for table, zone in zip(self.tables, zones, strict=True)])
        return np.asarray(rows[:, 0] + rows[:, 1] * y + rows[:, 2] * v)

    def jacobian(self, y: Array, zones: Sequence[int]) -> Array:
        j = np.zeros((2 * self.n, 2 * self.n))
        j[: self.n, self.n :] = np.eye(self.n)
        for i in range(self.n):
            if self.preloaded:
                n, opening, factor = self.preloaded
                k = n * factor * np.sum(np.maximum([opening + y[i], opening - y[i]], 0.0) ** (n - 1.0))
                j[1, 0] = -k
            else:
                j[self.n + i, [i, self.n + i]] = -self.tables[i][zones[i], 1:]
        return j

    def whole(self) -> Leg:
        """The plain call."""
        n, pieces = self.n, self.pieces()
        starts = np.array([t for t, *_ in pieces])

        def rate(t: float, x: Array) -> Array:
            start, _, force, rise = pieces[max(int(np.searchsorted(starts, t, "right")) - 1, 0)]
            pull = self.spring(x[:n], x[n:], self.zones(x[:n]))
            return np.concatenate([x[n:], force + rise * (t - start) - pull])

        def jacobian(t: float, x: Array) -> Array:
            return self.jacobian(x[:n], self.zones(x[:n]))

        x = np.concatenate([self.start, np.zeros(n)])
        last = self.scene.corners[-1]
        empty = (np.empty(0), np.empty(0))
        return Leg(rate, jacobian, (), pieces[0][0], last, x, self.size, self.scene.times, empty)

    def legs(self, solve: Solve) -> Array:
        """States (time, 2n) by the call with events."""
        n, times = self.n, self.scene.times
        x, zones = np.concatenate([self.start, np.zeros(n)]), self.zones(self.start)
        states, events = np.empty((0, 2 * n)), 0
        for start, end, force, rise in self.pieces():
            t = start
            while t < end:
                self.settle(x, zones, force + rise * (t - start))
                guards = self.guards(zones)

                def rate(
                    at: float, x: Array, zones: Sequence[int] = tuple(zones), start: float = start,
                    force: Array = force, rise: Array = rise,
                ) -> Array:  # fmt: skip
                    pull = self.spring(x[:n], x[n:], zones)
                    return np.concatenate([x[n:], force + rise * (at - start) - pull])

                def jacobian(at: float, x: Array, zones: Sequence[int] = tuple(zones)) -> Array:
                    return self.jacobian(x[:n], zones)

                offset = np.zeros(2 * n), np.zeros(2 * n)
                if not self.preloaded:
                    constant = force + rise * (t - start) - self.spring(np.zeros(n), np.zeros(n), zones)
                    offset = np.concatenate([np.zeros(n), constant]), np.concatenate([np.zeros(n), rise])
                asked = times[len(states) : np.searchsorted(times, end, "right")]
                terms = self.jacobian(x, zones), np.array(offset)
                leg = Leg(rate, jacobian, guards, t, end, x, self.size, asked, terms)
                found, t, x, hit = solve(leg)
                states = np.vstack([states, found])
                if hit is not None:
                    events += 1
                    enter(guards[hit], x, zones)
                    if events > EVENTS:
                        raise RuntimeError(f"trapped at an event: {EVENTS} of them until {t:.6g} s")
        return states

    def settle(self, x: Array, zones: list[int], force: Array) -> None:
        """Change the zone of each axis that stands on an edge, to rounding, and is on its way over it."""
        n = self.n
        rates = np.array([x[n:], force - self.spring(x[:n], x[n:], zones)])
        for guard in self.guards(zones):
            room = guard.sign * (x[guard.axis] - guard.edge)
            speed, push = guard.sign * rates[:, guard.axis]
            if room <= 1e-12 * self.size[0] and (speed < 0.0 or (speed == 0.0 and push < 0.0)):
                enter(guard, x, zones)

    def guards(self, zones: Sequence[int]) -> list[Guard]:
        found = []
        for axis, (edges, zone) in enumerate(zip(self.edges, zones, strict=True)):
            if zone < len(edges):
                found.append(Guard(axis, float(edges[zone]), -1, zone + 1))
            if zone > 0:
                found.append(Guard(axis, float(edges[zone - 1]), 1, zone - 1))
        return found

    def error(self, states: Array) -> float:
        """As `Scene.error`, of states at all instants."""
        if len(states) != self.scene.times.size:
            return np.inf
        loads, n = np.empty((len(states), len(self.scene.springs))), self.n
        if self.preloaded:
            loads[:, 0] = self.spring(states[:, 0], states[:, 1], ())
        for i, path in enumerate(self.scene.paths):
            rows = [np.array(path.segments(zone), float) for zone in range(len(path.edges) + 1)]
            for at, (y, v) in enumerate(states[:, [i, n + i]]):
                of = rows[int((self.edges[i] <= y).sum())]
                loads[at, self.scene.on(self.scene.axes[i])] = of[:, 0] + of[:, 1] * y + of[:, 2] * v
        return self.scene.error(loads, states[:, :n])


def enter(guard: Guard, x: Array, zones: list[int]) -> None:
    """Go over the edge of a guard, to the first number behind it."""
    zones[guard.axis] = guard.zone
    x[guard.axis] = np.nextafter(guard.edge, -guard.sign * np.inf)


def scipy_leg(method: str) -> Solve:
    """solve_ivp; the Jacobian for those that take one; guards are terminal events."""

    def solve(leg: Leg) -> Ended:
        events = []
        for guard in leg.guards:

            def event(t: float, x: Array, guard: Guard = guard) -> float:
                return float(guard.sign * (x[guard.axis] - guard.edge))

            event.terminal, event.direction = True, -1.0
            events.append(event)
        options: dict[str, Any] = {}
        if method in ("Radau", "BDF", "LSODA"):
            options["jac"] = leg.jacobian
        found = scipy.integrate.solve_ivp(
            leg.rate,
            (leg.t, leg.end),
            leg.x,
            method=method,
            t_eval=np.union1d(leg.asked, leg.end),
            rtol=RTOL,
            atol=RTOL * leg.size,
            events=events,
            **options,
        )
        if not found.success:
            raise RuntimeError(found.message)
        states = np.reshape(np.transpose(found.y), (-1, leg.x.size))
        hits = [i for i, times in enumerate(found.t_events or []) if len(times)]
        if hits:
            first = min(hits, key=lambda i: found.t_events[i][0])
            at = float(found.t_events[first][0])
            return (
                states[: np.searchsorted(leg.asked, at, "right")],
                at,
                found.y_events[first][0].copy(),
                first,
            )
        return states[: len(leg.asked)], leg.end, states[-1].copy(), None

    return solve


def sundials_leg(name: str) -> Solve:
    """CVODE BDF or Adams, or IDA, of scikit-sundae; the Jacobian given; guards are terminal events."""

    def solve(leg: Leg) -> Ended:
        from sksundae.cvode import CVODE
        from sksundae.ida import IDA

        residual = name == "IDA"

        def rooms(t: float, x: Array, out: Array) -> None:
            out[:] = [guard.sign * (x[guard.axis] - guard.edge) for guard in leg.guards]

        def events(t: float, x: Array, rate: Array, out: Array) -> None:
            rooms(t, x, out)

        for event in (rooms, events):
            event.terminal = [True] * len(leg.guards)
            event.direction = [-1] * len(leg.guards)
        options: dict[str, Any] = {"rtol": RTOL, "atol": RTOL * leg.size, "max_num_steps": STEPS}
        if leg.guards:
            options |= {"eventsfn": events if residual else rooms, "num_events": len(leg.guards)}
        times = np.unique(np.concatenate([[leg.t], leg.asked, [leg.end]]))

        def right(t: float, x: Array, out: Array) -> None:
            out[:] = leg.rate(t, x)

        def slope(t: float, x: Array, rate: Array, out: Array) -> None:
            out[:, :] = leg.jacobian(t, x)

        def left(t: float, x: Array, rate: Array, out: Array) -> None:
            out[:] = rate - leg.rate(t, x)

        def slopes(t: float, x: Array, rate: Array, residual: Array, cj: float, out: Array) -> None:
            out[:, :] = cj * np.eye(x.size) - leg.jacobian(t, x)

        if residual:
            found = IDA(left, jacfn=slopes, **options).solve(times, leg.x, leg.rate(leg.t, leg.x))
        else:
            solver = CVODE(right, jacfn=slope, method=name.removeprefix("CVODE "), **options)
            found = solver.solve(times, leg.x)
        if not found.success:
            raise RuntimeError(found.message)
        ended = leg.guards and found.t_events is not None and len(found.t_events)
        at = float(found.t_events[0]) if ended else leg.end
        keep = np.isin(found.t, leg.asked) & (found.t <= at)
        last = found.y_events[0] if ended else found.y[-1]
        hit = int(np.argmax(np.abs(found.i_events[0]))) if ended else None
        return found.y[keep], at, np.array(last), hit

    return solve
