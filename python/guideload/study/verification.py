"""Verification of a study: some of its samples are solved again, by another method or more tightly.

As in `guideload.audit.verification`, the second solution is under a slightly changed motion, so that it shows both the
error of a sample and its sensitivity; where it differs, a third one under the motion itself separates them.
"""

from __future__ import annotations

import numpy as np

from guideload.audit.verification import PERTURBATION, SENSITIVE, explained_error, tighter
from guideload.base.arrays import Array, Indices
from guideload.base.errors import GuideloadError
from guideload.base.methods import METHODS
from guideload.study.metadata import StudyVerification
from guideload.study.plan import Plan
from guideload.study.quantities import QUANTITIES
from guideload.study.result import StudyResult

SHARE = 400  # one of so many samples is solved again; a second solution may cost ten times the first
# Samples: 20 find with 95 % what happens in one of seven, 200 what happens in one of 67.
FEWEST, MOST = 20, 200
# Exact where no contact is preloaded.
EXACT_IF_LINEAR = ("auto", *(name for name, of in METHODS.items() if of.exact_if_linear))


def verify_study(plan: Plan, result: StudyResult, threads: int) -> StudyVerification | str:
    """Verify a finished study; text if there is nothing to compare, or if it failed."""
    try:
        return _verify(plan, result, threads)
    except GuideloadError as error:  # the samples are done, and stay
        return f"it failed: {error}"


def _verify(plan: Plan, result: StudyResult, threads: int) -> StudyVerification | str:
    level = plan.metadata.machine.scene.model_level
    method, rtol = plan.metadata.method, plan.metadata.rtol
    linear = level == "linear" and all(
        target[0] != "law" or target[2] == "stiffness" for target, *_ in plan.changes
    )
    if linear and method in EXACT_IF_LINEAR:
        return "not needed, all springs are linear"
    samples = samples_solved_again(plan, result)
    if not samples.size:
        return "no sample has a result"
    if level != "smooth nonlinear":
        other = "exact"
    else:  # auto: exponential, and beside edges rk45, or implicit where the sample is stiff
        other = "auto" if method == "implicit" else "implicit"
    exact = other == "exact" and method in EXACT_IF_LINEAR
    explained = explained_error({"method": "exact" if exact else method, "rtol": rtol})
    tight = tighter(rtol)
    perturbation = PERTURBATION if other == "exact" else max(PERTURBATION, tight)
    values = np.vstack([plan.values(i, i + 1) for i in samples.tolist()])
    first, _ = plan.batch_of_links(method, rtol, 1.0).run(values, threads)
    second, failures = plan.batch_of_links(other, tight, 1.0 + perturbation).run(values, threads)
    size = np.abs(first).max(axis=1)
    difference = sensitivity = _change(first, second, size)
    far = np.flatnonzero(difference > min(explained, SENSITIVE))
    if far.size:
        third, _ = plan.batch_of_links(other, tight, 1.0).run(values[far], threads)
        difference, sensitivity = difference.copy(), sensitivity.copy()
        difference[far] = _change(first[far], third, size[far])
        sensitivity[far] = _change(second[far], third, size[far])
    unpredictable = sensitivity > SENSITIVE
    doubtful = ~(difference <= explained) & ~unpredictable & ~np.isnan(second).any(axis=1)
    worst, most = int(np.argmax(np.nan_to_num(difference))), int(np.argmax(np.nan_to_num(sensitivity)))
    return StudyVerification(
        method=other,
        rtol=tight,
        perturbation=perturbation,
        explained=explained,
        solved=len(samples) - len(failures),
        failed=len(failures),
        reason=failures[0][1] if failures else "",
        doubtful=int(np.count_nonzero(doubtful)),
        unpredictable=int(np.count_nonzero(unpredictable)),
        difference=float(np.nan_to_num(difference[worst])),
        difference_in=int(samples[worst]),
        sensitivity=float(np.nan_to_num(sensitivity[most])),
        sensitivity_in=int(samples[most]),
    )


def samples_solved_again(plan: Plan, result: StudyResult) -> Indices:
    """Samples with a result, ascending: the worst of the leading quantity, and others at random by the seed."""
    count = min(max(FEWEST, plan.runs // SHARE), MOST, plan.runs)
    seed = np.random.SeedSequence(plan.metadata.seed or 0, spawn_key=(2,))  # 0 and 1 are those of the draws
    chosen = np.random.default_rng(seed).choice(plan.runs, count, replace=False)
    leading = result.of_all_runs(result.leading)
    known = ~np.isnan(leading)
    if not known.any():
        return np.empty(0, np.intp)
    quantity = QUANTITIES[result.leading.partition("[")[0]]
    worst = np.nanargmin(leading) if quantity.smallest_is_worst else np.nanargmax(leading)
    return np.unique(np.append(chosen[known[chosen]], worst))


def _change(one: Array, other: Array, size: Array) -> Array:
    """(sample,) largest difference of the peaks, over the largest load of the sample."""
    change: Array = np.abs(one - other).max(axis=1) / np.where(size > 0.0, size, 1.0)
    return change
