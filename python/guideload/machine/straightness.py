"""Rails that are not straight: profiles along a rail, given by points or by a spectrum of waves."""

from __future__ import annotations

import csv
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any, Protocol

import numpy as np
from pydantic import AfterValidator, Field, StrictInt, field_validator

from guideload.base.arrays import Array
from guideload.base.config import ConfigModel, in_range, listed, optional
from guideload.base.errors import ValueRefused, refused_at
from guideload.base.ranges import LENGTH, POSITION, POWER
from guideload.base.units import quantity
from guideload.machine.unchecked import find_tables, find_texts

COLUMNS = ("x", "dy", "dz")
WAVES = 100  # of a random profile: one in each of as many bands of the wave number, of equal ratios; it does not repeat
POINTS_PER_WAVE = 4  # of a table, in the shortest wave that it is taken to show
BLOCK = 4096  # places evaluated at a time, which takes some megabytes

Length = Annotated[float, in_range(POSITION)]
Amplitude = Annotated[float, in_range(POSITION, least=0.0)]
PositiveLength = Annotated[float, in_range(LENGTH, above=0.0)]


class Profile(Protocol):
    """Displacement of a rail along y and z, over the places x of the fixed frame."""

    @property
    def reach(self) -> tuple[float, float]:
        """First and last place at which it is known [m]."""

    @property
    def shortest(self) -> float:
        """Its shortest wavelength [m]."""

    def at(self, x: Array) -> tuple[Array, Array]:
        """Displacements (n, 2) [m] and slopes (n, 2) [1] along y and z at places (n,) [m]."""


# ---- points


def _checked(points: tuple[Any, ...]) -> tuple[Any, ...]:
    if len(points) < 2:
        raise ValueRefused("at least two points [x, dy, dz]", points)
    x = np.array(points)[:, 0]
    back = np.flatnonzero(np.diff(x) <= 0.0)
    if back.size:
        i = int(back[0])
        hint = f"[{i}] and [{i + 1}] are at {x[i]:g} and {x[i + 1]:g} m"
        raise ValueRefused("points in ascending order of x, each once", points, hint)
    return points


ProfilePoint = Annotated[tuple[Length, Length, Length], listed(*COLUMNS)]
Straightness = Annotated[tuple[ProfilePoint, ...], AfterValidator(_checked)]


class Spline:
    """The profile through points (m, 3) of x, dy, dz [m]: a natural cubic spline, without kinks in its slope."""

    def __init__(self, points: Array) -> None:
        from scipy.interpolate import CubicSpline  # machines with straight rails do not need it

        self.reach = float(points[0, 0]), float(points[-1, 0])
        self.shortest = float(POINTS_PER_WAVE * np.diff(points[:, 0]).min())
        self._spline = CubicSpline(points[:, 0], points[:, 1:], bc_type="natural")

    def at(self, x: Array) -> tuple[Array, Array]:
        return self._spline(x), self._spline(x, 1)


@lru_cache(maxsize=64)
def spline_through(points: tuple[tuple[float, float, float], ...]) -> Profile:
    """The profile through the points of a rail."""
    return Spline(np.array(points))


def with_straightness(values: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The values of a machine file with the points of the files in place of their names, `straightness_file` of rails.

    Raises ConfigError, with the key path of the machine file, for a file that does not exist or has other columns.
    """
    rails = list(find_tables(values, "rails"))
    for i, name in find_texts(values, "rails", "straightness_file"):
        try:
            rails[i] = {**rails[i], "straightness": _parse_points(folder / name, rails[i])}
            del rails[i]["straightness_file"]
        except ValueRefused as refused:
            path = ("rails", i, "straightness_file")
            raise refused_at(path, refused.expected, name, refused.hint) from None
    return {**values, "rails": rails} if rails else values


def _parse_points(file: Path, rail: dict[str, Any]) -> list[tuple[float, ...]]:
    """The points of a CSV file with the columns x, dy and dz, each with its unit as in "dy [um]"."""
    if "straightness" in rail:
        raise ValueRefused("no straightness_file beside straightness", str(file), "keep one of them")
    try:
        rows = [row for row in csv.reader(file.read_text(encoding="utf-8-sig").splitlines()) if any(row)]
    except (OSError, UnicodeDecodeError) as error:
        hint = f"{file}: {error}; the name is relative to the machine file"
        raise ValueRefused("a CSV file with x, dy and dz", str(file), hint) from None
    heads = [head.replace("]", "").split("[") for head in rows[0]] if rows else []
    units = {name.strip(): unit[0].strip() if unit else "m" for name, *unit in heads}
    if sorted(units) != sorted(COLUMNS) or len(heads) != len(COLUMNS):
        hint = f"the first row of {file} is {', '.join(rows[0]) if rows else 'missing'}"
        raise ValueRefused('the columns x, dy and dz, as in "x [mm],dy [um],dz [um]"', str(file), hint)
    columns = [(list(units).index(name), units[name]) for name in COLUMNS]
    points = []
    for number, row in enumerate(rows[1:], 2):
        try:
            points.append(tuple(quantity(f"{row[i]} {unit}", "m") for i, unit in columns))
        except (ValueRefused, IndexError) as error:
            raise ValueRefused(
                "three numbers in each row", str(file), f"row {number} of {file}: {error}"
            ) from None
    return points


# ---- spectrum


class Waviness(ConfigModel):
    """A random profile: waves with random phases, whose power density falls as 1/k^exponent with the wave number k."""

    rms: Annotated[tuple[Amplitude, Amplitude], listed("y", "z")] = Field(
        description='root mean squares of the displacement along y and z, e.g. ["10 um", "5 um"]'
    )
    wavelengths: Annotated[tuple[PositiveLength, PositiveLength], listed("shortest", "longest")] = Field(
        description='the shortest and the longest wavelength, e.g. ["50 mm", "2 m"]'
    )
    exponent: Annotated[float, in_range(POWER, least=0.0)] = optional(
        "of the fall of the power density with the wave number", 2.0
    )
    seed: Annotated[StrictInt, Field(ge=0, lt=2**63)] = Field(
        description="of the random phases: the same seed gives the same profile"
    )

    @field_validator("wavelengths")
    @classmethod
    def _ascending(cls, wavelengths: tuple[float, float]) -> tuple[float, float]:
        if not wavelengths[0] < wavelengths[1]:
            raise ValueRefused("[shortest, longest], the first below the second", list(wavelengths))
        return wavelengths

    @property
    def reach(self) -> tuple[float, float]:
        """It is known everywhere."""
        return -np.inf, np.inf

    @property
    def shortest(self) -> float:
        """Its shortest wavelength [m]."""
        return self.wavelengths[0]

    @cached_property
    def waves(self) -> tuple[Array, Array, Array]:
        """Wave numbers (w,) [1/m], and amplitudes (w, 2) [m] of the cosines and the sines along y and z."""
        rng = np.random.default_rng(self.seed)
        low, high = (2.0 * np.pi / length for length in reversed(self.wavelengths))
        k = low * (high / low) ** ((np.arange(WAVES) + rng.random(WAVES)) / WAVES)
        power = k ** (1.0 - self.exponent)  # density times the width of the band, which grows with k
        size = np.sqrt(2.0 * power / power.sum())[:, None] * np.array(self.rms)
        phase = 2.0 * np.pi * rng.random((WAVES, 2))
        return k, size * np.cos(phase), size * np.sin(phase)

    def at(self, x: Array) -> tuple[Array, Array]:
        """Displacements (n, 2) [m] and slopes (n, 2) [1] along y and z at places (n,) [m]."""
        k, cosines, sines = self.waves
        displacement, slope = np.empty((x.size, 2)), np.empty((x.size, 2))
        for start in range(0, x.size, BLOCK):
            part = slice(start, start + BLOCK)
            angle = np.outer(x[part], k)
            cos, sin = np.cos(angle), np.sin(angle)
            displacement[part] = cos @ cosines + sin @ sines
            slope[part] = cos @ (k[:, None] * sines) - sin @ (k[:, None] * cosines)
        return displacement, slope
