"""What holds for every elastic law, whatever its parameters: force, tangent and energy belong together."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from guideload._core import Law

stiffness = st.floats(1e2, 1e10)
travel = st.floats(1e-8, 1e-2)


@st.composite
def curves(draw):
    count = draw(st.integers(2, 16))
    steps = draw(st.lists(st.tuples(travel, st.floats(0.0, 1e5)), min_size=count, max_size=count))
    points = np.cumsum(steps, axis=0) - np.array(steps).sum(axis=0) * draw(st.floats(0.2, 0.8))
    points[-1, 1] += 1.0  # a curve that never rises is none
    return Law.curve(points)


laws = st.one_of(
    st.builds(Law.linear, stiffness),
    st.builds(Law.sided, stiffness, stiffness, st.just(0.0) | travel),
    st.builds(Law.sided, stiffness, st.just(0.0), travel),
    st.builds(Law.preloaded, stiffness, st.floats(1.0, 1e5), st.sampled_from([3 / 2, 10 / 9])),
    curves(),
)


def deflections(law: Law) -> np.ndarray:
    """Deflections on all segments, between the edges and beyond them, ascending, none at an edge."""
    edges = law.edges
    reach = max(np.abs(edges).max(initial=0.0), 1e-6)
    marks = np.unique(np.concatenate(([-3 * reach], edges, [3 * reach])))
    between = [np.linspace(low, high, 9)[1:-1] for low, high in zip(marks[:-1], marks[1:], strict=True)]
    return np.concatenate(between)


@given(laws)
def test_the_force_is_the_derivative_of_the_energy(law):
    """By Gauss's rule on each interval between edges; a root at the opening of a row costs it digits."""
    d = deflections(law)
    ends = np.sort(np.concatenate((d, law.edges)))
    nodes, weights = np.polynomial.legendre.leggauss(40)
    half, middle = np.diff(ends)[:, None] / 2, (ends[1:] + ends[:-1])[:, None] / 2
    force = law.force(np.ascontiguousarray((middle + half * nodes).ravel())).reshape(-1, 40)
    work = (half * force * weights).sum(axis=1)
    energy = law.energy(ends)
    assert np.abs(np.diff(energy) - work).max() <= 1e-7 * np.abs(energy).max()
    assert law.energy(np.zeros(1))[0] == pytest.approx(0.0, abs=1e-15 * np.abs(energy).max())


@given(laws)
def test_the_tangent_is_the_derivative_of_the_force(law):
    d = deflections(law)
    marks = np.concatenate((law.edges, [-np.inf, np.inf]))
    step = 1e-4 * np.abs(d[:, None] - marks).min(axis=1).clip(max=np.abs(d).max())
    difference = (law.force(d + step) - law.force(d - step)) / ((d + step) - (d - step))
    rounding = 1e-14 * np.abs(law.force(d)).max() / step
    assert (np.abs(difference - law.tangent(d)) <= 1e-6 * law.stiffness + 10 * rounding).all()


@given(laws)
def test_the_force_never_falls_and_energy_is_convex(law):
    d = deflections(law)
    force, energy = law.force(d), law.energy(d)
    assert (np.diff(force) >= -1e-12 * np.abs(force).max()).all()
    assert (law.tangent(d) >= 0.0).all()
    slack = 1e-12 * np.abs(energy).max()
    assert (np.diff(energy) >= force[:-1] * np.diff(d) - slack).all()
    assert (np.diff(energy) <= force[1:] * np.diff(d) + slack).all()


@given(laws, st.floats(1e-3, 1e3))
def test_a_scaled_law_has_all_forces_scaled_and_the_same_edges(law, factor):
    d, scaled = deflections(law), law.scaled(factor)
    assert scaled.kind == law.kind
    assert scaled.edges == pytest.approx(law.edges, rel=1e-12)
    force = factor * law.force(d)
    assert np.abs(scaled.force(d) - force).max() <= 1e-12 * np.abs(force).max()
    assert scaled.stiffness == pytest.approx(factor * law.stiffness, rel=1e-12)


@given(stiffness, st.floats(1.0, 1e5), st.sampled_from([3 / 2, 10 / 9]))
def test_parameters_of_a_preloaded_law_come_back(k, preload, exponent):
    law = Law.preloaded(k, preload, exponent)
    opening = law.edges[1]
    assert law.tangent(np.zeros(1))[0] == pytest.approx(k, rel=1e-12)
    assert opening == pytest.approx(2 * exponent * preload / k, rel=1e-12)
    assert law.force(np.array([opening]))[0] == pytest.approx(2**exponent * preload, rel=1e-12)
    assert law.force(-deflections(law)) == pytest.approx(-law.force(deflections(law)), rel=1e-12)


@given(curves())
def test_a_curve_goes_through_its_edges_in_straight_lines(law):
    marks = law.edges
    if marks.size < 2:
        return
    middle = np.ascontiguousarray((marks[1:] + marks[:-1]) / 2)
    force = law.force(np.ascontiguousarray(marks))
    expected = (force[1:] + force[:-1]) / 2
    assert law.force(middle) == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(force).max())
