"""Are the standard errors and intervals of studies true? `python tests/benchmarks/study_errors.py [--seeds 200]`

Over many seeds: how often the 95 % interval of each estimate holds the truth, the standard error that the study tells
over the scatter of the estimate, and the width of the interval over that of independent samples. Two cases: a product
of 13 lognormal factors, whose truth is a closed form; and the packaged study, whose truth is that of a run of 64 times
as many samples as one study has.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
from scipy import stats

from guideload import Study, run_study
from guideload.cli.inputs import EXAMPLES
from guideload.study import statistics
from guideload.study.sampling import Design, Sampling

LEVELS = (0.05, 0.5, 0.95, 0.99)
NAMES = (*(f"{100 * level:g} %" for level in LEVELS), "mean", "P")
DESIGNS: tuple[tuple[Sampling, int], ...] = (
    ("random", 1),
    ("sobol", 1),
    ("sobol", 8),
    ("sobol", 16),
    ("latin hypercube", 8),
)
COLUMN = "peak_resultant_N"
Rows = np.ndarray  # (estimate, 4): value, low, high, standard error


def estimates(values: np.ndarray, replicates: int, limit: float) -> Rows:
    """Quantiles, mean and probability above a limit."""
    replicate = np.arange(values.size) % replicates if replicates > 1 else None
    found = [*np.transpose(statistics.quantiles(values, LEVELS, replicate=replicate))]
    found.append(np.array(statistics.mean(values, replicate=replicate)))
    counts = (statistics.counted(one, replicate) for one in (values > limit, np.ones(values.size, np.bool_)))
    found.append(np.array([float(part) for part in statistics.probability(*counts)]))
    return np.array(found)


def lines(title: str, of_seeds: Rows, truth: np.ndarray, independent: np.ndarray) -> None:
    """Print coverage, standard error over scatter, and width of the interval over that of independent samples."""
    values, low, high, error = np.moveaxis(of_seeds, 2, 0)
    covered = np.mean((low <= truth) & (truth <= high), axis=0)
    told = np.sqrt(np.nanmean(error**2, axis=0) / np.mean((values - truth) ** 2, axis=0))
    width = np.median(high - low, axis=0) / independent
    for what, numbers in (("covered %", 100 * covered), ("s.e./scatter", told), ("width", width)):
        print(
            f"{title:28s}{what:14s}"
            + "".join(f"{number:8.{0 if what[0] == 'c' else 2}f}" for number in numbers),
            flush=True,
        )
        title = ""


def compare(
    truth: np.ndarray,
    limit: float,
    count: int,
    seeds: int,
    values_of: Callable[[Sampling, int, int], np.ndarray],
) -> None:
    """Print the lines of each design; values_of: of a sampling, a number of replicates and a seed."""
    independent = None
    for sampling, replicates in DESIGNS:
        of_seeds = [values_of(sampling, replicates, seed) for seed in range(seeds)]
        rows = np.array([estimates(values, replicates, limit) for values in of_seeds])
        independent = np.median(rows[:, :, 2] - rows[:, :, 1], axis=0) if independent is None else independent
        lines(f"{sampling}, {replicates} of {count // replicates}", rows, truth, independent)


def products(count: int, seeds: int) -> None:
    """Products of lognormal factors, which are lognormal."""
    weights = 0.3 * 0.8 ** np.arange(13)
    law, limit = stats.lognorm(np.linalg.norm(weights)), 3.0
    truth = np.array([*law.ppf(LEVELS), law.mean(), law.sf(limit)])

    def values(sampling: Sampling, replicates: int, seed: int) -> np.ndarray:
        uniforms = Design(sampling, seed, count, 13, replicates=replicates).uniforms(0, count)
        return np.exp(weights @ stats.norm.ppf(uniforms))

    compare(truth, limit, count, seeds, values)


def machines(count: int, seeds: int) -> None:
    """The peak resultant of the packaged study."""
    described = Study.from_toml(EXAMPLES / "study.toml").model_copy(
        update={"quantities": ("resultant",), "statistics": ("max",), "histories": 0}
    )
    given = {name: getattr(described, name) for name in type(described).model_fields.keys() - {"replicates"}}

    def peaks(**keys: object) -> np.ndarray:
        return run_study(Study(**(given | keys))).column(COLUMN)

    def values(sampling: Sampling, replicates: int, seed: int) -> np.ndarray:
        keys = {} if sampling == "random" else {"replicates": replicates}
        return peaks(samples=count, seed=seed, sampling=sampling, **keys)

    limit = 6800.0
    truth = estimates(peaks(samples=64 * count, seed=10**6), 8, limit)[:, 0]
    compare(truth, limit, count, seeds, values)


def main() -> None:
    parser = argparse.ArgumentParser(description="Coverage of the intervals of studies.")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--samples", type=int, default=2048)
    options = parser.parse_args()
    for title, case in (("Product of 13 lognormal factors", products), ("Packaged study", machines)):
        print(f"\n{title}, {options.samples} samples, {options.seeds} seeds")
        print(" " * 42 + "".join(f"{name:>8s}" for name in NAMES))
        case(options.samples, options.seeds)


if __name__ == "__main__":
    main()
