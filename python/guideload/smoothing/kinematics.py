"""What all smoothing methods share: their result, the checks of the samples, the warning about noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arguments import require_unmasked
from guideload.base.arrays import Array, check_finite
from guideload.base.errors import TraceError
from guideload.base.number_text import counted
from guideload.base.warnings import LIMITS

Kind = Literal["position", "velocity"]
UNIT = {"position": "m", "velocity": "m/s"}

FEWEST = 8
SPAN = 100  # usual steps: more than the smoothing spans
STILL_QUANTA = 2.5  # largest change at rest: two quanta, and their rounding


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Motion at the time stamps of the samples."""

    position: Array  # (n,) m; for samples of velocity it starts at 0
    velocity: Array  # (n,) m/s
    acceleration: Array  # (n,) m/s2
    bandwidth: float  # Hz, at which a change of acceleration has half amplitude; inf if unknown
    note: str  # method and parameters, as text


Motion = TypeVar("Motion", bound=Kinematics)


def checked_samples(time: ArrayLike, value: ArrayLike, kind: Kind) -> tuple[Array, Array]:
    """Time stamps (n,) s and samples (n,) as float64.

    Raises TraceError for an unknown kind, shapes that do not agree, fewer than 8 samples, numbers that are not finite,
    and times that do not increase.
    """
    require_unmasked("time", time)
    require_unmasked("value", value)
    stamps, samples = np.asarray(time, float), np.asarray(value, float)
    if kind not in get_args(Kind):
        raise TraceError(f'smoothing: kind: expected one of {", ".join(get_args(Kind))}, got "{kind}"')
    if stamps.ndim != 1 or samples.shape != stamps.shape:
        raise TraceError(f"smoothing: expected one value per stamp, got {samples.shape} and {stamps.shape}")
    if stamps.size < FEWEST:
        raise TraceError(f"smoothing: expected at least {FEWEST} samples, got {stamps.size}")
    for name, numbers in (("time", stamps), ("value", samples)):
        check_finite(f"smoothing: {name}", numbers)
    back = np.flatnonzero(np.diff(stamps) <= 0.0) + 1
    if back.size:
        before, here = stamps[back[0] - 1 : back[0] + 1].tolist()
        raise TraceError(f"smoothing: time[{back[0]}]: expected more than {before!r} s, got {here!r}")
    return stamps, samples


def constant_motion(time: Array, value: Array, kind: Kind) -> Kinematics:
    """The motion if all samples are equal: standstill, or constant speed."""
    zero = np.zeros_like(value)
    if kind == "position":
        return Kinematics(value.copy(), zero, zero, np.inf, "the axis stands still: all samples are equal")
    position = value * (time - time[0])
    return Kinematics(position, value.copy(), zero, np.inf, "constant speed: all samples are equal")


def travel(time: Array, velocity: Array, acceleration: Array | None = None) -> Array:
    """Position (n,) m from 0: by cubic Hermite velocity between stamps; without acceleration by trapezoids."""
    step = np.diff(time)
    parts = 0.5 * (velocity[1:] + velocity[:-1]) * step
    if acceleration is not None:
        parts += (acceleration[:-1] - acceleration[1:]) * step**2 / 12.0
    return np.concatenate([[0.0], np.cumsum(parts)])


def across_gaps(motion: Motion, time: Array, value: Array, kind: Kind, quantum: float) -> Motion:
    """The motion, at constant speed across each gap in the samples that is longer than `SPAN` usual steps.

    The samples before such a gap show nothing of those after it, and the least speed that the smoothing leaves at its
    ends would be kilometres after hours. The speed is that of the change of position, or 0 for a change of up to
    `STILL_QUANTA` quanta. Samples of speed do not show the way: the cart stands still.

    time, value (n,): the samples; quantum: of the value, 0 if unknown.
    """
    step = np.diff(time)
    gaps = np.flatnonzero(step > SPAN * np.median(step))
    if not gaps.size:
        return motion
    velocity, acceleration, position = motion.velocity.copy(), motion.acceleration.copy(), motion.position
    way = np.diff(value)[gaps] if kind == "position" else np.zeros(gaps.size)
    speed = np.where(np.abs(way) > STILL_QUANTA * quantum, way / step[gaps], 0.0)
    for ends in (gaps, gaps + 1):
        velocity[ends], acceleration[ends] = speed, 0.0
    if kind == "velocity":
        position = travel(time, velocity, acceleration)
    moves = "moves at constant speed" if speed.any() else "stands still"
    note = f"{motion.note}; the cart {moves} across {counted(gaps.size, 'gap')} of over {SPAN} steps"
    return replace(motion, position=position, velocity=velocity, acceleration=acceleration, note=note)


def noise_warning(noise: float, value: Array, quantum: float, step: float) -> str:
    """Warning if `noise` (rms, in the unit of the samples) is too large for an encoder, or "".

    step: s, median time between samples.
    """
    share = noise / float(np.ptp(value))
    if LIMITS["noise"].holds(share) or noise <= quantum:
        return ""
    return (
        f"the noise is {100 * share:.2g} % of the signal's range, so the trace is very noisy or too coarse for its "
        f"moves (a sample every {step:.3g} s): the acceleration is cut"
    )
