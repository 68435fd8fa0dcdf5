"""The core's batch as Python calls it: conversions, errors, and rows that equal single runs."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import reference as ref
from samples import assert_samples_are_runs

from guideload import Machine, Motion, Study
from guideload._core import Batch, Law
from guideload.base.errors import ArgumentError, SceneError, TraceError

MACHINE = ref.on_rails((0.0,), 0.6, ("y", "z", "rx", "ry", "rz"), 5e4)  # the paper's two carriages
LINKS = 8
TIME = np.concatenate([np.linspace(0.0, 0.1, 60), np.linspace(0.1, 0.13, 40)])
ACCELERATION = np.column_stack([2.0 * np.sin(80.0 * TIME), np.cos(50.0 * TIME), 0.0 * TIME])
MEASURES = [
    (q, g, s) for g in (0, 1) for q in ("Fy", "Mz", "resultant") for s in ("min", "max", "rms", "start")
]


def batch(
    law: Law, changes: Sequence[Any], measures: Sequence[tuple[str, int, str]] = MEASURES, **other: Any
) -> Batch:
    arguments: dict[str, Any] = {
        "laws": [law] * LINKS,
        "time": TIME,
        "acceleration": ACCELERATION,
        "wrench": None,
        "speed": np.abs(np.sin(TIME)),
        "exponent": 3.0,
        "changes": changes,
        "measures": measures,
        "method": "auto",
        "rtol": 1e-6,
    }
    return ref.core_batch(MACHINE, **arguments | other)


def stiffness_of_carriages() -> list[Any]:
    """Mass in column 0, the stiffness of each carriage in columns 1 and 2."""
    changes: list[Any] = [(("mass", 0, 0), 0.0, [(0, 1.0)])]
    return changes + [(("law", link, "stiffness"), 0.0, [(1 + link // 4, 6e7)]) for link in range(LINKS)]


def moved_parts() -> Machine:
    """The cart with widths, a rolled rail and mounting errors."""
    machine = ref.cart(width=0.03)
    first, second = machine.rails
    rolled = second.model_copy(update={"roll": "30 deg", "mounting_error": (2e-6, 1e-6)})
    return machine.model_copy(update={"rails": (first, rolled)})


SCALED = [
    {"path": "body.mass", "distribution": "uniform", "plus_minus": "20 %"},
    {"path": "carriages.*.stiffness", "each": "carriage", "distribution": "lognormal", "sigma": 0.1},
]
MOVED = [
    {"path": f"carriages.*.{key}", "each": "carriage", "distribution": "uniform", "plus_minus": "20 %"}
    for key in ("length", "width")
]
MOVED += [
    {"path": path, "each": "value", "distribution": "normal", "sigma": "5 um"}
    for path in ("rails.*.mounting_error", "carriages[2b].mounting_error")
]
MOVED += [{"path": "rails.*.position", "each": "value", "distribution": "normal", "sigma": "20 mm"}]


@pytest.mark.parametrize(
    ("machine", "vary"),
    [
        (ref.cart(), SCALED),
        (ref.cart_clear(), SCALED),
        (moved_parts(), MOVED),
        (ref.cart_clear(), MOVED[:1] + MOVED[2:]),
    ],
    ids=["linear", "clear", "moved", "moved, clear"],
)
def test_rows_are_those_of_single_runs(machine: Machine, vary: list[dict[str, Any]]) -> None:
    motion = Motion(TIME, ACCELERATION, velocity=0.5 + 0.0 * ACCELERATION)
    study = Study(machine=machine, motion=motion, vary=vary, samples=5, seed=1)
    assert_samples_are_runs(study, range(5), 1e-12)


@pytest.mark.parametrize(
    "law", [Law.sided(6e7, 6e7, 0.0), Law.sided(6e7, 6e7, 5e-6)], ids=["linear", "clear"]
)
@pytest.mark.parametrize("exponent", [3.0, 10.0 / 3.0])
def test_a_payload_that_stays_is_part_of_the_body(law: Law, exponent: float) -> None:
    """Also if its stay consists of two that touch, one of which begins within a block of samples."""
    time = np.insert(TIME, 71, TIME[70])
    keys = {
        "time": time,
        "acceleration": np.insert(ACCELERATION, 71, ACCELERATION[70], axis=0),
        "speed": np.abs(np.sin(time)),
        "exponent": exponent,
        "measures": [
            *MEASURES,
            *(
                (q, 1, s)
                for q, s in (("Fy", "time_of_max"), ("load", "mean"), ("load", "max"), ("contact", "lost"))
            ),
            *(("drive", 0, s) for s in ("min", "max", "time_of_min", "rms")),
        ],
    }
    half = (625.0, (0.12, -0.65, 0.18), (0.5 * np.array(MACHINE.body.inertia)).tolist(), False)
    halves = {"mass": half[0], "inertia": half[2]}
    changes = [(("payload_mass", 0, 0), 25.0, [(0, 0.5)])]
    values = np.array([[1200.0], [1300.0]])
    whole, _ = batch(law, [(("mass", 0, 0), 650.0, [(0, 0.5)])], **keys).run(values, 1)
    for stays in ([(0, time.size)], [(0, 71), (71, time.size)]):
        parts, failures = batch(law, changes, **keys, **halves, payloads=[(*half, stays)]).run(values, 1)
        assert not failures
        np.testing.assert_allclose(parts, whole, rtol=1e-10, atol=1e-9)


def test_stays_of_payloads_and_their_values_are_checked() -> None:
    part = (90.0, (0.3, 0.2, -0.1), MACHINE.body.inertia, False)
    for stay in ((0, 101), (50, 50), (0, 50)):
        with pytest.raises(
            ArgumentError, match=r"payloads\[0\]: expected stays within the 100 samples, and two"
        ):
            batch(Law.linear(6e7), [], payloads=[(*part, [stay])])
    one = batch(Law.linear(6e7), [(("payload_mass", 0, 0), 0.0, [(0, 1.0)])], payloads=[(*part, [(0, 100)])])
    _, failures = one.run(np.array([[90.0], [-1.0]]), 1)
    assert failures == [(1, "payloads[0].mass: expected > 0 kg, got -1")]
    with pytest.raises(ArgumentError, match=r"the scene has no payloads\[1\]\.mass"):
        batch(Law.linear(6e7), [(("payload_mass", 1, 0), 0.0, [(0, 1.0)])], payloads=[(*part, [(0, 100)])])


def test_samples_without_a_rest_position_are_counted() -> None:
    """Carriages that bear a load downwards only: the body tips where its centre of mass lies beyond a rail."""
    beside = np.array([[0.0], [0.3], [0.36], [1.4]])  # m, of the rails at 0.35 m
    changes = [(("center_of_mass", 2, 0), 0.0, [(0, 1.0)])]
    table, failures = batch(Law.sided(0.0, 6e7, 0.0), changes, free=["y", "rx", "rz"]).run(beside, 2)
    assert np.isfinite(table[:2]).all() and np.isnan(table[2:]).all()
    assert [index for index, _ in failures] == [2, 3]
    assert all(
        "no static equilibrium" in message and "rotation about x" in message for _, message in failures
    )


def test_the_interpreter_is_free_meanwhile_and_one_batch_serves_all_threads() -> None:
    values = np.random.default_rng(2).uniform(0.8, 1.2, (200, 3)) * [1250.0, 1.0, 1.0]
    shared = batch(Law.sided(6e7, 6e7, 5e-6), stiffness_of_carriages())
    tables: list[Any] = [None] * 4

    def work(i: int) -> None:
        tables[i] = shared.run(values[50 * i : 50 * i + 50], 1)[0]

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    whole, _ = shared.run(values, 3)
    np.testing.assert_array_equal(np.concatenate(tables), whole)


def test_a_sample_without_a_result_is_nan_and_has_its_reason() -> None:
    values = np.array([[1250.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1250.0, 1.0, -2.0], [1250.0, 0.0, 0.0]])
    table, failures = batch(Law.linear(6e7), stiffness_of_carriages()).run(values, 1)
    assert [row for row, _ in failures] == [1, 2, 3]
    assert failures[0][1] == "body.mass: expected > 0 kg, got -1"
    assert failures[1][1].startswith("links[4].stiffness: expected >= 0 N/m, got -120000000")
    assert failures[2][1].startswith("the body is not supported")
    assert np.isfinite(table[0]).all()
    assert np.isnan(table[1:]).all()


def test_empty_tables_are_tables() -> None:
    table, failures = batch(Law.linear(6e7), []).run(np.empty((0, 3)), 4)
    assert table.shape == (0, len(MEASURES)) and failures == []
    table, _ = batch(Law.linear(6e7), [], measures=[]).run(np.empty((70, 0)), 2)
    assert table.shape == (70, 0)


@pytest.mark.parametrize(
    ("error", "match", "changed"),
    [
        (SceneError, "body.mass", {"mass": 0.0}),
        (SceneError, r"links\[3\].damping", {"damping": np.array([5e4, 5e4, 5e4, -1.0, 0, 0, 0, 0])}),
        (TraceError, "time", {"time": TIME[::-1].copy()}),
        (ArgumentError, "rtol", {"rtol": 0.0}),
        (ArgumentError, "exponent", {"exponent": 0.0}),
        (ArgumentError, "speed: expected 100 numbers, got 3", {"speed": np.zeros(3)}),
        (ArgumentError, r"links\[8\].damping", {"changes": [(("damping", 8, 0), 1.0, [])]}),
        (ArgumentError, "body.mass twice", {"changes": [(("mass", 0, 0), 1.0, [])] * 2}),
        (ArgumentError, "measures", {"measures": [("Fy", 2, "max")]}),
        (ValueError, "measures", {"measures": [("Fq", 0, "max")]}),
        (ValueError, "changes", {"changes": [(("colour", 0, 0), 1.0, [])]}),
        (ValueError, "changes", {"changes": [(("law", 0, "weight"), 1.0, [])]}),
        (ValueError, "method", {"method": "euler"}),
        (IndexError, "there is no link 8", {"groups": [np.arange(4), np.array([8])]}),
    ],
)
def test_errors_name_what_is_wrong(error: type[Exception], match: str, changed: dict[str, Any]) -> None:
    arguments = {"changes": [], **changed}
    with pytest.raises(error, match=match):
        batch(Law.linear(6e7), **arguments)


def test_a_method_that_a_law_does_not_have_is_a_reason() -> None:
    preloaded = Law.preloaded(6e7, 600.0, 1.5)
    _, failures = batch(preloaded, [], method="exact").run(np.empty((1, 0)), 1)
    assert "no exact solution" in failures[0][1]
    rows = [
        batch(preloaded, [], method=method).run(np.empty((1, 0)), 1)
        for method in ("auto", "exponential", "rk45", "implicit")
    ]
    assert all(failures == [] for _, failures in rows)
    np.testing.assert_allclose(rows[1][0], rows[2][0], rtol=1e-4)
    np.testing.assert_allclose(rows[2][0], rows[3][0], rtol=1e-4)
    np.testing.assert_array_equal(rows[0][0], rows[1][0])


def test_values_of_another_shape_are_refused() -> None:
    sound = batch(Law.linear(6e7), stiffness_of_carriages())
    with pytest.raises(ArgumentError, match="values: expected 3 columns"):
        sound.run(np.ones((2, 2)), 1)
    with pytest.raises(ValueError, match="C-contiguous"):
        sound.run(np.ones((3, 2)).T, 1)
