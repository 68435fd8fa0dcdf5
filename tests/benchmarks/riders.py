"""Time of a run in which a rider moves all the time: guideload, its exact method without the motion, and pydiffsol.

The cart of the yardstick carries a slide of 120 kg that swings by 0.3 m along z at 0.5 Hz during the cycle of the cart.
Each program computes the loads of the 16 links at the 7062 stamps; errors are the largest difference from `implicit` at
1e-12, which the tests compare with DOP853, over the largest load. Times are medians of alternating runs.

    python tests/benchmarks/riders.py
"""

from __future__ import annotations

import importlib.util
import statistics
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from clock import on_cores, processor, timed
from peers.diffsol import listed
from reference import cart, cycle
from rider_reference import Array, Riding

from guideload import Motion, simulate
from guideload.machine.riders import Rider

ROUNDS = 9
SOLVERS = ("bdf", "esdirk34", "tr_bdf2")  # those that take a mass matrix
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
SLIDE = Rider(
    name="slide",
    mass=120.0,
    center_of_mass=(0.1, -0.3, 0.0),
    inertia=((4.0, 0.0, 0.0), (0.0, 5.0, 0.0), (0.0, 0.0, 3.0)),
    direction=(0.0, 0.0, 1.0),
)


def swinging(time: Array) -> Motion:
    rate, size = np.pi, 0.3
    place, speed = size * np.cos(rate * time), -size * rate * np.sin(rate * time)
    return Motion.along_x(time, -(rate**2) * place, velocity=speed, position=place)


def dense(matrix: Array) -> str:
    """All entries of a matrix: sums of matrices of different layouts are refused."""
    return ", ".join(f"({i}, {j}): {float(value)!r}" for (i, j), value in np.ndenumerate(matrix))


def diffsol(motion: Motion, travel: Motion) -> Callable[[str, float], Callable[[], Array]]:
    """pydiffsol on the same equations, linear in the travel and its square; states in units of their size."""
    import pydiffsol

    def matrices(s: float, v: float, a: float, drive: float) -> tuple[Array, Array, Array, Array]:
        return Riding(machine, [lambda _: (s, v, a)], lambda _: np.array([drive, 0.0, 0.0])).matrices(0.0)

    machine = cart().model_copy(update={"riders": (SLIDE,)})
    base = Riding(machine, [lambda _: (0.0, 0.0, 0.0)], lambda _: np.zeros(3))
    free, n = np.array(base.free), len(base.free)
    unit = np.concatenate([np.full(n, 1e-5), np.full(n, 1e-3)])

    def mass(s: float) -> Array:
        whole = np.eye(2 * n)
        whole[n:, n:] = matrices(s, 0.0, 0.0, 0.0)[0][np.ix_(free, free)]
        return whole * unit

    def rates(*at: float) -> Array:
        _, damping, stiffness, _ = matrices(*at)
        top = np.hstack([np.zeros((n, n)), np.eye(n)])
        return (
            np.vstack([top, -np.hstack([stiffness[np.ix_(free, free)], damping[np.ix_(free, free)]])]) * unit
        )

    def push(*at: float) -> Array:
        return np.concatenate([np.zeros(n), matrices(*at)[3][free]])

    half, square = (mass(1.0) - mass(-1.0)) / 2.0, (mass(1.0) + mass(-1.0)) / 2.0 - mass(0.0)
    rest, still = push(0, 0, 0, 0), rates(0, 0, 0, 0)
    # The rate per unit of speed and of acceleration at the travels 0 and 1, and the forces.
    by = {
        "V": rates(0, 1, 0, 0) - still,
        "W": rates(1, 1, 0, 0) - rates(0, 1, 0, 0),
        "P": rates(0, 0, 1, 0) - still,
        "Q": rates(1, 0, 1, 0) - rates(0, 0, 1, 0),
    }
    forces = {
        "f": rest,
        "g": push(1, 0, 0, 0) - rest,
        "h": push(0, 0, 1, 0) - rest,
        "b": push(0, 0, 0, 1) - rest,
        "c": push(1, 0, 0, 1) - push(1, 0, 0, 0) - push(0, 0, 0, 1) + rest,
    }
    drive, place = motion.acceleration[:, 0], travel.position
    assert place is not None and travel.velocity is not None
    start = base.start()
    start[:n] = np.linalg.solve(base.stiffness[np.ix_(free, free)], push(float(place[0, 0]), 0, 0, 0)[n:])
    histories = {"drive": drive, "s": place[:, 0], "v": travel.velocity[:, 0], "a": travel.acceleration[:, 0]}
    lines = [f"time_k {{ {listed(motion.time)} }}"]
    lines += [f"{name}given_k {{ {listed(values)} }}" for name, values in histories.items()]
    lines += [f"{name}m_ij {{ {dense(matrix)} }}" for name, matrix in {"A": still, **by}.items()]
    lines += [f"M{k}m_ij {{ {dense(matrix)} }}" for k, matrix in enumerate((mass(0.0), half, square))]
    lines += [f"{name}f_i {{ {listed(vector)} }}" for name, vector in forces.items()]
    lines += [f"u_i {{ {listed(start / unit)} }}", f"dudt_i {{ (0:{2 * n}): 0.0 }}"]
    lines += [f"{name} {{ interp1d(time_k, {name}given_k, t) }}" for name in histories]
    lines.append("mass_ij { M0m_ij + s * M1m_ij + s * s * M2m_ij }")
    lines += [f"{name}u_i {{ {name}m_ij * u_j }}" for name in ("A", *by)]
    lines += [
        "M_i { mass_ij * dudt_j }",
        "F_i { Au_i + v * Vu_i + s * v * Wu_i + a * Pu_i + s * a * Qu_i + ff_i + s * gf_i + a * hf_i "
        "+ drive * bf_i + s * drive * cf_i }",
    ]
    ode, nothing = pydiffsol.Ode("\n".join(lines), matrix_type=pydiffsol.nalgebra_dense), np.empty(0)

    def at(solver: str, rtol: float) -> Callable[[], Array]:
        def call() -> Array:
            ode.ode_solver = getattr(pydiffsol, solver)
            ode.rtol = ode.atol = rtol
            return base.link_loads(ode.solve_dense(nothing, motion.time).ys.T * unit)

        return call

    return at


def main() -> None:
    on_cores(1)
    motion = cycle()
    travel = swinging(motion.time)
    riders, machine = {"slide": travel}, cart().model_copy(update={"riders": (SLIDE,)})

    def ours(method: Any, rtol: float, moves: dict[str, Motion]) -> Callable[[], Array]:
        return lambda: simulate(machine, motion, method, riders=moves, rtol=rtol)._run.solution.link_loads(
            "total"
        )

    truth = ours("implicit", 1e-12, riders)()
    calls = {"guideload exact, the slide at rest": (ours("exact", 1e-6, {}), False)}
    for method in ("rk45", "implicit"):
        calls |= {
            f"guideload {method}, rtol {rtol:.0e}": (ours(method, rtol, riders), True)
            for rtol in (1e-6, 1e-8)
        }
    if importlib.util.find_spec("pydiffsol"):
        peer = diffsol(motion, travel)
        for solver in SOLVERS:
            calls |= {
                f"pydiffsol {solver}, rtol {rtol:.0e}": (peer(solver, rtol), True) for rtol in TOLERANCES
            }
    else:
        print("pydiffsol is not installed: pip install pydiffsol")
    errors: dict[str, float] = {}
    for name, (call, moves) in list(calls.items()):
        try:
            loads = call()
        except Exception as error:  # of a peer; the others go on
            print(f"{name}: {str(error)[:100]}")
            del calls[name]
            continue
        errors[name] = float(np.abs(loads - truth).max() / np.abs(truth).max()) if moves else float("nan")
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(ROUNDS):
        for name, (call, _) in calls.items():
            times[name].append(timed(call))
    base = statistics.median(next(iter(times.values())))
    print(f"{processor()}, one core, medians of {ROUNDS} alternating runs")
    for name, seconds in times.items():
        median = statistics.median(seconds)
        print(f"{name:<38} {1e3 * median:8.2f} ms {median / base:6.1f} x exact  error {errors[name]:.1e}")


if __name__ == "__main__":
    main()
