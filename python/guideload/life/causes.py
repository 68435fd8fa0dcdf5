"""Why: the causes of the worst load, and the shares of the phases of the cycle in the damage."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from guideload.base.arrays import Array
from guideload.life.mean_load import Travel

PHASES = ("at rest", "speeding up", "constant speed", "braking")
RESTING = 0.01  # of the largest speed: slower is "at rest"
STEADY = 0.05  # of the largest acceleration: less is "constant speed"


class WorstInstant(NamedTuple):
    """The instant of the largest equivalent static load of a carriage, and the shares of its causes."""

    time: float  # s
    load: float  # N, P0 at this instant
    shares: dict[str, float]  # N by cause; their sum is the load, and a negative share relieves the carriage
    noise: float  # N, 1.96 standard deviations of the load from the uncertainty of the trace, or nan
    phase: str  # of the cycle at this instant


def phases(travel: Travel) -> Array:
    """The phase of the cycle in the middle of each of the n - 1 intervals, as index into `PHASES`."""
    velocity = 0.5 * (travel.velocity[:-1] + travel.velocity[1:])
    acceleration = 0.5 * (travel.acceleration[:-1] + travel.acceleration[1:])
    speed, rate = np.abs(velocity), np.abs(acceleration)
    phase = np.where(velocity * acceleration > 0.0, 1, 3)
    phase[rate <= STEADY * np.abs(travel.acceleration).max()] = 2
    phase[speed <= RESTING * np.abs(travel.velocity).max()] = 0
    return phase


def phase_shares(phase: Array, damage: Array) -> dict[str, float]:
    """Share of each phase in the damage; damage: (..., n - 1) of the intervals."""
    amounts = np.bincount(phase, damage.reshape(-1, phase.size).sum(axis=0), len(PHASES))
    total = float(amounts.sum())
    return {
        name: float(amount) / total if total else 0.0 for name, amount in zip(PHASES, amounts, strict=True)
    }
