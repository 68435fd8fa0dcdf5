"""Are the standard errors and intervals of studies true? `python tests/benchmarks/study_errors.py [--seeds 100]`

The peak resultant of the packaged study, over many seeds: how often the 95 % interval of each estimate holds the truth,
the standard error that the study tells over the scatter of the estimate, and the width of the interval over that of
independent samples. The truth is that of 64 times as many samples as one study has.
"""

from __future__ import annotations

import argparse

import numpy as np

from guideload import Study, run_study
from guideload.cli.inputs import EXAMPLES
from guideload.study import statistics
from guideload.study.sampling import Sampling

SAMPLES, LIMIT = 2048, 6800.0  # N
LEVELS = (0.05, 0.5, 0.95, 0.99)
NAMES = (*(f"{100 * level:g} %" for level in LEVELS), "mean", f"above {LIMIT:.0f} N")
DESIGNS: tuple[tuple[Sampling, int], ...] = (("random", 1), ("sobol", 8), ("sobol", 1))
Rows = np.ndarray  # (estimate, 4): value, low, high, standard error


def estimates(values: np.ndarray, replicates: int) -> Rows:
    """Quantiles, mean and probability above the limit."""
    replicate = np.arange(values.size) % replicates if replicates > 1 else None
    found = [*np.transpose(statistics.quantiles(values, LEVELS, replicate=replicate))]
    found.append(np.array(statistics.mean(values, replicate=replicate)))
    counts = (statistics.counted(one, replicate) for one in (values > LIMIT, np.ones(values.size, np.bool_)))
    found.append(np.array([float(part) for part in statistics.probability(*counts)]))
    return np.array(found)


def lines(title: str, of_seeds: Rows, truth: np.ndarray, independent: np.ndarray) -> None:
    """Print coverage, standard error over scatter, and width of the interval over that of independent samples."""
    values, low, high, error = np.moveaxis(of_seeds, 2, 0)
    covered = np.mean((low <= truth) & (truth <= high), axis=0)
    told = np.sqrt(np.nanmean(error**2, axis=0) / np.mean((values - truth) ** 2, axis=0))
    width = np.median(high - low, axis=0) / independent
    for what, numbers in (("covered", covered), ("s.e./scatter", told), ("width", width)):
        print(f"{title:20s}{what:14s}" + "".join(f"{number:14.2f}" for number in numbers), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=100)
    options = parser.parse_args()
    keys = {"quantities": ("resultant",), "statistics": ("max",), "histories": 0}
    described = Study.from_toml(EXAMPLES / "study.toml").model_copy(update=keys)
    given = {name: getattr(described, name) for name in type(described).model_fields.keys() - {"replicates"}}

    def peaks(**keys: object) -> np.ndarray:
        return run_study(Study(**(given | keys))).column("peak_resultant_N")

    truth = estimates(peaks(samples=64 * SAMPLES, seed=10**6), 8)[:, 0]
    print(" " * 34 + "".join(f"{name:>14s}" for name in NAMES))
    independent = None
    for sampling, replicates in DESIGNS:
        design = {"sampling": sampling} | ({} if sampling == "random" else {"replicates": replicates})
        of_seeds = (peaks(samples=SAMPLES, seed=seed, **design) for seed in range(options.seeds))
        rows = np.array([estimates(values, replicates) for values in of_seeds])
        if independent is None:
            independent = np.median(rows[:, :, 2] - rows[:, :, 1], axis=0)
        lines(f"{sampling}, {replicates} of {SAMPLES // replicates}", rows, truth, independent)


if __name__ == "__main__":
    main()
