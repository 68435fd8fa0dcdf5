"""What samples leave open about an acceleration: a Gaussian process, drawn from and carried to the loads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from guideload._core import draw_motion
from guideload.base.arrays import Array

Cells = NDArray[np.uint32]

COVER, TAIL = 1.96, 0.025  # standard deviations of the 95 % band, and what lies on either side of it
# Of the kernels: step, variance, covariance, cell, intensity.
Chain: TypeAlias = tuple[Array, Array, Array, Cells, Array]


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Deviations of the true acceleration from its estimate at n time stamps, given the samples.

    The state is the position and its first N - 1 derivatives (velocity samples: the velocity and its), of which the
    N-th is white noise; times and values are in units that keep numbers tame.

    step        (n - 1,) time to the next stamp
    variance    (n,) of the noise that each sample has beside the state's first number
    covariance  (N, N) of the state before the first sample
    cell        (n - 1,) index of each interval's intensity
    intensity   (cells,) of the white noise
    derivative  which number of the state is the acceleration
    unit        (n,) m/s2 per unit of that number, with the factor that the band is scaled by
    time        (n,) s, the stamps; None if they are those of the motion. Between them deviations are linear
    """

    step: Array
    variance: Array
    covariance: Array
    cell: Cells
    intensity: Array
    derivative: int
    unit: Array
    time: Array | None = None

    @property
    def states(self) -> int:
        """N."""
        return int(self.covariance.shape[0])

    @property
    def chain(self) -> Chain:
        """What the kernels take."""
        return self.step, self.variance, self.covariance, self.cell, self.intensity

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, n) m/s2, deviations drawn from all that fit the samples; the same generator gives the same.

        The first draws of many are those of few. Time and memory are O(count n).
        """
        seed = int(rng.integers(2**63))
        drawn = draw_motion(self.chain, self.derivative, count, seed)
        drawn *= self.unit
        return drawn
