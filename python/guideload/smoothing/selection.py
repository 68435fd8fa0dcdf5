"""Orders of the white derivative, tried on the samples and weighted: the candidates of the mixture of `estimation`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from guideload.base.arrays import Array
from guideload.base.cores import cores, threads
from guideload.base.errors import RunError, TraceError
from guideload.smoothing.adaptive import AdaptedModel, adapted, adapted_in_pieces, results
from guideload.smoothing.oscillation import DECAYING, find_oscillator, more_likely
from guideload.smoothing.stationary import ScaledSamples, StationaryFit, fitted

ORDERS = (3, 4, 5, 6)  # of the white derivative of the position
# Factors on the standard deviations, calibrated by tests/benchmarks/encoder.py, by order, without and with an
# oscillator; times ROUNDED if rounding dominates the noise, because its errors are bounded.
SCALE, RINGING_SCALE = {3: 0.78, 4: 0.89, 5: 0.84, 6: 0.97}, {3: 1.0, 4: 1.2}
QUIET, ROUNDED = 0.1, 0.86  # quanta of measurement noise up to which rounding dominates; factor
# Weight of the adapted models in the score of an order; below 1, as they have been fitted to the same samples.
ADAPTED_WEIGHT = 0.5
# Difference of two scores that makes an order e times as probable as another: above 1, as no order is the true model
# and the scores of neighbouring samples err together. Least weight of an order that takes part.
TEMPERATURE, LEAST_WEIGHT = 4.0, 0.01
# Weight of the prior for nearly even densities, and score below the best order's down to which it is tried.
EVEN, TRIED = 1.0, 30.0
# Log density subtracted from the score of an order: jumps of acceleration are rare, but fit coarse samples well.
HANDICAP = {3: 12.0, 4: 0.0, 5: 0.0, 6: 0.0}
# Orders of a drive that the axis follows as an oscillator does, and score by which the best of them must exceed the
# best without an oscillator: two numbers more are fitted.
DRIVEN, RINGING = (3, 4), 8.0
# Strides (as factors of frequency and damping) and moves with which the oscillator is improved on all samples, and
# largest factor on its frequency.
FINE_STRIDES, FINE_MOVES, FINE_RANGE = ((1.03, 1.2), (1.01, 1.07)), 6, 1.2


@dataclass(frozen=True, eq=False)
class MixtureComponent:
    """An order of the white derivative, adapted to all samples, with its weight and its posterior; scaled units."""

    weight: float
    model: AdaptedModel
    mean: Array  # (n, 3) of the state
    variance: Array  # (n,) of the acceleration
    error_variance: Array  # (n,) calibrated variance of the error of the acceleration

    @property
    def order(self) -> int:
        return self.model.smoother.fit.order


class Trial(NamedTuple):
    """An order of the white derivative, adapted to the excerpts, and its score."""

    score: float
    fit: StationaryFit
    predictive: float  # score of the stationary fit
    models: list[AdaptedModel]

    @property
    def rings(self) -> bool:
        """Whether it has an oscillator."""
        return self.fit.oscillator is not None


def weighted(samples: ScaledSamples, taken: int) -> list[MixtureComponent]:
    """The candidates with a weight above 0, the best first. taken: order of the derivative that was sampled, 0 or 1.

    Raises TraceError if no order survives rounding.
    """
    excerpts = samples.excerpts(2 - taken)
    trials = _trials(excerpts, taken)
    # An oscillator is used only if it is much more likely. Without it none has one.
    rings = _best(trials, True) - RINGING > _best(trials, False)
    eligible = [trial for trial in trials if trial.rings == rings]
    # The scores are those of the excerpts; that of all samples grows with their number.
    whole = samples.value.size / sum(part.value.size for part in excerpts)
    while eligible:
        scores = np.array([trial.score for trial in eligible])
        weights = np.exp((scores - scores.max()) * whole / TEMPERATURE)
        weights[weights < LEAST_WEIGHT] = 0.0
        weights /= weights.sum()
        candidates: list[MixtureComponent] = []
        for number in np.argsort(-scores)[: np.count_nonzero(weights)]:
            try:
                candidates.append(_component(samples, eligible[number], float(weights[number])))
            except RunError:  # beyond the range of numbers: the others are weighted anew
                del eligible[number]
                break
        else:
            return candidates
    steps = samples.step * samples.time_unit
    raise TraceError(
        f"smoothing: no order survives rounding on steps of time from {steps.min():.3g} to {steps.max():.3g} s; "
        "cut the trace at its longest gaps or leave out samples that lie very close together"
    )


def _trials(excerpts: list[ScaledSamples], taken: int) -> list[Trial]:
    """The orders that survive rounding, with an oscillator too if the samples show one.

    The best are tried with nearly even densities as well.
    """
    with threads(cores()) as submit:
        plain = [StationaryFit(order, taken) for order in ORDERS]
        tried = dict(zip(ORDERS, results(submit, lambda model: _tried(excerpts, model), plain), strict=True))
        trials = _sound(tried.values())
        driven = [trial.fit for trial in _sound(tried[order] for order in DRIVEN)]
        oscillator = find_oscillator(excerpts, driven, submit)
        if oscillator:
            # Else an order that jumps could take noise for jumps.
            noise = max(trials, key=lambda trial: trial.score).models[0].fit.noise
            noisy = [replace(part, least_noise=max(part.least_noise, 0.5 * noise)) for part in excerpts]
            driving = [StationaryFit(order, taken, oscillator=oscillator) for order in DRIVEN]
            ringing = _sound(results(submit, lambda model: _ringing(noisy, model), driving))
            least, most = DECAYING
            trials += [
                it for it in ringing if it.fit.oscillator and least <= it.fit.oscillator.damping <= most
            ]
        near = [trial for trial in trials if trial.score > _best(trials, trial.rings) - TRIED]
        return trials + _sound(results(submit, lambda trial: _adapted(excerpts, trial, EVEN), near))


def _sound(trials: Iterable[Trial | None]) -> list[Trial]:
    """Those that survived rounding."""
    return [trial for trial in trials if trial is not None]


def _component(samples: ScaledSamples, trial: Trial, weight: float) -> MixtureComponent:
    """The trial adapted to all samples. Raises RunError if its numbers do not survive rounding."""
    if trial.models[0].segment.size == samples.step.size:  # it is of all samples already
        model = trial.models[0].with_jumps_located()
    else:
        prior = float(np.mean([model.weight for model in trial.models]))
        model = adapted_in_pieces(samples, trial.fit, prior)
    mean, variances = model.smoother.smooth((model.segment, model.fit.density), model.coloured_sites)
    variance = variances[:, trial.fit.acceleration]
    quiet = model.fit.noise < QUIET**2 * samples.quantum
    scales = RINGING_SCALE if trial.rings else SCALE
    scale = scales[trial.fit.order] * (ROUNDED if quiet else 1.0)
    error_variance = scale**2 * variance * model.error_share(variance)
    return MixtureComponent(weight, model, mean, variance, error_variance)


def _best(trials: list[Trial], rings: bool) -> float:
    """The best score of those with an oscillator, or without."""
    return max((trial.score for trial in trials if trial.rings == rings), default=-np.inf)


def _tried(excerpts: list[ScaledSamples], model: StationaryFit) -> Trial | None:
    """The stationary fit of an order, adapted with the weight of the prior that the samples suggest.

    None if it does not survive rounding.
    """
    try:
        fit, predictive = fitted(excerpts, model)
    except RunError:  # beyond the range of numbers
        return None
    if not (np.isfinite(predictive) and 0.0 < fit.time_constant < np.inf):  # long gaps, beyond doubles
        return None
    return _adapted(excerpts, Trial(0.0, fit, predictive, []), None)


def _ringing(excerpts: list[ScaledSamples], model: StationaryFit) -> Trial | None:
    """The same with an oscillator, whose frequency and damping are improved with the adapted densities."""
    assert model.oscillator is not None
    trial, fastest = _tried(excerpts, model), FINE_RANGE * model.oscillator.frequency
    for strides in FINE_STRIDES:
        if trial is None:
            break
        parts = [(part, each.segment, each.fit) for part, each in zip(excerpts, trial.models, strict=True)]
        moved, _ = more_likely(trial.fit, parts, strides, FINE_MOVES, fastest)
        after = _tried(excerpts, replace(model, oscillator=moved))
        if after is None:
            break
        trial = after
    return trial


def _adapted(excerpts: list[ScaledSamples], trial: Trial, weight: float | None) -> Trial | None:
    """The trial adapted with this weight of the prior; None if it does not survive rounding."""
    try:
        models = [adapted(part, trial.fit, weight) for part in excerpts]
    except RunError:  # beyond the range of numbers
        return None
    after = sum(float(model.fit.predictive.sum()) for model in models)
    if not (np.isfinite(after) and all(np.isfinite(model.fit.density).all() for model in models)):
        return None
    score = trial.predictive + ADAPTED_WEIGHT * after - HANDICAP[trial.fit.order]
    return trial._replace(score=score, models=models)
