"""Modal tests, as with a hammer: measured natural frequencies, damping ratios and mode shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import linear_sum_assignment

from guideload.base.arrays import Array, Complex, Indices
from guideload.identification.measured import Measured, Noise, Residuals
from guideload.identification.model import ModelAt, SensorPlace

# The smallest MAC of a pair: below it the shapes have less than half of their motion in common.
LEAST_MAC = 0.6
LEAST_PLACES = 3  # of a shape whose MAC means something: with one place it is always 1
LEAST_MOVED = 0.05  # of the largest component: a hammer at a place that moves less hardly excites the mode
LOST = 1e3  # residual of a measured mode that no computed one is left for: far beyond any noise
LEAST_DAMPING = 1e-12  # below it a ratio is rounding
SMALLEST_SHARE = 1e-9  # of shapes at right angles
KINDS = ("frequencies", "damping ratios", "shapes")


@dataclass(frozen=True, eq=False)
class MeasuredMode:
    """One measured mode.

    frequency  Hz, |lambda|/(2 pi) of its eigenvalue lambda or, if the test says so, of the damped vibration
    damping    1, damping ratio, or None
    shape      (places,) real, in any scale, or None
    number     of the computed mode that it is, counted from 1 by ascending frequency; None: the one that fits
    """

    frequency: float
    damping: float | None = None
    shape: Array | None = None
    number: int | None = None


@dataclass(frozen=True)
class ModePair:
    """A measured mode and the computed one that it is paired with; `computed` and the rest are None without one."""

    measured: int
    computed: int | None
    frequency: float | None = None
    damping: float | None = None
    # modal assurance criterion of the shapes (0 to 1), None without a measured shape
    mac: float | None = None
    reason: str = ""


@dataclass(frozen=True, eq=False)
class ModalTest(Measured):
    """A modal test.

    places    of the shapes' components
    levels    standard deviations: of frequencies and of damping ratios relative to the value, of shapes relative to
              their largest component
    known     whether each level is known, or a start only
    damped    whether the frequencies are those of the damped vibration
    rejected  measured modes without a computed one, and the reason
    """

    name: str
    modes: tuple[MeasuredMode, ...]
    places: tuple[SensorPlace, ...]
    levels: tuple[float, float, float]
    known: tuple[bool, bool, bool]
    damped: bool = False
    rejected: tuple[tuple[int, str], ...] = ()

    @classmethod
    def shown(
        cls,
        name: str,
        model: ModelAt,
        places: Sequence[SensorPlace],
        levels: tuple[float, float, float],
        hammer: SensorPlace,
        band: tuple[float, float],
    ) -> ModalTest:
        """What a test would show of a machine: its modes within a band [Hz] that move where the hammer strikes."""
        computed = _Computed.of(model, places)
        moved, frequency = abs(_real_shapes(model, [hammer])[0][:, 0]), np.exp(computed.log_frequency)
        seen = moved > LEAST_MOVED * abs(computed.shapes).max(axis=1)
        seen &= (frequency >= band[0]) & (frequency <= band[1])
        modes = tuple(
            MeasuredMode(
                float(frequency[k]),
                float(computed.damping[k]),
                shape if len(places) > 1 else None,
                int(k) + 1,
            )
            for k, shape in enumerate(computed.shapes)
            if seen[k]
        )
        return cls(name, modes, tuple(places) if len(places) > 1 else (), levels, (True,) * 3)

    @cached_property
    def _kept(self) -> list[int]:
        """The measured modes that are fitted."""
        out = {i for i, _ in self.rejected}
        return [i for i in range(len(self.modes)) if i not in out]

    @cached_property
    def _rows(self) -> list[tuple[int, int]]:
        """Measured mode and kind of value of each residual; a shape, whose scale is free, has one less than places."""
        rows = []
        for i in self._kept:
            mode = self.modes[i]
            counts = 1, mode.damping is not None, 0 if mode.shape is None else len(self.places) - 1
            rows += [(i, kind) for kind, count in enumerate(counts) for _ in range(count)]
        return rows

    @cached_property
    def _used(self) -> list[int]:
        """Kinds of values that this test has."""
        return sorted({kind for _, kind in self._rows})

    @property
    def noise(self) -> tuple[Noise, ...]:
        return tuple(
            Noise(f"{KINDS[kind]} of {self.name}", self.known[kind], self.levels[kind]) for kind in self._used
        )

    @property
    def noise_index(self) -> Indices:
        return np.array([self._used.index(kind) for _, kind in self._rows], dtype=np.intp)

    @property
    def labels(self) -> tuple[str, ...]:
        words = ("frequency", "damping", "shape")
        return tuple(f"{words[kind]} of mode {i + 1}" for i, kind in self._rows)

    def residuals(self, model: ModelAt, nuisance: Array) -> Residuals:
        values, slopes = np.full(len(self._rows), LOST), np.zeros((model.z.size, len(self._rows)))
        computed, at = _Computed.of(model, self.places, self.damped), 0
        pairs, fits = self._paired(computed)
        for i, k in pairs:
            rows = slice(at, at + fits[i].shape[1])
            if k is not None:
                values[rows], slopes[:, rows] = fits[i][k], self._slopes(i, k, computed)
            at = rows.stop
        return Residuals(values, model.by_z(slopes).T, np.zeros((values.size, 0)))

    def pairs(self, model: ModelAt) -> tuple[ModePair, ...]:
        """Every measured mode with its computed one at this machine."""
        computed = _Computed.of(model, self.places, self.damped)
        found, reasons = dict(self._paired(computed)[0]), dict(self.rejected)
        pairs = []
        for i, mode in enumerate(self.modes):
            k = found.get(i)
            if k is None:
                pairs.append(ModePair(i, None, reason=reasons.get(i, "the machine has no mode left for it")))
                continue
            mac = None if mode.shape is None else _mac(mode.shape, computed.shapes[k])
            frequency, damping = math.exp(computed.log_frequency[k]), float(computed.damping[k])
            pairs.append(ModePair(i, k, frequency, damping, mac))
        return tuple(pairs)

    def computed_shapes(self, model: ModelAt) -> Array:
        """(n, places) shapes of the computed modes."""
        return _real_shapes(model, self.places)[0]

    def prepared_for(self, model: ModelAt, nuisance: Array) -> ModalTest:
        """The test without measured modes that no computed mode resembles, or that are too many."""
        computed, rejected = _Computed.of(model, self.places, self.damped), {}
        for i, mode in enumerate(self.modes):
            if mode.shape is None or len(self.places) < LEAST_PLACES:
                continue
            best = max((_mac(mode.shape, shape) for shape in computed.shapes), default=0.0)
            if best < LEAST_MAC:
                rejected[i] = f"its shape resembles none of the computed ones: the best MAC is {best:.2f}"
        without = replace(self, rejected=tuple(rejected.items()))
        few = f"the machine has only {len(computed.shapes)} modes"
        rejected |= {i: few for i, k in without._paired(computed)[0] if k is None}
        items = tuple(sorted(rejected.items()))
        return self if items == self.rejected else replace(self, rejected=items)

    @cached_property
    def _across(self) -> dict[int, tuple[Array, Array]]:
        """For each measured shape a with largest component 1: a/|a|^2 and a basis (places, places - 1) across it."""
        shapes = {i: self.modes[i].shape for i in self._kept}
        units = {i: shape / abs(shape).max() for i, shape in shapes.items() if shape is not None}
        return {i: (unit / (unit @ unit), null_space(unit[None])) for i, unit in units.items()}

    def _paired(self, computed: _Computed) -> tuple[list[tuple[int, int | None]], dict[int, Array]]:
        """The pairing with the least sum of squares; residuals (n, count) of each measured with all computed modes.

        The least sum over all pairings is a continuous function of the machine, so the pairs may change during a fit.
        """
        fits: dict[int, Array] = {}
        cost = np.zeros((len(self._kept), computed.damping.size))
        for row, i in enumerate(self._kept):
            mode = self.modes[i]
            columns = [(computed.log_frequency - math.log(mode.frequency)) / self.levels[0]]
            if mode.damping is not None:
                columns.append(np.log(computed.damping / mode.damping) / self.levels[1])
            if mode.shape is not None:
                across = computed.shapes @ self._across[i][1]
                columns.extend((across / (self._share(i, computed)[:, None] * self.levels[2])).T)
            fits[i] = np.array(columns).T
            cost[row] = (fits[i] ** 2).sum(axis=1)
            if mode.shape is not None:
                cost[row] += np.where(computed.lengths > 0.0, 0.0, LOST**3)  # it moves none of the places
            if mode.number is not None:
                cost[row] += np.where(np.arange(cost.shape[1]) == mode.number - 1, 0.0, LOST**3)
        rows, chosen = linear_sum_assignment(cost)
        pairs = dict(zip(rows.tolist(), chosen.tolist(), strict=True))
        return [(i, pairs.get(row)) for row, i in enumerate(self._kept)], fits

    def _share(self, i: int, computed: _Computed) -> Array:
        """(n,) scale of the computed shapes: their part along the measured one."""
        share = computed.shapes @ self._across[i][0]
        least = SMALLEST_SHARE * np.where(computed.lengths > 0.0, computed.lengths, 1.0)
        return np.where(abs(share) > least, share, least)

    def _slopes(self, i: int, k: int, computed: _Computed) -> Array:
        """Derivatives (p, count) by the values of the residuals of measured mode i against computed mode k."""
        mode = self.modes[i]
        columns = [computed.log_frequency_by[:, k] / self.levels[0]]
        if mode.damping is not None:
            columns.append(computed.damping_by[:, k] / computed.damping[k] / self.levels[1])
        if mode.shape is not None:
            (along, across), by = self._across[i], computed.shapes_by[:, k]
            share = self._share(i, computed)[k]
            part = computed.shapes[k] @ across / share
            moved = by @ across - (by @ along)[:, None] * part
            columns.extend((moved / (share * self.levels[2])).T)
        return np.array(columns).T


@dataclass(frozen=True, eq=False)
class _Computed:
    """The n vibrating modes of a machine as a modal test shows them, and derivatives (p, ...) by the values."""

    log_frequency: Array
    log_frequency_by: Array
    damping: Array
    damping_by: Array
    shapes: Array
    shapes_by: Array

    @cached_property
    def lengths(self) -> Array:
        """(n,) of the shapes."""
        return np.asarray(np.linalg.norm(self.shapes, axis=1))

    @classmethod
    def of(cls, model: ModelAt, places: Sequence[SensorPlace], damped: bool = False) -> _Computed:
        """damped: whether the frequencies are those of the damped vibration."""
        vibrates = model.modes.eigenvalue.imag > 0.0  # the others are overdamped
        eigenvalue, by = model.modes.eigenvalue[vibrates], _known(model.modes.d_eigenvalue[:, vibrates])
        size, size_by = abs(eigenvalue), (by / eigenvalue).real
        turning = eigenvalue.imag if damped else size
        log_by = by.imag / eigenvalue.imag if damped else size_by
        damping = np.maximum(-eigenvalue.real / size, LEAST_DAMPING)
        log = np.log(turning / (2.0 * np.pi))
        shapes, shapes_by = _real_shapes(model, places)
        return cls(log, log_by, damping, -by.real / size - damping * size_by, shapes, shapes_by)


def _real_shapes(model: ModelAt, places: Sequence[SensorPlace]) -> tuple[Array, Array]:
    """Shapes (n, places) of the damped modes, as real as a phase makes them, and derivatives (p, n, places)."""
    rows = np.array([place.row for place in places]).reshape(-1, 6).T
    vibrates = model.modes.eigenvalue.imag > 0.0
    shape = model.modes.damped_shape[vibrates] @ rows
    by = _known(model.modes.d_damped_shape[:, vibrates] @ rows)
    if not places:
        return shape.real, by.real
    square = (shape * shape).sum(axis=1)
    turn = np.exp(-0.5j * np.angle(square))[:, None]
    square = np.where(square == 0.0, 1.0, square)  # of a mode that moves none of the places
    d_angle = -0.5 * ((2.0 * shape * by).sum(axis=2) / square).imag[..., None]
    return (turn * shape).real, (turn * (by + 1j * d_angle * shape)).real


def _known(derivatives: Complex) -> Complex:
    """Derivatives with 0 in place of nan, where eigenvalues coincide."""
    return np.where(np.isnan(derivatives), 0.0, derivatives)


def _mac(first: Array, second: Array) -> float:
    """Modal assurance criterion: squared cosine of the angle between two shapes; 0 for a shape that does not move."""
    first, second = (one / (abs(one).max() or 1.0) for one in (first, second))
    if not (first.any() and second.any()):
        return 0.0
    return float((first @ second) ** 2 / ((first @ first) * (second @ second)))
