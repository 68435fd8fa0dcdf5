"""Conversion of units to SI: a value is an SI number or a string such as "350 N/um".

Only the units below are known. Angle is a separate dimension, so that rpm and Hz, or rad/s and 1/s, cannot be confused.
Factors are exact fractions, and a value is rounded once: "85 mm" is the double 0.085.
"""

from __future__ import annotations

import math
import re
from difflib import get_close_matches
from fractions import Fraction
from functools import lru_cache
from numbers import Real
from typing import NamedTuple

from guideload.base.errors import ValueRefused, shortened


class Unit(NamedTuple):
    """A unit: its ratio to SI, and its powers of length, mass, time and angle."""

    ratio: Fraction
    powers: tuple[int, int, int, int]


BASES = ("[length]", "[mass]", "[time]", "[angle]")
PREFIXES = {"": 0, "n": -9, "u": -6, "µ": -6, "μ": -6, "m": -3, "c": -2, "d": -1, "k": 3, "M": 6, "G": 9}
PREFIXES |= {"nano": -9, "micro": -6, "milli": -3, "centi": -2, "deci": -1, "kilo": 3, "mega": 6, "giga": 9}
# Symbol, other names, ratio to SI (of rpm that of rev over 60), powers of length, mass, time and angle.
TABLE = """
m     meter,metre             1                        1  0  0  0
s     second                  1                        0  0  1  0
g     gram                    0.001                    0  1  0  0
rad   radian                  1                        0  0  0  1
deg   degree,°                0.0174532925199432957692 0  0  0  1
rev   revolution,turn         6.28318530717958647693   0  0  0  1
min   minute                  60                       0  0  1  0
h     hour                    3600                     0  0  1  0
rpm   revolutions_per_minute  628318530717958647693/6000000000000000000000 0 0 -1 1
Hz    hertz                   1                        0  0 -1  0
N     newton                  1                        1  1 -2  0
Nm    newton_meter            1                        2  1 -2  0
Ns    newton_second           1                        1  1 -1  0
t     tonne                   1000                     0  1  0  0
lb    pound                   0.45359237               0  1  0  0
lbf   pound_force             4.4482216152605          1  1 -2  0
in    inch                    0.0254                   1  0  0  0
ft    foot                    0.3048                   1  0  0  0
g_0   standard_gravity        9.80665                  1  0 -2  0
"""
UNITS = {
    name: Unit(Fraction(ratio), (int(a), int(b), int(c), int(d)))
    for symbol, names, ratio, a, b, c, d in map(str.split, TABLE.strip().splitlines())
    for name in (symbol, *names.split(","))
}
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

USUAL = ("mm", "um", "ms", "kN", "kg")  # units with a prefix that are meant most often
LONGEST = 100  # characters of a value or unit
# Exponents of at most three digits: no double needs more, and fractions of a million digits take minutes.
NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)(?![\d.,])\s*(.*?)\s*", re.DOTALL)
_NAME = r"([A-Za-zµμ°](?:[A-Za-zµμ]|_(?!0))*(?:_0)?)(?:\^(-?\d{1,2}))?"
UNIT = re.compile(rf"(?:1\s*/\s*)?{_NAME}(?:\s*[*/ ]\s*{_NAME})*|1")
FACTOR = re.compile(rf"([*/]?)\s*{_NAME}\s*")
# Symbols of all units, and the units with prefix that drawings and catalogues use.
SYMBOLS = [row.split()[0] for row in TABLE.strip().splitlines()]
SYMBOLS += ["kg", "mm", "um", "cm", "kN", "ms", "mrad", "kHz"]
# Beside the SI unit, in hints for a number without unit: the unit that is more likely meant.
ON_DRAWINGS = {"m": "mm", "N": "kN", "N/m": "N/um", "N s/m": "kN s/m", "m/N": "um/kN", "s": "ms"}
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
            comma = re.fullmatch(r"\s*([+-]?\d+),(\d+\s*[^\d\s.,][^.,]*)", value)
            example = f"{comma[1]}.{comma[2].strip()}" if comma else f"1.5 {unit}".removesuffix(" 1")
            its_unit = "" if unit == "1" else ", then its unit"
            raise ValueRefused(expected, value, f'write a number with a decimal point{its_unit}: "{example}"')
        number, written = match.groups()
        ratio = re.fullmatch(r":\s*(\d+\.?\d*)", written) if unit == "1" else None
        if ratio and float(number) * float(ratio[1]):
            least, most = sorted((float(number) / float(ratio[1]), float(ratio[1]) / float(number)))
            raise ValueRefused(expected, value, f"write the ratio as one number, {most:g} or {least:g}")
        if not written and unit != "1":
            either = " or ".join(f'"{number} {one}"' for one in (ON_DRAWINGS.get(unit), unit) if one)
            raise ValueRefused(expected, value, f"add the unit, as in {either}")
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
    source, goal = _parsed(unit), _parsed(target)
    if source.powers != goal.powers:
        if goal != _parsed("rad/s") or _plain(unit).replace(" ", "") not in ("1/min", "min^-1"):
            hint = f'"{unit}" is {_dimension(source)}'
            if goal == _parsed("rad/s") and source.powers == UNITS["Hz"].powers:
                hint = f'"{unit}" may mean turns or radians per second: write rev/s or rad/s'
            raise ValueRefused(_name(target), unit, hint)
        source = UNITS["rpm"]
    return source.ratio / goal.ratio


@lru_cache(maxsize=256)
def _parsed(unit: str) -> Unit:
    """The unit of a product of units and powers. Raises ValueRefused."""
    plain = _plain(unit)
    if len(plain) > LONGEST or not UNIT.fullmatch(plain):
        raise ValueRefused(
            "a unit", unit, f'"{shortened(unit)}" is no unit; write it like N/um, N s/m or kg m^2'
        )
    ratio, powers = Fraction(1), [0, 0, 0, 0]
    for sign, name, written in FACTOR.findall(plain.removeprefix("1")):
        exponent = int(written or 1) * (-1 if sign == "/" else 1)
        factor = _named(unit, name)
        ratio *= factor.ratio**exponent
        powers = [p + exponent * q for p, q in zip(powers, factor.powers, strict=True)]
    return Unit(ratio, (powers[0], powers[1], powers[2], powers[3]))


def _named(unit: str, name: str) -> Unit:
    """A unit by its name, which may have a prefix or be a plural. Raises ValueRefused."""
    stems = [name, name[:-1]] if name.endswith("s") and len(name) > 2 else [name]
    for stem in stems:
        for prefix in sorted(PREFIXES, key=len):
            found = UNITS.get(stem.removeprefix(prefix)) if stem.startswith(prefix) else None
            if found is not None:
                return found._replace(ratio=found.ratio * Fraction(10) ** PREFIXES[prefix])
    near = get_close_matches(name, [*USUAL, *SYMBOLS], n=4, cutoff=0.5)
    near = near or [symbol for symbol in SYMBOLS if symbol.lower() == name.lower()]
    near = [f'"{symbol}"' for symbol in dict.fromkeys(near)]
    hint = f"known, with the usual prefixes: {', '.join(SYMBOLS)}"
    if near:
        hint = f"did you mean {' or '.join(near)}?"
    if name.rstrip("s") in ("count", "inc", "increment", "tick", "pulse"):
        hint = "counts are no unit by themselves: state the counts per turn or per metre"
    raise ValueRefused("a unit", unit, f'unit "{name}" is unknown; {hint}')


def _plain(unit: str) -> str:
    """`unit` with plain signs: "kg·m²" becomes "kg*m^2", "kg m2" becomes "kg m^2"."""
    return re.sub(r"([A-Za-z])(-?\d)", r"\1^\2", unit.strip().translate(SIGNS))


def _name(unit: str) -> str:
    if unit == "1":
        return DIMENSIONS[unit]
    return f"{DIMENSIONS.get(unit) or _dimension(_parsed(unit))} in {unit}"


def _dimension(unit: Unit) -> str:
    for name, word in DIMENSIONS.items():
        if _parsed(name).powers == unit.powers:
            return word
    return " ".join(f"{base}^{power}" for base, power in zip(BASES, unit.powers, strict=True) if power)
