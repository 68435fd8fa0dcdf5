"""The result of a study: known distributions, failed samples, quantities, files; and its report."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import studies
from command_line import EXAMPLES
from texts import one_line, row

from guideload import Machine, Motion, Study, run_study
from guideload.base.errors import ArgumentError, ArgumentTypeError, ValueRefused
from guideload.reports.study import study_report
from guideload.study.metadata import StudyMetadata
from guideload.study.quantities import QUANTITIES
from guideload.study.result import LEVELS, StudyResult

BY_CHANCE = 1e-4


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return studies.study(20_000)


def test_the_summary_is_that_of_the_known_distribution(result: StudyResult) -> None:
    summary = result.summary()
    for i, carriage in enumerate(result.metadata.carriages):
        row, law = summary.loc["peak_resultant_N", carriage], studies.law(i, 4, 5)
        assert row["samples"] == 20_000
        assert row["mean"] == pytest.approx(law.mean(), abs=4 * law.std() / 20_000**0.5)
        assert row["standard_deviation"] == pytest.approx(law.std(), rel=4 / 40_000**0.5)
        sure = result.quantiles(f"peak_resultant_N[{carriage}]", LEVELS, confidence=1 - BY_CHANCE)
        assert ((sure["low"] <= law.ppf(LEVELS)) & (law.ppf(LEVELS) <= sure["high"])).all()
        for level, name in zip(LEVELS, ("q01", "q05", "q50", "q95", "q99"), strict=True):
            assert sure.loc[level, "low"] < row[f"{name}_low"] < row[name] < row[f"{name}_high"]
            assert row[name] == sure.loc[level, "value"]


def test_peaks_are_largest_magnitudes_and_the_machine_has_those_of_its_worst_carriage(
    result: StudyResult,
) -> None:
    for carriage in result.metadata.carriages:
        resultant = result.column(f"peak_resultant_N[{carriage}]")
        np.testing.assert_array_equal(resultant, result.store.data[f"max_resultant_N[{carriage}]"])
        np.testing.assert_allclose(result.column(f"peak_Fy_N[{carriage}]"), 0.9 * resultant)
        np.testing.assert_allclose(result.column(f"peak_Fz_N[{carriage}]"), 0.3 * resultant)
        life = 50 * (27.1e3 / (0.8 * resultant)) ** 3
        np.testing.assert_allclose(result.column(f"life_km[{carriage}]"), life)
    of_all = [result.column(f"peak_resultant_N[{carriage}]") for carriage in result.metadata.carriages]
    np.testing.assert_array_equal(result.column("peak_resultant_N"), np.max(of_all, axis=0))
    lives = [result.column(f"life_km[{carriage}]") for carriage in result.metadata.carriages]
    np.testing.assert_allclose(result.column("life_km"), np.sum(np.power(lives, -1.5), axis=0) ** (-1 / 1.5))
    safeties = [result.column(f"static_safety[{carriage}]") for carriage in result.metadata.carriages]
    np.testing.assert_allclose(safeties, 36.7e3 / (1.2 * np.array(of_all)))
    np.testing.assert_array_equal(result.column("static_safety"), np.min(safeties, axis=0))
    np.testing.assert_allclose(result.column("peak_drive_N"), 0.5 * np.mean(of_all, axis=0))
    summary = result.summary()
    for name in ("peak_resultant_N", "life_km", "peak_drive_N"):
        assert summary.loc[(name, ""), "q95"] == result.quantiles(name).loc[0.95, "value"]


def test_columns_as_stored_are_there_and_others_are_refused_with_the_nearest(result: StudyResult) -> None:
    for name in ("body.mass", "k[3]", "min_Fy_N[2b]", "contact_lost[1a]", "max_drive_N"):
        np.testing.assert_array_equal(result.column(name), result.store.data[name])
    with pytest.raises(ValueRefused, match=r"got \"peak_resultant\[1a\]\"; nearest: peak_resultant_N\[1a\]"):
        result.column("peak_resultant[1a]")
    with pytest.raises(ValueRefused, match=r"peak_drive_N"):
        result.column("peak_drive_N[1a]")
    with pytest.raises(ValueRefused):
        result.column("peak_resultant_N[nobody]")
    for lookup in (result.owners, result.of_carriages):
        with pytest.raises(
            ValueRefused, match='expected a quantity, got "x"; this study has peak_resultant_N'
        ):
            lookup("x")
    with pytest.raises(ArgumentTypeError, match="^name: expected text, got None"):
        result.column(None)  # type: ignore[arg-type]


@pytest.mark.parametrize("sensitivity", [False, True])
def test_replicates_scatter_by_the_weights_of_their_samples(sensitivity: bool) -> None:
    """The standard error of a mean is that of the means of the replicates, also with rows of a Saltelli design."""
    result = studies.changed(studies.study(800, sensitivity=sensitivity), replicates=8)
    values = result.column("peak_resultant_N[1a]")
    means = [values[result.replicate == i].mean() for i in range(8)]
    row = result.summary().loc["peak_resultant_N", "1a"]
    assert row["mean_standard_error"] == pytest.approx(np.std(means, ddof=1) / 8**0.5, rel=1e-12)
    if sensitivity:
        assert values.reshape(8, 2, -1).shape[1] == 2
        np.testing.assert_array_equal(result.replicate[:6], [0, 0, 1, 1, 2, 2])  # A and B of a row together
        assert (result.sensitivity()["total_standard_error"] > 0).all()
    report = one_line(study_report(result).text())
    assert "divided among 8 independent sets" in report
    assert "divided among" not in one_line(study_report(studies.study(80)).text())


def test_failed_samples_are_left_out_and_counted_by_kind() -> None:
    """The others' statistics are those of a study without them; figures in a reason make no kind of their own."""
    failed = {i: f"the links leave rx unsupported, stiffness {i}e-3 N/m" for i in range(0, 40, 2)}
    failed[7] = "no equilibrium"
    holed, whole = studies.study(1000, failed=failed), studies.study(1000)
    rest = np.setdiff1d(np.arange(1000), list(failed))
    assert (holed.runs, holed.finished, holed.failed) == (1000, 1000, 21)
    row = holed.summary().loc["peak_resultant_N", "1a"]
    assert row["samples"] == 979
    assert row["mean"] == pytest.approx(whole.column("peak_resultant_N[1a]")[rest].mean(), rel=1e-13)
    table = holed.failures()
    assert table["count"].tolist() == [20, 1] and table["first_sample"].tolist() == [0, 7]
    assert table["reason"].tolist() == [failed[0], "no equilibrium"]
    np.testing.assert_allclose(table["share"], [0.02, 0.001])
    reasons = holed.table(["body.mass"])["reason"]
    assert reasons[7] == "no equilibrium" and reasons.notna().sum() == 21
    assert whole.failures().empty


def test_what_has_not_run_yet_is_left_out_and_is_no_failure() -> None:
    left = studies.study(1000, finished=400)
    assert (left.runs, left.finished, left.failed) == (1000, 400, 0)
    assert left.summary()["samples"].unique().tolist() == [400]
    assert "400 of 1000 samples have run" in one_line(study_report(left).text())


def test_probabilities_of_limits_are_known_and_those_of_the_machine_of_any_carriage() -> None:
    result = studies.study(50_000, limits={"peak_resultant_N": 7000.0, "life_km": 4000.0})
    table = result.probabilities()
    for i, carriage in enumerate(result.metadata.carriages):
        law = studies.law(i, 4, 5)
        sure = result.probability_above(f"peak_resultant_N[{carriage}]", 7000.0, confidence=1 - BY_CHANCE)
        assert sure.low <= law.sf(7000) <= sure.high
        row = table.loc["peak_resultant_N", carriage]
        assert row["probability"] == sure.value and sure.low < row["low"] < row["high"] < sure.high
        # A life of 4000 km is reached below a mean load of 27.1 kN (50/4000)^(1/3).
        load = 27.1e3 * (50 / 4000) ** (1 / 3) / 0.8
        count = int((result.column(f"peak_resultant_N[{carriage}]") > load).sum())
        assert table.loc[("life_km", carriage), "count"] == count
        assert table.loc[("life_km", carriage), "limit"] == 4000
        lost = result.column(f"contact_lost[{carriage}]").sum()
        assert table.loc[("contact_lost", carriage), "count"] == lost
    any_of_them = (result.column("peak_resultant_N") > 7000).sum()
    assert table.loc[("peak_resultant_N", ""), "count"] == any_of_them


def test_what_drives_the_peak_follows_from_the_weights() -> None:
    """Of a linear case the total index is the share of the squared weight; ranks are as strong as the weight."""
    shares = studies.weights(4, 5)[0] ** 2
    shares /= shares.sum()
    result = studies.study(20_000, sensitivity=True)
    found = result.sensitivity("peak_resultant_N[1a]")
    np.testing.assert_allclose(found["total"], shares, atol=0.03)
    np.testing.assert_allclose(found["first_order"], shares, atol=0.03)
    strongest = ["body.mass", "k[1]", "k[2]", "k[3]", "k[4]"]
    assert result.driving("peak_resultant_N[1a]").index.tolist() == strongest
    assert result.runs == 20_000 * 7 and result.column("k[1]").size == 40_000  # A and B are the samples
    plain = studies.study(20_000)
    ranks = plain.rank_correlation("peak_resultant_N[1a]")["rank_correlation"]
    pearson = np.sign(studies.weights(4, 5)[0]) * shares**0.5
    np.testing.assert_allclose(ranks, 6 / np.pi * np.arcsin(pearson / 2), atol=0.03)
    assert plain.driving().index[0] == "body.mass"
    with pytest.raises(ArgumentError, match="sensitivity = true"):
        plain.sensitivity()


def test_a_centre_of_mass_that_loads_either_side_drives_the_peak() -> None:
    """It has no rank correlation, as its sign does not matter, but the rank correlation of its distance."""
    machine = Machine.from_toml(EXAMPLES / "kinds" / "gantry.toml")
    motion = Motion.along_x([0.0, 0.1, 0.2, 0.5, 0.6, 0.7], [0.0, 3.0, 0.0, 0.0, -3.0, 0.0])
    scatter = {"body.mass": "5 %", "body.center_of_mass.x": "35 mm"}
    vary = [{"path": path, "distribution": "normal", "sigma": sigma} for path, sigma in scatter.items()]
    drawn, designed = (
        run_study(Study(machine=machine, motion=motion, samples=512, seed=1, vary=vary, sensitivity=each))
        for each in (False, True)
    )
    found, shares = drawn.driving(), designed.driving()["first_order"]
    assert [*found.index] == [*shares.index] == ["body.center_of_mass.x", "body.mass"]
    assert [*found["to_both_sides"]] == [True, False]
    assert abs(drawn.rank_correlation().loc["body.center_of_mass.x", "rank_correlation"]) < 0.15
    np.testing.assert_allclose(found["rank_correlation"] ** 2, shares, atol=0.1)
    assert "Driven by body.center_of_mass.x (rank correlation" in study_report(drawn).text()
    assert "to both sides" in study_report(drawn).text()


def test_columns_are_read_when_asked_for_and_once_for_the_summary() -> None:
    result = studies.study(100)
    assert result.store.read == []
    result.column("body.mass")
    assert result.store.read == ["body.mass"]
    result.store.read.clear()
    result.summary()
    again = [name for name in set(result.store.read) if result.store.read.count(name) > 1]
    assert {name.partition("[")[0] for name in again} == {"mean_load_N"}  # life is made of it too


def test_parquet_and_json_hold_all_and_the_summary(tmp_path: Path) -> None:
    result = studies.study(50, failed={3: "no equilibrium"}, limits={"peak_resultant_N": 7000.0})
    result.to_parquet(tmp_path / "all.parquet")
    table = pd.read_parquet(tmp_path / "all.parquet")
    assert table["sample"].tolist() == list(range(50)) and table["reason"][3] == "no equilibrium"
    np.testing.assert_array_equal(table["min_Fy_N[2b]"], result.store.data["min_Fy_N[2b]"])
    result.to_json(tmp_path / "summary.json")
    content = json.loads((tmp_path / "summary.json").read_text())
    first = content["summary"][0]
    assert (first["quantity"], first["carriage"]) == ("peak_resultant_N", "1a")
    assert first["q50"] == pytest.approx(result.summary().loc[("peak_resultant_N", "1a"), "q50"], rel=1e-8)
    assert first["q99_high"] is None  # 49 samples do not bound it
    assert content["failed"] == 1 and content["failures"][0]["reason"] == "no equilibrium"
    assert StudyMetadata(**content["metadata"]) == result.metadata
    with pytest.raises(ValueRefused, match=r"ends in \.json"):
        result.to_json(tmp_path / "summary.txt")


def test_every_quantity_has_its_unit() -> None:
    assert {quantity.unit for quantity in QUANTITIES.values()} == {"N", "N m", "km", "s", ""}


# ---- the report


def cells(text: str, first: str, after: str) -> list[str]:
    """Cells of the first row that starts with this cell, below the heading `after`."""
    return row(text[text.index(after) :], first)


def test_the_report_has_the_figures_of_the_summary() -> None:
    result = studies.study(2000, limits={"peak_resultant_N": 7000.0})
    text = study_report(result).text()
    row = result.summary().loc["peak_resultant_N", "1b"]
    expected = [row[name] for name in ("mean", "standard_deviation", "q05", "q50", "q95", "q99")]
    numbers = [float(cell) for cell in cells(text, "1b", "Peak resultant")[1:]]
    np.testing.assert_allclose([*numbers[:2], *numbers[2::2]], expected, atol=0.51)
    errors = [row[f"{name}_standard_error"] for name in ("q05", "q50", "q95", "q99")]
    np.testing.assert_allclose(numbers[3::2], errors, rtol=0.05)


def test_the_report_warns_of_few_samples_failures_and_wide_intervals() -> None:
    failed = dict.fromkeys(range(5), "no equilibrium")
    text = one_line(study_report(studies.study(100, failed=failed)).text())
    assert "5 of 100 runs failed, 5 %" in text and "no equilibrium" in text
    assert "the 99 % quantile needs 368 samples" in text
    wide = one_line(study_report(studies.study(20, sensitivity=True)).text())
    assert "Sobol indices" in wide and "wide" in wide


@pytest.mark.parametrize(("carriages", "factors"), [(1, 1), (4, 3), (8, 40)])
@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "ascii"])
def test_the_report_fits_its_width_and_encoding(carriages: int, factors: int, encoding: str) -> None:
    result = studies.study(30, carriages, factors, limits={"life_km": 1000.0})
    for each in (result, studies.chosen(result)):
        text = study_report(each).text(80, encoding)
        assert max(map(len, text.splitlines())) <= 80 and "…" not in text
        assert ("..." in text) == (each is result)  # 30 samples bound no outer quantile
        text.encode(encoding)


def test_a_study_without_any_result_has_a_report() -> None:
    nothing = studies.without_result()
    assert "no sample has a result" in one_line(study_report(nothing).text())
    assert nothing.summary().empty
    unborn = studies.study(5, finished=0, sensitivity=True)
    assert "no sample has a result" in one_line(study_report(unborn).text())


@pytest.mark.parametrize(
    ("recorded", "name", "title"),
    [
        ([("Fy", "max")], "max_Fy_N", "Largest Fy [N]"),
        ([("Fz", "min"), ("contact", "lost")], "min_Fz_N", "Smallest Fz [N]"),
        ([("drive", "max")], "max_drive_N", "Largest drive force [N]"),
        ([("load", "mean")], "mean_load_N", "Mean load [N]"),
        ([("drive", "min"), ("drive", "max")], "peak_drive_N", "Peak drive force [N]"),
        ([("resultant", "rms"), ("Fy", "time_of_max")], "rms_resultant_N", "Rms resultant [N]"),
        ([("Fy", "time_of_max")], "time_of_max_Fy_s[1a]", "Time of the largest Fy [s]"),
    ],
)
def test_a_study_without_peaks_is_about_what_it_recorded(
    recorded: list[tuple[str, str]], name: str, title: str
) -> None:
    result = studies.recording(studies.study(500), recorded)
    assert result.leading == name
    text, (stem, _, owner) = one_line(study_report(result).text()), name.partition("[")
    words = f"{title[0].lower()}{title[1:].partition(' [')[0]} of {owner.removesuffix(']') or 'the machine'}"
    assert title in text and f"What drives the {words}" in text
    rows = result.summary().loc[stem]
    for carriage, figures in rows.iterrows():
        column = result.column(f"{stem}[{carriage}]" if carriage else stem)
        assert figures["mean"] == pytest.approx(column.mean(), rel=1e-12)
    if stem in result.store.data or f"{stem}[1a]" in result.store.data:  # recorded as it is
        assert ("" in rows.index) == (not stem.startswith("time"))  # no time is worse than another
        of_all = [column for key, column in result.store.data.items() if key.partition("[")[0] == stem]
        worst = np.min if name.startswith("min") else np.max
        if not owner:
            np.testing.assert_array_equal(result.column(name), worst(of_all, axis=0))


def test_the_report_leads_with_the_answer() -> None:
    result = studies.study(2000, limits={"peak_resultant_N": 9000.0})
    answer = study_report(result).text().partition("Study\n")[0]
    row, any_carriage = result.summary().loc["peak_resultant_N", "2b"], result.probabilities().iloc[4]
    interval = f"{row['q99_low']:.0f} to {row['q99_high']:.0f} at 95 %"
    assert f"Peak resultant, 99 % quantile: {row['q99']:.0f} N ({interval}), carriage 2b" in answer
    probability = 100 * any_carriage["probability"]
    assert f"Probability of peak resultant above 9000 N: {probability:.3g} % (" in answer
    assert f"Driven by {result.driving().index[0]} (rank correlation " in answer
    life = studies.recording(result, [("load", "mean")], limits={})
    mean_load = life.summary().loc[("mean_load_N", "2b"), "q99"]
    assert f"{mean_load:.0f} N" in study_report(life).text().split("Study\n")[0]
    cases = study_report(studies.chosen(result)).text().partition("Study\n")[0]
    largest = result.column("peak_resultant_N")
    assert f"{largest.max():.0f} N, case {largest.argmax()}" in one_line(cases)
    assert f"above 9000 N: {(largest > 9000).sum()} of 2000 cases" in cases


def test_given_cases_are_listed_one_by_one_without_statistics(tmp_path: Path) -> None:
    result = studies.chosen(
        studies.study(60, 2, 2, failed={3: "no equilibrium"}, limits={"peak_resultant_N": 6e3})
    )
    text = study_report(result).text()
    assert "given cases" in text and "seed" not in text
    for left_out in ("What drives", "Probabilities", "lies in", "std. dev.", "368", "Clopper"):
        assert left_out not in text
    assert "not a random sample" in one_line(text) and "first 50 of 60 cases" in one_line(text)
    for i in (0, 49):
        row = cells(text, str(i), "Cases")
        peaks = [result.column(f"peak_resultant_N[{carriage}]")[i] for carriage in ("1a", "2a")]
        np.testing.assert_allclose([float(cell) for cell in row[3:5]], peaks, atol=0.51)
        assert float(row[5]) == pytest.approx(result.column("life_km")[i], abs=0.51)
        assert float(row[6]) == pytest.approx(result.column("static_safety")[i], abs=0.0051)
        assert (row[7:] == ["peak", "resultant"]) == (max(peaks) > 6e3)
    assert cells(text, "3", "Cases")[-1] == "failed"
    result.to_json(tmp_path / "summary.json")
    content = json.loads((tmp_path / "summary.json").read_text())
    assert len(content["cases"]) == 60 and "driving" not in content


def test_lost_contact_of_a_preloaded_machine_is_a_row_open() -> None:
    result = studies.study(100)
    assert "contact lost" in study_report(result).text() and "a row open" not in study_report(result).text()
    text = one_line(study_report(studies.preloaded(result)).text())
    assert "contact lost" not in text
    assert "A row open: at some instant of a run one row of rolling elements is unloaded" in text


def test_too_few_samples_tell_nothing_of_what_drives_them() -> None:
    text = one_line(study_report(studies.study(1)).text())
    assert (
        "too few samples to estimate" in text and "rank correlation" not in text and "none beyond" not in text
    )
    assert "1 sample " in text and "1 samples" not in text
    assert "rank correlation" in study_report(studies.study(10)).text()
    assert "too few samples to estimate" in study_report(studies.study(9, sensitivity=True)).text()


def test_limits_take_text_with_a_unit_and_levels_are_refused_with_the_way_out() -> None:
    result = studies.study(300)
    found = result.probability_above("peak_resultant_N[1a]", "7 kN")
    assert found == result.probability_above("peak_resultant_N[1a]", 7000.0)
    assert all(type(one) is float for one in found)
    assert result.probability_below("life_km", "4e6 m") == result.probability_below("life_km", 4000.0)
    with pytest.raises(ValueRefused, match="a force in N"):
        result.probability_above("peak_resultant_N", "7 mm")
    for levels in (95, [95], [0.5, 1.0], 0.95, [0.0], [-0.1], []):
        with pytest.raises(ArgumentError, match=r"between 0 and 1, got .*\[0\.95\] is for the 95 % quantile"):
            result.quantiles("peak_resultant_N", levels)


@pytest.mark.parametrize("limit", [float("nan"), np.float64("nan")])
def test_a_limit_is_a_number(limit: float) -> None:
    result = studies.study(300)
    for probability in (result.probability_above, result.probability_below):
        with pytest.raises(ValueRefused, match="expected a number as the limit"):
            probability("peak_resultant_N", limit)
