"""Derivatives of natural frequencies, damping, mode shapes and frequency responses, in the undamped modes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array, Complex
from guideload.machine.modes import vibrating_modes

# Relative distance of frequencies that count as one: nearer ones have shapes with less than half of the digits.
REPEATED = 1e-8
# Size of x^T (2 lambda M + C) x of a shape of length 1 in the undamped modes, over that of an undamped mode, below
# which the eigenvalue is defective, as in critical damping: its derivative is infinite.
DEFECTIVE = 1e-7


@dataclass(frozen=True, eq=False)
class ModeDerivatives:
    """The n undamped and the m damped modes, by ascending frequency, and their derivatives by p columns.

    frequency, d_frequency          (n,) Hz, (p, n), of the undamped machine
    damping_ratio, d_damping_ratio  (n,), (p, n), of the damped machine, as in `Modes`; of an overdamped mode the ratio
                                    without coupling to other modes
    shape, d_shape                  (n, 6), (p, n, 6), undamped, of unit modal mass
    eigenvalue, d_eigenvalue        (m,) 1/s, complex, (p, m), of the damped machine: one of each conjugate pair, with
                                    positive imaginary part, and all real ones (of overdamped modes)
    damped_shape, d_damped_shape    (m, 6) complex, (p, m, 6), with x^T (2 lambda M + C) x = 1
    repeated                        indices of undamped modes with equal frequencies. A change of one column splits
                                    these: d_frequency lists their slopes, ascending. Derivatives of their shapes and
                                    damping ratios are nan. Likewise for equal eigenvalues of the damped machine
    reasons                         why derivatives are nan, in words
    """

    frequency: Array
    d_frequency: Array
    damping_ratio: Array
    d_damping_ratio: Array
    shape: Array
    d_shape: Array
    eigenvalue: Complex
    d_eigenvalue: Complex
    damped_shape: Complex
    d_damped_shape: Complex
    repeated: tuple[tuple[int, ...], ...]
    reasons: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Modal:
    """q = shapes^T y with y'' + damping y' + omega^2 y = 0, and the derivatives of the equations in these shapes."""

    omega: Array  # (n,) rad/s
    shapes: Array  # (n, 6), of unit modal mass
    damping: Array  # (n, n)
    d_mass: Array  # (p, n, n)
    d_damping: Array
    d_stiffness: Array

    # ---- frequency response

    def response(self, omega: Array, force: Array, d_force: Array) -> tuple[Complex, Complex]:
        """Amplitudes (m, 6) under a force (6,) on all dofs, and their derivatives (m, p, 6)."""
        w = omega[:, None, None]
        dynamic = np.diag(self.omega**2) + 1j * w * self.damping - w**2 * np.eye(self.omega.size)
        change = self._dynamic(np.asarray(1j * omega, dtype=np.complex128))
        y = np.linalg.solve(dynamic, np.tile(self.shapes @ force, (omega.size, 1))[..., None])
        right = (d_force @ self.shapes.T)[None] - (change @ y[:, None])[..., 0]
        d_y = np.linalg.solve(dynamic[:, None], right[..., None])[..., 0]
        amplitudes = y[..., 0] @ self.shapes
        return np.asarray(amplitudes, np.complex128), np.asarray(d_y @ self.shapes, np.complex128)

    def _dynamic(self, rates: Complex) -> Complex:
        """Derivatives (m, p, n, n) of s^2 M + s C + K at rates s (m,)."""
        s = rates[:, None, None, None]
        return np.asarray(s**2 * self.d_mass + s * self.d_damping + self.d_stiffness)

    # ---- modes

    def modes(self) -> ModeDerivatives:
        """The modes and their derivatives."""
        reasons: list[str] = []
        d_frequency, d_shape, repeated = self._undamped(reasons)
        ratio = np.diag(self.damping) / (2.0 * self.omega)
        mixed = np.einsum("pkj,jk->pk", d_shape, self.damping)
        d_modal = np.einsum("pkk->pk", self.d_damping) + 2.0 * mixed
        d_ratio = d_modal / (2.0 * self.omega) - ratio * d_frequency / self.omega
        eigenvalue, d_eigenvalue, damped, d_damped = self._damped(reasons)
        # Of the modes that vibrate those of the damped machine, as in `Modes`.
        modes, places = vibrating_modes(ratio, eigenvalue)
        value, change, size = eigenvalue[places], d_eigenvalue[:, places], np.abs(eigenvalue[places])
        ratio[modes] = -value.real / size
        d_ratio[:, modes] = (value.real * (value.conj() * change).real / size**2 - change.real) / size
        d_ratio[:, [k for group in repeated for k in group]] = np.nan
        turn = 2.0 * np.pi
        return ModeDerivatives(
            self.omega / turn,
            d_frequency / turn,
            ratio,
            d_ratio,
            self.shapes,
            d_shape @ self.shapes,
            eigenvalue,
            d_eigenvalue,
            damped @ self.shapes,
            d_damped @ self.shapes,
            repeated,
            tuple(reasons),
        )

    def _undamped(self, reasons: list[str]) -> tuple[Array, Array, tuple[tuple[int, ...], ...]]:
        """Derivatives of omega (p, n), of the shapes in the shapes (p, n, n), and groups of equal frequencies."""
        squares, n = self.omega**2, self.omega.size
        # (p, j, k): work of a change on shape j in mode k.
        work = self.d_stiffness - squares * self.d_mass
        slope = np.einsum("pkk->pk", work).copy()
        gaps = squares - squares[:, None]  # of mode k to shape j
        np.fill_diagonal(gaps, 1.0)
        groups = tuple(_groups(self.omega))
        for group in groups:
            at = list(group)
            slope[:, at] = np.linalg.eigvalsh(work[:, at][:, :, at])
            gaps[np.ix_(at, at)] = 1.0
            frequency = self.omega[at[0]] / (2.0 * np.pi)
            reasons.append(
                f"modes {_numbers(group)} have one frequency, {frequency:.6g} Hz: their shapes may be any of a plane "
                "and have no derivative; the slopes of the frequencies are those along each column alone"
            )
        mixed = work / gaps
        mixed[:, range(n), range(n)] = -0.5 * np.einsum("pkk->pk", self.d_mass)
        for group in groups:
            mixed[:, :, list(group)] = np.nan
        return slope / (2.0 * self.omega), mixed.transpose(0, 2, 1), groups

    def _damped(self, reasons: list[str]) -> tuple[Complex, Complex, Complex, Complex]:
        """Eigenvalues (m,), their derivatives (p, m), shapes (m, n) and their derivatives (p, m, n)."""
        values, shapes = self._eigenpairs()
        d_values = np.full((len(self.d_mass), values.size), np.nan + 0j)
        d_shapes = np.full((len(self.d_mass), *shapes.shape), np.nan + 0j)
        groups = list(_groups(values))
        for group in groups:
            at = list(group)
            basis = shapes[at]
            weight = basis @ self._slope(values[at[:1]], basis.T)
            if np.linalg.cond(weight) < 1.0 / DEFECTIVE:
                change = basis @ self._dynamic(values[at[:1]])[0] @ basis.T
                d_values[:, at] = np.sort_complex(-np.linalg.eigvals(np.linalg.solve(weight, change)))
            reasons.append(
                f"eigenvalues {_numbers(group)} of the damped machine coincide: their shapes have no derivative"
            )
        alone = np.ones(values.size, dtype=np.bool_)
        alone[[k for group in groups for k in group]] = False
        weights = (shapes * self._slope(values[:, None], shapes[..., None])[..., 0]).sum(axis=1)
        critical = alone & (np.abs(weights) < DEFECTIVE * (np.abs(values) + self.omega[0]))
        reasons += [
            f"eigenvalue {k + 1} of the damped machine is critically damped: it has no derivative"
            for k in np.flatnonzero(critical)
        ]
        simple = alone & ~critical
        shapes[simple] = _turned(shapes[simple] / np.sqrt(weights[simple])[:, None])
        d_values[:, simple], d_shapes[:, simple] = self._simple(values[simple], shapes[simple])
        return values, d_values, shapes, d_shapes

    def _slope(self, value: Complex, shapes: Complex) -> Complex:
        """(2 lambda M + C) x for shapes x as columns (..., n, k), each with its lambda (..., 1)."""
        return np.asarray(2.0 * value[..., None] * shapes + self.damping @ shapes)

    def _simple(self, values: Complex, x: Complex) -> tuple[Complex, Complex]:
        """Derivatives (p, m) of simple eigenvalues (m,) and (p, m, n) of their shapes (m, n)."""
        n, p = self.omega.size, len(self.d_mass)
        slope = self._slope(values[:, None], x[..., None])[..., 0]
        column, turn = x[:, None, :, None], 2.0 * values[:, None, None, None]
        change = (self._dynamic(values) @ column)[..., 0]  # (m, p, n)
        d_value = -(change * x[:, None]).sum(axis=-1)
        own = (((turn * self.d_mass + self.d_damping) @ column)[..., 0] * x[:, None]).sum(axis=-1)
        bordered = np.zeros((values.size, n + 1, n + 1), dtype=np.complex128)
        bordered[:, :n, :n] = values[:, None, None] * self.damping
        bordered[:, range(n), range(n)] += values[:, None] ** 2 + self.omega**2
        bordered[:, :n, n] = bordered[:, n, :n] = slope
        right = np.empty((values.size, n + 1, p), dtype=np.complex128)
        right[:, :n] = (-change - d_value[..., None] * slope[:, None]).transpose(0, 2, 1)
        right[:, n] = -d_value * (x * x).sum(axis=1)[:, None] - 0.5 * own
        d_x = np.linalg.solve(bordered, right)[:, :n]
        return d_value.T, np.asarray(d_x.transpose(2, 0, 1), dtype=np.complex128)

    def _eigenpairs(self) -> tuple[Complex, Complex]:
        """Eigenvalues (m,), ascending by size, without conjugates, and their shapes (m, n) in the modes."""
        n, omega = self.omega.size, np.diag(self.omega)
        matrix = np.block([[np.zeros((n, n)), omega], [-omega, -self.damping]])
        values, vectors = np.linalg.eig(matrix)
        kept = values.imag >= 0.0
        order = np.argsort(np.abs(values[kept]), kind="stable")
        values = np.asarray(values[kept][order], dtype=np.complex128)
        # The upper half is omega y.
        shapes = (vectors[:n, kept][:, order] / self.omega[:, None]).T
        shapes /= np.linalg.norm(shapes, axis=1)[:, None]
        return values, np.ascontiguousarray(shapes, dtype=np.complex128)


def _numbers(group: Sequence[int]) -> str:
    """Numbers of modes, from 1."""
    return ", ".join(str(k + 1) for k in group)


def _turned(shapes: Complex) -> Complex:
    """Each shape (m, n) or its negative, so that its largest entry has a positive real part."""
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=1)[:, None], axis=1)
    return np.where(largest.real > 0.0, shapes, -shapes)


def _groups(values: Array | Complex) -> Iterator[tuple[int, ...]]:
    """Indices of values that are one to rounding, in groups of two or more."""
    left = list(range(values.size))
    while left:
        k = left.pop(0)
        near = [j for j in left if abs(values[j] - values[k]) <= REPEATED * abs(values[k])]
        left = [j for j in left if j not in near]
        if near:
            yield (k, *near)
