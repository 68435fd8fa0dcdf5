"""The result of an identification: values of the unknowns, their uncertainty, and what the data cannot determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import chi2, norm

from guideload.base.arguments import checked, whole_number
from guideload.base.arrays import Array
from guideload.base.finite import finite_json
from guideload.base.notebook import as_html
from guideload.identification.fit import STARTS, Fit, fit
from guideload.identification.measured import Measured, Noise, NuisanceParameter
from guideload.identification.modal_test import ModalTest
from guideload.identification.model import Model, ModelAt
from guideload.identification.record_checks import RecordChannel, record_channels, record_doubts
from guideload.identification.records import Record
from guideload.identification.uncertainty import (
    Interval,
    Undetermined,
    covariance,
    degrees_of_freedom,
    intervals,
    student_quantile,
    undetermined,
)
from guideload.identification.unknowns import Unknown, UnknownTable, machine_with, resolve_unknowns
from guideload.machine.machine import Machine
from guideload.parameters.parameters import Parameter, Parameters
from guideload.sensitivity.varied import NO_MOTION

if TYPE_CHECKING:
    import pandas as pd

# ---- tests of the residuals: is their size that of the noise, are they white, do they have a trend?


RARE = 0.01  # probability below which a test says that something is wrong
FEWEST_IN_SERIES = 8  # values of which a series can be judged
OUTLIER = 4.0  # standard deviations: one of 16 000 values is further out by chance


@dataclass(frozen=True)
class ResidualTest:
    """The residuals of one group of values that share a noise level."""

    name: str
    count: int  # its values
    rms: float  # root mean square of the residuals, in standard deviations of the noise as stated
    noise: Noise  # its noise as stated, or where the estimate began
    factor: float | None  # estimated noise over `noise`; None where it is known
    doubts: tuple[str, ...]  # in words


def residual_tests(fit: Fit) -> tuple[ResidualTest, ...]:
    """A test of each group of values."""
    labels = [label for each in fit.objective.data for label in each.labels]
    in_time = [isinstance(each, Record) for each in fit.objective.data for _ in each.noise]
    tests = []
    for i, noise in enumerate(fit.objective.noise):
        here = np.flatnonzero(fit.objective.noise_index == i)
        values, factor = fit.residuals[here], float(fit.objective.factors[i])
        doubts = _size(factor * values, float(fit.free_values[i])) if noise.known else []
        if not in_time[i]:
            doubts += _series(values)
        elif alike := _likeness(values):
            doubts.append(
                f"neighbouring differences are alike (correlation {alike:.2f}): the model lacks something, such as a "
                "law of friction or of a link; the intervals are widened for it"
            )
        doubts += [
            f"the {labels[here[k]]} is {abs(values[k]):.1f} standard deviations off"
            for k in np.flatnonzero(abs(values) > OUTLIER).tolist()[:3]
        ]
        rms = factor * float(np.sqrt(np.mean(values**2))) if here.size else 0.0
        estimated = None if noise.known else factor
        tests.append(ResidualTest(noise.name, here.size, rms, noise, estimated, tuple(doubts)))
    return tuple(tests)


def _size(values: Array, free: float) -> list[str]:
    if free < 1.0:
        return []
    squares = float(values @ values)
    ratio = float(np.sqrt(squares / free))
    if chi2.sf(squares, free) < RARE:
        return [
            f"the differences are {ratio:.2g} times the stated noise: the noise is larger, or the model lacks something"
        ]
    if chi2.cdf(squares, free) < RARE:
        return [f"the differences are only {ratio:.2g} times the stated noise: it is stated too large"]
    return []


def _series(values: Array) -> list[str]:
    """Doubts about values in the order of frequency or time: neighbours alike, or a trend."""
    n = values.size
    if n < FEWEST_IN_SERIES or not values.any():
        return []
    doubts = []
    if likeness := _likeness(values):
        doubts.append(
            f"neighbouring differences are alike (correlation {likeness:.2f}): they are not noise alone, the model "
            "lacks something, and the intervals are too narrow"
        )
    order = np.linspace(-1.0, 1.0, n)
    trend = float(order @ values / np.sqrt(order @ order) / np.sqrt(np.mean(values**2)))
    if 2.0 * norm.sf(abs(trend)) < RARE:
        doubts.append("the differences have a trend from the first value to the last")
    return doubts


def _likeness(values: Array) -> float:
    """Correlation of neighbours; 0 if it may be chance."""
    likeness = float(values[1:] @ values[:-1]) / max(float(values @ values), np.finfo(float).tiny)
    return likeness if norm.sf(likeness * np.sqrt(values.size)) < 0.5 * RARE else 0.0


# ---- the result


@dataclass(frozen=True)
class UnknownEstimate:
    """An identified number of the machine.

    name       its name in the description; unit: of value and ends, SI
    value      the most probable one
    low, high  interval with a probability of 95 %
    is_identified  whether the data determine it: they at least halve the spread before
    narrowed   standard deviation after the data over that before
    profile    whether the interval is from the likelihood profile
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    is_identified: bool
    narrowed: float
    profile: bool


@dataclass(frozen=True)
class NuisanceEstimate:
    """The most probable value of a nuisance parameter, and its interval with a probability of 95 %, in SI.

    is_identified: whether the data determine it by itself, and not only together with others.
    """

    parameter: NuisanceParameter
    value: float
    low: float
    high: float
    is_identified: bool


@dataclass(frozen=True, eq=False, repr=False)
class Identification:
    """The numbers of a machine under measured data.

    nominal       the machine before the identification
    unknowns      its unknown numbers
    fit           the best fit
    covariance    (p + q, p + q) of the coordinates: logarithms of positive parameters, nuisance parameters of the data
    intervals     of the p unknowns of the machine
    undetermined  groups of unknowns, or of nuisance parameters of a data set, that the data do not separate
    residuals     tests of the residuals
    """

    nominal: Machine
    unknowns: tuple[Unknown, ...]
    fit: Fit
    covariance: Array
    intervals: tuple[Interval, ...]
    undetermined: tuple[Undetermined, ...]
    residuals: tuple[ResidualTest, ...]

    @cached_property
    def estimates(self) -> tuple[UnknownEstimate, ...]:
        """The identified numbers of the machine."""
        return tuple(
            UnknownEstimate(
                one.name,
                one.unit,
                one.value(z),
                one.value(reach.low),
                one.value(reach.high),
                reach.is_identified,
                reach.narrowed,
                reach.profile,
            )
            for one, z, reach in zip(self.unknowns, self.fit.minimum.x.tolist(), self.intervals, strict=False)
        )

    @property
    def correlation(self) -> Array:
        """(p, p) of the coordinates of the machine's unknowns."""
        block = self.covariance[: len(self.unknowns), : len(self.unknowns)]
        sigma = np.sqrt(np.diag(block))
        return np.asarray(block / np.outer(sigma, sigma))

    @cached_property
    def identified(self) -> tuple[tuple[Parameter, float, UnknownEstimate], ...]:
        """Each parameter of the machine that was unknown, its most probable value, and the estimate that it is from."""
        parameters = Parameters(self.nominal, NO_MOTION)
        return tuple(
            (parameters.at(path)[0], estimate.value * (nominal if one.is_factor else 1.0), estimate)
            for one, estimate in zip(self.unknowns, self.estimates, strict=True)
            for path, nominal in zip(one.targets, one.nominal.tolist(), strict=True)
        )

    @cached_property
    def machine(self) -> Machine:
        """The machine with the most probable values."""
        return machine_with(self.nominal, ((parameter, value) for parameter, value, _ in self.identified))

    def __repr__(self) -> str:
        known = sum(one.is_identified for one in self.estimates)
        return (
            f"<Identification of {self.nominal.name}: {known} of {len(self.estimates)} unknowns identified>"
        )

    def _repr_html_(self) -> str:
        return as_html(repr(self), self.table())

    def table(self) -> pd.DataFrame:
        """A row per unknown; columns as the fields of `UnknownEstimate`."""
        import pandas as pd

        rows = [asdict(one) for one in self.estimates]
        return pd.DataFrame(rows).set_index("name").drop(columns="profile")

    def nuisance_estimates(self, data: Measured) -> tuple[NuisanceEstimate, ...]:
        """Estimates of the nuisance parameters of one of the data sets."""
        values, here = self.nuisance_values(data), self.fit.objective.columns[self.data.index(data)]
        degrees = degrees_of_freedom(self.fit, self.covariance)[here]
        sigma = np.sqrt(np.diag(self.covariance)[here]) * self.fit.objective.units[here]
        reach = student_quantile(degrees) * sigma
        bounds = np.array([one.bounds for one in data.nuisance]).reshape(-1, 2)
        ends = np.clip([values - reach, values + reach], *bounds.T)
        together = {name for group in self.undetermined for name in group.names}
        alone = [one.name not in together for one in data.nuisance]
        rows = zip(data.nuisance, values.tolist(), *ends.tolist(), alone, strict=True)
        return tuple(NuisanceEstimate(*row) for row in rows)

    def nuisance_values(self, data: Measured) -> Array:
        """The nuisance parameters of a data set, in SI."""
        return self.fit.objective.nuisance_values(self.fit.minimum.x)[self.data.index(data)]

    @property
    def model(self) -> ModelAt:
        """The machine with the most probable values, as the data see it."""
        objective = self.fit.objective
        return objective.model.at(self.fit.minimum.x[: objective.p])

    @property
    def data(self) -> tuple[Measured, ...]:
        """The data as fitted."""
        return self.fit.objective.data

    def noise_factor(self, data: Measured, group: int) -> float:
        """Estimated over stated noise of a group of values of a data set; 1 where it is known."""
        objective = self.fit.objective
        return float(objective.factors[objective.groups[self.data.index(data)]][group])

    def record_channels(self, data: Record) -> list[RecordChannel]:
        """Measured and computed values of the channels of one of the data sets, a record in time."""
        return record_channels(data, self.model, self.nuisance_values(data))

    @cached_property
    def messages(self) -> tuple[str, ...]:
        """What may be wrong with the records and the search, in words."""
        records = [each for each in self.data if isinstance(each, Record)]
        doubts = (one for each in records for one in record_doubts(each, self.record_channels(each)))
        return (*doubts, *self.fit.messages)


@checked
def identify(
    machine: Machine, unknown: Sequence[UnknownTable], data: Sequence[Measured], *, starts: int = STARTS
) -> Identification:
    """The numbers of a machine that explain measured data best, with their uncertainty.

    Parameters
    ----------
    machine
        The nominal machine.
    unknown
        What is unknown of it, as the [[unknown]] tables of an identify file.
    data
        Measured data of any kinds, such as `ModalTest` and `Deflections`.
    starts
        Number of searches; four times as many for a nonlinear machine.

    Raises
    ------
    ConfigError
        For unknowns that the machine does not have.
    ArgumentError
        Without data, with less than one start, and where no possible machine is found near the expected values.
    SceneError
        For a machine that its links do not support.
    """
    unknowns = resolve_unknowns(unknown, machine)
    found = fit(Model(machine, unknowns), data, whole_number("starts", starts))
    spread = covariance(found)
    ends, groups = intervals(found, spread), undetermined(found, spread)
    return Identification(machine, unknowns, found, spread, ends, groups, residual_tests(found))


# ---- as JSON


def json_text(found: Identification) -> str:
    """Estimates, their correlation, and what the report says; a number that the data do not determine is null."""
    modal_tests = [each for each in found.data if isinstance(each, ModalTest)]
    no_values = dict.fromkeys(("value", "low", "high"))
    content = {
        "machine": found.nominal.name,
        "estimates": [asdict(one) | ({} if one.is_identified else no_values) for one in found.estimates],
        "correlation": found.correlation.tolist(),
        "own_numbers": [
            {"name": one.parameter.name, "unit": one.parameter.unit}
            | {name: getattr(one, name) if one.is_identified else None for name in no_values}
            for data in found.data
            for one in found.nuisance_estimates(data)
        ],
        "undetermined": [asdict(one) for one in found.undetermined],
        "modes": {test.name: [asdict(pair) for pair in test.pairs(found.model)] for test in modal_tests},
        "differences": [asdict(one) for one in found.residuals],
        "messages": list(found.messages),
    }
    return finite_json(content, indent=1, ascii_only=False) + "\n"
