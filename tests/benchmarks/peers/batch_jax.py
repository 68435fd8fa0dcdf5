"""JAX: one scene as a function, mapped over all and compiled for the processor, in double precision."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from peers.scatter import Peaks, Scatter

CHUNK = 64  # scenes in one call: their matrices stay in the cache


@cache
def _compiled() -> Callable[..., Any]:
    import jax

    jax.config.update("jax_enable_x64", True)
    jnp = jax.numpy

    def discrete(mass: Any, r: Any, stiff: Any, damp: Any, known: dict[str, Any]) -> tuple[Any, ...]:
        """p, g0, g1, c, rest of one scene, from its draws."""
        free, n = known["free"], len(known["free"])
        s = jnp.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
        eye, zeros = jnp.eye(n), jnp.zeros((n, n))
        inertia = jnp.block([[mass * jnp.eye(3), -mass * s], [mass * s, known["inertia"] - mass * s @ s]])
        inverse = jnp.linalg.inv(inertia[free][:, free])
        stiffness, damping = (
            jnp.tensordot(*pair, 1) for pair in ((stiff, known["stiff"]), (damp, known["damp"]))
        )
        sag = jnp.linalg.solve(stiffness, inertia[free, :3] @ known["gravity"])
        a = jnp.block([[zeros, eye], [-inverse @ stiffness, -inverse @ damping]])
        b = jnp.concatenate([jnp.zeros(n), -inverse @ inertia[free, 0]])
        elastic = jnp.repeat(stiff, 2)[:, None] * known["elastic"]
        c = jnp.hstack([elastic, jnp.repeat(damp, 2)[:, None] * known["damped"]])
        h = known["step"]
        m = jnp.zeros((2 * n + 2, 2 * n + 2)).at[: 2 * n, : 2 * n].set(a * h).at[: 2 * n, 2 * n].set(b * h)
        e = jax.scipy.linalg.expm(m.at[2 * n, 2 * n + 1].set(1.0))[: 2 * n]
        return e[:, : 2 * n], e[:, 2 * n] - e[:, 2 * n + 1], e[:, 2 * n + 1], c, elastic @ sag

    def run(mass: Any, center: Any, stiff: Any, damp: Any, known: dict[str, Any]) -> Any:
        p, g0, g1, c, rest = jax.vmap(discrete, in_axes=(0, 0, 0, 0, None), out_axes=-1)(
            mass, center, stiff, damp, known
        )

        def step(carry: tuple[Any, ...], u: tuple[Any, Any]) -> tuple[tuple[Any, ...], None]:
            x, low, high = carry
            new, load = g0 * u[0] + g1 * u[1], rest
            # Column by column: XLA makes of it one loop over the scenes, and is quicker so than with a dot product.
            for j in range(len(p)):
                new += p[:, j] * x[j]
            for j in range(len(p)):
                load += c[:, j] * new[j]
            return (new, jnp.minimum(low, load), jnp.maximum(high, load)), None

        u = known["u"]
        (_, low, high), _ = jax.lax.scan(step, (0.0 * g0, rest, rest), (u[:-1], u[1:]))
        return jnp.maximum(-low, high).T

    compiled: Callable[..., Any] = jax.jit(run)
    return compiled


def scan(of: Scatter) -> Peaks:
    """The exact propagator as a scan over the samples, a chunk of scenes at a time."""
    run, geometry = _compiled(), of.geometry
    known = {
        "free": np.array(geometry.free),
        "inertia": geometry.inertia,
        "gravity": geometry.gravity,
        "stiff": geometry.stiff,
        "damp": geometry.damp,
        "elastic": geometry.elastic,
        "damped": geometry.damped,
        "step": of.nominal.step,
        "u": of.nominal.u,
    }
    parts = []
    for start in range(0, len(of), CHUNK):
        # A short last chunk is filled up with its last scene: another shape would be compiled anew.
        take = np.minimum(np.arange(start, start + CHUNK), len(of) - 1)
        parts.append(run(of.mass[take], of.center[take], of.stiffness[take], of.damping[take], known))
    return np.concatenate([np.asarray(part) for part in parts])[: len(of)]
