"""Sampling: the same bits by any way to a sample, evenness that each sequence promises, correlations as asked."""

import math
import pickle
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import kstest

from guideload.study.sampling import Copula, Design, LatinHypercube, Random, Sampling, Sobol, cholesky

SAMPLINGS: list[Sampling] = ["sobol", "latin hypercube", "random"]
THREE = [[1.0, 0.5, -0.3], [0.5, 1.0, 0.2], [-0.3, 0.2, 1.0]]


def copula(columns: Sequence[int], matrix: list[list[float]]) -> Copula:
    factor = cholesky(matrix)
    assert factor is not None
    return Copula(tuple(columns), factor)


def same(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    return a.tobytes() == np.ascontiguousarray(b).tobytes()


def deviation(numbers: NDArray[np.float64]) -> float:
    """Kolmogorov-Smirnov's statistic times sqrt(n) against the uniform distribution."""
    return float(kstest(numbers, "uniform", method="asymp").statistic) * math.sqrt(numbers.size)


# ---- by index


@pytest.mark.parametrize("replicates", [1, 7])
@pytest.mark.parametrize("sensitivity", [False, True])
@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_a_sample_has_the_same_bits_whatever_was_asked(
    sampling: Sampling, sensitivity: bool, replicates: int
) -> None:
    correlated = None if sensitivity else copula((0, 2, 4), THREE)
    design = Design(sampling, 7, 300, 5, sensitivity, correlated, replicates)
    whole = design.uniforms(0, design.runs)
    assert whole.shape == (5, design.runs)
    jumps = ((0, 1), (5, 6), (0, 3), (290, 300), (4, 4), (17, 200), (200, 217), (299, 300), (3, 8))
    for start, stop in jumps:
        assert same(design.uniforms(start, stop), whole[:, start:stop]), (start, stop)
    for chunk in (1, 7, 64):
        pieces = [design.uniforms(k, min(k + chunk, 300)) for k in range(0, 300, chunk)]
        assert same(np.concatenate(pieces, axis=1), whole[:, :300])
    assert same(pickle.loads(pickle.dumps(design)).uniforms(11, 40), whole[:, 11:40])


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_threads_do_not_disturb_each_other(sampling: Sampling) -> None:
    design = Design(sampling, 3, 4096, 6, replicates=3)
    whole = Design(sampling, 3, 4096, 6, replicates=3).uniforms(0, 4096)
    with ThreadPoolExecutor(4) as pool:
        parts = list(pool.map(lambda k: design.uniforms(k, k + 64), range(0, 4096, 64)))
    assert same(np.concatenate(parts, axis=1), whole)


@pytest.mark.parametrize("replicates", [1, 8])
@pytest.mark.parametrize("sampling", ["sobol", "random"])
def test_more_samples_begin_with_the_same(sampling: Sampling, replicates: int) -> None:
    few, many = (Design(sampling, 1, count, 4, replicates=replicates) for count in (100, 900))
    assert same(few.uniforms(0, 100), many.uniforms(0, 100))


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_another_seed_gives_other_samples(sampling: Sampling) -> None:
    one, other = (Design(sampling, seed, 64, 3).uniforms(0, 64) for seed in (1, 2))
    assert not np.any(one == other)


# ---- evenness


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_numbers_are_uniform_and_neither_0_nor_1(sampling: Sampling) -> None:
    numbers = Design(sampling, 5, 65_536, 6).uniforms(0, 65_536)
    assert numbers.min() > 0.0 and numbers.max() < 1.0
    # 2.2 is passed by 1 in 8000 of random sequences; the even ones stay far below.
    assert max(deviation(row) for row in numbers) < (2.2 if sampling == "random" else 0.1)
    between = np.corrcoef(numbers) - np.eye(6)
    assert np.abs(between).max() < 4.5 / 256.0  # 4.5 sigma of 15 independent pairs: 1 in 10 000


def test_sobol_has_one_sample_in_each_box_of_a_net() -> None:
    """A (0, 2)-sequence: every dyadic box of area 2^-m has one of any 2^m aligned points."""
    points = Sobol(2, 9).columns(256, 512)
    for split in range(9):
        boxes = np.floor(points * np.array([[2.0**split], [2.0 ** (8 - split)]]))
        assert np.unique(boxes, axis=1).shape[1] == 256


def test_each_replicate_is_a_whole_design_of_its_own() -> None:
    """256 points of each scramble of Sobol's sequence fill a net; 35 or 36 samples of each hypercube its strata."""
    points = Design("sobol", 9, 1024, 2, replicates=4).uniforms(0, 1024)
    cubes = Design("latin hypercube", 9, 250, 3, replicates=7).uniforms(0, 250)
    for i in range(4):
        boxes = np.floor(points[:, i::4] * np.array([[16.0], [16.0]]))
        assert np.unique(boxes, axis=1).shape[1] == 256
        assert not same(points[:, i::4], points[:, (i + 1) % 4 :: 4])
    for i in range(7):
        own = cubes[:, i::7]
        count = own.shape[1]
        assert count == len(range(i, 250, 7))
        assert np.array_equal(np.sort(np.floor(own * count), axis=1), np.tile(np.arange(count), (3, 1)))
    assert same(
        Design("latin hypercube", 9, 3, 2, replicates=8).uniforms(0, 3)[:, 1:2],
        Design("latin hypercube", 9, 3, 2, replicates=8).uniforms(1, 2),
    )  # fewer samples than replicates


@pytest.mark.parametrize("samples", [1, 2, 3, 5, 16, 17, 97, 1000, 4097])
def test_a_latin_hypercube_has_one_sample_in_each_stratum(samples: int) -> None:
    points = LatinHypercube(7, 4, samples).columns(0, samples)
    strata = np.sort(np.floor(points * samples), axis=1)
    assert np.array_equal(strata, np.tile(np.arange(samples), (7, 1)))


def test_the_order_of_the_strata_is_random() -> None:
    strata = np.array([np.floor(LatinHypercube(4, seed, 8).columns(0, 1) * 8)[:, 0] for seed in range(2000)])
    counts = np.array([np.bincount(column.astype(int), minlength=8) for column in strata.T])
    chi2 = ((counts - 250.0) ** 2 / 250.0).sum(axis=1)
    assert chi2.max() < 27.0  # 7 degrees of freedom: 1 in 3000 for each of four
    big = np.floor(LatinHypercube(2, 1, 10**9).columns(5 * 10**8, 5 * 10**8 + 4096))
    assert np.all(big == 0.0)  # any part of a large one, in no memory
    steps = np.diff(LatinHypercube(1, 1, 4096).columns(0, 4096)[0])
    assert abs(np.corrcoef(steps[:-1], steps[1:])[0, 1] + 0.5) < 0.07  # of independent numbers: -1/2


def test_random_numbers_are_independent_along_the_samples() -> None:
    numbers = Random(3, 2).columns(0, 40_000)
    for lag in (1, 2, 3):
        assert abs(np.corrcoef(numbers[0, :-lag], numbers[0, lag:])[0, 1]) < 4.5 / 200.0


# ---- designs


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_a_saltelli_design_has_a_b_and_a_with_each_column_of_b(sampling: Sampling) -> None:
    d, samples = 3, 50
    design = Design(sampling, 8, samples, d, sensitivity=True)
    assert design.runs == samples * (d + 2)
    runs = design.uniforms(0, design.runs).reshape(d, samples, d + 2)
    a, b = runs[:, :, 0], runs[:, :, 1]
    assert not np.any(a == b)
    for j in range(d):
        mixed = a.copy()
        mixed[j] = b[j]
        assert np.array_equal(runs[:, :, 2 + j], mixed)
    base = Design(sampling, 8, samples, 2 * d).uniforms(0, samples)
    assert np.array_equal(np.concatenate([a, b]), base)


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_the_copula_has_the_correlations_and_keeps_the_marginals(sampling: Sampling) -> None:
    n = 65_536
    plain = Design(sampling, 6, n, 5).uniforms(0, n)
    numbers = Design(sampling, 6, n, 5, copula=copula((0, 2, 4), THREE)).uniforms(0, n)
    assert np.array_equal(numbers[[1, 3]], plain[[1, 3]])
    found = np.corrcoef(ndtri(numbers))
    expected = np.eye(5)
    expected[np.ix_([0, 2, 4], [0, 2, 4])] = THREE
    assert np.abs(found - expected).max() < 4.5 / 256.0
    assert max(deviation(row) for row in numbers) < 2.2
    assert numbers.min() > 0.0 and numbers.max() < 1.0


def test_cholesky_is_the_factor_and_tells_what_has_none() -> None:
    factor = cholesky(THREE)
    assert factor is not None
    full = np.array([[*row, *[0.0] * (3 - len(row))] for row in factor])
    assert np.abs(full @ full.T - THREE).max() < 1e-15
    assert cholesky([[1.0, 1.0], [1.0, 1.0]]) is None
    assert cholesky([[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]]) is None
