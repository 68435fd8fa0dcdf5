"""Measured responses to known forces: frequency response functions, and static deflections."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, ValueRefused
from guideload.base.number_text import joined
from guideload.base.units import factor
from guideload.identification.measured import Measured, Noise, NuisanceParameter, Residuals
from guideload.identification.model import ModelAt, SensorPlace, parse_place
from guideload.machine.machine import Machine
from guideload.study.varied_parameters import column_numbers, name_and_unit
from guideload.traces.format.sources import load_table

Complex = NDArray[np.complex128]
# Unit of a response, by the number of derivatives of the displacement by time.
UNITS = ("m/N", "m/s/N", "m/s^2/N")
UFF_RESPONSES = {8: 0, 11: 1, 12: 2}  # ordinate types of UFF58: displacement, velocity, acceleration
UFF_AXES = {1: "x", 2: "y", 3: "z"}
NEAR = 0.3  # relative distance of computed and measured curves within which the computed ones give the noise
SAME = 0.02  # relative change of the sizes that ends the rounds
FREQUENCY_RESPONSE = 4  # function type of UFF58


@dataclass(frozen=True, eq=False)
class ResponseCurve:
    """One measured response.

    force, place  where the force acts, and where and along what the response is measured
    derivatives   of the displacement by time: 0 displacement, 1 velocity, 2 acceleration
    frequency     (n,) Hz
    value         (n,) complex, per N in SI; convention exp(i 2 pi f t)
    """

    force: SensorPlace
    place: SensorPlace
    derivatives: int
    frequency: Array
    value: Complex

    @property
    def name(self) -> str:
        return f"{self.place.name} by a force at {self.force.name}"

    def computed(self, model: ModelAt) -> tuple[Complex, Complex]:
        """The response (n,) of the machine, and its derivatives (n, p) by the values."""
        q, by = model.response(self.frequency, self.force)
        turn = (2j * np.pi * self.frequency) ** self.derivatives
        along, by_along = (np.einsum("...k,k", motion, self.place.row) for motion in (q, by))
        return turn * along, turn[:, None] * by_along


@dataclass(frozen=True, eq=False)
class FrequencyResponses(Measured):
    """Measured frequency responses.

    level        standard deviation of real and imaginary part, relative to the size of the response
    floor        the same of noise that is everywhere, relative to the largest response of a curve
    known        whether the level is known, or a start only
    calibration  standard deviation of a factor on all values, from the calibration of hammer and sensors; 0: none
    sizes        of the responses, to which the noise is relative, for each curve; without: those measured
    """

    name: str
    curves: tuple[ResponseCurve, ...]
    level: float
    floor: float
    known: bool
    calibration: float = 0.0
    sizes: tuple[Array, ...] = ()

    @property
    def nuisance(self) -> tuple[NuisanceParameter, ...]:
        if self.calibration == 0.0:
            return ()
        return (
            NuisanceParameter(f"calibration of {self.name}", "1", 1.0, self.calibration, self.calibration),
        )

    @property
    def noise(self) -> tuple[Noise, ...]:
        return (Noise(f"curves of {self.name}", self.known),)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        return tuple(
            f"{part} of {curve.name} at {hertz:.4g} Hz"
            for curve in self.curves
            for part in ("real part", "imaginary part")
            for hertz in curve.frequency.tolist()
        )

    @cached_property
    def _scales(self) -> list[Array]:
        """Standard deviation of each value of each curve."""
        sizes = self.sizes or [abs(curve.value) for curve in self.curves]
        return [np.hypot(self.level * size, self.floor * size.max()) for size in sizes]

    def residuals(self, model: ModelAt, nuisance: Array) -> Residuals:
        values, slopes, scales = [], [], []
        gain = float(nuisance[0]) if nuisance.size else 1.0
        for curve, scale in zip(self.curves, self._scales, strict=True):
            found, by = curve.computed(model)
            rest = (gain * found - curve.value) / scale
            by, by_gain = gain * by / scale[:, None], found / scale
            values += [rest.real, rest.imag]
            slopes += [by.real, by.imag]
            scales += [by_gain.real, by_gain.imag]
        by_nuisance = np.concatenate(scales)[:, None][:, : nuisance.size]
        return Residuals(np.concatenate(values), np.concatenate(slopes) * model.slopes, by_nuisance)

    def settled(self, model: ModelAt, nuisance: Array) -> FrequencyResponses:
        """With the noise of the computed responses, once they are near: of measured ones the small weigh too much."""
        gain = float(nuisance[0]) if nuisance.size else 1.0
        found = [gain * curve.computed(model)[0] for curve in self.curves]
        near = [_distance(one, curve.value) for one, curve in zip(found, self.curves, strict=True)]
        sizes = tuple(np.asarray(abs(one), dtype=np.float64) for one in found)
        same = self.sizes and max(_distance(*pair) for pair in zip(sizes, self.sizes, strict=True)) < SAME
        return self if max(near) > NEAR or same else replace(self, sizes=sizes)


def _distance(one: Array | Complex, other: Array | Complex) -> float:
    """Size of the difference of two responses over that of the second."""
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))


# ---- files


def is_universal(file: str | Path) -> bool:
    """Whether the name of a file is that of a universal file."""
    return Path(file).suffix.lower() in (".uff", ".unv", ".uf")


def read_curves(
    file: Path, machine: Machine, force: str | None, nodes: dict[str, str], low: float, high: float
) -> tuple[ResponseCurve, ...]:
    """The responses in a file, from `low` to `high` [Hz]. Raises ValueRefused, TraceError."""
    read = list(_of_uff(file, machine, nodes) if is_universal(file) else _of_table(file, machine, force))
    curves = []
    for curve in read:
        inside = (curve.frequency >= low) & (curve.frequency <= high) & (curve.frequency > 0.0)
        if inside.any():
            curves.append(replace(curve, frequency=curve.frequency[inside], value=curve.value[inside]))
    if not curves:
        raise ValueRefused("frequency responses in the wanted range", file.name, "it has none there")
    return tuple(curves)


def _of_table(file: Path, machine: Machine, force: str | None) -> Iterator[ResponseCurve]:
    """Curves of a table with columns "frequency [Hz]", "tool y re [m/N]" and "tool y im [m/N]"."""
    if force is None:
        raise ValueRefused("the place of the force", None, 'add force = "tool y"')
    hit, table = parse_place(force, machine), load_table(file)
    names = {name_and_unit(header)[0]: header for header in table.names}
    if "frequency" not in names:
        raise ValueRefused('a column "frequency [Hz]"', table.names[:4], f"{table.source} lacks it")
    frequency = column_numbers(table, names["frequency"], "Hz")[0]
    places = [name[:-3] for name in names if name.endswith(" re") and f"{name[:-3]} im" in names]
    if not places:
        words = 'columns such as "tool y re [m/N]" and "tool y im [m/N]"'
        raise ValueRefused(words, table.names[:4], "as `guideload response --csv` writes them")
    for place in places:
        header = names[f"{place} re"]
        derivatives = _derivatives(name_and_unit(header)[1], header)
        re, im = (
            column_numbers(table, names[f"{place} {part}"], UNITS[derivatives])[0] for part in ("re", "im")
        )
        yield ResponseCurve(hit, parse_place(place, machine), derivatives, frequency, re + 1j * im)


def _derivatives(unit: str, header: str) -> int:
    """The kind of a response by its unit: m/N 0, m/s/N 1, m/s^2/N or 1/kg 2."""
    for derivatives, known in enumerate(UNITS):
        try:
            factor(unit or UNITS[0], known)
        except ValueRefused:
            continue
        return derivatives
    raise ValueRefused(f"a response in {joined(UNITS)}", header)


def _of_uff(file: Path, machine: Machine, nodes: dict[str, str]) -> Iterator[ResponseCurve]:
    """Curves of a universal file; nodes: names of points by the number of the node, where they differ."""
    try:
        import pyuff
    except ImportError:
        raise ArgumentError(
            f"{file}: universal files are read by the package pyuff: pip install 'guideload[uff]', or export a CSV file"
        ) from None
    found = pyuff.UFF(str(file)).read_sets()
    for one in found if isinstance(found, list) else [found]:
        if one.get("type") != 58 or one.get("func_type") != FREQUENCY_RESPONSE:
            continue
        kind = int(one.get("ordinate_spec_data_type", 0))
        if kind not in UFF_RESPONSES:
            raise ValueRefused("responses in displacement, velocity or acceleration", f"ordinate type {kind}")
        hit, place = (_uff_place(one, which, machine, nodes) for which in ("ref", "rsp"))
        value = np.asarray(one["data"], dtype=np.complex128)
        yield ResponseCurve(hit, place, UFF_RESPONSES[kind], np.asarray(one["x"], dtype=np.float64), value)


def _uff_place(one: dict[str, Any], which: str, machine: Machine, nodes: dict[str, str]) -> SensorPlace:
    node, direction = str(int(one[f"{which}_node"])), int(one[f"{which}_dir"])
    if abs(direction) not in UFF_AXES:
        raise ValueRefused("directions 1 to 3, x to z", direction, f"of node {node}")
    sign = "-" if direction < 0 else ""
    return parse_place(f"{nodes.get(node, node)} {sign}{UFF_AXES[abs(direction)]}", machine)


# ---- static deflections


@dataclass(frozen=True, eq=False)
class Deflection:
    """A displacement [m] along a place, under a force [N] along another one."""

    force_at: SensorPlace
    force: float
    at: SensorPlace
    moved: float


@dataclass(frozen=True, eq=False)
class Deflections(Measured):
    """Static deflections of a machine with linear links, from its place at rest.

    level  standard deviation [m]
    known  whether it is known, or a start only
    """

    name: str
    values: tuple[Deflection, ...]
    level: float
    known: bool

    @property
    def noise(self) -> tuple[Noise, ...]:
        return (Noise(f"displacements of {self.name}", self.known),)

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"displacement {one.at.name} by a force at {one.force_at.name}" for one in self.values)

    def computed(self, model: ModelAt) -> tuple[Array, Array]:
        """The displacements (n,) [m] of the machine, and their derivatives (n, p) by the values."""
        free = model.rest.free
        forces = np.array([one.force * one.force_at.row[free] for one in self.values]).T
        rows = np.array([one.at.row[free] for one in self.values])
        stiffness = model.rest.stiffness[np.ix_(free, free)]
        change = model.rest.d_stiffness[:, free][:, :, free]
        q, back = np.linalg.solve(stiffness, forces), np.linalg.solve(stiffness, rows.T)
        return np.einsum("nk,kn->n", rows, q), -np.einsum("kn,pkl,ln->np", back, change, q)

    def residuals(self, model: ModelAt, nuisance: Array) -> Residuals:
        found, by = self.computed(model)
        rest = (found - np.array([one.moved for one in self.values])) / self.level
        return Residuals(rest, by * model.slopes / self.level, np.zeros((rest.size, 0)))
