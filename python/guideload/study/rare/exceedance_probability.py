"""`exceedance_probability`: the probability, however small, that a machine of a study exceeds a limit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike

import numpy as np
from scipy.stats import chi2, t

from guideload.base.arguments import checked, whole_number
from guideload.base.arrays import Array
from guideload.base.cores import cores
from guideload.base.errors import ArgumentError
from guideload.base.number_text import percent, scientific
from guideload.study.description.plan import Plan
from guideload.study.description.study import Study
from guideload.study.rare.limit_state import LimitState
from guideload.study.rare.subset_simulation import SAMPLES, subset_simulation

FIRST = 10  # populations of the first round: their scatter is known to a quarter
LEAST = 1e-9  # probability: the tails of measured parameters are not known farther out
TARGET = 0.1
CONFIDENCE = 0.75  # of the upper limit of the true scatter, from which the number of populations follows
MOST_RUNS = 1_000_000
FAILED = 0.01  # share of the runs without a value above which a doubt says so

Progress = Callable[[int], None]  # takes the number of runs so far


@dataclass(frozen=True)
class RareProbability:
    """Probability that a quantity exceeds a limit, from independent populations of a subset simulation.

    name, limit               quantity of the machine or a carriage, and its limit in its unit
    probability               mean of the populations
    coefficient_of_variation  its standard error, from the scatter of the populations, over the probability
    low, high                 95 % interval (Student's t, of the logarithm)
    populations, runs         their number, and the machines that were run
    doubts                    why the estimate cannot be trusted, in sentences; empty if it can
    """

    name: str
    limit: float
    probability: float
    coefficient_of_variation: float
    low: float
    high: float
    populations: int
    runs: int
    seed: int
    doubts: tuple[str, ...]


@checked
def exceedance_probability(
    study: Study | Plan | str | PathLike[str],
    name: str,
    limit: float | str | None = None,
    *,
    coefficient_of_variation: float = TARGET,
    most_runs: int = MOST_RUNS,
    threads: int | None = None,
    progress: Progress | None = None,
) -> RareProbability:
    """Probability that machines of a study exceed a limit, by subset simulation; for probabilities down to 1e-9.

    study     a study, its plan or its file; its number of samples does not matter
    name      a quantity of the machine, "peak_resultant_N", or of a carriage, "peak_resultant_N[2b]"; a life or a
              static safety exceeds its limit if it is below
    limit     in the unit of the quantity, or text with a unit; by default that of the study
    coefficient_of_variation  populations are run until it is at most so large
    most_runs no population begins that would need more runs; the first ten run in any case
    threads   by default one per core; the result does not depend on them
    progress  called repeatedly with the number of runs so far

    Raises ArgumentError, and for a file what Study.from_toml raises.
    """
    if isinstance(study, str | PathLike):
        study = Study.from_toml(study)
    plan = study.plan() if isinstance(study, Study) else study
    if not 1e-6 <= coefficient_of_variation < 1.0:
        expected = "expected a number from 1e-6 to 1, e.g. 0.1"
        raise ArgumentError(f"coefficient_of_variation: {expected}, got {coefficient_of_variation!r}")
    most_runs = whole_number("most_runs", most_runs, FIRST * SAMPLES)
    state = LimitState(plan, name, limit, whole_number("threads", cores() if threads is None else threads))

    def margin(scores: Array) -> Array:
        margins = state(scores)
        if progress is not None:
            progress(state.runs)
        return margins

    seed, factors = plan.metadata.seed or 0, len(plan.factors)
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(4,)))
    estimates = subset_simulation(margin, factors, FIRST, LEAST, generator)
    each = state.runs / FIRST
    while estimates.any():
        # Few populations may scatter little by chance, so their number follows from an upper limit of the true scatter.
        larger = np.sqrt((estimates.size - 1) / chi2.ppf(1.0 - CONFIDENCE, estimates.size - 1))
        wanted = np.ceil(estimates.size * (larger * _variation(estimates) / coefficient_of_variation) ** 2)
        more = int(min(wanted - estimates.size, 3 * estimates.size, (most_runs - state.runs) / each))
        if more < 1:
            break
        estimates = np.append(estimates, subset_simulation(margin, factors, more, LEAST, generator))
    probability = float(estimates.mean())
    variation = _variation(estimates)
    factor = float(np.exp(t.ppf(0.975, estimates.size - 1) * variation)) if probability else np.nan
    return RareProbability(
        name=name,
        limit=state.limit,
        probability=probability,
        coefficient_of_variation=variation,
        low=probability / factor if probability else 0.0,
        high=min(probability * factor, 1.0) if probability else LEAST,
        populations=estimates.size,
        runs=state.runs,
        seed=seed,
        doubts=tuple(_doubts(state, estimates, variation, coefficient_of_variation)),
    )


def _variation(estimates: Array) -> float:
    """Coefficient of variation of the mean of independent estimates; NaN if it is 0."""
    mean = estimates.mean()
    return float(estimates.std(ddof=1) / estimates.size**0.5 / mean) if mean else np.nan


def _doubts(state: LimitState, estimates: Array, variation: float, wanted: float) -> list[str]:
    doubts, size = [], estimates.size
    lost = int(np.count_nonzero(estimates == 0.0))
    if lost == size:
        doubts.append(
            f"No population came to the limit: its probability is below {scientific(LEAST)}, or no machine of the "
            "study can exceed it, as with bounded distributions, or the quantity changes in steps so large that no "
            "sample comes nearer."
        )
    elif lost:
        doubts.append(
            f"{lost} of {size} populations did not come to the limit: the quantity changes in steps, or the limit lies "
            f"near {scientific(LEAST)}. The estimate contains them as 0."
        )
    if variation > wanted:
        doubts.append(
            f"The coefficient of variation is {percent(variation)}, not {percent(wanted)}: allow more runs than "
            f"{state.runs}."
        )
    if state.failed > FAILED * state.runs:
        doubts.append(
            f"{state.failed} of {state.runs} runs had no solution and count as not beyond the limit, so that the true "
            f"probability may be higher: {state.reason}"
        )
    return doubts
