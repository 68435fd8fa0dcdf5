"""The limit state of a study: how far machines are beyond a limit, as a function of normal scores of their factors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches

import numpy as np
from scipy.special import ndtr

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, ValueRefused, shown
from guideload.base.units import quantity as to_unit
from guideload.study.description.measures import (
    CONTACT,
    LIFE,
    LIMITS,
    MEAN_LOAD,
    PEAK_LOAD,
    QUANTITIES,
    unit_of,
)
from guideload.study.description.plan import Plan
from guideload.study.results.columns import StudyColumns
from guideload.study.sampling.distributions import HIGHEST, LOWEST
from guideload.study.storage.store import Chunk, SampleStore


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
        near = get_close_matches(name, names, n=3, cutoff=0.4) or names[:3]
        raise ArgumentError(
            f"name: expected a quantity of the study, got {shown(name)}; nearest: {', '.join(near)}"
        )
    if stem == CONTACT:
        hint = "nothing tells how near a machine is to lost contact: count it in a study with more samples"
        raise ArgumentError(f"name: expected a quantity with a limit, got {shown(name)}; {hint}")
    limit = plan.metadata.limits.get(stem) if limit is None else limit
    if limit is None:
        raise ArgumentError(f"limit: expected a limit on {name}, as in the table [limits] of a study file")
    try:
        if isinstance(limit, str):
            limit = 1e-3 * to_unit(limit, "m") if stem == LIFE else to_unit(limit, unit_of(stem) or "1")
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
    metadata = plan.metadata
    kept = [i for i, (load, _, statistic) in enumerate(metadata.measures) if (load, statistic) in needed]
    measures, columns = (tuple(of[i] for i in kept) for of in (metadata.measures, metadata.columns))
    return replace(plan, metadata=metadata.model_copy(update={"measures": measures, "columns": columns}))
