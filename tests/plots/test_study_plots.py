"""The pictures of a study show the figures of its result, at every size, and leave the process as it was."""

from pathlib import Path

import matplotlib
import numpy as np
import pytest
import studies
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread
from unrendered import leave_unrendered

from guideload.base.number_text import load_with_unit
from guideload.plots import study as pictures
from guideload.plots.drivers import BARS
from guideload.plots.saving import save
from guideload.study.quantities import PEAK
from guideload.study.result import StudyResult


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return studies.study(3000, limits={"peak_resultant_N": 8000.0, "life_km": 4000.0}, histories=100)


def labels(ax: Axes) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def texts(ax: Axes) -> str:
    return "\n".join(text.get_text() for text in ax.texts)


def test_distributions_mark_the_quantiles_of_every_carriage(result: StudyResult) -> None:
    ax = pictures.distributions(result)
    assert [label.get_text() for label in ax.get_yticklabels()] == list(result.metadata.carriages)
    for row, carriage in enumerate(result.metadata.carriages):
        found = result.quantiles(f"peak_resultant_N[{carriage}]", (0.05, 0.5, 0.95, 0.99))["value"]
        bar, middle, last, interval = ax.lines[4 * row : 4 * row + 4]
        np.testing.assert_allclose(bar.get_xdata(), found.iloc[[0, 2]])
        assert middle.get_xdata()[0] == found[0.5] and last.get_xdata()[0] == found[0.99]
        assert set(bar.get_ydata()) == {row}
        ends = result.quantiles(f"peak_resultant_N[{carriage}]", [0.99])[["low", "high"]]
        np.testing.assert_allclose(interval.get_xdata(), ends.loc[0.99])
    assert ax.get_xlabel() == "peak resultant [N]" and "3000 samples" in ax.get_title(loc="left")
    assert f"limit {load_with_unit(8000)}" in texts(ax)


def test_exceedance_is_that_of_the_result_with_its_band(result: StudyResult) -> None:
    ax = pictures.exceedance(result)
    assert labels(ax) == [*result.metadata.carriages, "machine (any)"] and ax.get_yscale() == "log"
    for column, line in zip([*result.of_carriages(PEAK), PEAK], ax.lines, strict=False):
        limits, (share, *_) = result.exceedance(column)
        np.testing.assert_array_equal(line.get_xdata(), limits)
        np.testing.assert_array_equal(line.get_ydata(), share)
    assert len(ax.collections) == 5
    assert pictures.exceedance(result, "peak_drive_N").get_legend().get_texts()[0].get_text() == "machine"


def test_a_life_is_shown_by_what_does_not_reach_it(result: StudyResult) -> None:
    ax = pictures.exceedance(result, "life_km")
    life = result.column("life_km[1a]")
    for limit, share in np.transpose(ax.lines[0].get_data())[::50]:
        assert share == pytest.approx(np.mean(life <= limit), abs=1e-12)
    assert "not reached" in ax.get_title(loc="left") and "limit 4" in texts(ax)


def test_the_curve_of_failures_is_their_probability(result: StudyResult) -> None:
    ax = pictures.failure(result)
    *of_carriages, machine, shorter = (line.get_data() for line in ax.lines[:6])
    for name, curve in zip([*result.metadata.carriages, ""], [*of_carriages, machine], strict=True):
        for travel, share in np.transpose(curve)[::40]:
            expected = result.failure_probability(travel).loc[name, "probability"]
            assert share == pytest.approx(expected, rel=1e-9)
    for travel, share in np.transpose(shorter)[60::20]:
        assert share == pytest.approx(result.failure_probability(travel).loc["", "shorter"], abs=1e-12)
    assert ax.lines[6].get_xdata()[0] == 4000.0 and "required life" in str(ax.lines[6].get_label())
    with pytest.raises(ValueError, match="no life"):
        pictures.failure(studies.recording(result, [("load", "mean")]))


def test_the_title_leaves_the_legend_its_room(result: StudyResult) -> None:
    ax = pictures.distributions(result)
    ax.figure.draw_without_rendering()
    assert ax.get_legend().get_window_extent().y1 <= ax._left_title.get_window_extent().y0


def test_a_limit_far_beyond_leaves_the_samples_their_room() -> None:
    far = studies.study(300, 2, limits={"peak_resultant_N": 1e6})
    for draw in (pictures.distributions, pictures.exceedance):
        ax = draw(far)
        assert ax.get_xlim()[1] < 2e4 and "→" in texts(ax)


@pytest.mark.parametrize("sensitivity", [False, True])
def test_tornado_has_the_drivers_strongest_on_top(sensitivity: bool) -> None:
    result = studies.study(400, 2, 30, sensitivity=sensitivity)
    ax = pictures.tornado(result)
    drivers = result.driving()
    main = drivers["total" if sensitivity else "rank_correlation"]
    both = drivers.get("to_both_sides", [False] * len(drivers))
    names = [f"{'± ' * folded}{name}" for name, folded in zip(drivers.index, both, strict=True)]
    assert [label.get_text() for label in ax.get_yticklabels()] == names[:BARS]
    widths = [bar.get_width() for bar in ax.patches[:BARS]]
    np.testing.assert_allclose(widths, main.iloc[:BARS])
    assert ax.get_ylim()[0] > ax.get_ylim()[1]  # the first on top
    assert "and 14 more" in texts(ax)
    assert ("Sobol index" if sensitivity else "rank correlation") in ax.get_xlabel()


def test_scatter_shows_the_samples_over_what_drives_them(result: StudyResult) -> None:
    axes = pictures.scatter(result)
    assert len(axes) == 5
    for ax, name in zip(axes, result.driving().index, strict=True):
        drawn = ax.collections[0].get_offsets()
        np.testing.assert_array_equal(drawn[:, 0], result.column(name))
        np.testing.assert_array_equal(drawn[:, 1], result.column("peak_resultant_N"))
        assert ax.get_xlabel().startswith(name)
    one = pictures.scatter(result, "peak_Fy_N[2a]")[0]
    assert one.figure.get_suptitle() == "What drives the peak |Fy| of 2a: Gantry"
    np.testing.assert_array_equal(one.collections[0].get_offsets()[:, 1], result.column("peak_Fy_N[2a]"))


def test_band_holds_the_histories_and_the_machine_as_described(result: StudyResult) -> None:
    ax = pictures.band(result, "2a")
    data = result.histories.sel(carriage="2a")
    median, described = (line.get_ydata() for line in ax.lines)
    np.testing.assert_allclose(median, np.median(data["resultant"], axis=0))
    np.testing.assert_array_equal(described, data["nominal_resultant"])
    assert labels(ax) == ["all", "5 % to 95 %", "median", "nominal machine"]
    few = pictures.band(studies.study(30, 1, histories=3), "1a")
    assert len(few.lines) == 4 and "3 samples" in few.get_title(loc="left")
    with pytest.raises(ValueError, match="no carriage 'x': the study has '1a', '2a'"):
        pictures.band(result, "x")
    with pytest.raises(ValueError, match="no histories were stored"):
        pictures.band(studies.study(30), "1a")


@pytest.mark.parametrize(
    ("samples", "carriages", "factors", "sensitivity"),
    [(1, 1, 1, False), (10, 8, 40, True), (300, 4, 12, False), (100_000, 1, 2, False)],
)
def test_at_every_size_the_pictures_hold_their_carriages_and_parameters(
    samples: int, carriages: int, factors: int, sensitivity: bool
) -> None:
    result = studies.study(samples, carriages, factors, sensitivity=sensitivity, histories=3)
    too_few = samples == 1
    rows, curves = pictures.distributions(result), pictures.exceedance(result)
    assert len(rows.get_yticks()) == carriages
    assert len(curves.lines) == carriages + (carriages > 1)
    few = result.column("peak_resultant_N").size <= pictures.FEW
    dots = [line.get_xdata() for line in rows.lines if line.get_markersize() == 4]
    drawn = [result.column(column) for column in result.of_carriages(PEAK)] if few else []
    np.testing.assert_array_equal(dots, drawn)
    assert len(rows.patches) == (0 if few else carriages)
    bars = pictures.tornado(result).patches
    assert len(bars) == (0 if too_few else min(factors, BARS) * (1 + sensitivity))
    assert len(pictures.scatter(result)) == min(factors, 6)
    for ax in (rows, curves):
        ax.figure.draw_without_rendering()
        drawn, page = ax.get_tightbbox(), ax.figure.bbox
        assert page.y0 <= drawn.y0 and drawn.y1 <= page.y1 and page.x0 <= drawn.x0  # nothing is cut off


def test_all_pictures_are_saved_and_none_is_blank(tmp_path: Path, result: StudyResult) -> None:
    paths = pictures.save_study(result, tmp_path / "new")
    assert [path.stem for path in paths] == [
        *(
            "distributions",
            "exceedance",
            "tornado",
            "life",
            "static_safety",
            "failure",
            "scatter",
            "histories",
        )
    ]
    for path in paths:
        red, green, blue = np.round(255 * imread(path)[::3, ::3, :3]).T
        assert (
            np.unique(65536 * red + 256 * green + blue).size > 20
        )  # more colours than a frame and its text have


def test_a_study_without_any_result_says_so(tmp_path: Path) -> None:
    nothing = studies.without_result()
    for ax in (pictures.distributions(nothing), pictures.exceedance(nothing), pictures.tornado(nothing)):
        assert "no sample has a result" in texts(ax)
    pictures.save_study(nothing, tmp_path)
    lost = studies.study(30, histories=3)
    lost.histories["resultant"][:] = np.nan  # every history is that of a sample that failed
    band = pictures.band(lost, "1a")
    assert "no sample has a result" in texts(band)
    save(band, tmp_path / "band.png")


def test_axes_given_are_drawn_on_and_the_process_is_left_alone(result: StudyResult) -> None:
    before = dict(matplotlib.rcParams)
    for draw in (pictures.distributions, pictures.exceedance, pictures.tornado):
        ax = Figure().add_subplot()
        assert draw(result, ax=ax) is ax
    axes = [Figure().add_subplot() for _ in range(2)]
    assert pictures.scatter(result, axes=axes) == axes
    assert dict(matplotlib.rcParams) == before
    with pytest.raises(ValueError, match="no quantity 'peak': the study has 'peak_resultant_N'"):
        pictures.distributions(result, "peak")


@pytest.mark.parametrize(
    ("recorded", "name"),
    [(("load", "mean"), "mean load"), (("contact", "lost"), "contact lost"), (("Fy", "max"), "largest Fy")],
)
def test_without_peaks_another_quantity_is_drawn(recorded: tuple[str, str], name: str) -> None:
    result = studies.recording(studies.study(50, 2), [recorded])
    for draw in (pictures.distributions, pictures.exceedance):
        assert draw(result).get_xlabel().partition(" [")[0] == name
    assert pictures.tornado(result).get_title(loc="left").startswith(f"What drives the {name} of the machine")
    assert pictures.scatter(result)[0].get_ylabel().partition(" [")[0] == name


def test_few_samples_and_chosen_cases_have_no_drivers_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_unrendered(monkeypatch)
    assert texts(pictures.tornado(studies.study(1))) == "too few samples to estimate what drives it"
    given = studies.chosen(studies.study(30))
    names = {path.stem for path in pictures.save_study(given, tmp_path)}
    assert names == {"distributions", "life", "static_safety", "scatter"}
    assert pictures.distributions(given).get_legend() is None
    assert pictures.scatter(given)[0].figure.get_suptitle() == "The peak resultant of the machine: Gantry"


def test_pictures_of_a_preloaded_machine_tell_of_open_rows() -> None:
    ax = pictures.distributions(studies.preloaded(studies.study(30)), "contact_lost")
    assert "A row open" in ax.get_title(loc="left") and ax.get_xlabel() == "a row open"


def test_lives_are_on_a_log_axis(result: StudyResult) -> None:
    for draw in (pictures.distributions, pictures.exceedance):
        assert draw(result, "life_km").get_xscale() == "log"
        assert draw(result).get_xscale() == "linear"
        low = draw(studies.study(100, limits={"life_km": 10.0}), "life_km")  # far below all lives
        assert low.get_xlim()[0] > 100 and "← limit" in texts(low)
