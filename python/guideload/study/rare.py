"""`exceedance_probability`: the probability, however small, that a machine of a study exceeds a limit.

By subset simulation (Au and Beck 2001): a small probability as a product of larger ones, each of the next level.
Several independent populations run side by side, so that their scatter gives the error of their mean. Each starts with
independent samples; the best tenth of them start Markov chains that stay beyond the level which they have reached, by
conditional sampling with a step adapted to the acceptance (Papaioannou et al. 2015). It needs no gradient and finds
all regions that its samples reach, and its work grows with the logarithm of the probability.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from os import PathLike

import numpy as np
from scipy.special import ndtr
from scipy.stats import chi2, t

from guideload.base.arguments import checked, whole_number
from guideload.base.arrays import Array, Indices
from guideload.base.cores import cores
from guideload.base.errors import ArgumentError, ValueRefused, shown
from guideload.base.number_text import digits, percent, scientific
from guideload.study.columns import StudyColumns, nearest
from guideload.study.distributions import HIGHEST, LOWEST
from guideload.study.plan import Plan
from guideload.study.quantities import CONTACT, LIMITS, MEAN_LOAD, PEAK_LOAD, QUANTITIES, require_limit
from guideload.study.statistics import probability as probability_of
from guideload.study.storage import Chunk, SampleStore
from guideload.study.study import Study, make_plan

# ---- subset simulation


Margin = Callable[[Array], Array]  # (n, factors) normal scores to (n,) margins, positive beyond the limit

SAMPLES = 2000  # of a population at a level: the bias of the product falls with them, here to 1 or 2 %
SHARE = 0.1  # of the samples that start chains: the usual value; work is nearly the same from 0.1 to 0.3
ACCEPTED = 0.44  # share of accepted candidates at which chains forget fastest (Papaioannou et al. 2015)
FIRST_STEP = 0.6


def subset_simulation(
    margin: Margin, factors: int, populations: int, least: float, generator: np.random.Generator
) -> tuple[Array, Array]:
    """(populations,) independent estimates of the probability that the margin of normal scores is positive, and bounds.

    An estimate is 0 below the probability `least`, which is then the bound, or if its samples do not get on towards
    the limit: the bound is then that of an event which occurred in none of so many samples, at 95 %.
    """
    scores = generator.standard_normal((populations, SAMPLES, factors))
    margins = _margins(margin, scores)
    estimates, level = np.ones(populations), np.full(populations, -np.inf)
    bounds, never = np.full(populations, least), float(probability_of(0, SAMPLES).high)
    active = np.arange(populations)
    starts = np.empty((populations, int(SHARE * SAMPLES)), np.intp)
    while active.size:
        for i in active:
            starts[i], level[i], share = _next_level(margins[i], float(level[i]), starts.shape[1], generator)
            bounds[i] = least if share else estimates[i] * never
            estimates[i] *= share
        estimates[estimates < least] = 0.0
        active = active[(level[active] <= 0.0) & (estimates[active] > 0.0)]
        if active.size:
            first = starts[active, :, None]
            begin = (
                np.take_along_axis(scores[active], first, 1),
                np.take_along_axis(margins[active], first[..., 0], 1),
            )
            scores[active], margins[active] = _chains(margin, *begin, level[active, None], generator)
    return estimates, bounds


def _next_level(
    margins: Array, level: float, count: int, generator: np.random.Generator
) -> tuple[Indices, float, float]:
    """Samples that start chains, the next level (infinite beyond the limit), and the share of samples beyond it.

    The share is 0 if no sample is beyond the present level.
    """
    beyond = margins > 0.0
    if beyond.mean() >= SHARE:
        return np.zeros(count, np.intp), np.inf, float(beyond.mean())
    threshold = float(np.partition(margins, -count)[-count])
    if threshold <= level:  # many samples have the same margin
        higher = margins[margins > level]
        threshold = float(higher.min()) if higher.size else np.inf
    if threshold > 0.0:  # the next higher margins are beyond the limit already, or there are none
        return np.zeros(count, np.intp), np.inf, float(beyond.mean())
    inside = np.flatnonzero(margins >= threshold)
    chosen = generator.permutation(inside)[:count]
    return np.resize(chosen, count), threshold, inside.size / margins.size


def _chains(
    margin: Margin, scores: Array, margins: Array, level: Array, generator: np.random.Generator
) -> tuple[Array, Array]:
    """Samples (population, SAMPLES) beyond the levels, from chains that start at these, side by side."""
    steps = np.full((len(scores), 1, 1), FIRST_STEP)
    all_scores, all_margins = [scores], [margins]
    for step in range(1, round(1 / SHARE)):
        noise = generator.standard_normal(scores.shape)
        candidates = np.sqrt(1.0 - steps**2) * scores + steps * noise
        found = _margins(margin, candidates)
        accepted = found >= level
        scores = np.where(accepted[..., None], candidates, scores)
        margins = np.where(accepted, found, margins)
        all_scores.append(scores)
        all_margins.append(margins)
        rate = accepted.mean(axis=1)[:, None, None]
        steps = np.minimum(steps * np.exp((rate - ACCEPTED) / np.sqrt(step)), 1.0)
    return np.concatenate(all_scores, axis=1), np.concatenate(all_margins, axis=1)


def _margins(margin: Margin, scores: Array) -> Array:
    return margin(scores.reshape(-1, scores.shape[-1])).reshape(scores.shape[:-1])


# ---- the limit state of a study


class LimitState:
    """Margins of machines beyond a limit; calling it runs them in the core's batch.

    name    quantity of the machine ("peak_resultant_N") or of a carriage ("peak_resultant_N[2b]")
    limit   in its unit
    runs    machines that were run
    failed  those without a value, which count as not beyond the limit; reason: why the first of them has none
    """

    def __init__(self, plan: Plan, name: str, limit: float | str | None, threads: int) -> None:
        if plan.design is None:
            raise ArgumentError(
                "probability: expected a study of varied parameters, got given cases, which have no probability"
            )
        if plan.metadata.draws_motion:
            raise ArgumentError(
                "probability: expected the same motion for all samples, got one drawn from the posterior of the trace "
                "(motion.posterior), whose thousands of numbers a subset simulation cannot follow: set it to false, or "
                "count the samples beyond the limit in a study with many of them"
            )
        drive = plan.metadata.machine.drive
        if drive is not None and drive.push_direction is not None:
            raise ArgumentError(
                "probability: expected a drive without pressure_angle, whose push would be the same in all samples; "
                "leave pressure_angle and push_direction out and add the push to the process forces, which "
                "motion.force_scale varies, or run machines of your own draws by themselves"
            )
        self.name, self.threads = name, threads
        self.limit, self.sign = _limit(plan, name, limit)
        self.plan = _recording(plan, name)
        self.runs, self.failed, self.reason = 0, 0, ""

    def __call__(self, scores: Array) -> Array:
        """(n,) margins of normal scores (n, factors): positive beyond the limit; -inf without a solution."""
        values = self.plan.values_at(np.clip(ndtr(scores.T), LOWEST, HIGHEST))
        rows, failed = self.plan.batch().run(values, self.threads)
        self.runs += len(values)
        metadata = self.plan.metadata.model_copy(update={"runs": len(values), "sensitivity": False})
        store = SampleStore(metadata)
        store.add(Chunk(0, values, rows, dict(failed)))
        margins = self.sign * (StudyColumns(store, metadata).column(self.name) - self.limit)
        unknown = np.isnan(margins)
        self.failed += int(unknown.sum())
        if unknown.any():
            self.reason = self.reason or (failed[0][1] if failed else f"{self.name} is not a number")
        return np.where(unknown, -np.inf, margins)


def wanted_limits(plan: Plan, given: Sequence[str]) -> dict[str, float | str]:
    """Limits by quantity: those in texts such as "peak_resultant[2b]=9 kN", or all of the study without any.

    Raises ArgumentError.
    """
    limits: dict[str, float | str] = {}
    for text in given:
        key, equals, value = text.partition("=")
        stem, bracket, carriage = key.strip().partition("[")
        if not equals or stem not in LIMITS:
            known = f"a known NAME, one of {', '.join(LIMITS)}"
            raise ArgumentError(
                f'--limit: expected NAME=VALUE such as "peak_resultant=9 kN", with {known}; got {text!r}'
            )
        limits[f"{LIMITS[stem].name}{bracket}{carriage}"] = value.strip()
    if not given:
        limits |= plan.metadata.limits
    if not limits:
        raise ArgumentError(
            '--limit: expected a limit, e.g. "peak_resultant=9 kN"; the study has no table [limits]'
        )
    return limits


def _limit(plan: Plan, name: str, limit: float | str | None) -> tuple[float, float]:
    """The limit in the unit of the quantity; and 1, or -1 if values below the limit exceed it."""
    stem = name.partition("[")[0]
    columns = StudyColumns(SampleStore(plan.metadata), plan.metadata)
    names = [one for one in columns.names() if QUANTITIES[one.partition("[")[0]].worse is not None]
    if name not in names:
        hint = nearest(name, names)
        raise ArgumentError(f"name: expected a quantity of the study, got {shown(name)}; {hint}")
    if stem == CONTACT:
        hint = "nothing tells how near a machine is to lost contact: count it in a study with more samples"
        raise ArgumentError(f"name: expected a quantity with a limit, got {shown(name)}; {hint}")
    limit = plan.metadata.limits.get(stem) if limit is None else limit
    if limit is None:
        raise ArgumentError(f"limit: expected a limit on {name}, as in the table [limits] of a study file")
    try:
        require_limit(QUANTITIES[stem], plan.metadata.machine, limit)
        if isinstance(limit, str):
            limit = QUANTITIES[stem].limit(limit, plan.metadata.repetition)
        limit = float(limit)
        if not np.isfinite(limit):
            raise ValueRefused("a finite number", limit)
    except ValueRefused as refused:
        raise ArgumentError(f"limit on {name}: {refused}") from None
    return float(limit), -1.0 if QUANTITIES[stem].smallest_is_worst else 1.0


def _recording(plan: Plan, name: str) -> Plan:
    """The plan that records only what the quantity needs."""
    needed = set(QUANTITIES[name.partition("[")[0]].sources)
    if needed & {MEAN_LOAD, PEAK_LOAD}:
        needed |= {MEAN_LOAD, PEAK_LOAD}  # together they say that carriages have ratings
    measures = tuple(one for one in plan.metadata.measures if (one[0], one[2]) in needed)
    return replace(plan, metadata=plan.metadata.model_copy(update={"measures": measures}))


# ---- the probability


# Populations before the others: if no machine reaches the limit, these tell it in a third of the time.
PILOTS = 3
FIRST = 10  # populations of the first estimate: their scatter is known to a quarter
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
    low, high                 95 % interval (Student's t, of the logarithm); from 0 if no population came to the limit
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

    Parameters
    ----------
    study
        A study, its plan or its file; its number of samples does not matter.
    name
        A quantity of the machine, "peak_resultant_N", or of a carriage, "peak_resultant_N[2b]"; a life or a static
        safety exceeds its limit if it is below.
    limit
        In the unit of the quantity, or text with a unit; by default that of the study.
    coefficient_of_variation
        Populations are run until it is at most so large.
    most_runs
        Maximum runs for this limit, at least 20 000; the first ten populations may exceed it.
    threads
        By default one per core; the result does not depend on them.
    progress
        Called repeatedly with the number of runs so far.

    Raises
    ------
    ArgumentError
        For an unknown quantity, a limit that does not fit, and a study without distributions.

    For a file also what `Study.from_toml` raises.
    """
    plan = make_plan(study)
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
    (estimates, bounds), more = subset_simulation(margin, factors, PILOTS, LEAST, generator), FIRST - PILOTS
    while estimates.any() and more >= 1:
        estimates = np.append(estimates, subset_simulation(margin, factors, more, LEAST, generator)[0])
        # Few populations may scatter little by chance, so their number follows from an upper limit of the true scatter.
        larger = np.sqrt((estimates.size - 1) / chi2.ppf(1.0 - CONFIDENCE, estimates.size - 1))
        wanted = np.ceil(estimates.size * (larger * _variation(estimates) / coefficient_of_variation) ** 2)
        affordable = (most_runs - state.runs) * estimates.size / state.runs
        more = int(min(wanted - estimates.size, 3 * estimates.size, affordable))
    probability = float(estimates.mean())
    variation = _variation(estimates)
    factor = float(np.exp(t.ppf(0.975, estimates.size - 1) * variation)) if probability else np.nan
    high = min(probability * factor, 1.0) if probability else float(bounds.max())
    return RareProbability(
        name=name,
        limit=state.limit,
        probability=probability,
        coefficient_of_variation=variation,
        low=probability / factor if probability else 0.0,
        high=high,
        populations=estimates.size,
        runs=state.runs,
        seed=seed,
        doubts=tuple(_doubts(state, estimates, variation, coefficient_of_variation, high)),
    )


def _variation(estimates: Array) -> float:
    """Coefficient of variation of the mean of independent estimates; NaN if it is 0."""
    mean = estimates.mean()
    return float(estimates.std(ddof=1) / estimates.size**0.5 / mean) if mean else np.nan


def _doubts(state: LimitState, estimates: Array, variation: float, wanted: float, high: float) -> list[str]:
    doubts, size = [], estimates.size
    lost = int(np.count_nonzero(estimates == 0.0))
    if lost == size and high > LEAST:
        doubts.append(
            "No population came to the limit: the quantity changes in steps so large, as with measured values, that no "
            f"sample came nearer. So many runs only show that its probability is at most {digits(high, 2)}."
        )
    elif lost == size:
        doubts.append(
            f"No population came to the limit: its probability is below {scientific(LEAST)}, or no machine of the "
            "study can exceed it, as with bounded distributions."
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
