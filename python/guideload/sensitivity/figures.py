"""Quantities of a run with one number per carriage, and their derivatives backwards in time: peak, mean load, life."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from guideload._core import equivalent_load_weights
from guideload.base.arrays import Array, find_runs
from guideload.base.errors import LifeError
from guideload.life.criteria import Criteria, criteria_of
from guideload.life.mean_load import Travel, integrals, mean_load
from guideload.parameters.parameters import part_path
from guideload.sensitivity.run import RunDerivatives

UNITS = {"peak_resultant": "N", "mean_load": "N", "life": "m"}
TIE = 1e-9  # relative distance of a second peak that counts as equal
MOST_TIES = 32  # instants that share a peak at which derivatives are taken, each at the cost of some runs


def most_critical(quantity: str, values: Array) -> int:
    """Index of the carriage with the largest load or the shortest life, of values (carriage,), some of them nan."""
    return int(np.nanargmin(values) if quantity == "life" else np.nanargmax(values))


class CarriageQuantities:
    """Quantities of a run by carriage. Each method returns values (carriage,) and derivatives (p, carriage).

    notes  in words, why a derivative is nan
    """

    def __init__(self, run: RunDerivatives) -> None:
        self._run, self.notes = run, list[str]()
        self.names = [carriage.name for carriage in run.machine.carriages]
        self.columns = len(run.at_rest.columns)

    @cached_property
    def at_peaks(self) -> RunDerivatives:
        """The run with the instants of the peaks."""
        return self._run.with_peaks()

    @cached_property
    def _loads_at_peaks(self) -> Array:
        return self.at_peaks.carriage_loads()

    @cached_property
    def resultants(self) -> Array:
        """The y-z resultants [N] at the instants of `at_peaks`, (time, carriage)."""
        return np.asarray(np.linalg.norm(self._loads_at_peaks[:, :, 1:3], axis=2))

    @cached_property
    def run(self) -> RunDerivatives:
        """The run with the instants of `simulate`, between which loads are nearly linear."""
        return self._run.with_visible_vibration()

    def peak_resultant(self) -> tuple[Array, Array]:
        """The largest y-z resultant [N]. Its derivative is that of the resultant at its instant."""
        values, derivatives = np.empty(len(self.names)), np.empty((self.columns, len(self.names)))
        for i, name in enumerate(self.names):
            values[i], instants, by = self._peak(i)
            derivatives[:, i] = by[0]
            if np.abs(by - by[0]).max() > np.sqrt(TIE) * np.abs(by[0]).max() or not values[i]:
                derivatives[:, i] = np.nan
                times, reason = self.at_peaks.motion.time[instants], "the carriage carries nothing"
                if values[i]:
                    ends = f"{times.min():.6g} s and at {times.max():.6g} s"
                    reason = f"it is reached at {ends}, where the load changes differently"
                self.notes.append(f"peak_resultant of carriage {name} has no derivative: {reason}")
        return values, derivatives

    def peak_changes(self, carriage: int, steps: Array) -> tuple[float, Array]:
        """The largest y-z resultant [N] of a carriage, and its changes (p,) by small changes of the columns.

        To first order. If the peak occurs at several instants, each change is that of the instant whose load grows
        most; the opposite change then need not have the opposite effect.
        """
        value, _, by = self._peak(carriage)
        return value, (by * steps).max(axis=0) if value else np.abs(by * steps).max(axis=0)

    def _peak(self, carriage: int) -> tuple[float, list[int], Array]:
        """The largest resultant, indices of the instants that share it, and its derivatives (instants, p) there.

        Of a carriage without load they are those of the magnitude of the load.
        """
        resultant = self.resultants[:, carriage]
        first, after = find_runs(resultant >= (1.0 - TIE) * resultant.max())  # stretches of equal loads
        ends = np.unique(np.concatenate([first, after - 1]))
        ends = ends[np.unique(np.linspace(0, ends.size - 1, MOST_TIES).round().astype(int))]
        instants = list(dict.fromkeys((int(resultant.argmax()), *ends.tolist())))
        by = np.array([self._resultant_gradient(carriage, k) for k in instants])
        return float(resultant.max()), instants, by

    def _resultant_gradient(self, carriage: int, k: int) -> Array:
        loads = self._loads_at_peaks
        across = loads[k, carriage, 1:3]
        size = float(np.linalg.norm(across))
        directions = (across / size,) if size else ((1.0, 0.0), (0.0, 1.0))
        parts = []
        for direction in directions:
            weights = np.zeros_like(loads)
            weights[k, carriage, 1:3] = direction
            parts.append(self.at_peaks.gradient(weights))
        return parts[0] if size else np.hypot(*parts)

    def mean_load(self) -> tuple[Array, Array]:
        """The mean load over distance [N] of the carriages with ratings; nan for the others. Raises LifeError."""
        values = np.full(len(self.names), np.nan)
        derivatives = np.full((self.columns, len(self.names)), np.nan)
        for one, mean, by in self._means():
            values[one.index], derivatives[:, one.index] = mean, by
        return values, derivatives

    def life(self) -> tuple[Array, Array]:
        """The rating life [m] of the carriages with ratings; nan for the others. Raises LifeError."""
        values, derivatives = self.mean_load()
        for one in criteria_of(self._run.machine, self._run.machine.life):
            mean = values[one.index]
            values[one.index] = one.life_under(mean)
            derivatives[:, one.index] *= -one.rating.exponent * values[one.index] / mean
        return values, derivatives

    def _means(self) -> Iterator[tuple[Criteria, float, Array]]:
        """Criteria, mean load [N] of straight lines between the instants, and its derivatives (p,)."""
        machine, all_loads = self.run.machine, self.run.carriage_loads()
        travel = Travel.of(self.run.motion)
        for one in criteria_of(machine, machine.life):
            preload, by_columns = self._preload(one)
            rule = replace(one.rule, preload=preload)
            if preload and rule.effect == "power":
                raise LifeError(
                    f"carriage {one.name}: the rule {machine.life.rule} jumps by 1 % where the load passes 2.8 times "
                    "the preload, so its mean load has no derivative; leave preload_in_life = false out, or run a study"
                )
            loads, exponent = np.ascontiguousarray(all_loads[:, one.index]), one.rating.exponent
            power, path = integrals(travel, loads, rule, exponent)
            mean = mean_load(power, path, exponent)
            by_loads = equivalent_load_weights(*travel, loads, rule.of_core, exponent)
            weights = np.zeros_like(all_loads)
            weights[:, one.index] = mean / (exponent * power.sum()) * by_loads
            derivatives = self.run.gradient(weights)
            if preload:
                # Loads and preload times a factor give the mean times it: by Euler, the derivatives add up to the mean.
                by_preload = (mean - float((loads * weights[:, one.index]).sum())) / preload
                derivatives = derivatives + by_preload * by_columns
            yield one, mean, derivatives

    def _preload(self, one: Criteria) -> tuple[float, Array]:
        """The preload [N] that a carriage's rule counts, with the values of the columns, and its derivatives (p,)."""
        carriage, at_rest = self._run.machine.carriages[one.index], self._run.at_rest
        found = one.rule.preload, np.zeros(self.columns)
        for key in ("preload_y", "preload_z") if one.rule.preload else ():
            own, by = getattr(carriage, key) or 0.0, np.zeros(self.columns)
            for i, column in enumerate(at_rest.columns):
                if f"{part_path('carriages', carriage.name)}.{key}" in column.paths:
                    by[i] = own if column.form == "factor" else 1.0
                    own = float(by[i] * at_rest.values[i])
            if own and (key == "preload_y" or own > found[0]):
                found = own, by
        return found
