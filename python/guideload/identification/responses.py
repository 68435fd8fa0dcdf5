"""Measured responses to known forces: frequency response functions, and static deflections."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.identification.measured import Measured, Noise, NuisanceParameter, Residuals
from guideload.identification.model import ModelAt, SensorPlace

Complex = NDArray[np.complex128]
NEAR = 0.3  # relative distance of computed and measured curves within which the computed ones give the noise
SAME = 0.02  # relative change of the sizes that ends the rounds


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
