"""Whether a motion moves, and whether its histories belong together: velocity and position are integrals."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.base.number_text import digits, percent
from guideload.base.warnings import LIMITS, WarningText
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion


def motion_texts(motion: Motion, machine: Machine | None = None) -> tuple[str, ...]:
    """The warnings of a motion that need all its samples: of its histories, and of its reading."""
    return (*_rest_warnings(motion, machine), *_history_warnings(motion), *motion.warnings)


def _rest_warnings(motion: Motion, machine: Machine | None) -> Iterator[WarningText]:
    """Warn of a motion that is at rest throughout, unless process forces or riders load the guides."""
    position = None if motion.position is None else motion.position - motion.position[0]
    histories = (motion.acceleration, motion.velocity, position, motion.wrench)
    if any(each is not None and each.any() for each in histories) or (machine is not None and machine.riders):
        return
    source = f"{motion.source}: " if motion.source else ""
    yield WarningText(
        "no motion",
        f"Warning: {source}the cart does not move, every acceleration is 0: the loads "
        "are those at rest. Is it the right column, and the right part of the record?",
    )


def _history_warnings(motion: Motion) -> Iterator[WarningText]:
    """Warn of a velocity that is not the integral of the acceleration, and of a position not that of the velocity.

    The acceleration is linear between the stamps, so the velocity is quadratic. Not of records: their smoothing makes
    all three from the same samples, with differences where these are too far apart or missing, which is told of
    otherwise.
    """
    if motion.recorded:
        return
    step, slope = np.diff(motion.time)[:, None], motion.acceleration
    curved = step**2 / 12.0 * (slope[:-1] - slope[1:])
    source = f"{motion.source}: " if motion.source else ""
    for key, history, of, unit, added, use in (
        (
            "velocity",
            motion.velocity,
            "acceleration",
            "m/s",
            0.0,
            "mean loads and life from the velocity too",
        ),
        ("position", motion.position, "velocity", "m", curved, "what depends on the place from the position"),
    ):
        if history is None:
            return
        parts = step * (slope[1:] + slope[:-1]) / 2.0 + added
        integral = np.concatenate((np.zeros((1, 3)), np.cumsum(parts, axis=0)))
        off, *changes = (np.ptp(each, axis=0).max() for each in (history - integral, history, integral))
        if (largest := max(changes)) and not LIMITS[key].holds(off / largest):
            yield WarningText(
                key,
                f"Warning: {source}the change of the {key} differs from the integral of the {of} by up to "
                f"{digits(off)} {unit}, {percent(off / largest)} of the largest: is one of them in another unit, or "
                f"are the samples too far apart? Loads follow from the acceleration, {use}.",
            )
        slope = history
