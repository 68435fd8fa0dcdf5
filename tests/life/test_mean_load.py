"""The mean load over distance: exact for loads linear in time, against mpmath and closed forms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from guideload.base.arrays import Array
from guideload.life.equivalent_load import EquivalentLoad, PreloadEffect
from guideload.life.mean_load import Travel, integrals, mean_load

WEIGHTS = np.zeros((2, 5, 2))
WEIGHTS[0, 0], WEIGHTS[1, 1], WEIGHTS[0, 2], WEIGHTS[0, 4], WEIGHTS[1, 3] = (1.2, 1.0), 1.1, 10.0, 12.0, 7.0
ALONG_Y = np.zeros((2, 5, 2))
ALONG_Y[0, 0] = 1.0
OPENING = {"power": 2.8, "linear": 3.0, "ball": 2.0**1.5, "roller": 2.0 ** (10.0 / 9.0)}  # over the preload
SCAN = 16  # samples of an interval among which the reference looks for changes of sign


def record(count: int) -> tuple[Travel, Array]:
    """Stamps, a speed that changes its sign within intervals, and loads that all do."""
    rng = np.random.default_rng(0)
    time, acceleration = np.cumsum(rng.uniform(0.5, 1.5, count)), rng.normal(size=count)
    gain = np.diff(time) * (acceleration[1:] + acceleration[:-1]) / 2.0
    velocity = np.append(0.0, np.cumsum(gain))
    loads = 1e3 * rng.normal(size=(count, 6))
    return Travel(time, velocity - velocity.mean(), acceleration), loads


def crossings(function: Callable[[Any], Any]) -> list[Any]:
    """Places in (0, 1) where a function changes its sign, by bisection."""
    found = []
    for k in range(SCAN):
        low, high = mp.mpf(k) / SCAN, mp.mpf(k + 1) / SCAN
        sign = function(low) > 0
        if sign == (function(high) > 0):
            continue
        for _ in range(85):
            middle = (low + high) / 2
            low, high = (middle, high) if (function(middle) > 0) == sign else (low, middle)
        found.append(low)
    return found


def loaded_row(load: Any, preload: Any, rolling: PreloadEffect) -> Any:
    """What the loaded row carries under a load, by Newton's method for its deflection."""
    n = mp.mpf(3) / 2 if rolling == "ball" else mp.mpf(10) / 9
    deflection, change = mp.mpf(load) / preload / 2**n, mp.mpf(1)
    while abs(change) > mp.mpf(10) ** -(mp.mp.dps - 3):
        excess = (1 + deflection) ** n - (1 - deflection) ** n - load / preload
        change = excess / n / ((1 + deflection) ** (n - 1) + (1 - deflection) ** (n - 1))
        deflection = min(max(deflection - change, mp.mpf(0)), mp.mpf(1))
    return preload * (1 + deflection) ** n


def reference(travel: Travel, loads: Array, rule: EquivalentLoad, exponent: Any) -> Any:
    """The mean load by numerical integration in 25 digits, cut at every kink."""
    power = path = mp.mpf(0)
    opening = mp.mpf(rule.preload) * OPENING[rule.effect]
    for i, width in enumerate(np.diff(travel.time)):
        (v0, v1), (a0, a1) = ([mp.mpf(x) for x in history[i : i + 2]] for history in travel[1:])
        step = mp.mpf(width)

        def speed(s: Any, v: Any = v0, dv: Any = v1 - v0, bend: Any = step * (a1 - a0) / 2) -> Any:
            return v + dv * s + bend * (s * s - s)

        def component(k: int, s: Any, at: int = i) -> Any:
            return mp.mpf(loads[at, k]) * (1 - s) + mp.mpf(loads[at + 1, k]) * s

        def groups(s: Any, component: Any = component) -> list[Any]:
            values = [component(k, s) for k in range(1, 6)]
            pairs = ([abs(v) * mp.mpf(w[k, int(v < 0)]) for k, v in enumerate(values)] for w in rule.weights)
            return [mp.fsum(pair) for pair in pairs]

        def before(s: Any, groups: Any = groups) -> Any:
            return max(groups(s)) + mp.mpf(rule.minor) * min(groups(s))

        def load(s: Any, before: Any = before) -> Any:
            value, preload = before(s), mp.mpf(rule.preload)
            if value >= opening:
                return value
            if rule.effect == "power":
                return preload * (value / opening + 1) ** mp.mpf(1.5)
            return (
                preload + 2 * value / 3
                if rule.effect == "linear"
                else loaded_row(value, preload, rule.effect)
            )

        kinks = [*crossings(speed), *crossings(lambda s, g=groups: g(s)[0] - g(s)[1])]
        kinks += [s for k in range(1, 6) for s in crossings(lambda s, c=component, k=k: c(k, s))]
        kinks += crossings(lambda s, b=before: b(s) - opening)
        ends = [mp.mpf(0), *sorted(kinks), mp.mpf(1)]
        power += step * mp.quad(lambda s, p=load, v=speed: p(s) ** exponent * abs(v(s)), ends)
        path += step * mp.quad(lambda s, v=speed: abs(v(s)), ends)
    return (power / path) ** (1 / exponent)


@pytest.mark.parametrize(
    ("minor", "preload", "effect"),
    [
        (1, 0, "ball"),
        (0.6, 0, "ball"),
        (0.6, 7e3, "power"),
        (1, 7e3, "linear"),
        (0.6, 7e3, "ball"),
        (1, 7e3, "roller"),
    ],
)
@pytest.mark.parametrize(("above", "below"), [(3, 1), (10, 3), (157, 100)])
def test_the_mean_load_is_exact_for_loads_linear_in_time(
    above: int, below: int, minor: float, preload: float, effect: PreloadEffect
) -> None:
    travel, loads = record(4)
    rule = EquivalentLoad(WEIGHTS, minor, (), preload, effect)
    with mp.workdps(25):
        exact = float(reference(travel, loads, rule, mp.mpf(above) / below))
    found = mean_load(*integrals(travel, loads, rule, above / below), above / below)
    # Rounding; of preloaded rows, nodes near the opening. Asked for are 1e-9.
    assert found == pytest.approx(exact, rel=1e-11 if preload and effect in ("ball", "roller") else 1e-13)


def uniform(values: Array) -> tuple[Travel, Array]:
    """A load along y at constant speed."""
    time = np.linspace(0.0, 1.0, values.size)
    loads = np.zeros((values.size, 6))
    loads[:, 1] = values
    return Travel(time, np.ones_like(time), np.zeros_like(time)), loads


def mean_of(values: Array, exponent: float = 3.0) -> float:
    travel, loads = uniform(values)
    return mean_load(*integrals(travel, loads, EquivalentLoad(ALONG_Y, 1.0), exponent), exponent)


@pytest.mark.parametrize("exponent", [1.57, 3.0, 10.0 / 3.0])
def test_a_load_that_rises_from_zero(exponent: float) -> None:
    """The catalogues' (Pmin + 2 Pmax)/3 is 6 % above the exact value for p = 3."""
    assert mean_of(np.array([0.0, 1.0]), exponent) == pytest.approx(
        (exponent + 1) ** (-1 / exponent), rel=1e-14
    )
    assert 2.0 / 3.0 / mean_of(np.array([0.0, 1.0])) == pytest.approx(1.06, abs=0.005)


def test_curved_histories_converge_with_the_square_of_the_step() -> None:
    """Catalogues print 0.65 Pmax for a raised cosine, 4 % low, and 0.75 Pmax for a rectified sine, which is right."""
    for function, exact, printed in (
        (lambda t: 0.5 - 0.5 * np.cos(2 * np.pi * t), (5.0 / 16.0) ** (1 / 3), 0.96),
        (lambda t: np.sin(np.pi * t), (4.0 / (3.0 * np.pi)) ** (1 / 3), 1.0),
    ):
        errors = [abs(mean_of(function(np.linspace(0, 1, n + 1))) - exact) for n in (64, 128, 256)]
        assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([2.0, 2.0], abs=0.05)
        shortcut = 0.65 if printed < 1 else 0.75
        assert shortcut / exact == pytest.approx(printed, abs=0.005)


def test_dwell_uses_no_life_and_units_scale() -> None:
    rule = EquivalentLoad(ALONG_Y, 1.0)
    moving, loads = uniform(np.array([1.0, 2.0]))
    dwelling = Travel(np.array([0.0, 1.0, 1.0, 5.0]), np.array([1.0, 1.0, 0.0, 0.0]), np.zeros(4))
    with_dwell = integrals(dwelling, np.vstack([loads, loads[1:], 9.0 * loads[1:]]), rule, 3.0)
    assert mean_load(*with_dwell, 3.0) == mean_load(*integrals(moving, loads, rule, 3.0), 3.0)
    assert with_dwell[1].tolist() == [1.0, 0.0, 0.0]
    resting = moving._replace(velocity=np.zeros(2))
    assert np.isnan(mean_load(*integrals(resting, loads, rule, 3.0), 3.0))
    travel, loads = record(40)
    rule = EquivalentLoad(WEIGHTS, 0.6)
    mean = mean_load(*integrals(travel, loads, rule, 3.0), 3.0)
    assert mean_load(*integrals(travel, 7.0 * loads, rule, 3.0), 3.0) == pytest.approx(7.0 * mean, rel=1e-13)
    faster = Travel(travel.time, 3.0 * travel.velocity, 3.0 * travel.acceleration)
    assert mean_load(*integrals(faster, loads, rule, 3.0), 3.0) == pytest.approx(mean, rel=1e-13)
