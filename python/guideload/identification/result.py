"""The result of an identification: values of the unknowns, their uncertainty, and what the data cannot determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.identification.covariance import (
    covariance,
    curvature,
    degrees_of_freedom,
    information,
)
from guideload.identification.directions import Undetermined, undetermined
from guideload.identification.fit import STARTS, Fit, fit
from guideload.identification.intervals import Interval, interval
from guideload.identification.machine_values import machine_with
from guideload.identification.measured import Measured, OwnUnknown
from guideload.identification.model import Model, ModelAt
from guideload.identification.residual_tests import ResidualTest, residual_tests
from guideload.identification.unknowns import Unknown, UnknownTable, parameters_of, unknowns_of
from guideload.machine.machine import Machine
from guideload.parameters.parameters import Parameter


@dataclass(frozen=True)
class Estimate:
    """An identified number of the machine.

    name       its name in the description; unit: of value and ends, SI
    value      the most probable one
    low, high  interval with a probability of 95 %
    is_identified  whether the data determine it: they at least halve the spread before
    narrowed   spread after the data over the one before
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


@dataclass(frozen=True, eq=False)
class Identification:
    """The numbers of a machine under measured data.

    nominal       the machine before
    unknowns      what was unknown of it
    fit           the best fit
    covariance    (p + q, p + q) of the coordinates: logarithms of positive parameters, own unknowns of the data
    intervals     of the p unknowns of the machine
    undetermined  groups of unknowns that the data do not separate
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
    def estimates(self) -> tuple[Estimate, ...]:
        """The identified numbers of the machine."""
        return tuple(
            Estimate(
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
    def identified(self) -> tuple[tuple[Parameter, float, Estimate], ...]:
        """Each parameter of the machine that was unknown, its most probable value, and the estimate that it is from."""
        parameters = parameters_of(self.nominal)
        return tuple(
            (parameters.at(path)[0], estimate.value * (nominal if one.is_factor else 1.0), estimate)
            for one, estimate in zip(self.unknowns, self.estimates, strict=True)
            for path, nominal in zip(one.targets, one.nominal.tolist(), strict=True)
        )

    @cached_property
    def machine(self) -> Machine:
        """The machine with the most probable values."""
        return machine_with(self.nominal, ((parameter, value) for parameter, value, _ in self.identified))

    @property
    def own_values(self) -> tuple[tuple[OwnUnknown, float, float], ...]:
        """The own unknowns of all data with their most probable values and standard deviations, SI."""
        objective, p = self.fit.objective, len(self.unknowns)
        own = [one for each in self.data for one in each.own]
        values = (self.fit.minimum.x * objective.units)[p:].tolist()
        sigmas = (np.sqrt(np.diag(self.covariance)) * objective.units)[p:].tolist()
        return tuple(zip(own, values, sigmas, strict=True))

    def own_of(self, data: Measured) -> Array:
        """The own unknowns of a data set, in SI."""
        return self.fit.objective.own_of(self.fit.minimum.x)[self.data.index(data)]

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
        first = sum(len(one.noise) for one in self.data[: self.data.index(data)])
        return float(self.fit.objective.factors[first + group])

    @property
    def messages(self) -> tuple[str, ...]:
        """What may be wrong with the search, in words."""
        return self.fit.messages


@checked
def identify(
    machine: Machine, unknown: Sequence[UnknownTable], data: Sequence[Measured], *, starts: int = STARTS
) -> Identification:
    """The numbers of a machine that explain measured data best, with their uncertainty.

    Raises ConfigError for unknowns that the machine does not have, ArgumentError without unknowns or data.
    """
    unknowns = unknowns_of(unknown, parameters_of(machine))
    found = fit(Model(machine, unknowns), data, starts)
    spread = covariance(found)
    sigma, degrees = np.sqrt(np.diag(spread)), degrees_of_freedom(found, spread)
    widening = sigma / np.sqrt(np.diag(curvature(found)))
    each = zip(sigma.tolist(), degrees.tolist(), widening.tolist(), strict=True)
    intervals = tuple(interval(found, i, *one) for i, one in enumerate(islice(each, len(unknowns))))
    groups = undetermined(unknowns, found.minimum.x, information(found), spread)
    return Identification(machine, unknowns, found, spread, intervals, groups, residual_tests(found))
