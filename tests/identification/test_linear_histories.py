"""Histories of a linear machine: those of the core, at any instant, and exact derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hammer_tests import unknown
from motor_records import moves
from reference import cart, cart_clear

from guideload import Machine, Motion, simulate
from guideload.base.errors import ArgumentError
from guideload.identification.linear_histories import Inputs, LinearHistories
from guideload.identification.model import Model
from guideload.identification.unknowns import UnknownTable

ROW = np.array([0.0, 1.0, -0.4, 0.2, 0.1, 0.5])
QUANTITIES = ("displacement", "velocity", "acceleration")
TABLES = (
    UnknownTable(path="body.mass"),
    UnknownTable(path="body.center_of_mass.y", spread=0.1),
    UnknownTable(path="carriages.*.stiffness_y"),
    UnknownTable(path="carriages.*.damping_z"),
)


@pytest.fixture(scope="module")
def machine() -> Machine:
    return cart()


@pytest.fixture(scope="module")
def motion() -> Motion:
    return moves(1.0)


def at_rest(machine: Machine, motion: Motion) -> LinearHistories:
    model = Model(machine, unknown(machine, *TABLES))
    return model.at(np.zeros(len(TABLES))).histories(Inputs.of(machine, motion))


def test_histories_are_those_of_the_core(machine: Machine, motion: Motion) -> None:
    """At the stamps and between them, where the core gets them as further stamps."""
    between = np.sort(np.random.default_rng(0).uniform(0.0, 1.0, 200))
    time = np.unique(np.concatenate([motion.time, between]))
    finer = Motion.along_x(time, np.interp(time, motion.time, motion.acceleration[:, 0]))
    expected = simulate(machine, finer, "exact")
    histories = at_rest(machine, motion)
    at = histories.at(time)
    outputs = [histories.along(ROW, i) for i in range(3)]
    sag = expected.quantities["static_displacement"] @ ROW
    wanted = [expected.quantities[name] @ ROW - (sag if i == 0 else 0.0) for i, name in enumerate(QUANTITIES)]
    for output, reference in zip(
        [*outputs, histories.reaction(0)], [*wanted, expected.history("reaction")[:, 0]], strict=True
    ):
        found = histories.history(output, at).values
        assert found == pytest.approx(reference, abs=1e-9 * abs(reference).max())


def test_derivatives_are_exact(machine: Machine, motion: Motion) -> None:
    """By the unknowns and by time, against central differences, whose error here is below 1e-6 of the largest."""
    model = Model(machine, unknown(machine, *TABLES))
    inputs, step = Inputs.of(machine, motion), 1e-5
    time = np.linspace(0.30034, 0.70034, 40)
    z = np.array([0.1, 0.02, -0.2, 0.3])

    def history(z: np.ndarray, time: np.ndarray, kind: int):
        histories = model.at(z).histories(inputs)
        output = histories.along(ROW, kind) if kind < 3 else histories.reaction(0)
        return histories.history(output, histories.at(time))

    for kind in range(4):
        found = history(z, time, kind)
        by = model.at(z).by_z(found.by)
        for unit, derivative in zip(np.eye(4), by, strict=True):
            slope = (
                history(z + step * unit, time, kind).values - history(z - step * unit, time, kind).values
            ) / step
            assert derivative == pytest.approx(0.5 * slope, abs=1e-6 * abs(slope).max())
        later, earlier = (history(z, time + shift, kind).values for shift in (1e-7, -1e-7))
        assert found.slope == pytest.approx((later - earlier) / 2e-7, abs=1e-6 * abs(found.slope).max())


def test_equal_modes_keep_their_derivatives() -> None:
    """A slide with the same stiffness in y and z: its modes come in pairs of one frequency."""
    keys = {"rail": "1", "length": 0.2, "width": 0.2, "stiffness_y": 1e8, "stiffness_z": 1e8}
    machine = Machine(
        rails=[{"name": "1", "position": [0.0, 0.0]}],
        body={"mass": 100.0, "center_of_mass": [0.0, 0.0, 0.0], "inertia": np.diag([1.0, 1.0, 1.0]).tolist()},
        carriages=[{"name": "a", "x": 0.0, **keys, "damping_y": 1e4, "damping_z": 1e4}],
    )
    model = Model(machine, unknown(machine, UnknownTable(path="carriages.*.stiffness_y")))
    motion = moves(0.5)
    force = np.zeros((motion.time.size, 3))
    force[:, 1:] = np.sin(400.0 * motion.time)[:, None]
    inputs = Inputs.of(machine, motion.with_force([0.1, 0.1, 0.0], force))

    def history(z: float):
        histories = model.at(np.array([z])).histories(inputs)
        return histories.history(histories.along(ROW, 1), histories.at())

    slope = (history(1e-5).values - history(-1e-5).values) / 2e-5
    found = model.at(np.zeros(1)).by_z(history(0.0).by)[0]
    assert found == pytest.approx(slope, abs=1e-5 * abs(slope).max())


def test_a_record_that_begins_under_way_does_not_ring(machine: Machine) -> None:
    """A constant acceleration from before the first stamp leaves the machine in its quasi-static place."""
    motion = Motion.along_x(np.arange(50) * 1e-3, np.full(50, 2.0), recorded=True)
    histories = at_rest(machine, motion)
    found = histories.history(histories.along(ROW, 0), histories.at())
    assert np.ptp(found.values) < 1e-12 * abs(found.values).max()
    assert np.ptp(found.by, axis=1).max() < 1e-9 * abs(found.by).max()


def test_machines_that_are_not_linear_are_refused(motion: Motion) -> None:
    with pytest.raises(
        ArgumentError, match="links of the level piecewise linear.*give its stiffness as one number"
    ):
        Inputs.of(cart_clear(), motion)
