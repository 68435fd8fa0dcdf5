"""Logs of sensors under a measured motion: accelerometers, sensors of velocity or displacement, load cells.

A channel shows gain (row @ q + motion of the cart) + offset at its point and in its direction, or gain times the change
of a load + offset, later or earlier than the trace by a delay that all channels of the log share. The offset holds
gravity and the zero of the amplifier, the gain its sensitivity, the delay the distance of the clocks of two loggers.
The delay is sought from where the log and the prediction of the machine file correlate best. The gain of a strain gauge
may be unknown, sign and all: its search starts where the prediction at that delay fits best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.signal import correlate, correlation_lags

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, TraceError
from guideload.identification.measured import WIDE, Noise, NuisanceParameter
from guideload.identification.model import Excitation, LoadPlace, ModelAt, SensorPlace
from guideload.identification.records import Record, Whitening, Windows, draw_deviations
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.motion import Motion
from guideload.sensitivity.linearised import Linearised
from guideload.sensitivity.run import History, Instants, RunDerivatives
from guideload.sensitivity.varied import VariedMachine

Kind = Literal["acceleration", "velocity", "displacement", "load"]
UNIT = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
PER_PERIOD = 10.0  # windows in a period of the highest mode, whose vibration a mean over one lowers by 1.6 %
FIRST_LEVEL = 0.1  # of a channel's standard deviation: where the search for its noise starts
ALIKE = 0.1  # least correlation of log and prediction at the best delay: noise alone has less in a record of some moves
LIKEST = 1.0 - 1e-9  # correlation that rounding may exceed
ROUNDING = 1e-9  # of the loads of a carriage: a component below it is 0
LEAST_OVERLAP = 0.5  # of the log, or of the trace if it is shorter, that the clocks have in common


@dataclass(frozen=True)
class Channel:
    """One sensor."""

    place: SensorPlace | LoadPlace  # point and direction, or the load that it measures
    # what it measures; an acceleration is absolute, velocity and displacement are from the carriages' guides
    kind: Kind = "acceleration"
    level: float | None = None  # standard deviation of its noise [`unit`]; None if unknown
    # relative standard deviation of its gain; 0 if the gain is known, inf if nothing is known of it
    gain_spread: float = 0.0

    @property
    def name(self) -> str:
        """ "acceleration of tool y" """
        return f"{self.kind} of {self.place.name}"

    @property
    def unit(self) -> str:
        """Of its values: SI, or "1" for those of its column if its gain is unknown."""
        if self.gain_spread == np.inf:
            return "1"
        return self.place.unit if isinstance(self.place, LoadPlace) else UNIT[self.kind]

    def shown(self, at: Instants, rest: Linearised) -> History:
        """What it shows without offset, gain and delay; displacements and loads are changes from rest."""
        if isinstance(self.place, LoadPlace):
            return self.place.shown(at, rest)
        row, history = self.place.row, at.history(self.kind, self.place.row)
        if self.kind == "displacement":
            return history.from_rest(float(rest.static_position @ row), rest.d_static_position @ row)
        if self.kind == "acceleration":
            cart, jerk = at.inputs[:, :3] @ row[:3], at.input_slopes[:, :3] @ row[:3]
            return replace(history, values=history.values + cart, slope=history.slope + jerk)
        return history


@dataclass(frozen=True, eq=False)
class SensorLog(Record):
    """A log of k channels with common stamps."""

    channels: tuple[Channel, ...]
    gains: Array  # (k,) expected gains: 1, or where the search for an unknown gain starts
    delay: float  # s, stamp of the log minus that of the trace, where the search starts
    reach: float  # s, how far it may go; 0 if both have one clock
    # draws of the error of the trace's acceleration, none if it is exact
    deviations: tuple[Excitation, ...] = ()
    fitted: bool = False  # whether a first fit is over: errors of the trace count near the right machine only
    whitening: Whitening | None = None  # of the residuals for these errors

    @classmethod
    def of(
        cls,
        machine: Machine,
        motion: Motion,
        channels: Sequence[Channel],
        time: Array,
        values: Array,
        *,
        name: str = "sensor log",
        one_clock: bool = False,
        window: float | None = None,
    ) -> SensorLog:
        """A log of channels (n, k) beside the trace of a motion.

        one_clock: whether log and trace have the same stamps, so that there is no delay. window: s; by default a tenth
        of the period of the highest mode. Raises ArgumentError for a machine that is not linear, TraceError for a log
        that does not resemble the motion.
        """
        excitation = Excitation.of(machine, motion)
        stamps = excitation.motion.time
        window = window or _usual_window(machine)
        delay, reach = 0.0, 0.0 if one_clock else 0.5 / float(Modes.of(machine).frequency.min())
        expected = _expected(name, machine, excitation, channels)
        if reach and all(one.gain_spread == np.inf for one in channels):
            raise ArgumentError(
                f"{name}: sensors of unknown gain alone do not tell the delay between log and trace; record both with "
                "one clock (one_clock = true), or an accelerometer along x or a calibrated sensor in the same log"
            )
        if reach:
            delay = _best_delay(name, stamps, channels, expected, time, values)
        place = time - delay
        usable = (place >= stamps[0] + reach) & (place <= stamps[-1] - reach)
        windows = Windows.of(time, usable, window, name)
        spreads = values[windows.samples].std(axis=0)
        for channel, spread in zip(channels, spreads, strict=True):
            if not spread > 0.0:
                raise TraceError(
                    f"{name}: {channel.name}: expected a sensor that moves, got the same value everywhere"
                )
        given = zip(channels, spreads.tolist(), strict=True)
        levels = np.array([FIRST_LEVEL * spread if one.level is None else one.level for one, spread in given])
        gains = np.ones(len(channels))
        for i in [i for i, one in enumerate(channels) if one.gain_spread == np.inf]:
            there = np.interp(place[windows.samples], stamps, expected[:, i])
            gains[i] = np.cov(there, values[windows.samples, i])[0, 1] / there.var(ddof=1)
        return cls(
            name=name,
            excitation=excitation,
            time=time,
            values=values,
            windows=windows,
            levels=levels,
            channels=tuple(channels),
            gains=gains,
            delay=delay,
            reach=reach,
            deviations=draw_deviations(motion, stamps),
        )

    @classmethod
    def shown(cls, name: str, model: ModelAt, excitation: Excitation, channel: Channel) -> SensorLog:
        """The log of one channel of known noise, by the clock of the trace, as a machine would show it."""
        assert channel.level is not None
        time = excitation.motion.time
        values = np.hypot(channel.shown(model.run(excitation).at(time), model.rest).values, channel.level)
        windows = Windows.of(time, np.ones(values.size, dtype=np.bool_), _usual_window(model.machine), name)
        levels = np.array([channel.level])
        return cls(name, excitation, time, values[:, None], windows, levels, (channel,), np.ones(1), 0.0, 0.0)

    # ---- as the fit sees it

    @cached_property
    def nuisance(self) -> tuple[NuisanceParameter, ...]:
        sizes = abs(self.values[self.windows.samples]).max(axis=0)
        found = [
            NuisanceParameter(f"offset of {one.name} in {self.name}", one.unit, 0.0, WIDE * size, size)
            for one, size in zip(self.channels, sizes.tolist(), strict=True)
        ]
        for one, gain in zip(self.channels, self.gains.tolist(), strict=True):
            if one.gain_spread:
                unknown = one.gain_spread == np.inf
                scale = abs(gain) if unknown else one.gain_spread
                spread = WIDE * scale if unknown else scale
                found.append(
                    NuisanceParameter(f"gain of {one.name} in {self.name}", "1", gain, spread, scale)
                )
        if self.reach:
            bounds = self.delay - self.reach, self.delay + self.reach
            name = f"delay of {self.name}"
            found.append(
                NuisanceParameter(name, "s", self.delay, WIDE * self.reach, 0.1 * self.reach, bounds)
            )
        return tuple(found)

    @property
    def _gain_places(self) -> dict[int, int]:
        """Place among the nuisance parameters of the gain of each channel that has one."""
        scaled = [i for i, one in enumerate(self.channels) if one.gain_spread]
        return {i: place for place, i in enumerate(scaled, len(self.channels))}

    @property
    def noise(self) -> tuple[Noise, ...]:
        known = not self.deviations  # the noise of the whitened residuals is estimated
        return tuple(
            Noise(f"{one.name} in {self.name}", known and one.level is not None, level, one.unit)
            for one, level in zip(self.channels, self.levels.tolist(), strict=True)
        )

    @property
    def titles(self) -> tuple[tuple[str, str], ...]:
        return tuple((one.name, one.unit) for one in self.channels)

    def _whitened(self, series: Array) -> Array:
        return series if self.whitening is None else self.whitening(series)

    @property
    def error_draws(self) -> Array | None:
        return None if self.whitening is None else self.whitening.errors

    def prepared_for(self, model: ModelAt, nuisance: Array) -> SensorLog:
        """The log with its residuals whitened for the errors of the trace, near this machine."""
        if not self.deviations:
            return self
        if not self.fitted:
            return replace(self, fitted=True)
        if self.whitening is not None and self.whitening.is_near(model.z):
            return self
        runs = map(model.run_once, self.deviations)
        predicted = np.array([self.predicted(model, nuisance, run)[0] for run in runs])
        errors = predicted - nuisance[: len(self.channels), None]
        residuals = self.predicted(model, nuisance)[0] - self.measured
        scales = self.scales.reshape(residuals.shape)
        return replace(self, whitening=Whitening.of(model.z, errors / scales, residuals / scales))

    def predicted(
        self, model: ModelAt, nuisance: Array, run: RunDerivatives | None = None
    ) -> tuple[Array, Array, Array]:
        """run: by default that under the motion."""
        k, m = len(self.channels), self.windows.first.size
        instants = self.time[self.windows.samples] - (nuisance[-1] if self.reach else 0.0)
        at = (run or model.run(self.excitation)).at(self.excitation.within(instants))
        predicted, by_unknowns = np.empty((k, m)), np.empty((model.z.size, k, m))
        by_nuisance = np.zeros((nuisance.size, k, m))
        for i, channel in enumerate(self.channels):
            history = channel.shown(at, model.rest)
            plain, by_values, by_time = map(self.windows.mean, (history.values, history.by, history.slope))
            place = self._gain_places.get(i)
            gain = 1.0 if place is None else nuisance[place]
            predicted[i] = gain * plain + nuisance[i]
            by_unknowns[:, i] = gain * model.by_z(by_values)
            by_nuisance[i, i] = 1.0
            if place is not None:
                by_nuisance[place, i] = plain
            if self.reach:
                by_nuisance[-1, i] = -gain * by_time
        return predicted, by_unknowns, by_nuisance


def _usual_window(machine: Machine) -> float:
    """Length [s] of the windows if none is given."""
    return 1.0 / (PER_PERIOD * float(Modes.of(machine).frequency.max()))


def _expected(name: str, machine: Machine, excitation: Excitation, channels: Sequence[Channel]) -> Array:
    """(time, k) what the machine file predicts for the channels at the stamps of the trace."""
    run = VariedMachine(machine, ["body.mass"]).run(excitation.motion, start=excitation.start)
    at = run.at(excitation.motion.time)
    expected = [one.shown(at, run.at_rest).values for one in channels]
    for one, values in zip(channels, expected, strict=True):
        if isinstance(one.place, LoadPlace) and one.place.quantity == "carriage_loads":
            loads = run.carriage_loads()[:, one.place.index[0]]
            if np.abs(values).max() <= ROUNDING * np.abs(loads - loads[0]).max():
                raise ArgumentError(
                    f"{name}: {one.name} is 0 in this machine whatever it does, as its carriage does not resist there; "
                    "leave this channel out, or give the carriage a width"
                )
    return np.array(expected).T


def _best_delay(
    name: str, stamps: Array, channels: Sequence[Channel], expected: Array, time: Array, values: Array
) -> float:
    """The delay [s] at which the channels (n, k) are most likely, given what is expected of them (time, k) at stamps.

    With correlations c, the likelihood of a lag has the logarithm -n/2 sum ln(1 - c^2): a channel that hardly depends
    on unknown numbers decides. Raises TraceError if log and expectation hardly correlate.
    """
    step = max(float(np.median(np.diff(stamps))), float(np.median(np.diff(time))))
    here = np.arange(stamps[0], stamps[-1], step)
    there = np.arange(time[0], time[-1], step)
    lags = correlation_lags(there.size, here.size)
    sums, likelihood = np.zeros(lags.size), np.zeros(lags.size)
    for channel, predicted, measured in zip(channels, expected.T, values.T, strict=True):
        first, second = np.interp(here, stamps, predicted), np.interp(there, time, measured)
        first, second = first - first.mean(), second - second.mean()
        size = np.linalg.norm(first) * np.linalg.norm(second)
        alike = correlate(second, first, method="fft") / size if size > 0.0 else np.zeros(lags.size)
        sums += abs(alike) if channel.gain_spread == np.inf else alike
        likelihood -= np.log1p(-(np.clip(alike, 0.0, LIKEST) ** 2))
    overlap = correlate(np.ones(there.size), np.ones(here.size), method="fft")
    allowed = overlap >= LEAST_OVERLAP * min(there.size, here.size)
    best = int(np.argmax(np.where(allowed, likelihood, -np.inf)))
    if sums[best] < ALIKE * len(expected.T):
        raise TraceError(
            f"{name}: the log resembles the expected motion at no delay (best correlation "
            f"{sums[best] / len(expected.T):.2f}): is it of the same moves, and are points and directions right?"
        )
    return float(there[0] - here[0] + lags[best] * step)
