"""The 95 % credible band of the life, from the uncertainty of the trace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array
from guideload.life.carriage_life import CarriageLife
from guideload.life.rating_life import system_life
from guideload.life.record import Record
from guideload.motion.uncertainty import COVER

SAMPLES = 20  # drawn motions; the standard deviation of ln life is then known to 16 %


@dataclass(frozen=True, eq=False)
class LifeBand:
    """95 % credible band of the life of each carriage and of the machine, under the true motion.

    lower, upper    (carriage,) m
    machine         m, ends of the band of the machine
    method          method of computation, in words
    """

    lower: Array
    upper: Array
    machine: tuple[float, float]
    method: str


def life_bands(record: Record, carriages: Sequence[CarriageLife]) -> LifeBand | None:
    """The bands; None without uncertainty, or for a result without its run: from a file, a pickle or a deepcopy."""
    lives = [
        [float(one.life_under(one.mean_under(loads[:, one.index]))) for one in carriages]
        for loads in record.result.drawn_loads(SAMPLES)
    ]
    if not lives:
        return None
    samples = np.log(np.column_stack([np.array(lives), [system_life(row) for row in lives]]))
    middle, half = samples.mean(axis=0), COVER * samples.std(axis=0, ddof=1)
    lower, upper = np.exp(middle - half), np.exp(middle + half)
    method = (
        f"{SAMPLES} Monte Carlo samples of the motion run through the scene; mean of ln life over the samples -+ "
        f"{COVER} standard deviations"
    )
    return LifeBand(lower[:-1], upper[:-1], (float(lower[-1]), float(upper[-1])), method)
