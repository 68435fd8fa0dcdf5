"""The uniform numbers of each run by index: sequences, and designs of them.

A sequence is scrambled Sobol, a Latin hypercube or independent random numbers; a design takes its samples as they are,
or as a Saltelli design, and correlates columns. The numbers of a sample depend on its index alone, not on the order or
the ranges in which samples are requested. All lie within `LOWEST` and `HIGHEST`.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from guideload.base.arrays import Array, Flags, Indices
from guideload.study.distributions import HIGHEST, LOWEST

Words = NDArray[np.uint64]
Sampling = Literal["sobol", "latin hypercube", "random"]


@dataclass(frozen=True)
class Sobol:
    """Sobol's sequence with a random linear matrix scramble and shift (Matousek 1998), from SciPy."""

    dimensions: int
    seed: int

    BITS = 32  # the most that SciPy's fast_forward supports; the sequence has 2^32 samples

    @cached_property
    def _engine(self) -> qmc.Sobol:
        generator = np.random.default_rng(np.random.SeedSequence(self.seed))
        return qmc.Sobol(self.dimensions, scramble=True, bits=self.BITS, seed=generator)

    def columns(self, start: int, stop: int) -> Array:
        with _ENGINES:
            engine = self._engine
            if engine.num_generated > start:
                engine.reset()
            if engine.num_generated < start:
                engine.fast_forward(start - engine.num_generated)
            # SciPy warns if the first call asks for a number of samples that is no power of two: ask for one.
            first = 1 if start == 0 and stop > 0 else 0
            blocks = [engine.random(count) for count in (first, stop - start - first) if count]
        points = np.concatenate([np.empty((0, self.dimensions)), *blocks])
        # Each number is the middle of its interval of 2^-32, so that none is 0.
        return np.ascontiguousarray(points.T) + 0.5 ** (self.BITS + 1)

    def __getstate__(self) -> dict[str, Any]:
        return {"dimensions": self.dimensions, "seed": self.seed}  # without the engine


_ENGINES = threading.Lock()  # an engine has state, its position in the sequence: one thread at a time


@dataclass(frozen=True)
class Random:
    """Independent numbers: Philox (Salmon et al. 2011), a counter-based generator that can start anywhere."""

    dimensions: int
    seed: int

    def columns(self, start: int, stop: int) -> Array:
        first, last = start * self.dimensions, stop * self.dimensions
        words = np.random.Philox(key=_key(self.seed, 0), counter=first // WORDS_PER_COUNT).random_raw(
            last - WORDS_PER_COUNT * (first // WORDS_PER_COUNT)
        )
        numbers = (words[first % WORDS_PER_COUNT :].reshape(-1, self.dimensions) >> np.uint64(11)) * 2.0**-53
        return np.maximum(np.ascontiguousarray(numbers.T), LOWEST)


WORDS_PER_COUNT = 4  # words of 64 bits that Philox computes per value of its counter


@dataclass(frozen=True)
class LatinHypercube:
    """One sample in each of `samples` equal strata of every dimension, in random order, at a random place in it.

    The order is a permutation that is computed, not stored: a Feistel network on pairs of digits with a key per
    dimension, applied again to indices that it maps outside the strata (cycle walking; Black and Rogaway 2002).
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
        keys = _key(self.seed, 1, ROUNDS * self.dimensions).reshape(ROUNDS, self.dimensions, 1)
        order = self._feistel(index, keys)
        while (outside := np.nonzero(order >= np.uint64(self.samples)))[0].size:
            order[outside] = self._feistel(order[outside], keys[:, outside[0], 0])
        return order

    def _feistel(self, index: Words, keys: Words) -> Words:
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


ROUNDS = 6  # of the Feistel network


def _key(seed: int, use: int, words: int = 2) -> Words:
    sequence = np.random.SeedSequence(seed, spawn_key=(use,))
    return np.asarray(sequence.generate_state(words, np.uint64), np.uint64)


# ---- designs


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
        if not self.sensitivity:
            return np.arange(start, stop, dtype=np.float64)
        row, from_b = self._of_runs(start, stop, self.dimensions)
        return np.asarray(2.0 * row + from_b)

    def _of_runs(self, start: int, stop: int, column: Any) -> tuple[Indices, Flags]:
        """Rows of runs in a Saltelli design, and whether they have the column, or columns (n, 1), of B."""
        row, matrix = np.divmod(np.arange(start, stop), self._matrices)
        return row, (matrix == 1) | (matrix == 2 + column)

    @cached_property
    def _sequences(self) -> list[Sobol | Random | LatinHypercube]:
        """One for each replicate."""
        columns, turns = 2 * self.dimensions if self.sensitivity else self.dimensions, self.replicates
        seeds = [self.seed]
        if turns > 1:
            keys = np.random.SeedSequence(self.seed, spawn_key=(3,))
            seeds = keys.generate_state(turns, np.uint64).tolist()
        if self.sampling == "latin hypercube":
            counts = [len(range(i, self.samples, turns)) for i in range(turns)]
            return [LatinHypercube(columns, *one) for one in zip(seeds, counts, strict=True)]
        kind = Sobol if self.sampling == "sobol" else Random
        return [kind(columns, seed) for seed in seeds]

    def _base(self, start: int, stop: int) -> Array:
        """The sequences in turns: sample i is number i // R of sequence i % R."""
        turns = self.replicates
        columns = np.empty((self._sequences[0].dimensions, stop - start))
        for i, sequence in enumerate(self._sequences):
            first, last = (-((i - end) // turns) for end in (start, stop))
            if first < last:
                columns[:, i + turns * first - start :: turns] = sequence.columns(first, last)
        return columns

    def uniforms(self, start: int, stop: int) -> Array:
        """(dimensions, stop - start) of the runs start to stop - 1."""
        if not self.sensitivity:
            uniforms = self._base(start, stop)
            if self.copula is not None:
                self.copula.apply(uniforms)
            return uniforms
        first, last = start // self._matrices, -(-stop // self._matrices)
        base = self._base(first, last)
        row, from_b = self._of_runs(start, stop, np.arange(self.dimensions)[:, None])
        return np.where(from_b, base[self.dimensions :, row - first], base[: self.dimensions, row - first])


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
        if not rest > LEAST_PIVOT:
            return None
        factor.append([*row, math.sqrt(rest)])
    return tuple(tuple(row) for row in factor)


LEAST_PIVOT = 1e-12  # least pivot of a correlation matrix (diagonal 1): smaller ones are rounding
