"""What an identification is worth: coverage, numbers without a value, residuals, models, what to measure next."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from hammer_tests import deflections, unknown, with_corners
from reference import cart

from guideload import ArgumentError, Machine, Modes
from guideload.identification import Deflections, UnknownTable, compare, identify, rank_measurements
from guideload.identification.description import identify_file
from guideload.identification.fit import fit
from guideload.identification.model import Model
from guideload.identification.model_comparison import _scores

EXAMPLES = Path(str(files("guideload"))) / "examples"
MACHINE = with_corners(cart())
ALONG_Y = UnknownTable(path="carriages.*.stiffness_y", each="rail")
ALONG_Z = UnknownTable(path="carriages.*.stiffness_z")
TABLES = (ALONG_Y, ALONG_Z)
TRUTH = np.array([-0.2, -0.5, -0.3])
PAIRS = [(a, b) for a in ("p0 y", "p2 y", "p1 z") for b in ("p0 y", "p1 y", "p2 y", "p3 z")]


def still(
    truth: np.ndarray, noise: float, seed: int = 0, pairs: list[tuple[str, str]] = PAIRS
) -> Deflections:
    """Displacements of the cart with these stiffnesses."""
    model = Model(MACHINE, unknown(MACHINE, *TABLES))
    return deflections(model, truth, pairs, noise, np.random.default_rng(seed))


def test_intervals_hold_the_truth() -> None:
    """Of 60 intervals, each with 95 %, less than 51 do so once in 2000 times; more in tests/benchmarks."""
    held = 0
    for seed in range(20):
        truth = 0.3 * np.random.default_rng(100 + seed).standard_normal(3)
        found = identify(MACHINE, TABLES, [still(truth, 0.02, seed)], starts=1)
        held += sum(one.low <= z <= one.high for one, z in zip(found.intervals, truth, strict=True))
    assert held >= 51


def test_without_information_there_is_no_number() -> None:
    """At rest neither mass nor damping shows; stiffness does."""
    tables = (ALONG_Z, UnknownTable(path="body.mass"), UnknownTable(path="carriages.*.damping_z"))
    found = identify(MACHINE, tables, [still(TRUTH, 0.01)], starts=2)
    assert [one.is_identified for one in found.estimates] == [True, False, False]
    assert [one.words for one in found.undetermined] == [
        "body.mass: these data say nothing about it",
        "carriages.*.damping_z: these data say nothing about it",
    ]
    assert found.estimates[1].narrowed == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("noise", "stated", "words"), [(0.05, 0.01, "times the stated noise"), (0.01, 0.1, "only")]
)
def test_noise_that_is_stated_wrong_is_noticed(noise: float, stated: float, words: str) -> None:
    data = still(TRUTH, noise)
    found = identify(MACHINE, TABLES, [replace(data, level=data.level * stated / noise)], starts=1)
    assert any(words in doubt for doubt in found.residuals[0].doubts)


@pytest.mark.parametrize("factor", [2.0, 0.01])
def test_estimated_noise_is_that_of_the_data(factor: float) -> None:
    """48 values determine their noise to 10 %; what is stated counts as three values more, unless it is far off."""
    data = still(TRUTH, 0.02, pairs=PAIRS * 4)
    found = identify(MACHINE, TABLES, [replace(data, level=data.level / factor, known=False)], starts=1)
    assert found.residuals[0].factor == pytest.approx(factor, rel=0.3)


def test_cross_validation_leaves_values_out() -> None:
    """The closed form of leaving out one value against fitting the others; one block is one value."""
    pairs = PAIRS[:8]
    data = still(TRUTH, 1e-4, pairs=pairs)
    found = identify(MACHINE, TABLES, [data], starts=1)
    scores = _scores(found)
    for i in range(len(pairs)):
        kept = tuple(one for k, one in enumerate(data.values) if k != i)
        rest = fit(Model(MACHINE, found.unknowns), [replace(data, values=kept)], starts=1)
        left = replace(data, values=(data.values[i],))
        model = rest.objective.model.at(rest.minimum.x)
        residual = left.residuals(model, np.zeros(0))
        gain = residual.by_unknowns[0]
        variance = 1.0 + gain @ rest.covariance @ gain
        density = -0.5 * (residual.values[0] ** 2 / variance + np.log(2.0 * np.pi * variance))
        assert scores[i] == pytest.approx(density - np.log(data.level), abs=1e-3)


def test_the_simplest_model_that_explains_the_data_is_taken() -> None:
    alike = (UnknownTable(path="carriages.*.stiffness_y"), ALONG_Z)
    for truth, best in ((TRUTH, "by rail"), (np.array([-0.2, -0.2, -0.3]), "alike")):
        data = still(truth, 0.02)
        models = {
            name: identify(MACHINE, t, [data], starts=1)
            for name, t in (("by rail", TABLES), ("alike", alike))
        }
        assert [one.name for one in compare(models) if one.is_best] == [best]


def test_a_measurement_narrows_as_the_ranking_said() -> None:
    """The second data are those of the machine that the first ones gave, so that the most probable machine stays."""
    before = identify(MACHINE, TABLES, [still(TRUTH, 0.02)], starts=1)
    second = still(before.fit.minimum.x, 0.005, pairs=[("p1 z", "p3 z"), ("p2 y", "p2 y")])
    name = before.unknowns[2].name
    (candidate,) = rank_measurements(before, [second], {name: 1.0})
    after = identify(MACHINE, TABLES, [still(TRUTH, 0.02), second], starts=1)
    narrowed = np.sqrt(np.diag(after.covariance) / np.diag(before.covariance))
    assert candidate.deviation == pytest.approx(narrowed[2], rel=0.02) and candidate.deviation < 0.5
    (of_all,) = rank_measurements(before, [second])
    assert of_all.deviation == pytest.approx(np.exp(np.log(narrowed).mean()), rel=0.02)


def test_the_ranking_says_what_would_be_identified() -> None:
    before = identify(MACHINE, TABLES, [still(TRUTH, 0.02, pairs=PAIRS[:3])], starts=1)
    (candidate,) = rank_measurements(before, [still(TRUTH, 0.01, pairs=[("p1 z", "p3 z")])])
    assert not before.estimates[2].is_identified and candidate.identified == (before.unknowns[2].name,)


def test_the_gantry_has_the_yaw_mode_of_the_paper() -> None:
    """Garcia-Herreros et al. (2013): 5.1 Hz with a damping ratio of about 0.09; J = 3.77 kg m2, k = 3975 N m/rad."""
    machine = Machine.from_toml(EXAMPLES / "gantry.toml")
    modes = Modes.of(machine)
    assert modes.frequency[0] == pytest.approx(np.sqrt(3975.0 / 3.77) / (2.0 * np.pi), rel=1e-3)
    assert modes.frequency[0] == pytest.approx(5.1, abs=0.1) and modes.damping_ratio[0] == pytest.approx(
        0.09, abs=0.005
    )


def test_the_packaged_hammer_test_gives_the_gantry_that_made_it() -> None:
    found = identify_file(EXAMPLES / "identify.toml")
    identified = {one.name: one for one in found.estimates if one.is_identified}
    truth = {"carriages[1].stiffness_y": 26e6, "carriages[2].stiffness_y": 23e6}
    for name, value in truth.items():
        assert identified[name].low < value < identified[name].high
        assert identified[name].value == pytest.approx(value, rel=0.03)
    assert [one.words.partition(", ")[0] for one in found.undetermined] == [
        "stiffness_z of carriages 1 and 2: only their sum",
        "stiffness of links joint 1 and joint 2: only their sum",
    ]


def test_deflections_that_say_nothing_are_refused() -> None:
    test = still(TRUTH, 0.01)
    for level in (0.0, -1e-8, np.nan):
        with pytest.raises(ArgumentError, match="^level: expected a finite standard deviation > 0, got"):
            replace(test, level=level)
    with pytest.raises(ArgumentError, match="^values: expected at least one deflection"):
        replace(test, values=())
    for name in ("force", "moved"):
        with pytest.raises(ArgumentError, match=f"^{name}: expected a finite number, got nan"):
            replace(test.values[0], **{name: np.nan})
    for starts in (0, -1):
        with pytest.raises(ArgumentError, match="^starts: expected a whole number from 1"):
            identify(MACHINE, TABLES, [test], starts=starts)
