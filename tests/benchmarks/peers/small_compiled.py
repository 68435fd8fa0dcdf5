"""Solvers of compiled equations, and Exudyn, for the scenes of the torture set: see small.py."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np
from scipy.interpolate import CubicHermiteSpline
from torture import RTOL

from peers.small import RK4_STEPS, STEPS, Array, Ended, Equations, Leg, Solve

# ---- pydiffsol: equations in its own language, in states of order one because it has one absolute tolerance


@cache
def _compiled(code: str) -> Any:
    import pydiffsol

    return pydiffsol.Ode(code, matrix_type=pydiffsol.nalgebra_dense)


def _solved(solver: str, code: str, inputs: Array, times: Array) -> Any:
    import pydiffsol

    ode = _compiled(code)
    ode.ode_solver = getattr(pydiffsol, solver)
    ode.rtol = ode.atol = RTOL
    return ode.solve_dense(inputs, times)


def _preloaded(given: Equations, y: str) -> str:
    n, opening, factor = given.preloaded or (0.0, 0.0, 0.0)
    return f"{factor!r} * (pow(max({opening!r} + {y}, 0.0), {n!r}) - pow(max({opening!r} - {y}, 0.0), {n!r}))"


def diffsol_whole(given: Equations, solver: str) -> Array:
    """States by one call; corners and edges as max(..., 0) and heaviside(...)."""
    n, size = given.n, given.size.tolist()
    pieces = given.pieces()
    rates = [f"{size[n + i] / size[i]!r} * v{i}" for i in range(n)]
    for i in range(n):
        y, v = f"({size[i]!r} * y{i})", f"({size[n + i]!r} * v{i})"
        terms = [f"{pieces[0][2][i]!r}", f"{pieces[0][3][i]!r} * t"]
        for (start, end, force, rise), (_, _, then, next_rise) in zip(pieces[:-1], pieces[1:], strict=True):
            jump = then[i] - force[i] - rise[i] * (end - start)
            terms.append(f"{float(jump)!r} * heaviside(t - {end!r})")
            terms.append(f"{float(next_rise[i] - rise[i])!r} * max(t - {end!r}, 0.0)")
        if given.preloaded:
            terms.append(f"-1.0 * {_preloaded(given, y)}")
        else:
            table = given.tables[i]
            terms.append(
                f"-1.0 * ({float(table[0, 0])!r} + {float(table[0, 1])!r} * {y} + {float(table[0, 2])!r} * {v})"
            )
            for edge, change in zip(given.edges[i].tolist(), np.diff(table, axis=0), strict=True):
                terms.append(f"-{float(change[1])!r} * max({y} - {edge!r}, 0.0)")
                terms.append(f"-{float(change[2])!r} * {v} * heaviside({y} - {edge!r})")
        total = " + ".join(terms).replace("--", "").replace("float64", "")
        rates.append(f"({total}) / {size[n + i]!r}")
    start = [repr(float(one / of)) for one, of in zip(given.start, size, strict=False)]
    names = [f"y{i} = {start[i]}" for i in range(n)] + [f"v{i} = 0.0" for i in range(n)]
    code = f"u_i {{ {', '.join(names)} }}\nF_i {{ {', '.join(rates)} }}".replace("np.(", "(")
    found = _solved(solver, code, np.empty(0), given.scene.times)
    return np.asarray(found.ys.T * given.size)


def diffsol_leg(given: Equations, solver: str) -> Solve:
    """Legs by `stop`; start and force are inputs, so a zone is compiled once."""
    n, size = given.n, given.size

    def solve(leg: Leg) -> Ended:
        a = leg.terms[0] * size / size[:, None]
        inputs = [f"y{i} = 0.0, v{i} = 0.0, c{i} = 0.0, r{i} = 0.0" for i in range(n)]
        rates = [f"{float(a[i, n + i])!r} * s{i}" for i in range(n)]
        for i in range(n):
            if given.preloaded:
                pull = f"-1.0 * {_preloaded(given, f'({float(size[i])!r} * d{i})')} / {float(size[n + i])!r}"
            else:
                pull = f"{float(a[n + i, i])!r} * d{i} + {float(a[n + i, n + i])!r} * s{i}"
            rates.append(f"c{i} + r{i} * t + {pull}")
        states = [f"d{i} = y{i}" for i in range(n)] + [f"s{i} = v{i}" for i in range(n)]
        code = f"in_i {{ {', '.join(inputs)} }}\nu_i {{ {', '.join(states)} }}\nF_i {{ {', '.join(rates)} }}"
        if leg.guards:
            stops = [
                f"{guard.sign * 1.0!r} * (d{guard.axis} - {float(guard.edge / size[guard.axis])!r})"
                for guard in leg.guards
            ]
            code += f"\nstop_i {{ {', '.join(stops)} }}"
        force = leg_force(given, leg) if given.preloaded else leg.terms[1]
        values = [
            [
                leg.x[i] / size[i],
                leg.x[n + i] / size[n + i],
                force[0][n + i] / size[n + i],
                force[1][n + i] / size[n + i],
            ]
            for i in range(n)
        ]
        times = np.union1d(leg.asked - leg.t, leg.end - leg.t)
        found = _solved(solver, code, np.ravel(values), times)
        ys, at = found.ys.T * size, float(found.ts[-1])
        reached = int(np.searchsorted(leg.asked - leg.t, at, "right"))
        if at >= times[-1]:
            return ys[: len(leg.asked)], leg.end, ys[-1].copy(), None
        rooms = [abs(ys[-1][guard.axis] - guard.edge) for guard in leg.guards]
        return ys[:reached], leg.t + at, ys[-1].copy(), int(np.argmin(rooms))

    return solve


def leg_force(given: Equations, leg: Leg) -> tuple[Array, Array]:
    """Force and rise of a leg of a preloaded spring, at the places of the speeds."""
    pull = given.spring(leg.x[:1], leg.x[1:], ())
    return np.array([0.0, leg.rate(leg.t, leg.x)[1] + pull[0]]), np.zeros(2)


# ---- diffrax


def diffrax_whole(given: Equations, solver: str) -> Array:
    """States by one call."""
    run = _whole(given, solver)
    x = np.concatenate([given.start, np.zeros(given.n)]) / given.size
    first, last = float(given.scene.corners[0]), float(given.scene.corners[-1])
    return np.asarray(run(first, last, x, given.scene.times, None).ys[:-1]) * given.size


@cache
def _whole(given: Equations, solver: str) -> Callable[..., Any]:
    import diffrax
    import jax

    jax.config.update("jax_enable_x64", True)
    jnp, n = jax.numpy, given.n
    pieces = given.pieces()
    starts = jnp.array([t for t, *_ in pieces])
    forces, rises = jnp.array([f for _, _, f, _ in pieces]), jnp.array([r for *_, r in pieces])

    def pull(y: Any, v: Any) -> Any:
        if given.preloaded:
            power, opening, factor = given.preloaded
            ahead, behind = jnp.maximum(opening + y, 0.0), jnp.maximum(opening - y, 0.0)
            return factor * (ahead**power - behind**power)
        rows = [
            jnp.asarray(table)[(jnp.asarray(edges) <= y[i]).sum()]
            for i, (table, edges) in enumerate(zip(given.tables, given.edges, strict=True))
        ]
        return jnp.array([row[0] + row[1] * y[i] + row[2] * v[i] for i, row in enumerate(rows)])

    def rate(t: Any, x: Any, _: Any) -> Any:
        k = jnp.maximum(jnp.searchsorted(starts, t, side="right") - 1, 0)
        y, v = x[:n] * given.size[:n], x[n:] * given.size[n:]
        return jnp.concatenate([v, forces[k] + rises[k] * (t - starts[k]) - pull(y, v)]) / given.size

    return _diffrax(diffrax, jax, solver, rate, ())


def _diffrax(diffrax: Any, jax: Any, solver: str, rate: Any, rooms: tuple[Any, ...]) -> Callable[..., Any]:
    def run(t: Any, end: Any, x: Any, times: Any, args: Any) -> Any:
        control: Any = diffrax.PIDController(rtol=RTOL, atol=RTOL)
        event = None
        if rooms:
            import optimistix

            event = diffrax.Event(
                list(rooms), optimistix.Newton(1e-10, 1e-10), direction=[False] * len(rooms)
            )
        return diffrax.diffeqsolve(
            diffrax.ODETerm(rate), getattr(diffrax, solver)(), t, end, None, x, args=args,
            saveat=diffrax.SaveAt(ts=times, t1=True), stepsize_controller=control, max_steps=STEPS, event=event,
        )  # fmt: skip

    return jax.jit(run)


@cache
def diffrax_leg(given: Equations, solver: str) -> Solve:
    """Legs by Event with a root finder, compiled once for all zones of a scene."""
    import diffrax
    import jax

    jax.config.update("jax_enable_x64", True)
    jnp, n, size = jax.numpy, given.n, given.size
    total = 2 * n if any(edges.size for edges in given.edges) else 0

    def rate(t: Any, x: Any, args: Any) -> Any:
        start, a, c, rise, _ = args
        out = a @ x + c + rise * (t - start)
        if not given.preloaded:
            return out
        power, opening, factor = given.preloaded
        y = x[:1] * size[:1]
        ahead, behind = jnp.maximum(opening + y, 0.0), jnp.maximum(opening - y, 0.0)
        pull = factor * (ahead**power - behind**power) / size[1]
        return jnp.concatenate([x[1:] * size[1] / size[0], out[1:] - pull])

    def room(i: int) -> Any:
        def of(t: Any, y: Any, args: Any, **_: Any) -> Any:
            sign, edge = args[4][i]
            return sign * (y[i // 2] - edge)

        return of

    run = _diffrax(diffrax, jax, solver, rate, tuple(room(i) for i in range(total)))

    def solve(leg: Leg) -> Ended:
        guards = np.zeros((total, 2))
        guards[:, 0], guards[:, 1] = 1.0, -1e30
        index: dict[int, int] = {}
        for k, guard in enumerate(leg.guards):
            place = 2 * guard.axis + (guard.sign > 0)
            guards[place], index[place] = (guard.sign, guard.edge / size[guard.axis]), k
        padded = np.full(given.scene.times.size, leg.end)
        padded[: len(leg.asked)] = leg.asked
        c, rise = leg_force(given, leg) if given.preloaded else leg.terms[1]
        a = np.zeros_like(leg.terms[0]) if given.preloaded else leg.terms[0] * size / size[:, None]
        found = run(leg.t, leg.end, leg.x / size, padded, (leg.t, a, c / size, rise / size, guards))
        done = np.isfinite(found.ts)
        ys, at = np.asarray(found.ys)[done] * size, float(found.ts[done][-1])
        reached = int(np.searchsorted(leg.asked, at, "right"))
        if found.result == diffrax.RESULTS.successful:
            return ys[: len(leg.asked)], leg.end, ys[-1].copy(), None
        rooms = [abs(ys[-1][guard.axis] - guard.edge) for guard in leg.guards]
        return ys[:reached], at, ys[-1].copy(), int(np.argmin(rooms))

    return solve


# ---- RK4 of fixed steps, by hand


@numba.njit(fastmath=False)
def _rk4(
    a: Array,
    c: Array,
    rise: Array,
    t: float,
    end: float,
    x: Array,
    h: float,
    guards: Array,
    law: Array,
    kept: Array,
) -> int:
    """Times and states after each step in `kept` (steps + 1, 1 + 2n); returns how many there are."""

    def rate(s, x):
        out = a @ x + c + rise * s
        if law[2] > 0.0:
            pull = max(law[1] + x[0], 0.0) ** law[0] - max(law[1] - x[0], 0.0) ** law[0]
            out[0], out[1] = x[1], c[1] + rise[1] * s - law[2] * pull
        return out

    def step(s, x, h):
        one = rate(s, x)
        two = rate(s + h / 2, x + h / 2 * one)
        three = rate(s + h / 2, x + h / 2 * two)
        four = rate(s + h, x + h * three)
        return x + h / 6 * (one + 2 * two + 2 * three + four)

    def room(x):
        least = 1.0
        for i in range(len(guards)):
            least = min(least, guards[i, 1] * (x[int(guards[i, 0])] - guards[i, 2]))
        return least

    steps = max(1, int(np.ceil((end - t) / h)))
    kept[0, 0], kept[0, 1:] = t, x
    s, part = 0.0, (end - t) / steps
    for k in range(steps):
        then = step(s, x, part)
        if room(then) < 0.0:
            low, high = 0.0, part
            for _ in range(60):
                middle = 0.5 * (low + high)
                if room(step(s, x, middle)) < 0.0:
                    high = middle
                else:
                    low = middle
            kept[k + 1, 0], kept[k + 1, 1:] = t + s + high, step(s, x, high)
            return k + 2
        x, s = then, s + part
        kept[k + 1, 0], kept[k + 1, 1:] = t + s, x
    kept[steps, 0] = end
    return steps + 1


def rk4_leg(given: Equations) -> Solve:
    """Legs in steps of a RK4_STEPS-th of the motion, the last of a leg cut by halves to end on the edge."""
    h = float(np.ptp(given.scene.corners)) / RK4_STEPS
    n = given.n
    kept = np.empty((RK4_STEPS + given.scene.corners.size + 2, 1 + 2 * n))

    def solve(leg: Leg) -> Ended:
        guards = np.array([[guard.axis, guard.sign, guard.edge] for guard in leg.guards]).reshape(-1, 3)
        c, rise = leg_force(given, leg) if given.preloaded else leg.terms[1]
        law = np.array(given.preloaded or (0.0, 0.0, 0.0))
        count = _rk4(np.ascontiguousarray(leg.terms[0]), c, rise, leg.t, leg.end, leg.x, h, guards, law, kept)
        rows = kept[:count]
        at = float(rows[-1, 0])
        asked = leg.asked[leg.asked <= at]
        found = between(rows[:, 0], rows[:, 1 : 1 + n], rows[:, 1 + n :], asked)
        last = rows[-1, 1:].copy()
        if at >= leg.end:
            return found, leg.end, last, None
        rooms = [guard.sign * (last[guard.axis] - guard.edge) for guard in leg.guards]
        return found, at, last, int(np.argmin(rooms))

    return solve


def between(times: Array, y: Array, v: Array, asked: Array) -> Array:
    """States at instants between steps by cubics of displacements and speeds."""
    distinct = np.append(True, np.diff(times) > 0.0)
    spline = CubicHermiteSpline(times[distinct], y[distinct], v[distinct])
    return np.hstack([spline(asked), spline(asked, 1)])


# ---- Exudyn


def exudyn_whole(given: Equations, solver: str) -> Array:
    """States by one call: DOPRI5 with its step control at RTOL, or GeneralizedAlpha in 20 000 steps."""
    import exudyn as exu
    import exudyn.itemInterface as item

    n, leg = given.n, given.whole()
    container = exu.SystemContainer()
    system = container.AddSystem()
    zero = [0.0] * n
    node = system.AddNode(
        item.NodeGenericODE2(
            referenceCoordinates=zero, initialCoordinates=given.start.tolist(), initialCoordinates_t=zero,
            numberOfODE2Coordinates=n,
        )
    )  # fmt: skip

    def force(_: Any, t: float, number: int, q: Any, q_t: Any) -> Any:
        return leg.rate(t, np.concatenate([q, q_t]))[n:]

    system.AddObject(
        item.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.eye(n), forceUserFunction=force)
    )
    kinds = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
    sensors = [
        system.AddSensor(
            item.SensorNode(nodeNumber=node, outputVariableType=kind, storeInternal=True, writeToFile=False)
        )
        for kind in kinds
    ]
    system.Assemble()
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime = float(given.scene.corners[-1])
    integration.numberOfSteps = 20_000
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 0.0
    settings.displayStatistics = False
    integration.verboseMode = 0
    if solver == "DOPRI5":
        explicit = integration.explicitIntegration
        explicit.dynamicSolverType = exu.DynamicSolverType.DOPRI5
        integration.numberOfSteps, integration.minimumStepSize = 1, 1e-14
        integration.relativeTolerance, integration.absoluteTolerance = RTOL, RTOL * float(given.size[0])
    kind = getattr(exu.DynamicSolverType, solver)
    system.SolveDynamic(settings, solverType=kind, showHints=False)
    rows = [np.array(system.GetSensorStoredData(sensor)) for sensor in sensors]
    return between(rows[0][:, 0], rows[0][:, 1:], rows[1][:, 1:], given.scene.times)
