"""What to measure next for a peak load or a life: figure and derivatives, records and modal tests as candidates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hammer_tests import deflections, unknown
from lives import cart
from machines import with_mass
from motor_records import moves

from guideload import Machine, Motion, PointOfInterest, peak_loads
from guideload.base.errors import ArgumentError, ConfigError
from guideload.duty.duty_cycle import LoadCase, duty_cycle
from guideload.identification import (
    Identification,
    UnknownTable,
    identify,
    parse_place,
    rank_measurements,
)
from guideload.identification.description import CandidateTable, IdentifyFile
from guideload.identification.modal_test import ModalTest
from guideload.identification.model import Excitation, Model
from guideload.identification.next_measurement import TargetQuantity, TargetTable, carriage_target
from guideload.identification.sensor_log import Channel, SensorLog
from guideload.identification.unknowns import machine_with

TABLES = (
    UnknownTable(path="carriages.*.stiffness_y", each="rail"),
    UnknownTable(path="carriages.*.stiffness_z"),
)
STEP = 1e-5  # of the logarithm of a stiffness


@pytest.fixture(scope="module")
def machine() -> Machine:
    points = [
        PointOfInterest(name="tool", at=(0.1, 0.3, 0.2)),
        PointOfInterest(name="end", at=(-0.3, 0.1, -0.35)),
    ]
    return cart().model_copy(update={"points": tuple(points)})


@pytest.fixture(scope="module")
def found(machine: Machine) -> Identification:
    """The cart after a few deflections, which its machine file explains exactly."""
    pairs = [("tool y", "tool y"), ("tool z", "tool z"), ("end y", "tool y")]
    exact = deflections(Model(machine, unknown(machine, *TABLES)), np.zeros(3), pairs)
    return identify(machine, TABLES, [replace(exact, level=1e-7)], starts=1)


def changed(found: Identification, index: int, factor: float) -> Machine:
    """The identified machine with another value of one unknown."""
    moved = found.estimates[index]
    values = ((one, value * (factor if of is moved else 1.0)) for one, value, of in found.identified)
    return machine_with(found.nominal, values)


def heavy(machine: Machine) -> Machine:
    return with_mass(machine, 1.3 * machine.body.mass)


@pytest.mark.parametrize("quantity", ["peak_resultant", "mean_load", "life"])
def test_figures_of_runs_and_their_derivatives(
    quantity: str, machine: Machine, found: Identification
) -> None:
    """Against runs of two load cases, and of machines beside; the interval by the covariance of the logarithms."""
    motions = moves(1.0), moves(0.6, seed=3)

    def computed(index: int, factor: float) -> np.ndarray:
        one = changed(found, index, factor)
        cases = [LoadCase("a", one, motions[0], 3.0), LoadCase("b", heavy(one), motions[1], 40.0)]
        cycle = duty_cycle(cases, 3600.0)
        if quantity == "peak_resultant":
            peaks = (peak_loads(case.machine, case.motion) for case in cases)
            return np.max([each.largest[:, 6] for each in peaks], axis=0)
        return {"mean_load": cycle.mean_loads, "life": cycle.carriage_lives}[quantity]

    runs = [LoadCase("light", machine, motions[0], 3.0), LoadCase("heavy", heavy(machine), motions[1], 40.0)]
    figure = carriage_target(found, quantity, runs)
    # The mean load of a figure with derivatives is that of loads linear between the instants.
    rel = 1e-9 if quantity == "peak_resultant" else 2e-5
    assert figure.value == pytest.approx({"life": min}.get(quantity, max)(computed(0, 1.0)), rel=rel)
    figure = carriage_target(found, quantity, runs, "1b")
    gradient = []
    for index, one in enumerate(found.estimates):
        ends = (computed(index, np.exp(sign * STEP))[1] for sign in (1.0, -1.0))
        gradient.append(np.subtract(*ends) / (2.0 * STEP))
        assert one.value * figure.derivatives[one.name] == pytest.approx(
            gradient[-1], abs=max(rel, 1e-5) * figure.value
        )
    sigma = np.sqrt(np.array(gradient) @ found.covariance @ gradient) / figure.value
    assert np.log(figure.high / figure.low) == pytest.approx(2.0 * 1.96 * sigma, rel=1e-3)


def test_a_record_narrows_the_figure_as_the_ranking_said(machine: Machine, found: Identification) -> None:
    """The peak load's interval after a record that is as predicted."""
    motion = moves(1.0)
    channel = Channel(parse_place("tool y", machine), level=0.05)
    record = SensorLog.shown("record", found.model, Excitation.of(machine, motion), channel)
    before = carriage_target(found, "peak_resultant", [LoadCase("one", machine, motion, 1.0)])
    (candidate,) = rank_measurements(found, [record], before.derivatives)
    at = found.model.run(record.excitation).at(record.time)
    exact = channel.shown(at, found.model.rest).values
    noise = channel.level * np.random.default_rng(0).standard_normal(exact.size)
    made = replace(record, values=(exact + noise)[:, None])
    after = identify(machine, TABLES, [*found.data, made], starts=1)

    def width(figure: TargetQuantity) -> float:
        return float(np.log(figure.high / figure.low))

    narrowed = width(
        carriage_target(after, "peak_resultant", [LoadCase("one", machine, motion, 1.0)])
    ) / width(before)
    assert candidate.deviation == pytest.approx(narrowed, rel=0.3) and candidate.deviation < 0.7


def test_a_modal_test_shows_the_modes_that_the_hammer_moves(found: Identification, tmp_path: Path) -> None:
    """As measured it has no residuals; a hammer at a node of a mode, and a narrow band, leave modes out."""
    places = ["tool y", "tool z", "end y"]
    table = CandidateTable(kind="modal test", force=["tool y", "end y"], at=places)
    everywhere, at_end = table.measurements(found.model, tmp_path)
    assert isinstance(everywhere, ModalTest) and isinstance(at_end, ModalTest)
    for test, place in ((everywhere, 0), (at_end, 2)):
        assert abs(test.residuals(found.model, np.zeros(0)).values).max() < 1e-9
        assert all(abs(one.shape[place]) > 0.05 * abs(one.shape).max() for one in test.modes)
        assert 0 < len(test.modes) <= len(found.model.modes.eigenvalue)
    lowest = everywhere.modes[0].frequency
    band = CandidateTable(kind="modal test", force=["tool y"], at=places, high=1.01 * lowest)
    (narrow,) = band.measurements(found.model, tmp_path)
    assert [one.frequency for one in narrow.modes] == [lowest]
    deviations = [one.deviation for one in rank_measurements(found, [everywhere, narrow])]
    assert deviations[0] <= deviations[1] <= 1.0


def test_impossible_figures_and_candidates_are_refused(machine: Machine, found: Identification) -> None:
    with pytest.raises(ConfigError, match="expected either motion or duty"):
        TargetTable(quantity="life")
    for keys, words in (
        ({"kind": "record", "at": ["tool y"]}, "expected accuracy and motion beside kind record"),
        ({"kind": "deflection", "at": ["tool y"]}, "expected force beside kind deflection"),
        (
            {"kind": "modal test", "at": ["tool y"], "force": ["tool y"], "low": "600 Hz"},
            "expected low below high, 500 Hz",
        ),
        (
            {"kind": "modal test", "at": ["tool y"], "force": ["tool y"], "load": 1.0},
            "no load beside kind modal",
        ),
    ):
        with pytest.raises(ConfigError, match=words):
            CandidateTable(**keys)
    file = {"machine": "m.toml", "unknown": [{"path": "body.mass"}]}
    for figure, words in (
        (
            {"quantity": "lif", "motion": "m.toml"},
            'figure.quantity: expected "peak_resultant", "mean_load" or "life"',
        ),
        (3, "figure: expected the name of an unknown, or a table"),
    ):
        with pytest.raises(ConfigError, match=words):
            IdentifyFile(**file, figure=figure)
    with pytest.raises(ArgumentError, match="figure.carriage: expected one of 1a, 1b, 2a and 2b, got '3'"):
        carriage_target(found, "life", [LoadCase("one", machine, moves(0.2), 1.0)], "3")
    still = Motion.along_x([0.0, 0.1, 0.2], [0.0, 0.0, 0.0], velocity=[0.0, 0.0, 0.0])
    with pytest.raises(ArgumentError, match="expected a motion that travels"):
        carriage_target(found, "life", [LoadCase("one", machine, still, 1.0)])
