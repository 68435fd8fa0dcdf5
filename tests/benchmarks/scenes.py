"""The scenes of the chart, with what their loads really are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from peers.compiled import loads_of, rate, rk4
from peers.laws import Law, Preloaded, Sided
from peers.problem import Array, Problem, problem
from peers.truth import between_events
from reference import cart, cart_clear, cart_stiff, cycle, noisy, preloaded, pulse, reference

from guideload import Machine, Motion

DIGITS = 40  # of the linear references; the squarings cost ten of them
CLEARANCE = Sided(positive=6e7, negative=6e7, clearance=5e-6)
PRELOAD = Preloaded(stiffness=6e7, preload=600.0)


@dataclass(frozen=True, eq=False)
class Truth:
    """The loads to compare with."""

    loads: Array  # (time, carriage, 2)
    how: str  # they were computed, and how far another way agrees

    def errors(self, loads: Array) -> tuple[float, float]:
        """Largest difference over that of the load, and over that of its dynamic part; infinite if not finite."""
        if not np.isfinite(loads).all():
            return np.inf, np.inf
        worst = np.abs(loads - self.loads).max()
        dynamic = self.loads - self.loads[0]  # all motions begin at rest
        return float(worst / np.abs(self.loads).max()), float(worst / np.abs(dynamic).max())


@dataclass(frozen=True, eq=False)
class Case:
    """One scene of the chart."""

    title: str
    machine: Callable[[], Machine]  # as guideload gets it
    linear: Callable[[], Machine]  # the same with linear links: geometry, masses and damping for the peers
    law: Law | None
    motion: Motion

    @cached_property
    def problem(self) -> Problem:
        return problem(self.linear(), self.motion, self.law)

    @cached_property
    def truth(self) -> Truth:
        """Independent of guideload, and of most peers."""
        if self.law is None:
            loads = reference(self.linear(), self.motion, DIGITS).carriage[:, :, 1:3]
            return Truth(loads, f"matrix exponential in {DIGITS} digits")
        if isinstance(self.law, Sided):
            loads, changes = between_events(self.problem)
            gap = difference(rk4(self.problem)(1 / 256), loads)
            how = (
                f"matrix exponentials between {changes} contact changes; RK4 of 1/256 ms differs by {gap:.0e}"
            )
            return Truth(loads, how)
        coarse, fine = map(rk4(self.problem), (1 / 64, 1 / 128))
        loads = fine + (fine - coarse) / 15.0
        gap = difference(tight_dop853(self.problem), loads)
        return Truth(loads, f"RK4 of 1/64 and 1/128 ms, extrapolated; DOP853 of 1/8 ms differs by {gap:.0e}")


def difference(loads: Array, other: Array) -> float:
    return float(np.abs(loads - other).max() / np.abs(other).max())


def tight_dop853(given: Problem) -> Array:
    """solve_ivp DOP853 at rtol 1e-12 with steps of 1/8 ms at most, whose dense output is as good as the steps."""
    solution = scipy.integrate.solve_ivp(
        rate(given),
        (given.time[0], given.time[-1]),
        np.zeros(given.b.size),
        method="DOP853",
        t_eval=given.time,
        rtol=1e-12,
        atol=1e-12 * given.size,
        max_step=given.step / 8.0,
    )
    return loads_of(given)(solution.y.T)


def cases() -> list[Case]:
    """The scenes of the chart."""
    clean, noise = cycle(), noisy()
    return [
        Case("cart, linear", cart, cart, None, clean),
        Case("cart, linear, noisy trace", cart, cart, None, noise),
        Case("5 \N{MICRO SIGN}m clearance", cart_clear, cart, CLEARANCE, clean),
        Case("5 \N{MICRO SIGN}m clearance, noisy trace", cart_clear, cart, CLEARANCE, noise),
        Case("overdamped", cart_stiff, cart_stiff, None, clean),
        Case("preloaded", preloaded, cart, PRELOAD, clean),
    ]


def at_rest_then_pulse() -> Case:
    return Case("a 20 ms pulse after 5 s of rest", cart, cart, None, pulse())
