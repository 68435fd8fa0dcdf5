"""Uncertainty of an estimated acceleration: the posterior of a state-space model, given the samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from guideload._core import draw_motion
from guideload.base.arrays import Array, ReadOnlyArrays, read_only

Segments = NDArray[np.uint32]

COVER, TAIL = 1.96, 0.025  # standard deviations of the 95 % band, and the probability on either side of it
# As the core takes them: frequency, damping ratio, index of the acceleration; step, variance, covariance, segment,
# density, oscillator.
OscillatorOfModel: TypeAlias = tuple[float, float, int]
StateSpaceModel: TypeAlias = tuple[Array, Array, Array, Segments, Array, OscillatorOfModel | None]


@dataclass(frozen=True, eq=False)
class Uncertainty(ReadOnlyArrays):
    """Posterior deviation of the acceleration from its estimate at n time stamps, given the samples.

    The state has N numbers: the position and its first N - 1 derivatives (for samples of velocity: the velocity and its
    derivatives). The N-th derivative is white process noise. With an oscillator the last numbers are others
    (`SampledModel` in _core.pyi). Time and values are scaled to be of order 1.
    """

    step: Array  # (n - 1,) time to the next stamp
    variance: Array  # (n,) of the measurement noise
    covariance: Array  # (N, N) of the state before the first sample
    segment: Segments  # (n - 1,) segment of each interval
    density: Array  # (segments,) process-noise density
    derivative: int  # index of the acceleration in the state
    unit: Array  # (n,) m/s2 per scaled unit of the acceleration; larger where the orders of the model differ
    # (n,) s, or None for the stamps of the motion. Deviations are linear between stamps
    time: Array | None = None
    # frequency in radians per scaled unit of time, damping ratio, index of the acceleration; None without
    oscillator: OscillatorOfModel | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                object.__setattr__(self, name, read_only(value))

    @property
    def model(self) -> StateSpaceModel:
        """The state-space model as the core takes it."""
        return self.step, self.variance, self.covariance, self.segment, self.density, self.oscillator

    def stamps(self, time: Array) -> Array:
        """Its time stamps (n,) [s], beside a motion with the stamps `time`."""
        return time if self.time is None else self.time

    def for_core(self, time: Array) -> tuple[StateSpaceModel, int, Array, Array]:
        """Model, index of the acceleration, its unit and stamps, as the core takes them; time: that of the motion."""
        return self.model, self.derivative, self.unit, self.stamps(time)

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, n) m/s2, draws of the deviation from the posterior; reproducible by the state of `rng`.

        The first draws do not depend on `count`. Time and memory are O(count n).
        """
        seed = int(rng.integers(2**63))
        drawn = draw_motion(self.model, self.derivative, count, seed)
        drawn *= self.unit
        return drawn
