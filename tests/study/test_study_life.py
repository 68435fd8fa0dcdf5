"""Life, static safety and probability of failure in a study: those of single runs, and known distributions."""

from __future__ import annotations

from dataclasses import astuple
from typing import Any

import numpy as np
import pytest
import studies
from lives import PRODUCT, cart, moved
from machines import with_carriages
from moves import GENTLE
from samples import sample_machine
from scipy import integrate

from guideload import Life, LifeConditions, Machine, Study, life_of, run_study, simulate
from guideload.base.errors import ArgumentError, ConfigError
from guideload.base.number_text import kilometres
from guideload.catalogue.product import Product
from guideload.motion.motion import Motion, refined
from guideload.reports.study import study_report
from guideload.simulation.instants import with_enough_instants
from guideload.study.metadata import StudyMetadata
from guideload.study.quantities import QUANTITIES
from guideload.study.result import StudyResult

MOTION = moved(GENTLE, 200.0)
CONDITIONS = {"reliability": 0.95, "hardness_factor": 0.9, "life": "20000 km", "application": "strong shock"}
PRELOADED = {"preload_y": 8e3, "preload_z": 8e3, "rolling": "ball"}
LINEAR = 1e-5  # of the life: means of loads are exact in a study with linear links, those of a run by Simpson's rule
PEAK = 1e-10  # of the largest loads, which are those at any time, whatever the instants
CASES = [[1.1, -0.31, 1.2e8], [0.7, -0.25, 0.8e8]]


def with_product(machine: Machine, **keys: Any) -> Machine:
    return machine.model_copy(update={"products": [Product(**PRODUCT | keys)]})


def study_of(machine: Machine, motion: Motion = MOTION, **keys: Any) -> Study:
    mass, x, stiffness = zip(*CASES, strict=True)
    masses = [factor * machine.body.mass for factor in mass]
    cases = {"body.mass": masses, "carriages[1a].x": x, "carriages[2b].stiffness_y": stiffness}
    return Study(machine=machine, motion=motion, **{"cases": cases} | keys)


def studied(machine: Machine, motion: Motion = MOTION, **keys: Any) -> StudyResult:
    return run_study(study_of(machine, motion, **keys))


def lives_of(study: Study, sample: int) -> tuple[Life, Life]:
    """The life of a single run with the instants of a study, and with 8 in each of their intervals."""
    motion = with_enough_instants(MOTION, study.plan().fastest_vibration())
    dense, machine = refined(motion, np.full(motion.time.size - 1, 8)), sample_machine(study, sample)
    one, other = (life_of(simulate(machine, each, study.method, rtol=study.rtol)) for each in (motion, dense))
    return one, other


@pytest.mark.parametrize(
    ("rule", "laws", "kind"),
    [
        ("sum", {}, "ball"),
        ("iko", {}, "roller"),
        ("thk", {"clearance_z": 5e-6}, "roller"),
        ("thomson", {"clearance_z": 5e-6}, "ball"),
        ("rexroth", PRELOADED, "ball"),
    ],
)
def test_life_and_safety_of_samples_are_those_of_single_runs(
    rule: Any, laws: dict[str, Any], kind: str
) -> None:
    classes = [{"name": "A", "stiffness": "400 N/um", "preload": "900 N"}]
    machine = with_product(
        cart(life=LifeConditions(rule=rule, **CONDITIONS)),
        type=kind,
        dynamic_moments={"roll": 300.0, "pitch": 250.0, "yaw": 250.0},
        preload_classes=classes,
        lift_factor=1.1,
    )
    machine = with_carriages(machine, **laws)
    study = study_of(machine, method="implicit" if laws is PRELOADED else "auto", rtol=1e-9)
    result = run_study(study)
    assert result.metadata.exponent == (3.0 if kind == "ball" else 10 / 3)
    # Step sizes on smooth laws depend on estimated errors, which change with rounding.
    rel = 1e-7 if laws is PRELOADED else 1e-12 if laws else LINEAR
    largest = 1e-7 if laws is PRELOADED else PEAK
    for i in range(len(CASES)):
        life, dense = lives_of(study, i)
        safety = []
        for one, near in zip(life.carriages, dense.carriages, strict=True):
            assert result.column(f"life_km[{one.name}]")[i] == pytest.approx(1e-3 * one.life, rel=rel)
            safety.append(result.column(f"static_safety[{one.name}]")[i])
            peak = result.column(f"peak_equivalent_load_N[{one.name}]")[i]
            for run in (one, near):  # largest loads are those at any time, whatever the samples
                assert safety[-1] == pytest.approx(run.static.safety, rel=largest)
                assert peak == pytest.approx(run.static.peak, rel=largest)
        assert result.column("life_km")[i] == pytest.approx(1e-3 * life.machine, rel=rel)
        assert life.machine == pytest.approx(dense.machine, rel=0.01)
        assert result.column("static_safety")[i] == min(safety)


@pytest.mark.parametrize("counts", [True, False])
def test_a_preload_of_a_class_is_said_not_to_scatter(counts: bool) -> None:
    """Where it counts, of the carriages whose preload does not vary, with the upper end of the class."""
    classes = [{"name": "A", "stiffness": "400 N/um", "preload": "900 N"}]
    plain = with_product(cart(life=LifeConditions(preload_in_life=counts)), preload_classes=classes)
    own = with_carriages(plain, "1a", "1b", **PRELOADED)
    cases = {"carriages[1a].preload_y": [5e3, 8e3], "carriages[1a].preload_z": [5e3, 8e3]}
    several = "has 8 kN (carriage 1b) and 900 N (carriage 2a and 2b), the upper"
    for study, words in (
        (study_of(plain), "has 900 N (carriage 1a, 1b, 2a and 2b), the upper end"),
        (study_of(own, cases=cases, method="implicit"), several),
    ):
        notes = study.plan().metadata.life_notes
        said = [note for note in notes if "the preload does not scatter" in note]
        assert len(said) == counts and all(words in note for note in said)


def test_a_preload_that_varies_counts_with_its_value() -> None:
    machine = with_carriages(with_product(cart()), **PRELOADED)
    cases = {"carriages.*.preload_y": [5e3, 8e3, 9e3], "carriages[1b].preload_z": [4e3, 8.5e3, 3e3]}
    study = study_of(machine, cases=cases, method="implicit", rtol=1e-9)
    result = run_study(study)
    for i, (y, z) in enumerate(zip(*cases.values(), strict=True)):
        life, dense = lives_of(study, i)
        for one, near in zip(life.carriages, dense.carriages, strict=True):
            assert one.mean_load > max(y, z if one.name == "1b" else PRELOADED["preload_z"])
            assert result.column(f"life_km[{one.name}]")[i] == pytest.approx(1e-3 * one.life, rel=1e-7)
            safety = result.column(f"static_safety[{one.name}]")[i]
            assert safety == pytest.approx(near.static.safety, rel=PEAK)


def test_carriages_side_by_side_keep_their_contact_factor() -> None:
    machine = with_product(cart(life={"rule": "thk"}), carriage_length="600 mm")
    study = study_of(machine)
    result = run_study(study)
    assert [one.contact_factor for one in result.rated.values()] == [0.81] * 4
    for i in range(len(CASES)):
        expected = 1e-3 * lives_of(study, i)[0].machine
        assert result.column("life_km")[i] == pytest.approx(expected, rel=LINEAR)


def test_the_probability_of_failure_combines_fatigue_and_parameters() -> None:
    """A reference by integration: mean loads are normal in these studies, and the life is 50 km (C/P)^3."""
    result = studies.study(100_000, 1, 1)
    law = studies.law(0, 1, 1)
    for travel in (300.0, 3000.0):

        def failing(peak: float, travel: float = travel) -> float:
            life = 50.0 * (27.1e3 / (0.8 * peak)) ** 3
            return float(law.pdf(peak) * (1.0 - 0.9 ** ((travel / life) ** 1.5)))

        low, high = law.ppf([1e-12, 1 - 1e-12])
        expected, _ = integrate.quad(failing, low, high, epsabs=0.0, epsrel=1e-10)
        row = result.failure_probability(travel, confidence=1 - 1e-4).loc["1a"]
        assert row["low"] <= expected <= row["high"] and row["high"] < 1.1 * row["low"]
        assert row["shorter"] == np.mean(result.column("life_km[1a]") < travel)
    assert result.failure_probability("300 km").equals(result.failure_probability(300.0))


def test_the_machine_fails_where_any_carriage_does_and_by_rule_at_its_life() -> None:
    result = studies.study(500)
    lives = np.stack([result.column(f"life_km[{name}]") for name in result.metadata.carriages])
    survive = np.prod(0.9 ** ((800.0 / lives) ** 1.5), axis=0)
    table = result.failure_probability(800.0)
    assert table.loc["", "probability"] == pytest.approx(1.0 - survive.mean(), rel=1e-12)
    np.testing.assert_allclose(result.column("life_km"), (lives**-1.5).sum(axis=0) ** (-1 / 1.5), rtol=1e-13)
    same = studies.changed(result, machine=with_conditions(result, reliability=0.99))
    assert same.failure_probability(800.0)["probability"].tolist() == pytest.approx(
        table["probability"].tolist(), rel=1e-10
    )  # the reliability is only the probability for which the life is stated


def with_conditions(result: StudyResult, **conditions: Any) -> Machine:
    machine = result.metadata.machine
    return machine.model_copy(update={"life": machine.life.model_copy(update=conditions)})


def test_requirements_of_the_machine_are_limits_and_those_of_the_study_go_first() -> None:
    machine = cart(life=CONDITIONS)
    assert studied(machine).metadata.limits == {"static_safety": 3.0, "life_km": 20000.0}
    own = studied(machine, limits={"life": "300 km", "static_safety": 5.0, "peak_equivalent_load": "9 kN"})
    assert own.metadata.limits == {"life_km": 300.0, "static_safety": 5.0, "peak_equivalent_load_N": 9e3}
    assert (own.column("life_km") < 300.0).sum() == own.cases()["exceeded"].str.contains("life").sum()


@pytest.mark.parametrize("unit", ["h", "years", "cycles"])
def test_a_life_in_any_unit_is_the_same_limit(unit: str) -> None:
    machine = cart(life={"life": "300 km", "cycles_per_hour": 500, "hours_per_year": 4000})
    repetition = life_of(simulate(machine, MOTION)).repetition
    cycles = 3e5 / repetition.distance
    text = f"{cycles / {'cycles': 1.0, 'h': 500.0, 'years': 500.0 * 4000.0}[unit]!r} {unit}"
    required = machine.model_copy(update={"life": machine.life.model_copy(update={"life": text})})
    for result in (studied(machine), studied(required), studied(machine, limits={"life": text})):
        assert result.metadata.limits["life_km"] == pytest.approx(300.0, rel=1e-14)
        found = result.metadata.repetition
        assert found is not None and astuple(found) == pytest.approx(astuple(repetition), rel=1e-15)
    probability = result.failure_probability(text)["probability"]
    assert probability.tolist() == pytest.approx(
        result.failure_probability(300.0)["probability"].tolist(), rel=1e-12
    )
    assert QUANTITIES["life_km"].limit(text, repetition) == pytest.approx(
        300.0, rel=1e-14
    )  # of `probability --limit`


def test_a_study_is_resumed_with_other_ratings_but_not_with_another_rule(tmp_path: Any) -> None:
    machine = cart(life=CONDITIONS)
    before = studied(machine).metadata
    better = with_product(
        cart(life=CONDITIONS | {"reliability": 0.9}), dynamic={"value": "44 kN", "base": "50 km"}
    )
    assert studied(better).metadata.fingerprint == before.fingerprint
    for other in (cart(life=CONDITIONS | {"rule": "thk"}), with_product(machine, static="50 kN")):
        assert studied(other).metadata.fingerprint != before.fingerprint
    before.write(tmp_path)
    assert StudyMetadata.read(tmp_path) == before and StudyMetadata.read(tmp_path).rated()


ROLLER = Product(**PRODUCT | {"name": "r", "type": "roller"})


def mixed() -> Machine:
    """A machine with a roller carriage among its ball carriages."""
    machine = cart().model_copy(update={"products": [Product(**PRODUCT), ROLLER]})
    return with_carriages(machine, "2a", product="r")


@pytest.mark.parametrize(
    ("machine", "motion", "reason"),
    [
        (
            with_product(cart(), static=None),
            MOTION,
            "no carriage has a product with dynamic and static rating",
        ),
        (
            with_product(cart(), static_moments={}),
            MOTION,
            "carriage 1a can carry a roll moment, which the rule sum",
        ),
        (cart(), Motion.along_x(MOTION.time, MOTION.acceleration[:, 0]), "the motion has no velocity"),
        (cart(), Motion.along_x([0, 1], [0, 0], velocity=[0, 0]), "the cart does not move along x"),
        (with_product(cart(), carriage_length="540 mm"), MOTION, "carriages 1a and 1b are side by side"),
        (mixed(), MOTION, "the ratings have 3 (carriage 1a) and 3.333 (carriage 2a)"),
    ],
)
def test_what_cannot_be_computed_is_told_and_a_limit_on_it_refused(
    machine: Machine, motion: Motion, reason: str
) -> None:
    result = studied(machine, motion)
    assert "life_km" not in result.quantities and not result.rated
    (note,) = result.metadata.life_notes
    assert note.startswith("Life and static safety are not computed: ") and reason in note
    assert " ".join(note.split()) in " ".join(study_report(result).text().split())
    with pytest.raises(ConfigError, match="no limit on life without a rating"):
        studied(machine, motion, limits={"life": "1 km"})
    with pytest.raises(ArgumentError, match="carriages whose products have ratings"):
        result.failure_probability(1.0)


def test_a_machine_without_products_and_a_study_without_load_have_no_life() -> None:
    plain = with_carriages(cart(), product=None)
    for result in (studied(plain), studied(cart(), quantities=["resultant"])):
        assert (
            result.metadata.life_notes == () and "Life and static safety" not in study_report(result).text()
        )
    with pytest.raises(ConfigError, match="no carriage has a product"):
        studied(plain, limits={"static_safety": 2})
    with pytest.raises(ConfigError, match='add "load" to quantities'):
        studied(cart(), quantities=["resultant"], limits={"life": "1 km"})


def test_the_report_has_the_figures_of_life() -> None:
    result = studies.study(2000, limits={"life_km": 900.0})
    text = " ".join(study_report(result).text().split())
    row = result.failure_probability().loc[""]
    assert f"failure by fatigue before 900 km: {100 * row['probability']:.3g} %" in text
    assert f"the rating life is shorter in {100 * row['shorter']:.3g} % of the samples" in text
    summary = result.summary()
    assert f"median {kilometres(1e3 * summary.loc[('life_km', ''), 'q50'])} km" in text
    assert f"1 % quantile {summary.loc[('static_safety', ''), 'q01']:.2f}" in text
