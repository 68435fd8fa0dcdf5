"""Estimated stiffness: Hertz's contacts solved one by one, printed values, and preload from clearance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from printed_stiffness import in_place_of_print, printed
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from guideload.base.errors import ConfigError
from guideload.catalogue.product import Product
from guideload.catalogue.stiffness import (
    CONTACT_EXPONENT,
    PER_LENGTH,
    estimated_stiffness,
    preload_of_interference,
    row_length_of_moment,
)

STEEL = 210e9 / (2 * (1 - 0.3**2))  # Pa, E* of two steel bodies
PRESSURE = 4200e6  # Pa, under C0 (ISO 14728-2)
GROOVE = 0.53  # radius of the groove over the diameter of the ball
PLAIN: dict[str, Any] = {"name": "p", "maker": "m", "edition": "e", "type": "ball", "static": "50 kN"}
CLASS = {"name": "A", "share_of_C0": 0.04}


def ball_in_groove(diameter: float) -> tuple[float, float]:
    """Load [N] at the pressure of C0, and c of the approach c Q^(2/3) [m] of one contact, by elliptic integrals."""
    curvature = (4 - 1 / GROOVE) / diameter
    difference = (1 / GROOVE) / (4 - 1 / GROOVE)

    def integrals(ratio: float) -> tuple[float, float]:
        m = 1 - ratio**-2
        return float(ellipk(m)), float(ellipe(m))

    def residual(ratio: float) -> float:
        first, second = integrals(ratio)
        return ((ratio**2 + 1) * second - 2 * first) / ((ratio**2 - 1) * second) - difference

    ratio = brentq(residual, 1.001, 100.0)
    first, second = integrals(ratio)
    long = (2 * ratio**2 * second / np.pi * 3 / (2 * curvature * STEEL)) ** (1 / 3)  # over Q^(1/3)
    load = (PRESSURE * 2 * np.pi * long * long / ratio / 3) ** 3
    return load, first / (np.pi * STEEL) * 1.5 / long


def carriage(diameter: float, length: float, preload_over_static: float) -> tuple[float, float]:
    """C0 and k at no load of two preloaded pairs of rows at 45 degrees, ball by ball."""
    load, c = ball_in_groove(diameter)
    balls = length / diameter
    static = 2 * balls * load * np.sqrt(0.5)

    def force(deflection: float) -> float:
        """Of the whole carriage; each ball has two contacts, and a pair of rows is pressed by the preload."""
        pressed = 2 * c * (load * preload_over_static) ** (2 / 3)
        approach = np.maximum(pressed + np.array([1, -1]) * deflection * np.sqrt(0.5), 0)
        each = (approach / (2 * c)) ** 1.5
        return float(2 * balls * np.sqrt(0.5) * (each[0] - each[1]))

    small = 1e-9
    return static, (force(small) - force(-small)) / (2 * small)


@pytest.mark.parametrize("diameter", [2e-3, 6e-3])
def test_the_law_is_that_of_the_balls_and_their_diameter_cancels(diameter: float) -> None:
    """Within 7 %: the constant is 24e9 in place of Hertz's 25.4e9 for this groove."""
    for length, share in ((0.04, 0.02), (0.1, 0.08)):
        static, stiffness = carriage(diameter, length, share)
        found = estimated_stiffness("ball", static, length, (share * static, share * static))
        assert found.stiffness == pytest.approx(stiffness, rel=0.07)
        assert found.stiffness / stiffness == pytest.approx(PER_LENGTH["ball"] / 25.4e9, rel=5e-3)


def test_lines_of_contact_are_stiffer_than_the_estimate_of_rollers() -> None:
    """Palmgren's 3.84e-5 Q^0.9/l^0.8 (N, mm) alone, rollers as long as thick: three times the estimate."""
    per_area = np.pi * 4000.0**2 / (2 * 115.4e3)  # N/mm2 of Q/(l D) at 4000 MPa
    thick, length, share = 4.0, 80.0, 0.04
    load = share * per_area * thick**2
    approach = 2 * 3.84e-5 * load**0.9 / thick**0.8
    contacts = 2 * 2 * (length / thick) * 0.5 * (10 / 9) * load / approach * 1e3  # N/m
    static = 2 * (length / thick) * per_area * thick**2 * np.sqrt(0.5)
    found = estimated_stiffness("roller", static, 0.08, (share * static, share * static))
    assert contacts / found.stiffness == pytest.approx(50e9 / PER_LENGTH["roller"], rel=0.02)


def test_every_printed_value_but_those_that_contradict_each_other_is_within_30_percent() -> None:
    """Of Z0, which begins at no preload, the German edition prints 1.8 to 2 times what the English one prints.

    Of HG20C no number is within 30 % of both.
    """
    inside = []
    for name, preload_class, edition, stiffness in printed():
        found = in_place_of_print(name, preload_class)
        ratio = found.stiffness / stiffness
        assert abs(ratio - 1) <= 0.3 or (edition, preload_class) == ("German", "Z0")
        inside.append(1 / found.factor <= ratio <= found.factor)
    assert len(inside) == 20 + 9 and np.mean(inside) >= 0.9


@pytest.mark.parametrize("kind", ["ball", "roller"])
def test_preload_from_clearance_is_the_preload_of_the_law(kind: str) -> None:
    """F0 of an interference presses a pair of rows by its half: d0 = 2 n F0/k."""
    force = preload_of_interference(kind, 50e3, 0.06, 12e-6)
    stiffness = estimated_stiffness(kind, 50e3, 0.06, (force, force)).stiffness
    assert 2 * CONTACT_EXPONENT[kind] * force / stiffness == pytest.approx(6e-6, rel=1e-12)
    assert preload_of_interference(kind, 50e3, 0.06, -1e-6) == 0.0
    clearance = {"name": "A", "radial_clearance": ["-12 um", "2 um"]}
    product = Product(**PLAIN | {"type": kind, "body_length": 0.06, "preload_classes": [clearance]})
    assert product.preload_range("A") == (0.0, force)


def test_the_row_that_a_moment_needs() -> None:
    """Balls along a row that tilts: the most loaded one carries as much as under C0."""
    places = (np.arange(2000) + 0.5) / 2000 - 0.5
    for kind, n in CONTACT_EXPONENT.items():
        moment = np.mean(np.abs(2 * places) ** n * np.abs(places)) * 50e3 * 0.06
        assert row_length_of_moment(kind, 50e3, float(moment)) == pytest.approx(0.06, rel=1e-6)


@pytest.mark.parametrize(
    ("changes", "source", "missing"),
    [
        ({}, "estimated, within 30 %", ()),
        ({"type": "roller"}, "estimated, within a factor of 2", ()),
        ({"preload_classes": [{**CLASS, "share_of_C0": [0, 0.02]}]}, "estimated, within a factor of 2", ()),
        ({"preload_classes": [{**CLASS, "stiffness": 5e8}]}, "by catalogue", ()),
        ({"preload_classes": []}, "", ("preload_classes",)),
        ({"preload_classes": [{"name": "A"}]}, "", ("share_of_C of A",)),
        ({"preload_classes": [{"name": "A", "share_of_C": 0.1}]}, "", ("dynamic",)),
        ({"body_length": None}, "", ("body_length",)),
        ({"static": None}, "", ("static",)),
    ],
    ids=str,
)
def test_source_of_the_stiffness_and_what_an_estimate_lacks(
    changes: dict[str, Any], source: str, missing: tuple[str, ...]
) -> None:
    product = Product(**PLAIN | {"body_length": 0.06, "preload_classes": [CLASS]} | changes)
    assert product.stiffness_source(None) == source and product.missing_for_estimate(None) == missing
    assert bool(product.law_keys(None)) == bool(source)


def test_one_printed_preload() -> None:
    for keys, words in (
        ({"share_of_C": [0.07, 0.05]}, "[least, largest]"),
        ({"share_of_C": 0.05, "share_of_C0": 0.02}, "one preload"),
    ):
        with pytest.raises(ConfigError) as caught:
            Product(**PLAIN, preload_classes=[{"name": "A", **keys}])
        assert words in str(caught.value)
