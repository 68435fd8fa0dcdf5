"""Cost of exact derivatives against that of runs, and against JAX on the same linear problem.

    python tests/benchmarks/sensitivities.py           # about a minute; JAX, if it can be imported, one more

The cart of the yardstick under its noisy cycle, 7062 samples: all histories by 20 parameters, one figure by 20
parameters backwards in time, and static loads and modes; all histories also of the cart with clearance and preload.
Each time is the median of runs in turn with the plain run.
JAX: the same states by a scan of the same propagator in double precision on one core, and its forward derivative
(jacfwd through the matrix exponential); the script says so where JAX is missing.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from functools import partial
from typing import Any

import harness
import numpy as np
from reference import cart, cart_clear, noisy, preloaded

from guideload import Machine, Motion
from guideload._core import Solution
from guideload.sensitivity import VariedMachine

PATHS = [
    "body.mass",
    *(f"body.center_of_mass.{axis}" for axis in "xyz"),
    *(f"body.inertia.{axes}" for axes in ("xx", "yy", "zz")),
    "gravity.y",
    *(f"carriages[{name}].stiffness_{axis}" for name in ("1a", "1b", "2a", "2b") for axis in "yz"),
    *(f"carriages[{name}].damping_y" for name in ("1a", "1b", "2a", "2b")),
]
HISTORIES = ("carriage_loads", "link_loads", "displacement", "velocity", "acceleration", "reaction")


def in_turn(works: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Median time of each work [s]."""
    return {name: statistics.median(of) for name, of in harness.by_turns(works, repeats).items()}


def plain(machine: Machine, motion: Motion, method: str) -> Solution:
    """A run and all its histories."""
    acceleration = np.ascontiguousarray(motion.acceleration)
    solution = machine.scene.solve(motion.time, acceleration, method=method, rtol=1e-6)
    solution.group_loads(machine.links_of_carriages, machine.carriage_places, "total")
    solution.link_loads("total")
    for quantity in ("position", "velocity", "acceleration", "reaction"):
        getattr(solution, quantity)()
    return solution


def forward(varied: VariedMachine, motion: Motion) -> None:
    """A run, and the derivatives of all its histories."""
    run = varied.at().system.run(motion.time, np.ascontiguousarray(motion.acceleration))
    for quantity in ("group_loads", "link_loads", "position", "velocity", "acceleration", "reaction"):
        run.derivatives(quantity)


def main() -> None:
    machine, motion = cart(), noisy()
    varied = VariedMachine(machine, PATHS)
    assert len(varied.columns) == 20
    groups = machine.links_of_carriages, machine.carriage_places
    acceleration = np.ascontiguousarray(motion.acceleration)

    loads = machine.scene.solve(motion.time, acceleration, method="exact", rtol=1e-6).group_loads(
        *groups, "total"
    )
    weights = np.ascontiguousarray((2.0 * loads).reshape(motion.time.size, -1))
    peak = np.zeros_like(weights)
    peak[int(np.abs(loads[:, 0, 1]).argmax()), 1] = 1.0

    def backward(of: Any) -> Callable[[], object]:
        return lambda: varied.at().system.run(motion.time, acceleration).gradient("group_loads", of)

    works: dict[str, Callable[[], object]] = {
        "run": lambda: plain(machine, motion, "exact"),
        "20 parameters, all histories": lambda: forward(varied, motion),
        "20 parameters, a sum of squares, backwards": backward(weights),
        "20 parameters, a peak, backwards": backward(peak),
        "20 parameters, at rest": varied.at,
        "20 parameters, modes": lambda: varied.at().modes(),
    }
    found = in_turn(works, 15)
    for name, seconds in found.items():
        print(f"{name:45s} {1e3 * seconds:9.3f} ms   {seconds / found['run']:7.2f} runs")
    nonlinear(motion)
    against_jax(varied, motion)


def nonlinear(motion: Motion) -> None:
    """All histories by the 20 parameters across contact changes and under preload, against a run by `auto`."""
    level = {"gravity": (0.0, -9.3, -3.1)}  # holds the links along z to one side
    scenes = {
        "clearance 5 um": (Machine(**cart_clear().model_dump() | level), "exact"),
        "clearance 5 um, space": (
            Machine(**cart_clear().model_dump() | {"gravity": (0.0, -0.3, -0.1)}),
            "exact",
        ),
        "preload": (preloaded(), "rk45"),
    }
    for name, (machine, method) in scenes.items():
        works = {
            "run": partial(plain, machine, motion, method),
            "forward": partial(forward, VariedMachine(machine, PATHS), motion),
        }
        found = in_turn(works, 3)
        text = f"{name}, {plain(machine, motion, method).contact_changes} changes, 20 parameters"
        print(f"{text:45s} {1e3 * found['forward']:9.3f} ms   {found['forward'] / found['run']:7.2f} runs")


def against_jax(varied: VariedMachine, motion: Any) -> None:
    try:
        import jax
    except ImportError:
        print("JAX is not installed here: no comparison (python -m pip install jax)")
        return
    import jax.numpy as jnp
    from jax.scipy.linalg import expm

    jax.config.update("jax_enable_x64", True)
    one = varied.at()
    f = one.free
    square = np.ix_(f, f)
    m, c, k = (getattr(one, name)[square] for name in ("mass", "damping", "stiffness"))
    dm, dc, dk = (
        np.array([of[square] for of in getattr(one, name)]) for name in ("d_mass", "d_damping", "d_stiffness")
    )
    column, d_column = one.mass[f, 0], one.d_mass[:, f, 0]
    n, h = f.size, float(np.diff(motion.time).mean())
    u = jnp.array(motion.acceleration[:, 0])

    def states(p: Any) -> Any:
        """Position and velocity relative to rest, at all samples; p: changes of the 20 values."""
        mass, damping, stiffness = (a + jnp.tensordot(p, b, 1) for a, b in ((m, dm), (c, dc), (k, dk)))
        force = -(column + p @ d_column)
        rates = [-jnp.linalg.solve(mass, of) for of in (stiffness, damping)]
        a = jnp.block([[jnp.zeros((n, n)), jnp.eye(n)], rates])
        b = jnp.concatenate([jnp.zeros(n), jnp.linalg.solve(mass, force)])[:, None]
        whole = jnp.zeros((2 * n + 2, 2 * n + 2)).at[: 2 * n, : 2 * n].set(a * h)
        whole = whole.at[: 2 * n, 2 * n : 2 * n + 1].set(b * h).at[2 * n, 2 * n + 1].set(1.0)
        e = expm(whole)[: 2 * n]
        step, start, end = e[:, : 2 * n], e[:, 2 * n] - e[:, 2 * n + 1], e[:, 2 * n + 1]

        def next_state(x: Any, ends: Any) -> Any:
            x = step @ x + start * ends[0] + end * ends[1]
            return x, x

        return jax.lax.scan(next_state, jnp.zeros(2 * n), jnp.stack([u[:-1], u[1:]], axis=1))[1]

    zero = jnp.zeros(len(one.columns))
    plain, forward = jax.jit(states), jax.jit(jax.jacfwd(states))
    theirs = np.asarray(forward(zero).block_until_ready())
    rates = varied.run(motion, start="rest").history("velocity")[:, 1:, f].transpose(1, 2, 0)
    size = np.abs(rates).max(axis=(0, 1))
    error = (np.abs(theirs[:, n:] - rates).max(axis=(0, 1))[size > 0.0] / size[size > 0.0]).max()

    def ours() -> None:
        varied.at().system.run(motion.time, np.ascontiguousarray(motion.acceleration)).derivatives("velocity")

    found = in_turn(
        {
            "JAX": lambda: plain(zero).block_until_ready(),
            "JAX, 20 parameters": lambda: forward(zero).block_until_ready(),
            "guideload, 20 parameters": ours,
        },
        7,
    )
    for name, seconds in found.items():
        print(f"states by {name:35s} {1e3 * seconds:9.3f} ms")
    print(f"largest difference of the derivatives of the velocities: {error:.1e} of the largest one")


if __name__ == "__main__":
    main()
