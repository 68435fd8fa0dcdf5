"""The uniform numbers of each sample: by their index, whatever was asked before and in which pieces.

A row per sample, a column per dimension, all within `LOWEST` and `HIGHEST`. Three sequences (`Sobol`,
`LatinHypercube`, `Random`), the Saltelli design made of them, and the Gaussian copula that correlates columns.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from guideload.base.arrays import Array
from guideload.study.distributions import HIGHEST, LOWEST

Words = NDArray[np.uint64]
Sampling = Literal["sobol", "latin hypercube", "random"]


class Uniforms(Protocol):
    """Uniform numbers by index: (dimensions, stop - start), contiguous."""

    def columns(self, start: int, stop: int) -> Array: ...


# ---- sequences


@dataclass(frozen=True)
class Sobol:
    """Sobol's sequence with a random linear matrix scramble and shift (Matousek 1998), from SciPy."""

    dimensions: int
    seed: int

    BITS = 32  # all that SciPy can skip in; the sequence has 2^32 samples

    @cached_property
    def _engine(self) -> list[Any]:
        """SciPy's engine and the index that it gives next."""
        generator = np.random.default_rng(np.random.SeedSequence(self.seed))
        return [qmc.Sobol(self.dimensions, scramble=True, bits=self.BITS, seed=generator), 0]

    def columns(self, start: int, stop: int) -> Array:
        with _ENGINES:
            engine, at = self._engine
            if at > start:
                engine.reset()
                at = 0
            if at < start:
                engine.fast_forward(start - at)
            # The very first alone: of a first draw SciPy wants a power of two, and warns.
            first = 1 if start == 0 and stop > 0 else 0
            parts = [engine.random(count) for count in (first, stop - start - first) if count]
            self._engine[1] = max(start, stop)
        points = np.concatenate([np.empty((0, self.dimensions)), *parts])
        # Each number is the middle of its cell: none is 0.
        return np.ascontiguousarray(points.T) + 0.5 ** (self.BITS + 1)

    def __getstate__(self) -> dict[str, Any]:
        return _fields_of(self)


_ENGINES = threading.Lock()  # an engine is a place in a sequence: one thread at a time


@dataclass(frozen=True)
class Random:
    """Independent numbers: Philox (Salmon et al. 2011), a generator that counts and so can start anywhere."""

    dimensions: int
    seed: int

    def columns(self, start: int, stop: int) -> Array:
        first, last = start * self.dimensions, stop * self.dimensions
        words = np.random.Philox(key=_key(self.seed, 0), counter=first // PER_COUNT).random_raw(
            last - PER_COUNT * (first // PER_COUNT)
        )
        numbers = (words[first % PER_COUNT :].reshape(-1, self.dimensions) >> np.uint64(11)) * 2.0**-53
        return np.maximum(np.ascontiguousarray(numbers.T), LOWEST)


PER_COUNT = 4  # words of 64 bits of one count


@dataclass(frozen=True)
class LatinHypercube:
    """One sample in each of `samples` equal strata of every dimension, in random order and at a random place in it.

    The order is a permutation that is computed, not stored: a Feistel network with a key per dimension, on pairs of
    digits, and again where it leads out of the strata (Black and Rogaway 2002).
    """

    dimensions: int
    seed: int
    samples: int

    def columns(self, start: int, stop: int) -> Array:
        index = np.arange(start, stop, dtype=np.uint64)
        stratum = self._permuted(np.broadcast_to(index, (self.dimensions, index.size)))
        place = Random(self.dimensions, self.seed).columns(start, stop)
        return np.clip((stratum + place) / self.samples, LOWEST, HIGHEST)

    def _permuted(self, index: Words) -> Words:
        # As many keys again whatever the number of dimensions: (rounds, dimensions).
        keys = _key(self.seed, 1, ROUNDS * self.dimensions).reshape(ROUNDS, self.dimensions, 1)
        found = self._exchanged(index, keys)
        while (outside := np.nonzero(found >= np.uint64(self.samples)))[0].size:
            found[outside] = self._exchanged(found[outside], keys[:, outside[0], 0])
        return found

    def _exchanged(self, index: Words, keys: Words) -> Words:
        """A permutation of 0 to side^2 - 1, where side^2 is the next square from the number of samples."""
        side = np.uint64(math.isqrt(self.samples - 1) + 1)
        high, low = index // side, index % side
        for key in keys:
            # 32 bits that depend on all of `low` and `key`, brought to 0 ... side - 1; products wrap at 2^64.
            mixed = (low + key) * np.uint64(0x9E3779B97F4A7C15)
            mixed = (mixed ^ (mixed >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
            mixed = high + (((mixed >> np.uint64(32)) * side) >> np.uint64(32))
            high, low = low, mixed - side * (mixed >= side)
        return high * side + low


ROUNDS = 6


def _key(seed: int, use: int, words: int = 2) -> Words:
    key: Words = (
        np.random.SeedSequence(seed, spawn_key=(use,)).generate_state(words, np.uint64).astype(np.uint64)
    )
    return key


def _fields_of(of: Any) -> dict[str, Any]:
    """What a dataclass is pickled as: what is computed from its fields is computed again where it is needed."""
    return {field.name: getattr(of, field.name) for field in fields(of)}


# ---- designs


@dataclass(frozen=True)
class Copula:
    """Correlated `columns` of uniform numbers: the rows of the lower Cholesky `factor` of the correlations of their
    normal scores."""

    columns: tuple[int, ...]
    factor: tuple[tuple[float, ...], ...]

    def apply(self, uniforms: Array) -> None:
        """Changes (dimensions, n) in place; each sample by itself, so that no sum depends on how many there are."""
        scores = ndtri(uniforms[list(self.columns)])
        for column, row in zip(self.columns, self.factor, strict=True):
            total = np.zeros(uniforms.shape[1])
            for coefficient, score in zip(row, scores, strict=False):
                if coefficient:
                    total += coefficient * score
            uniforms[column] = np.clip(ndtr(total), LOWEST, HIGHEST)


@dataclass(frozen=True)
class Design:
    """Which uniform numbers sample i has.

    With `sensitivity` (Saltelli 2010) there are dimensions + 2 runs for each of `samples`: run i is of the matrix
    i % (dimensions + 2), 0 for A, 1 for B, 2 + j for A with column j of B, and of its row i // (dimensions + 2).
    """

    sampling: Sampling
    seed: int
    samples: int
    dimensions: int
    sensitivity: bool = False
    copula: Copula | None = None

    @property
    def runs(self) -> int:
        return self.samples * (self.dimensions + 2 if self.sensitivity else 1)

    @cached_property
    def _sequence(self) -> Uniforms:
        columns = 2 * self.dimensions if self.sensitivity else self.dimensions
        if self.sampling == "sobol":
            return Sobol(columns, self.seed)
        if self.sampling == "random":
            return Random(columns, self.seed)
        return LatinHypercube(columns, self.seed, self.samples)

    def uniforms(self, start: int, stop: int) -> Array:
        """(dimensions, stop - start) of the runs start to stop - 1."""
        if self.sensitivity:
            return self._saltelli(start, stop)
        uniforms = self._sequence.columns(start, stop)
        if self.copula is not None:
            self.copula.apply(uniforms)
        return uniforms

    def _saltelli(self, start: int, stop: int) -> Array:
        block = self.dimensions + 2
        first, last = start // block, -(-stop // block)
        base = self._sequence.columns(first, last)
        row, matrix = np.divmod(np.arange(start, stop), block)
        row -= first
        own = np.arange(self.dimensions)[:, None]
        from_b = (matrix == 1) | (matrix == 2 + own)
        return np.where(from_b, base[self.dimensions :, row], base[: self.dimensions, row])

    def __getstate__(self) -> dict[str, Any]:
        return _fields_of(self)


def cholesky(matrix: Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...] | None:
    """The lower factor of a symmetric matrix, or None if that is not positive definite.

    By hand, for LAPACK's last bits differ between machines, and these decide every value that is drawn.
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


ROUNDING = 1e-12  # of a correlation matrix, whose diagonal is 1: a smaller pivot is what rounding leaves of 0
