"""What samples leave open about an acceleration: a Gaussian process, drawn from and carried to the loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload import _core

Array = NDArray[np.float64]
Cells = NDArray[np.uint32]


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
    """

    step: Array
    variance: Array
    covariance: Array
    cell: Cells
    intensity: Array
    derivative: int
    unit: Array

    @property
    def states(self) -> int:
        """N."""
        return int(self.covariance.shape[0])

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, n) m/s2, deviations drawn from all that fit the samples. Time and memory are O(count n)."""
        return np.stack([self._draw(rng) for _ in range(count)])

    def _draw(self, rng: np.random.Generator) -> Array:
        normal = rng.standard_normal(self.variance.size * self.states)
        # The samples themselves do not matter to the deviations from their mean.
        zero, at_rest = np.zeros(self.variance.size), np.zeros(self.states)
        drawn = _core.draw_motion(
            self.step,
            zero,
            self.variance,
            at_rest,
            self.covariance,
            self.cell,
            self.intensity,
            normal,
            self.derivative,
        )
        result: Array = self.unit * drawn
        return result
