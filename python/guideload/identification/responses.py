"""Measured responses to known forces: frequency response functions, and static deflections."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize_scalar

from guideload.base.arguments import require_type
from guideload.base.arrays import Array, Complex
from guideload.base.errors import ArgumentError
from guideload.identification.measured import Measured, Noise, NuisanceParameter, Residuals
from guideload.identification.model import ModelAt, SensorPlace

NEAR = 0.3  # relative distance of computed and measured curves within which the computed ones give the noise
SAME = 0.02  # rms relative change of the standard deviations that ends the rounds
TINY = float(np.finfo(np.float64).tiny)
RATIOS = np.geomspace(1e-6, 10.0, 29)  # floor over level, around which the most likely one is sought


def _require_level(level: float) -> None:
    """Raise ArgumentError unless a standard deviation is finite and > 0."""
    require_type("level", level, float)
    if not 0.0 < level < np.inf:
        raise ArgumentError(f"level: expected a finite standard deviation > 0, got {level:g}")


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

    Standard deviation of real and imaginary part: sqrt((level |H|)^2 + (floor max |H|)^2), with the response H and the
    maximum over its curve.

    level_known  whether level and floor are known; else the level is a start only
    floor_known  whether the floor is known beside a level that is not
    calibration  standard deviation of a factor on all values, from the calibration of hammer and sensors; 0: none
    sizes        of the responses, to which the noise is relative, for each curve; without: those measured
    ratio        floor over level, where they are estimated; None before
    """

    name: str
    curves: tuple[ResponseCurve, ...]
    level: float
    floor: float
    level_known: bool
    floor_known: bool = True
    calibration: float = 0.0
    sizes: tuple[Array, ...] = ()
    ratio: float | None = None

    def __post_init__(self) -> None:
        _require_level(self.level)

    @property
    def nuisance(self) -> tuple[NuisanceParameter, ...]:
        if self.calibration == 0.0:
            return ()
        return (
            NuisanceParameter(f"calibration of {self.name}", "1", 1.0, self.calibration, self.calibration),
        )

    @property
    def noise(self) -> tuple[Noise, ...]:
        floor = self.floor if self.ratio is None else self.ratio * self.level
        return (Noise(f"curves of {self.name}", self.level_known, self.level, floor=floor),)

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
        ratio = self.floor / self.level if self.ratio is None else self.ratio
        return [self.level * np.hypot(size, ratio * size.max()) for size in sizes]

    @property
    def scales(self) -> Array:
        return np.concatenate([np.tile(one, 2) for one in self._scales])  # of real and imaginary parts

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

    def prepared_for(self, model: ModelAt, nuisance: Array) -> FrequencyResponses:
        """The responses with noise by the computed ones, once near: small measured ones would weigh too much."""
        gain = float(nuisance[0]) if nuisance.size else 1.0
        found = [gain * curve.computed(model)[0] for curve in self.curves]
        errors = [one - curve.value for one, curve in zip(found, self.curves, strict=True)]
        distances = [
            np.linalg.norm(one) / np.linalg.norm(curve.value)
            for one, curve in zip(errors, self.curves, strict=True)
        ]
        if max(distances) > NEAR:
            return self
        new = replace(self, sizes=tuple(np.asarray(abs(one), dtype=np.float64) for one in found))
        if not self.level_known:
            ratio = new._most_likely_ratio(np.concatenate(errors))
            # The machine follows the ratio: the mean of both logarithms keeps two of them from alternating.
            new = replace(new, ratio=ratio if self.ratio is None else float(np.sqrt(ratio * self.ratio)))
        change = new.scales / self.scales - 1.0
        return self if self.sizes and np.sqrt(np.mean(change**2)) < SAME else new

    def _most_likely_ratio(self, errors: Complex) -> float:
        """Floor over level of the largest likelihood for these errors (n,) of all values."""
        size = np.concatenate(self.sizes)
        largest = np.concatenate([np.full(one.size, one.max()) for one in self.sizes])
        squares = 0.5 * abs(errors) ** 2

        def minus_log_likelihood(log_ratio: float) -> float:
            ratio = np.exp(log_ratio)
            shape = size**2 + (ratio * largest) ** 2
            level = self.floor / ratio if self.floor_known else np.sqrt(np.mean(squares / shape))
            variance = np.maximum(level**2 * shape, TINY)
            return float((np.log(variance) + squares / variance).sum())

        logs = np.log(RATIOS)
        best = min(range(1, logs.size - 1), key=lambda i: minus_log_likelihood(float(logs[i])))
        found = minimize_scalar(
            minus_log_likelihood, bounds=(logs[best - 1], logs[best + 1]), method="bounded"
        )
        return float(np.exp(found.x))


# ---- static deflections


@dataclass(frozen=True, eq=False)
class Deflection:
    """A displacement [m] along a place, under a force [N] along another one."""

    force_at: SensorPlace
    force: float
    at: SensorPlace
    moved: float

    def __post_init__(self) -> None:
        for name in ("force", "moved"):
            require_type(name, value := getattr(self, name), float)
            if not -np.inf < value < np.inf:
                raise ArgumentError(
                    f"{name}: expected a finite number, got {value:g}; leave the deflection out"
                )


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

    def __post_init__(self) -> None:
        _require_level(self.level)
        if not len(self.values):
            raise ArgumentError("values: expected at least one deflection, got none")

    @property
    def noise(self) -> tuple[Noise, ...]:
        return (Noise(f"displacements of {self.name}", self.known, self.level, "m"),)

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
