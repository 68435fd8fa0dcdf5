"""Pictures of long records: no value is lost in the overview, and the worst cycle is the one with the peak."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from reference import cart, cycle
from unrendered import leave_unrendered

from guideload import Motion, Moves, PointOfInterest, Result, plots, simulate
from guideload.html_report import run_page
from guideload.plots.long_records import columns, extremes, is_long, worst_cycle

LIMITS = {"speed": 1.0, "acceleration": 5.0, "jerk": 200.0}


@pytest.fixture(scope="module")
def long() -> Result:
    """Twelve cycles of a calm and a brisk move, known exactly; the brisk moves have the largest load."""
    calm, brisk = {"distance": 0.6, "acceleration": 1.0, "dwell": 0.4}, {"target": 0.0, "dwell": 0.4}
    point = PointOfInterest(name="tool", at=(0.3, -1.0, 0.4), settle_window=1e-6)
    motion = Moves(limits=LIMITS, moves=[calm, brisk], repeat=12).motion()
    return simulate(cart().model_copy(update={"points": [point]}), motion)


@pytest.mark.parametrize("count", [1, 10, 1500, 1501, 24_840])
def test_an_envelope_has_every_extreme(count: int) -> None:
    values = np.random.default_rng(count).normal(size=count)
    starts = columns(count)
    assert starts.size <= 1500 and starts[0] == 0
    found = extremes(values, starts)
    low, high = values[np.array(found)]
    group = np.searchsorted(starts, np.arange(count), side="right") - 1
    assert (low[group] <= values).all() and (values <= high[group]).all()
    assert all(np.array_equal(group[each], np.arange(starts.size)) for each in found)


def test_the_worst_cycle_is_that_of_the_peak(long: Result) -> None:
    """From the start of its move to the end of its standstill, with a margin on either side within the record."""
    assert is_long(long) and not is_long(simulate(cart(), cycle()))
    time, resultant = long.quantities["time"], long.quantities["resultant"].max(axis=1)
    part = worst_cycle(long)
    assert resultant[part].max() == resultant.max()
    length = 0.6 / 1.0 + 1.0 / 5.0 + 5.0 / 200.0 + 0.4
    assert 1.03 * length - 2e-3 <= time[part][-1] - time[part][0] <= 1.06 * length + 2e-3


@pytest.mark.parametrize("draw", [plots.resultant, plots.moments])
def test_overview_and_cycle_show_the_same_peak(long: Result, draw: object) -> None:
    above, below = draw(long).figure.axes
    names = {f"carriage {name}" for name in long.quantities["carriage"]}
    areas = [part for part in above.collections if isinstance(part, PolyCollection)]
    assert len(areas) == len(names) == 4
    peaks = [
        max(float(np.max(line.get_ydata())) for line in ax.lines if np.size(line.get_ydata()))
        for ax in (above, below)
    ]
    assert peaks[0] == peaks[1]
    if draw is plots.resultant:
        assert peaks[0] == long.largest_load().size
    top = max(area.get_paths()[0].vertices[:, 1].max() for area in areas)
    assert peaks[0] == pytest.approx(top, rel=1e-3)  # a peak between the instants is a little higher
    assert below.get_title("left").startswith("Worst cycle")
    assert below.get_xlim()[1] - below.get_xlim()[0] < 0.1 * np.ptp(above.get_xlim())


def test_paper_figures_have_the_cycle_beside_each_load(long: Result) -> None:
    axes = plots.paper_figures(long)
    titles = [ax.get_title("left") for ax in axes]
    assert titles[1:3] == ["Carriage 1a, y", "Carriage 1a, z"]
    assert titles[9:11] == ["Carriage 1a, y, worst cycle", "Carriage 1a, z, worst cycle"]
    assert len(axes) == 17
    assert len(plots.load_y(long, "1a").figure.axes) == 2


def test_short_records_are_drawn_as_lines() -> None:
    short = simulate(cart(), cycle())
    ax = plots.resultant(short)
    assert np.array_equal(ax.lines[0].get_xdata(), short.quantities["time"]) and len(ax.figure.axes) == 1
    assert len(plots.paper_figures(short)) == 9


def test_points_are_drawn_in_micrometres(long: Result) -> None:
    overview, closer, spectrum = plots.points(long)
    data = long.quantities
    moving = 1e6 * (data["point_displacement"] - data["static_point_displacement"])[:, 0]
    assert overview.collections and np.array_equal(closer.lines[0].get_ydata(), moving[worst_cycle(long), 0])
    frequency, density = (np.asarray(values) for values in spectrum.lines[0].get_data())
    assert frequency.size == density.size and spectrum.get_xscale() == "log"
    with pytest.raises(ValueError, match="no points to draw"):
        plots.points(simulate(cart(), cycle()))


def test_a_point_that_does_not_move_is_said_to() -> None:
    machine = cart().model_copy(update={"points": (PointOfInterest(name="tool", at=(0.0, 0.0, 0.0)),)})
    time = np.arange(200) * 1e-3
    _, spectrum = plots.points(simulate(machine, Motion.along_x(time, 0.0 * time)))
    spectrum.figure.draw_without_rendering()
    assert [text.get_text() for text in spectrum.texts] == ["the point does not move"]


def test_the_html_report_enlarges_the_worst_cycle(long: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)  # the titles are those of charts, which are not pictures
    titles = re.findall(r'"title": ("[^"]*")', run_page(long))
    assert any(json.loads(title).startswith("Resultant around the largest load") for title in titles)
