"""The HTML reports of a comparison, a sizing and a study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from guideload.html_report.document import Line, chart
from guideload.html_report.page import page_of
from guideload.plots.compare import comparison
from guideload.plots.style import carriage_look
from guideload.reports.compare import comparison_parts
from guideload.reports.sizing import sizing_parts

if TYPE_CHECKING:
    from guideload.duty.duty_cycle import DutyCycle
    from guideload.machine.machine import Machine
    from guideload.simulation.result import Result
    from guideload.sizing.size import Sizing
    from guideload.study.results.result import StudyResult


def comparison_page(results: Mapping[str, Result]) -> str:
    """Several runs side by side, by title; their most loaded carriages as charts that can be zoomed."""
    caption = "The resultant of the most loaded carriage of each run, and the peaks of all carriages."
    titles = ", ".join(results)
    return page_of(
        f"Comparison: {titles}",
        comparison_parts(results),
        [(comparison(results)[0], caption)],
        _charts(results),
    )


def _charts(results: Mapping[str, Result]) -> Iterator[str]:
    for i, (title, result) in enumerate(results.items()):
        data, look = result.quantities, carriage_look(i)
        at = int(result.peak_columns["peak_resultant_N"].argmax())
        line = Line(result.machine.carriages[at].name, data["resultant"][:, at], look.color)
        yield chart(
            f"{title}: resultant of the most loaded carriage", "N", data["time"], [line], group="runs"
        )


def sizing_page(machine: Machine, sizing: Sizing) -> str:
    """The ranked candidates, and the history of the smallest that holds."""
    best = sizing.smallest
    charts = [] if best is None or best.result is None else _charts({best.name: best.result})
    return page_of(f"{machine.name}: which carriage", sizing_parts(machine, sizing), charts=charts)


def duty_page(duty: DutyCycle) -> str:
    """The report of a duty cycle, and the history of the most loaded carriage in each case."""
    from guideload.reports.duty import duty_parts

    results = {case.name: life.record.result for case, life in zip(duty.cases, duty.lives, strict=True)}
    title = f"{duty.cases[0].machine.name}: duty cycle"
    return page_of(title, duty_parts(duty), charts=_charts(results))


def study_page(result: StudyResult) -> str:
    """The report of a study with its pictures."""
    from guideload.plots.study import study_drawings  # other pages do not need pandas
    from guideload.reports.study import study_parts

    drawings = ((draw(), caption) for caption, draw in study_drawings(result).items())
    return page_of(f"{result.metadata.machine.name}: study", study_parts(result), drawings)
