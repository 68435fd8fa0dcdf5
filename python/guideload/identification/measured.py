"""What a kind of measured data offers to the fit. A new kind is a class with these members, in a file of its own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array, Indices

if TYPE_CHECKING:
    from collections.abc import Sequence

    from guideload.identification.model import ModelAt


@dataclass(frozen=True)
class NuisanceParameter:
    """An unknown number beside those that are sought, such as an offset, a delay or a scale; it is fitted with them."""

    name: str  # in words: "offset of sensor tool y"
    unit: str  # SI
    expected: float  # most likely value before the data, where the search starts
    spread: float  # standard deviation before the data; inf if nothing is known
    scale: float  # in `unit`: the search takes steps of this size
    bounds: tuple[float, float] = (-float("inf"), float("inf"))  # smallest and largest value
    # of the machine file, such as "friction.seal", if it is a number of the machine, which all data share; else empty
    key: str = ""


# Spread before the data of a nuisance parameter of which nothing is known, in largest measured values: far beyond any.
WIDE = 100.0


@dataclass(frozen=True)
class Noise:
    """The noise of one group of measured values."""

    name: str  # in words: "frequencies of hammer test"
    # whether its stated level is right; if not, it is only a start, and the fit estimates a factor on it
    known: bool
    level: float  # standard deviation of a value
    unit: str = "1"  # of the level, SI; "1": it is relative
    # of frequency responses, relative to the largest value of a curve; added to that of the level by squares
    floor: float = 0.0


@dataclass(frozen=True, eq=False)
class Residuals:
    """Differences (predicted - measured)/(stated noise), and their derivatives."""

    values: Array  # (m,) 1; m does not change with the unknowns
    by_unknowns: Array  # (m, p) by the coordinates z of the machine's unknowns
    by_nuisance: Array  # (m, q) by the nuisance parameters of the data


class Measured(ABC):
    """One set of measured data of one kind, checked and in SI. Errors are independent, except those of a `Record`."""

    name: str  # in words, as in reports: "hammer test"

    @property
    def nuisance(self) -> Sequence[NuisanceParameter]:
        """Its nuisance parameters, often none."""
        return ()

    @property
    @abstractmethod
    def noise(self) -> Sequence[Noise]:
        """Its groups of values that share a noise level."""

    @property
    @abstractmethod
    def labels(self) -> Sequence[str]:
        """(m,) what each value is: "frequency of mode 2"; long records give one label for all their samples."""

    @property
    def noise_index(self) -> Indices:
        """(m,) index of the noise group of each value; by default they are of one group."""
        return np.zeros(len(self.labels), dtype=np.intp)

    @property
    def scales(self) -> Array:
        """(m,) the stated noise of each value, by which its residual is divided."""
        return np.array([one.level for one in self.noise])[self.noise_index]

    @abstractmethod
    def residuals(self, model: ModelAt, nuisance: Array) -> Residuals:
        """The residuals at one machine and nuisance parameters (q,)."""

    def prepared_for(self, model: ModelAt, nuisance: Array) -> Measured:
        """The data prepared for a fit near this machine, e.g. without modes that it does not have; often the same data.

        The fit prepares the data at its start and after each search, until they no longer change.
        """
        return self
