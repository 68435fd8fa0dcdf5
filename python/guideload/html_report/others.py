"""The HTML reports of a comparison, a sizing, a duty cycle and a study: their text with charts and pictures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from guideload.html_report.figures import Chart, Figure, Line, chart, picture
from guideload.html_report.page import report_page
from guideload.plots.style import carriage_look

if TYPE_CHECKING:
    from guideload.duty.duty_cycle import DutyCycle
    from guideload.machine.machine import Machine
    from guideload.simulation.result import Result
    from guideload.sizing.size import Sizing
    from guideload.study.result import StudyResult

PICTURES = "Pictures"  # the section of charts and pictures


def comparison_page(results: Mapping[str, Result]) -> str:
    """Several runs side by side, by title; their most loaded carriages as charts that can be zoomed."""
    from guideload.plots.compare import comparison
    from guideload.reports.compare import comparison_report

    caption = "The resultant of the most loaded carriage of each run, and the peaks of all carriages."
    figures: list[Figure] = [*_charts(results), picture(comparison(results)[0], caption)]
    return report_page(comparison_report(results), {PICTURES: figures})


def sizing_page(machine: Machine, sizing: Sizing) -> str:
    """The ranked candidates, and the history of the smallest that holds."""
    from guideload.reports.sizing import sizing_report

    best = sizing.smallest
    charts = [] if best is None or best.result is None else _charts({best.name: best.result})
    return report_page(sizing_report(machine, sizing), {PICTURES: charts})


def duty_page(duty: DutyCycle) -> str:
    """The report of a duty cycle, and the history of the most loaded carriage in each case."""
    from guideload.reports.duty import duty_report

    results = {case.name: life.record.result for case, life in zip(duty.cases, duty.lives, strict=True)}
    return report_page(duty_report(duty), {PICTURES: _charts(results)})


def study_page(result: StudyResult) -> str:
    """The report of a study with its pictures."""
    from guideload.plots.study import study_drawings  # other pages do not need pandas
    from guideload.reports.study import study_report

    drawings = (picture(draw(), caption) for caption, draw in study_drawings(result).items())
    return report_page(study_report(result), {PICTURES: drawings})


def _charts(results: Mapping[str, Result]) -> Iterator[Chart]:
    """The resultant of the most loaded carriage of each run."""
    for i, (title, result) in enumerate(results.items()):
        data, look = result.quantities, carriage_look(i)
        at = int(result.peak_columns["peak_resultant_N"].argmax())
        line = Line(result.machine.carriages[at].name, data["resultant"][:, at], look.color)
        words = f"{title}: resultant of the most loaded carriage"
        yield chart(words, "N", data["time"], [line], group="runs")
