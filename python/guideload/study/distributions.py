"""Distributions: values by inversion of uniform numbers between 0 and 1."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from scipy.special import exp2, ndtr, ndtri

from guideload.base.arrays import Array
from guideload.parameters.parameters import Form

# Bounds of all uniform numbers: at 0 and 1 a normal distribution is infinite, here -8.3 and 8.2 standard deviations.
LOWEST, HIGHEST = 2.0**-54, 1.0 - 2.0**-53


class Distribution(ABC):
    """A distribution of one number."""

    @abstractmethod
    def ppf(self, u: Array) -> Array:
        """Quantiles at the probabilities u."""

    @property
    def reach(self) -> tuple[float, float]:
        """The smallest and the largest value that can be drawn."""
        low, high = self.ppf(np.array([LOWEST, HIGHEST])).tolist()
        return low, high


@dataclass(frozen=True)
class Normal(Distribution):
    """Mean and standard deviation."""

    mean: float
    sigma: float

    def ppf(self, u: Array) -> Array:
        return self.mean + self.sigma * np.asarray(ndtri(u))

    def cdf(self, x: float) -> float:
        return float(ndtr((x - self.mean) / self.sigma))


@dataclass(frozen=True)
class Lognormal(Distribution):
    """Median, and standard deviation of the logarithm."""

    median: float
    sigma: float

    def ppf(self, u: Array) -> Array:
        # exp2 of SciPy is plain arithmetic; the last bits of NumPy's exp depend on the processor.
        return self.median * np.asarray(exp2((self.sigma / math.log(2.0)) * ndtri(u)))

    def cdf(self, x: float) -> float:
        return float(ndtr(math.log(x / self.median) / self.sigma)) if x > 0.0 else 0.0


@dataclass(frozen=True)
class Uniform(Distribution):
    """Constant density between low and high."""

    low: float
    high: float

    def ppf(self, u: Array) -> Array:
        return np.clip(self.low + (self.high - self.low) * u, self.low, self.high)

    def cdf(self, x: float) -> float:
        return min(max((x - self.low) / (self.high - self.low), 0.0), 1.0)

    @property
    def reach(self) -> tuple[float, float]:
        return self.low, self.high


@dataclass(frozen=True)
class Triangular(Distribution):
    """Density that rises linearly from low to the mode and falls linearly to high."""

    low: float
    mode: float
    high: float

    def ppf(self, u: Array) -> Array:
        width, up, down = self.high - self.low, self.mode - self.low, self.high - self.mode
        rising = self.low + np.sqrt(u * (width * up))
        falling = self.high - np.sqrt((1.0 - u) * (width * down))
        return np.clip(np.where(u * width < up, rising, falling), self.low, self.high)

    def cdf(self, x: float) -> float:
        width, up, down = self.high - self.low, self.mode - self.low, self.high - self.mode
        x = min(max(x, self.low), self.high)
        if x <= self.mode:
            return (x - self.low) ** 2 / (width * up) if up else 0.0
        return 1.0 - (self.high - x) ** 2 / (width * down)

    @property
    def reach(self) -> tuple[float, float]:
        return self.low, self.high


@dataclass(frozen=True, eq=False)
class Sample(Distribution):
    """Measured values (n,), ascending; drawn with replacement, each with probability 1/n."""

    values: Array

    def ppf(self, u: Array) -> Array:
        place = (u * self.values.size).astype(np.intp)
        return self.values[np.minimum(place, self.values.size - 1)]


Untruncated = Normal | Lognormal | Uniform | Triangular  # `cdf`: the probability of a value up to x


@dataclass(frozen=True)
class Truncated(Distribution):
    """A distribution truncated to low and high, one of which may be infinite."""

    base: Untruncated
    low: float
    high: float

    def ppf(self, u: Array) -> Array:
        below = self.base.cdf(self.low)
        inside = below + (self.base.cdf(self.high) - below) * u
        return np.clip(self.base.ppf(np.clip(inside, LOWEST, HIGHEST)), self.low, self.high)

    @property
    def reach(self) -> tuple[float, float]:
        low, high = self.base.reach
        return max(low, self.low), min(high, self.high)


def in_words(distribution: Distribution, scale: float, unit: str) -> str:
    """`scale` times a distribution, in words."""

    def span(low: float, high: float) -> str:
        first, last = sorted((scale * low, scale * high))
        if math.isinf(first):
            return f"at most {last:.9g}{unit}"
        if math.isinf(last):
            return f"at least {first:.9g}{unit}"
        return f"from {first:.9g} to {last:.9g}{unit}"

    match distribution:
        case Normal(mean, sigma):
            return f"normal with mean {scale * mean:.9g}{unit} and sigma {abs(scale) * sigma:.9g}{unit}"
        case Lognormal(median, sigma):
            return f"lognormal with median {scale * median:.9g}{unit} and sigma {sigma:.9g}"
        case Uniform(low, high):
            return f"uniform {span(low, high)}"
        case Triangular(low, mode, high):
            return f"triangular {span(low, high)} with mode {scale * mode:.9g}{unit}"
        case Sample(values):
            mean = scale * float(values.mean())
            return f"{values.size} values {span(*distribution.reach)} with mean {mean:.9g}{unit}"
        case Truncated(base, low, high):
            return f"{in_words(base, scale, unit)}, {span(low, high)}"
    raise TypeError(distribution)


@dataclass(frozen=True)
class Marginal:
    """The distribution of one column of values: `scale` times a value of `distribution`, increasing with u.

    form: how a value of the column sets its parameters: as their "value" in SI, as a "factor" on the machine's value,
    or as a "shift" of it in SI.
    """

    distribution: Distribution
    form: Form
    scale: float = 1.0

    def values(self, u: Array) -> Array:
        """(n,) from uniform numbers (n,) within `LOWEST` and `HIGHEST`."""
        u = u if self.scale > 0.0 else np.clip(1.0 - u, LOWEST, HIGHEST)
        return self.scale * self.distribution.ppf(u)

    @property
    def reach(self) -> tuple[float, float]:
        low, high = sorted(self.scale * end for end in self.distribution.reach)
        return low, high
