"""Logs of sensors: exact derivatives, known values found again with the delay of the clocks, unlike logs refused."""

from __future__ import annotations

import numpy as np
import pytest
from hammer_tests import derivative_errors, unknown
from motor_records import SOFT_TABLES, TOOL, moves, shown_by, soft_axis
from reference import cart_clear

from guideload import Machine, Motion
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, TraceError
from guideload.identification.fit import COARSE, Objective
from guideload.identification.model import Model, parse_place
from guideload.identification.result import identify
from guideload.identification.sensor_log import Channel, SensorLog

DELAY, OFFSETS, GAINS = 12.345678, np.array([-9.8, 0.1, 1e-5]), np.array([1.02, 1.0, 1.0])
STIFFER, MORE_DAMPED = 1.15, 0.7


def channels_on(machine: Machine) -> tuple[Channel, ...]:
    return (
        Channel(parse_place("tool y", machine), gain_spread=0.05),
        Channel(parse_place("tool x", machine)),
        Channel(parse_place("tool -y", machine), "displacement"),
    )


@pytest.fixture(scope="module")
def motion() -> Motion:
    return moves(2.0)


@pytest.fixture(scope="module")
def log(motion: Motion) -> tuple[Array, Array]:
    """Stamps of another clock at 870 Hz, and what the sensors of the true machine show there."""
    true = soft_axis(STIFFER, MORE_DAMPED)
    time = np.arange(0.05, 1.95, 1.0 / 870.0)
    return time + DELAY, GAINS * shown_by(true, motion, channels_on(true), time) + OFFSETS


def test_derivatives_are_exact(motion: Motion, log: tuple[Array, Array]) -> None:
    """Against central differences, by the unknowns, offsets, gain and delay."""
    machine = soft_axis()
    data = SensorLog.of(machine, motion, channels_on(machine), *log)
    model = Model(machine, unknown(machine, *SOFT_TABLES))
    nuisance = np.array([0.3, -0.1, 1e-5, 1.01, data.delay + 1e-3])
    own_steps = [1.0, 1.0, 1e-4, 0.1, 1e-6]
    errors, own = derivative_errors(data, model, np.array([0.1, -0.2]), nuisance, own_steps=own_steps)
    assert errors.max() < 1e-5 and own.max() < 1e-5


def test_exact_log_gives_stiffness_damping_and_the_delay_of_the_clocks(
    motion: Motion, log: tuple[Array, Array]
) -> None:
    machine = soft_axis()
    data = SensorLog.of(machine, motion, channels_on(machine), *log)
    found = identify(machine, SOFT_TABLES, [data], starts=2)
    stiffness, damping = (one.value for one in found.estimates)
    assert stiffness == pytest.approx(1e7 * STIFFER, rel=1e-6)
    assert damping == pytest.approx(1e3 * MORE_DAMPED, rel=1e-5)
    assert found.nuisance_values(found.data[0])[3:] == pytest.approx([GAINS[0], DELAY], rel=1e-6)


def test_intervals_cover_in_noise(motion: Motion, log: tuple[Array, Array]) -> None:
    """Two seeds; the share over many is measured by tests/benchmarks/identification.py."""
    machine, (time, values) = soft_axis(), log
    for seed in range(2):
        noise = np.random.default_rng(seed).standard_normal(values.shape)
        data = SensorLog.of(
            machine, motion, channels_on(machine), time, values + 0.1 * values.std(axis=0) * noise
        )
        stiffness, damping = identify(machine, SOFT_TABLES, [data], starts=1).estimates
        for one, true in ((stiffness, 1e7 * STIFFER), (damping, 1e3 * MORE_DAMPED)):
            sigma = (one.high - one.low) / 3.92
            assert abs(one.value - true) < 4.0 * sigma and sigma < 0.05 * true


def test_a_log_of_other_moves_is_refused(motion: Motion, log: tuple[Array, Array]) -> None:
    machine, (time, values) = soft_axis(), log
    with pytest.raises(TraceError, match="resembles the expected motion at no delay.*same moves"):
        noise = np.random.default_rng(0).standard_normal(values.shape)
        SensorLog.of(machine, motion, channels_on(machine), time, noise)
    with pytest.raises(TraceError, match="acceleration of tool x: expected a sensor that moves"):
        SensorLog.of(machine, motion, channels_on(machine), time, values * [1.0, 0.0, 1.0])


def test_machines_that_are_not_linear_are_refused(motion: Motion, log: tuple[Array, Array]) -> None:
    machine = cart_clear().model_copy(update={"points": (TOOL,)})
    with pytest.raises(
        ArgumentError, match="links of the level piecewise linear.*give its stiffness as one number"
    ):
        SensorLog.of(machine, motion, channels_on(machine), *log)


def test_a_search_does_not_depend_on_the_zero_of_a_clock(motion: Motion, log: tuple[Array, Array]) -> None:
    """A coarse search, too, ends at the true stiffness, wherever the clock of the logger has its zero."""
    machine, ends = soft_axis(), []
    for later in (0.0, 1e4):
        data = SensorLog.of(machine, motion, channels_on(machine), log[0] + later, log[1])
        objective = Objective(Model(machine, unknown(machine, *SOFT_TABLES)), [data])
        end = objective.search(objective.expected, tolerance=COARSE)
        ends.append(end.x - objective.expected)
    assert np.exp(ends[0][0]) == pytest.approx(STIFFER, rel=1e-3)
    # Stamps of 10 000 s are rounded to 2e-12 s.
    assert ends[1] == pytest.approx(ends[0], abs=1e-6)
