"""The uniform numbers of each run: plain samples or a Saltelli design, with correlated columns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtr, ndtri

from guideload.base.arrays import Array
from guideload.study.sampling.distributions import HIGHEST, LOWEST
from guideload.study.sampling.sequences import Replicated, Sampling, Single, sequence_of


@dataclass(frozen=True)
class Copula:
    """Gaussian copula: correlates `columns` of uniform numbers.

    factor: the rows of the lower Cholesky factor of the correlation matrix of their normal scores.
    """

    columns: tuple[int, ...]
    factor: tuple[tuple[float, ...], ...]

    def apply(self, uniforms: Array) -> None:
        """Correlate uniforms (dimensions, n) in place; row by row, so that sums do not depend on n."""
        scores = ndtri(uniforms[list(self.columns)])
        for column, row in zip(self.columns, self.factor, strict=True):
            total = np.zeros(uniforms.shape[1])
            for coefficient, score in zip(row, scores, strict=False):
                if coefficient:
                    total += coefficient * score
            uniforms[column] = np.clip(ndtr(total), LOWEST, HIGHEST)


@dataclass(frozen=True)
class Design:
    """The uniform numbers of run i.

    With `sensitivity` (Saltelli 2010) there are dimensions + 2 runs for each of `samples`: run i is row
    i // (dimensions + 2) of the matrix i % (dimensions + 2): 0 is A, 1 is B, 2 + j is A with column j of B.

    replicates: independent sequences that take turns; sample (or row) i is of the replicate i % replicates.
    draws: whether each run also has the number of a draw, which in a Saltelli design is one more dimension, the last.
    """

    sampling: Sampling
    seed: int
    samples: int
    dimensions: int
    sensitivity: bool = False
    copula: Copula | None = None
    replicates: int = 1
    draws: bool = False

    @property
    def runs(self) -> int:
        return self.samples * (self._matrices if self.sensitivity else 1)

    @property
    def _matrices(self) -> int:
        return self.dimensions + int(self.draws) + 2

    def draw_numbers(self, start: int, stop: int) -> Array:
        """(stop - start,) numbers of the draws: that of the run; in a Saltelli design one for each row of A and B."""
        numbers: Array = np.arange(start, stop, dtype=np.float64)
        if not self.sensitivity:
            return numbers
        row, matrix = np.divmod(numbers, self._matrices)
        from_b = (matrix == 1) | (matrix == 2 + self.dimensions)
        numbers = 2.0 * row + from_b
        return numbers

    @cached_property
    def _sequence(self) -> Single | Replicated:
        columns = 2 * self.dimensions if self.sensitivity else self.dimensions
        return sequence_of(self.sampling, columns, self.seed, self.samples, self.replicates)

    def uniforms(self, start: int, stop: int) -> Array:
        """(dimensions, stop - start) of the runs start to stop - 1."""
        if self.sensitivity:
            return self._saltelli(start, stop)
        uniforms = self._sequence.columns(start, stop)
        if self.copula is not None:
            self.copula.apply(uniforms)
        return uniforms

    def _saltelli(self, start: int, stop: int) -> Array:
        block = self._matrices
        first, last = start // block, -(-stop // block)
        base = self._sequence.columns(first, last)
        row, matrix = np.divmod(np.arange(start, stop), block)
        row -= first
        columns = np.arange(self.dimensions)[:, None]
        from_b = (matrix == 1) | (matrix == 2 + columns)
        return np.where(from_b, base[self.dimensions :, row], base[: self.dimensions, row])


def cholesky(matrix: Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...] | None:
    """The lower Cholesky factor of a symmetric matrix, or None if the matrix is not positive definite.

    It does not use LAPACK, the last bits of which differ between computers, and with them all drawn values.
    """
    factor: list[list[float]] = []
    for i, entries in enumerate(matrix):
        row: list[float] = []
        for j in range(i):
            done = math.fsum(a * b for a, b in zip(row, factor[j][:j], strict=True))
            row.append((entries[j] - done) / factor[j][j])
        rest = entries[i] - math.fsum(a * a for a in row)
        if not rest > ROUNDING:
            return None
        factor.append([*row, math.sqrt(rest)])
    return tuple(tuple(row) for row in factor)


ROUNDING = 1e-12  # least pivot of a correlation matrix (diagonal 1): smaller ones are rounding
