"""Method exponential: where it runs, what it is elsewhere; its order and error: rust/core/tests/laws/exponential.rs."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import reference as ref
from machines import one_mass
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from guideload import ArgumentError, Machine, Motion, peak_loads, simulate

Array = NDArray[np.float64]

MIXED: dict[str, Any] = {"preload_y": 1200.0, "rolling": "ball", "clearance_z": 3e-6}
BALLS = ref.preloaded()


@cache
def shaken() -> Motion:
    """Rest, jerk and constant acceleration, with noise."""
    return ref.piece(ref.noisy(), 560, 860)


def test_a_mass_on_two_rows_of_balls_moves_as_by_scipy() -> None:
    """m q'' + b q' + K [(d + q)^1.5 - (d - q)^1.5] = F; the rows open at d, which the motion passes."""
    mass, damping, stiffness, preload = 10.0, 400.0, 6e7, 600.0
    law = {"stiffness": stiffness, "preload": preload, "rolling": "ball", "damping": damping}
    opening = 3.0 * preload / stiffness  # both rows: k = 3 K sqrt(d), preload = K d^1.5
    coefficient = preload / opening**1.5
    time = np.arange(301) * 1e-3
    force = 2500.0 * np.interp(time, [0.0, 0.01, 0.1, 0.12, 0.3], [0.0, 1.0, 1.0, -0.8, 0.0])
    wrench = np.zeros((301, 6))
    wrench[:, 1] = force

    def rate(at: float, state: Array) -> list[float]:
        q, speed = state
        rows = max(opening + q, 0.0) ** 1.5 - max(opening - q, 0.0) ** 1.5
        return [speed, (np.interp(at, time, force) - damping * speed - coefficient * rows) / mass]

    want = solve_ivp(
        rate, (0.0, 0.3), (0.0, 0.0), "DOP853", t_eval=time, rtol=1e-11, atol=1e-16, max_step=1e-4
    ).y[0]
    motion = Motion(time, np.zeros((301, 3)), wrench=wrench)
    data = simulate(one_mass(mass, 0.0, **law), motion, rtol=1e-9, times=time).data
    got = data["displacement"].values[:, 1]
    assert data.attrs["method"] == "exponential"
    assert np.abs(want).max() > 1.2 * opening and data.attrs["contact_changes"] >= 2
    assert np.abs(got - want).max() <= 1e-8 * np.abs(want).max()


# ---- the choice, and what it is elsewhere


def test_auto_takes_it_for_preload_alone_and_says_why() -> None:
    auto = simulate(BALLS, shaken())
    assert auto.method == "exponential" and "preloaded" in auto.reason
    asked = simulate(BALLS, shaken(), "exponential")
    np.testing.assert_array_equal(asked.data["link_load"], auto.data["link_load"])
    assert asked.reason == "asked for"
    assert simulate(ref.cart(**MIXED), shaken()).method in ("rk45", "implicit")


def test_auto_takes_implicit_where_a_vibration_is_far_too_fast_for_the_samples() -> None:
    stiff = ref.cart(
        stiffness_y=1.2e11, stiffness_z=1.2e11, preload_y=1200.0, preload_z=1200.0, rolling="ball"
    )
    smooth = ref.piece(ref.cycle(), 560, 860)
    found = simulate(stiff, smooth)
    assert found.method == "implicit" and "the fastest vibration limits" in found.reason
    exponential = simulate(stiff, smooth, "exponential")
    assert found.data.attrs["steps"] < exponential.data.attrs["steps"]


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear])
def test_without_preload_it_is_exact_to_the_last_bit(machine: Any) -> None:
    found, exact = (simulate(machine(), shaken(), method) for method in ("exponential", "exact"))
    np.testing.assert_array_equal(found.data["link_load"], exact.data["link_load"])
    assert found.method == "exact" and "exponential was asked for" in found.reason
    np.testing.assert_array_equal(
        peak_loads(machine(), shaken(), "exponential").largest, peak_loads(machine(), shaken()).largest
    )


@pytest.mark.parametrize(
    ("machine", "options", "text"),
    [
        (ref.cart(), {"step": 1e-3}, 'step: method "exponential".*exact there.*leave step out'),
        (ref.cart(**MIXED), {}, 'clearance, one side or a curve beside preloaded.*expected "rk45"'),
        (BALLS, {"rtol": 1e-15}, "rtol: expected 1e-13 to 0.1"),
        (BALLS, {"step": -1e-3}, "step: expected > 0 s"),
    ],
)
def test_what_it_cannot_do_is_refused_with_the_way_out(
    machine: Machine, options: dict[str, Any], text: str
) -> None:
    for solve in (simulate, peak_loads):
        with pytest.raises(ArgumentError, match=text):
            solve(machine, shaken(), "exponential", **options)
