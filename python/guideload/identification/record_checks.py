"""Whether a record in time agrees with the model that was fitted to it: in size, variance and delay."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from guideload.base.arrays import Array
from guideload.base.number_text import digits
from guideload.identification.model import ModelAt
from guideload.identification.motor_force import MotorForce
from guideload.identification.records import Record

# A factor between measured and computed values that is so far from 1 is an error of the record.
LEAST_GAIN = 0.5
LEAST_DELAY = 1.5e-3  # s; shorter ones may be errors of the smoothing
CERTAIN = 5.0  # standard deviations
FEWEST = 20  # values that show a delay


class RecordChannel(NamedTuple):
    """Measured and computed values (windows,) of a channel of a record, in a unit."""

    name: str
    unit: str
    measured: Array
    computed: Array


def record_channels(data: Record, model: ModelAt, nuisance: Array) -> list[RecordChannel]:
    """The channels of a record. nuisance: the nuisance parameters of the record, in SI."""
    histories = zip(data.titles, data.measured, data.predicted(model, nuisance)[0], strict=True)
    return [RecordChannel(*name, measured, computed) for name, measured, computed in histories]


def explained_share(measured: Array, computed: Array) -> float:
    """Share of the variance of measured values that computed ones explain."""
    variance = float(measured.var())
    return 1.0 - float(np.mean((computed - measured) ** 2)) / variance if variance > 0.0 else 0.0


def record_doubts(data: Record, channels: list[RecordChannel]) -> Iterator[str]:
    """Sentences on channels that the model contradicts, and on a delay that was not sought."""
    has_delay = any(one.name.startswith("delay") for one in data.nuisance)
    for name, _, measured, computed in channels:
        channel = name if name == data.name else f"{name} in {data.name}"
        share, (gain, error) = explained_share(measured, computed), _gain(measured, computed)
        if share < 0.0 or abs(gain - 1.0) > max(LEAST_GAIN, CERTAIN * error):
            yield (
                f"{channel} contradicts the model, which explains {digits(100.0 * share, 3)} % of its variance; it is "
                f"{digits(gain)} times what the model computes. Do not use numbers that come from it: check unit, "
                "sign, place and clock of the record, and what the model lacks"
            )
        delay, error = (0.0, 0.0) if has_delay else _delay(data.window_time, measured, computed)
        if abs(delay) > max(LEAST_DELAY, CERTAIN * error):
            key = "delay = true" if isinstance(data, MotorForce) else "one_clock = false"
            side = "late" if delay > 0.0 else "early"
            yield (
                f"{channel} is about {digits(1e3 * abs(delay), 2)} ms {side}, which makes the numbers wrong: set {key} "
                "in its table"
            )


def _gain(measured: Array, computed: Array) -> tuple[float, float]:
    """Factor from computed to measured values by least squares, and its standard deviation; 1 and inf of zeros."""
    square = float(computed @ computed)
    if square == 0.0:
        return 1.0, float("inf")
    gain = float(measured @ computed) / square
    left = float(np.linalg.norm(measured - gain * computed))
    return gain, left / float(np.sqrt(square * max(measured.size - 1, 1)))


def _delay(time: Array, measured: Array, computed: Array) -> tuple[float, float]:
    """Delay [s] of measured values that explains their differences best, and its standard deviation.

    By least squares, beside a factor and an offset. 0 and inf where the computed values do not change.
    """
    if measured.size < FEWEST:
        return 0.0, float("inf")
    columns = np.column_stack([-np.gradient(computed, time), computed, np.ones_like(computed)])
    sizes = np.linalg.norm(columns, axis=0)
    columns /= np.where(sizes > 0.0, sizes, 1.0)
    numbers, _, rank, _ = np.linalg.lstsq(columns, measured - computed, rcond=None)
    if rank < len(sizes):
        return 0.0, float("inf")
    left = measured - computed - columns @ numbers
    variance = float(left @ left) / (left.size - rank) * float(np.linalg.inv(columns.T @ columns)[0, 0])
    return float(numbers[0] / sizes[0]), float(np.sqrt(variance) / sizes[0])
