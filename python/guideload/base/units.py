"""Conversion of units to SI: a value is an SI number or a string such as "350 N/um".

Only the units below are known: reading pint's own list takes 0.17 s, this one 0.01 s. Importing pint takes 0.1 s, so
it is imported only for units that are not in `COMMON`. Angle is a separate dimension, so that rpm and Hz, or rad/s and
1/s, cannot be confused. Factors are exact fractions, and a value is rounded once: "85 mm" is the double 0.085.
"""

from __future__ import annotations

import math
import re
from difflib import get_close_matches
from fractions import Fraction
from functools import lru_cache
from numbers import Real
from typing import TYPE_CHECKING, Any

from guideload.base.errors import ValueRefused, shortened

if TYPE_CHECKING:
    import pint

DEFINITIONS = """
nano- = 1e-9 = n-
micro- = 1e-6 = u- = µ- = μ-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
deci- = 1e-1 = d-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
meter = [length] = m = metre
second = [time] = s
gram = [mass] = g
radian = [angle] = rad
degree = 0.0174532925199432957692 * radian = deg = °
revolution = 6.28318530717958647693 * radian = rev = turn
minute = 60 * second = min
hour = 3600 * second = h
revolutions_per_minute = revolution / minute = rpm
hertz = 1 / second = Hz
newton = kilogram * meter / second ** 2 = N
newton_meter = newton * meter = Nm
newton_second = newton * second = Ns
tonne = 1000 * kilogram = t
pound = 0.45359237 * kilogram = lb
pound_force = 4.4482216152605 * newton = lbf
inch = 0.0254 * meter = in
foot = 0.3048 * meter = ft
standard_gravity = 9.80665 * meter / second ** 2 = g_0
"""
# Names of dimensions in errors; other dimensions appear as powers of the base dimensions.
DIMENSIONS = {
    "1": "a plain number",
    "kg": "a mass",
    "m": "a length",
    "s": "a time",
    "rad": "an angle",
    "N": "a force",
    "N m": "a moment",
    "N/m": "a stiffness",
    "m/N": "a compliance",
    "N s/m": "a damping",
    "N m/rad": "a rotational stiffness",
    "kg m^2": "a moment of inertia",
    "m/s": "a speed",
    "m/s^2": "an acceleration",
    "m/s^3": "a jerk",
    "rad/s": "an angular speed",
    "1/s": "a frequency",
}
# Common units: (SI unit, ratio to it). A test compares them with pint.
COMMON = {unit: (unit, Fraction(1)) for unit in DIMENSIONS} | {
    "mm": ("m", Fraction(1, 1000)),
    "um": ("m", Fraction(1, 10**6)),
    "km": ("m", Fraction(1000)),
    "kN": ("N", Fraction(1000)),
    "kN m": ("N m", Fraction(1000)),
    "N/um": ("N/m", Fraction(10**6)),
    "N/mm": ("N/m", Fraction(1000)),
    "kN/mm": ("N/m", Fraction(10**6)),
    "kN s/m": ("N s/m", Fraction(1000)),
    "ms": ("s", Fraction(1, 1000)),
    "mm/s": ("m/s", Fraction(1, 1000)),
    "rpm": ("rad/s", Fraction("6.28318530717958647693") / 60),
}

LONGEST = 100  # characters of a value or unit: pint recurses into each factor of a unit
# Exponents of at most three digits: no double needs more, and fractions of a million digits take minutes.
NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)(?![\d.,])\s*(.*?)\s*", re.DOTALL)
_NAME = r"[A-Za-zµμ°][A-Za-zµμ_]*(?:_0)?(?:\^-?\d{1,2})?"
UNIT = re.compile(rf"(?:1\s*/\s*)?{_NAME}(?:\s*[*/ ]\s*{_NAME})*|1")
SIGNS = str.maketrans({"·": "*", "⋅": "*", "²": "^2", "³": "^3"})


def quantity(value: object, unit: str) -> float:
    """`value` in the SI unit `unit`: a number is already in this unit, a string is a number with any unit.

    Raises ValueRefused for another dimension, an unknown or missing unit, and a value that is not finite.
    """
    expected = _name(unit)
    if isinstance(value, str):
        if len(value) > LONGEST:
            raise ValueRefused(expected, value, f"a number and its unit in at most {LONGEST} characters")
        match = NUMBER.fullmatch(value)
        if match is None:
            raise ValueRefused(
                expected, value, f'write a number with a decimal point, then its unit: "1.5 {unit}"'
            )
        number, written = match.groups()
        if not written and unit != "1":
            raise ValueRefused(expected, value, f'add the unit, as in "{number} {unit}"')
        try:
            return float(Fraction(number) * _ratio(written or "1", unit))
        except ValueRefused as error:
            raise ValueRefused(expected, value, error.hint) from None
        except OverflowError:
            raise ValueRefused(expected, value, "it is too large for a double") from None
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ValueRefused(expected, value, f'a number, or a string such as "1.5 {unit}"')
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise ValueRefused(expected, value, "it must be finite")
    return result


def factor(unit: str, target: str) -> float:
    """Factor that converts values in `unit` to `target`: factor("rpm", "rad/s") = 2 pi/60.

    "1/min" means turns per minute where an angular speed is expected, as on the name plates of motors (DIN 1301);
    "1/s" and "Hz" are refused there, because they may mean turns or radians per second.
    Raises ValueRefused for an unknown unit or another dimension.
    """
    return float(_ratio(unit, target))


@lru_cache(maxsize=256)
def _ratio(unit: str, target: str) -> Fraction:
    if unit in COMMON and target in COMMON:
        (si, ratio), (target_si, target_ratio) = COMMON[unit], COMMON[target]
        if si == target_si:
            return ratio / target_ratio
        if (si, target_si) != ("1/s", "rad/s"):
            raise ValueRefused(_name(target), unit, f'"{unit}" is {DIMENSIONS[si]}')
    source, goal = _parsed(unit), _parsed(target)
    if source.dimensionality != goal.dimensionality:
        if goal == _parsed("rad/s") and _plain(unit).replace(" ", "") in ("1/min", "min^-1"):
            source = _parsed("rpm")
        else:
            raise ValueRefused(_name(target), unit, _mismatch(unit, source, goal))
    return Fraction(_registry().convert(Fraction(1), source, goal))


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    return pint.UnitRegistry(DEFINITIONS.strip().splitlines(), non_int_type=Fraction)


def _parsed(unit: str) -> pint.Unit:
    plain = _plain(unit)
    if len(plain) > LONGEST or not UNIT.fullmatch(plain):
        raise ValueRefused(
            "a unit", unit, f'"{shortened(unit)}" is no unit; write it like N/um, N s/m or kg m^2'
        )
    from pint import UndefinedUnitError

    try:
        return _registry().parse_units("" if plain == "1" else plain)
    except (ValueError, KeyError):  # "nan" and "m^-0", of which pint makes numbers
        raise ValueRefused(
            "a unit", unit, f'"{unit}" is no unit; write it like N/um, N s/m or kg m^2'
        ) from None
    except UndefinedUnitError as error:
        unknown = str(error.unit_names[0] if isinstance(error.unit_names, tuple) else error.unit_names)
        near = get_close_matches(unknown, _symbols(), n=1, cutoff=0.5) or [
            name for name in _symbols() if name.lower() == unknown.lower()
        ]
        hint = (
            f'did you mean "{near[0]}"?'
            if near
            else f"known, with the usual prefixes: {', '.join(_symbols())}"
        )
        if unknown.rstrip("s") in ("count", "inc", "increment", "tick", "pulse"):
            hint = "counts are no unit by themselves: state the counts per turn or per metre"
        raise ValueRefused("a unit", unit, f'unit "{unknown}" is unknown; {hint}') from None


def _plain(unit: str) -> str:
    """`unit` in the notation of pint: "kg·m²" becomes "kg*m^2", "kg m2" becomes "kg m^2"."""
    return re.sub(r"([A-Za-z])(-?\d)", r"\1^\2", unit.strip().translate(SIGNS))


def _mismatch(unit: str, source: pint.Unit, goal: pint.Unit) -> str:
    if goal == _parsed("rad/s") and source.dimensionality == _parsed("1/s").dimensionality:
        return f'"{unit}" may mean turns or radians per second: write rev/s or rad/s'
    return f'"{unit}" is {_dimension(source)}'


def _name(unit: str) -> str:
    if unit == "1":
        return DIMENSIONS[unit]
    return f"{DIMENSIONS.get(unit) or _dimension(_parsed(unit))} in {unit}"


def _dimension(unit: pint.Unit) -> str:
    for name, word in DIMENSIONS.items():
        if _parsed(name).dimensionality == unit.dimensionality:
            return word
    return " ".join(f"{name}^{power}" for name, power in unit.dimensionality.items())


@lru_cache(maxsize=1)
def _symbols() -> list[str]:
    """Symbols of all units, and the units with prefix that drawings and catalogues use."""
    rows = [row.split(" = ") for row in DEFINITIONS.strip().splitlines() if "- = " not in row]
    return [row[2] for row in rows] + ["kg", "mm", "um", "cm", "kN", "ms", "mrad", "kHz"]
