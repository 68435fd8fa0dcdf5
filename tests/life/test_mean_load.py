"""The mean load over distance: exact for loads linear in time, against Gauss quadrature and closed forms."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from guideload.base.arrays import Array
from guideload.base.errors import ConfigError
from guideload.catalogue.rating import Rating
from guideload.life.equivalent_load import PLAIN_SUM, EquivalentLoad, PreloadEffect
from guideload.life.mean_load import Travel, integrals, mean_load

WEIGHTS = np.zeros((2, 5, 2))
WEIGHTS[0, 0], WEIGHTS[1, 1], WEIGHTS[0, 2], WEIGHTS[0, 4], WEIGHTS[1, 3] = (1.2, 1.0), 1.1, 10.0, 12.0, 7.0
ALONG_Y = np.zeros((2, 5, 2))
ALONG_Y[0, 0] = 1.0
OPENING = {"power": 2.8, "linear": 3.0, "ball": 2.0**1.5, "roller": 2.0 ** (10.0 / 9.0)}  # over the preload
SCAN = 1024  # parts of an interval in which the reference looks for changes of sign
NODES, WEIGHTS_OF_NODES = (np.polynomial.legendre.leggauss(40) + np.array([[1.0], [0.0]])) / 2.0


def record(count: int) -> tuple[Travel, Array]:
    """Stamps, a speed that changes its sign within intervals, and loads that all do."""
    rng = np.random.default_rng(0)
    time, acceleration = np.cumsum(rng.uniform(0.5, 1.5, count)), rng.normal(size=count)
    gain = np.diff(time) * (acceleration[1:] + acceleration[:-1]) / 2.0
    velocity = np.append(0.0, np.cumsum(gain))
    loads = 1e3 * rng.normal(size=(count, 6))
    return Travel(time, velocity - velocity.mean(), acceleration), loads


def loaded_row(load: Array, preload: float, rolling: PreloadEffect) -> Array:
    """What the loaded row carries under a load, by bisection for its deflection."""
    n = 1.5 if rolling == "ball" else 10.0 / 9.0
    low, high = np.zeros_like(load), np.ones_like(load)
    for _ in range(60):
        middle = (low + high) / 2.0
        above = (1.0 + middle) ** n - (1.0 - middle) ** n > load / preload
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return preload * (1.0 + low) ** n


def kinks(function: Callable[[Array], Array]) -> Array:
    """Places in (0, 1) where a function that is a parabola between neighbouring scanned places changes its sign."""
    places = np.linspace(0.0, 1.0, SCAN + 1)
    sign = function(places) > 0.0
    low, high = places[:-1][sign[:-1] != sign[1:]], places[1:][sign[:-1] != sign[1:]]
    rises = function(high) > 0.0
    for _ in range(60):
        middle = (low + high) / 2.0
        beyond = (function(middle) > 0.0) == rises
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return low


def reference(travel: Travel, loads: Array, rule: EquivalentLoad, exponent: float) -> float:
    """The mean load by Gauss quadrature between the kinks of load and speed, where both are smooth."""
    power = path = 0.0
    opening = rule.preload * OPENING[rule.effect]
    for i, step in enumerate(np.diff(travel.time)):
        (v0, v1), (a0, a1) = travel.velocity[i : i + 2], travel.acceleration[i : i + 2]

        def speed(s: Array, v: float = v0, dv: float = v1 - v0, bend: float = step * (a1 - a0) / 2) -> Array:
            return np.asarray(v + dv * s + bend * (s * s - s))

        def components(s: Array, at: int = i) -> Array:
            return np.outer(1.0 - s, loads[at, 1:]) + np.outer(s, loads[at + 1, 1:])

        def groups(s: Array, components: Callable[[Array], Array] = components) -> Array:
            values = components(s)
            return np.where(values > 0.0, values, 0.0) @ rule.weights[..., 0].T + (
                np.where(values < 0.0, -values, 0.0) @ rule.weights[..., 1].T
            )

        def before(s: Array, groups: Callable[[Array], Array] = groups) -> Array:
            both = groups(s)
            return np.asarray(both.max(axis=1) + rule.minor * both.min(axis=1))

        def load(s: Array, before: Callable[[Array], Array] = before) -> Array:
            value = before(s)
            if rule.effect == "power":
                opened = rule.preload * (value / opening + 1.0) ** 1.5 if opening else value
            elif rule.effect == "linear":
                opened = rule.preload + 2.0 * value / 3.0
            else:
                opened = loaded_row(value, rule.preload, rule.effect) if opening else value
            return np.where(value >= opening, value, opened)

        ends = [np.array([0.0, 1.0]), kinks(speed), kinks(lambda s, g=groups: g(s)[:, 0] - g(s)[:, 1])]
        ends += [kinks(lambda s, c=components, k=k: c(s)[:, k]) for k in range(5)]
        ends.append(kinks(lambda s, b=before: b(s) - opening))
        for low, high in pairwise(np.unique(np.concatenate(ends))):
            s, weights = low + (high - low) * NODES, step * (high - low) * WEIGHTS_OF_NODES
            power += weights @ (load(s) ** exponent * abs(speed(s)))
            path += weights @ abs(speed(s))
    return float((power / path) ** (1.0 / exponent))


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
    exact = reference(travel, loads, rule, above / below)
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


@pytest.mark.parametrize(("exponent", "beyond"), [(1.0, 0.9), (20.0, 20.1)])
def test_each_exponent_that_a_product_may_have_has_a_mean_load(exponent: float, beyond: float) -> None:
    """Also those at the ends of the range."""
    Rating(value=2e3, base=1e5, exponent=exponent)
    loads = np.zeros((2, 6))
    loads[:, 1] = 1e3
    travel = Travel(np.array([0.0, 1.0]), np.ones(2), np.zeros(2))
    assert mean_load(*integrals(travel, loads, PLAIN_SUM, exponent), exponent) == pytest.approx(
        1e3, rel=1e-13
    )
    with pytest.raises(ConfigError, match="an exponent from 1 to 20"):
        Rating(value=2e3, base=1e5, exponent=beyond)
