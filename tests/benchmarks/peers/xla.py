"""diffrax: solvers in JAX, compiled for the processor, in double precision."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Literal

import numpy as np

from peers.laws import Law, force
from peers.problem import Array, At, Problem

STEPS = 200_000
Limit = Literal["none", "interval", "samples"]
ARRAYS = ("a", "b", "c_yz", "rest_yz", "time", "u", "rows", "at_rest", "by", "onto", "constant")


@cache
def _compiled(solver: str, limit: Limit, law: Law | None) -> Callable[..., Any]:
    """One run as a function of its tolerance and all its arrays, so that scenes with the same law share it."""
    import diffrax as package
    import jax

    jax.config.update("jax_enable_x64", True)
    jnp = jax.numpy
    pull = force(law, jnp) if law is not None else None

    def rate(t: Any, x: Any, arrays: dict[str, Any]) -> Any:
        given, time, u = arrays, arrays["time"], arrays["u"]
        at = (t - time[0]) / (time[-1] - time[0]) * (u.size - 1)
        k = jnp.clip(at.astype(jnp.int64), 0, u.size - 2)
        out = given["a"] @ x + given["b"] * (u[k] + (u[k + 1] - u[k]) * (at - k))
        if pull is None:
            return out
        return out + given["constant"] - given["by"] @ pull(given["at_rest"] + given["rows"] @ x)

    def run(rtol: Any, arrays: dict[str, Any]) -> Any:
        time = arrays["time"]
        h = (time[-1] - time[0]) / (time.size - 1)
        control: Any = package.PIDController(rtol=rtol, atol=rtol, dtmax=h if limit == "interval" else None)
        if limit == "samples":
            control = package.ClipStepSizeController(control, step_ts=time)
        solution = package.diffeqsolve(
            package.ODETerm(rate),
            getattr(package, solver)(),
            time[0],
            time[-1],
            h,
            jnp.zeros_like(arrays["b"]),
            args=arrays,
            saveat=package.SaveAt(ts=time),
            stepsize_controller=control,
            max_steps=STEPS,
            throw=False,
        )
        loads = arrays["rest_yz"] + solution.ys @ arrays["c_yz"].T
        if pull is not None:
            loads += pull(arrays["at_rest"] + solution.ys @ arrays["rows"].T) @ arrays["onto"].T
        return loads, solution.result == package.RESULTS.successful

    compiled: Callable[..., Any] = jax.jit(run)
    return compiled


def diffrax(given: Problem, *, solver: str, limit: Limit) -> At:
    """A solver of diffrax, compiled once for all tolerances.

    limit: "samples" ends a step on each sample (ClipStepSizeController), as its documentation advises where
    the input has kinks; "interval" limits steps to the sample interval (dtmax); "none" leaves all to the
    tolerance.
    """
    given = given.scaled
    compiled = _compiled(solver, limit, given.law)
    arrays = {name: np.asarray(getattr(given, name)) for name in ARRAYS}

    def at(rtol: float) -> Array:
        loads, success = compiled(rtol, arrays)
        if not success:
            raise RuntimeError(f"diffrax {solver}: no success within {STEPS} steps")
        return np.asarray(loads).reshape(given.time.size, -1, 2)

    return at
