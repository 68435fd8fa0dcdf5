"""Units: exact factors, the spellings that people use, and refusals that say what was expected."""

import math
from fractions import Fraction

import numpy as np
import pytest

from guideload.base.errors import GuideloadError, ValueRefused
from guideload.base.units import DIMENSIONS, PREFIXES, UNITS, _parsed, factor, quantity


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        ("350 N/um", "N/m", 3.5e8),
        ("350 N/µm", "N/m", 3.5e8),  # micro sign
        ("350 N/μm", "N/m", 3.5e8),  # greek mu
        ("350 kN/mm", "N/m", 3.5e8),
        ("12 kN·s/m", "N s/m", 1.2e4),
        ("12 kN s/m", "N s/m", 1.2e4),
        ("12 kNs/m", "N s/m", 1.2e4),
        ("12 kN*s/m", "N s/m", 1.2e4),
        ("85mm", "m", 0.085),
        (" 85 mm ", "m", 0.085),
        ("127.3 mm", "m", 0.1273),
        (".5 in", "m", 0.0127),
        ("1.2e3 kg", "kg", 1200.0),
        ("2 t", "kg", 2000.0),
        ("1 lb", "kg", 0.45359237),
        ("3 kg m^2", "kg m^2", 3.0),
        ("3 kg·m²", "kg m^2", 3.0),
        ("3 kg m2", "kg m^2", 3.0),
        ("3 kg mm^2", "kg m^2", 3e-6),
        ("-9.80665 m/s^2", "m/s^2", -9.80665),
        ("-1 g_0", "m/s^2", -9.80665),
        ("5 m s^-2", "m/s^2", 5.0),
        ("180 deg", "rad", math.pi),
        ("12", "1", 12.0),
        (3, "kg", 3.0),
        (np.float32(0.5), "m", 0.5),
        (np.int64(7), "m", 7.0),
    ],
)
def test_spellings(value: object, unit: str, expected: float) -> None:
    assert quantity(value, unit) == expected  # exact: factors are fractions, rounded once


@pytest.mark.parametrize(
    ("unit", "target", "expected"),
    [
        ("rpm", "rad/s", 2 * math.pi / 60),
        ("1/min", "rad/s", 2 * math.pi / 60),
        ("min^-1", "rad/s", 2 * math.pi / 60),
        ("rev/min", "rad/s", 2 * math.pi / 60),
        ("rev/s", "rad/s", 2 * math.pi),
        ("deg/s", "rad/s", math.pi / 180),
        ("°/s", "rad/s", math.pi / 180),
        ("mm/s", "m/s", 1e-3),
        ("m/min", "m/s", 1 / 60),
        ("um", "m", 1e-6),
        ("ms", "s", 1e-3),
        ("h", "s", 3600.0),
        ("Hz", "1/s", 1.0),
    ],
)
def test_factor(unit: str, target: str, expected: float) -> None:
    assert factor(unit, target) == pytest.approx(expected, rel=2e-16, abs=0.0)  # one rounding on either side


@pytest.mark.parametrize("unit", DIMENSIONS)
def test_factors_form_a_group(unit: str) -> None:
    assert factor(unit, unit) == 1.0
    assert quantity(f"2.5 {unit}", unit) == 2.5


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        ("85 mm", "kg", ["a mass in kg", '"85 mm"', "is a length"]),
        ("3 N", "N/m", ["a stiffness in N/m", "is a force"]),
        ("3 m", "1", ["a plain number", "is a length"]),
        ("3 N m s", "kg", ["a mass in kg", "[length]"]),
        ("1250", "kg", ["a mass", 'as in "1250 kg"']),
        ("40,5 kg", "kg", ["decimal point", '"40.5 kg"']),
        ("120", "m", ['"120 mm" or "120 m"']),
        ("kg", "kg", ["a number"]),
        ("", "kg", ["a mass"]),
        ("nan kg", "kg", ["a mass"]),
        ("1e400 kg", "kg", ["too large"]),
        ("1e999999999 kg", "kg", ["a mass"]),
        ("3 KG", "kg", ["unknown", 'did you mean "kg"']),
        ("3 furlong", "m", ["unknown", "known, with the usual prefixes"]),
        ("3 N/(m", "N/m", ["no unit"]),
        ("3 counts", "rad", ["counts per turn"]),
        ("3 Hz", "rad/s", ["rev/s"]),
        ("3 1/s", "rad/s", ["rev/s"]),
        (True, "kg", ["a mass", "got true"]),
        (np.bool_(True), "kg", ["a mass"]),
        (None, "kg", ["a mass", "got None"]),
        ([1.0], "kg", ["a mass", "[1.0]"]),
        (1 + 2j, "kg", ["a mass"]),
        (math.nan, "kg", ["finite"]),
        (-math.inf, "kg", ["finite"]),
        (10**400, "kg", ["finite"]),
    ],
)
def test_refusals(value: object, unit: str, words: list[str]) -> None:
    with pytest.raises(ValueRefused) as caught:
        quantity(value, unit)
    assert isinstance(caught.value, GuideloadError)
    assert caught.value.value is value
    for text in words:
        assert text in str(caught.value)


def test_factor_refuses_other_dimensions() -> None:
    with pytest.raises(ValueRefused, match="a speed in m/s.*is an angular speed"):
        factor("rpm", "m/s")


def test_any_factor_of_a_product_may_have_a_prefix_a_power_or_a_plural() -> None:
    """A unit is the product of its factors from left to right, as it is read aloud."""
    for prefix, power in PREFIXES.items():
        for name, unit in ((name, unit) for name, unit in UNITS.items() if name != "°"):
            assert _parsed(f"{prefix}{name}^2 s/rad") == _parsed(f"s {prefix}{name} * {prefix}{name} / rad")
            if not prefix or prefix + name not in UNITS:  # "min" is a minute, "ft" a foot
                assert _parsed(prefix + name).ratio == unit.ratio * Fraction(10) ** power
            if len(name) > 1 and name != "g_0":
                assert _parsed(f"{name}s").powers == unit.powers
    assert _parsed("kg/m s") == _parsed("kg s/m") != _parsed("kg/m/s")
