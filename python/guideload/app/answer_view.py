"""The answer, always in view: the judgement, the figures, the load histories."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, replace
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

import guideload
from guideload.app import widgets
from guideload.app.answer import Answer, Refusal
from guideload.app.envelope import envelope
from guideload.app.hub import Hub

TITLE = "Loads of the carriages: resultant of Fy and Fz [N] over time [s]"
BLACK = "#1d2129"
FINE = 200  # steps of a history, which is 400 pixels wide
MARK = {"symbol": "triangle", "symbolRotate": 180, "symbolSize": 9, "symbolOffset": [0, -7]}


class Figures(ui.element, component="figures.js"):
    """Judgement and figures, whose changes leave the other elements of the page as they are."""

    def __init__(self) -> None:
        super().__init__()
        self.props["first"] = _judgement("open", "computing", [])

    def show(
        self, answer: Answer | Refusal, note: str, figures: Iterable[guideload.reports.KeyFigure]
    ) -> None:
        """Show the verdict of an answer with a note, and figures."""
        level, words = answer.verdict
        self.run_method("show", _judgement(level, words + note, figures))


def _judgement(
    level: guideload.reports.Level, words: str, figures: Iterable[guideload.reports.KeyFigure]
) -> dict[str, Any]:
    """What figures.js shows; a figure that is not judged is black."""
    colors = widgets.COLORS | {"open": BLACK}
    shown = [asdict(one) | {"color": colors[one.level]} for one in figures]
    return {"verdict": words, "icon": widgets.ICONS[level], "color": widgets.COLORS[level], "figures": shown}


class AnswerView:
    """Judgement, figures and histories of the last answer; in `hub.last_valid` if the newest has problems."""

    def __init__(self, hub: Hub) -> None:
        self.hub = hub
        self.window = (0.0, 100.0)  # visible part of the histories [%]
        self.shown: Answer | None = None
        with ui.element("section").classes("answer").props('aria-label="Answer"'):
            self.figures = Figures()
            self.progress = ui.label().classes("text-caption").props("role=status")
            self.chart = widgets.new_chart("Load histories")
            self.chart.on("chart:datazoom", self._zoomed, throttle=0.1)
            whole = ui.button("Whole history", on_click=self._whole).props("flat size=sm")
            whole.classes("self-start")
            with ui.expansion("Report: causes, life by place, modes, audit") as self.more:
                self.report = ui.column()
            self.cautions = ui.column().mark("cautions")
        self.more.on_value_change(lambda: self.show_report())

    def show_progress(self, what: str) -> None:
        """What a long run is doing."""
        self.progress.text = f"computing: {what}" if what else ""

    def show(self) -> None:
        """The newest answer."""
        answer, valid = self.hub.answer, self.hub.last_valid
        if answer is None:
            return
        stale = self.hub.problems and valid
        note = " (The figures below are of the last state that could be computed.)" if stale else ""
        figures = valid.figures.figures if valid else ()
        shown = [replace(one, level="open") for one in figures] if stale else figures
        self.figures.show(answer, note, shown)
        if valid is None or valid is self.shown:
            return
        judged_only = self.shown is not None and self.shown.result is valid.result
        self.shown = valid
        if not judged_only:
            self._draw(valid)
        if valid.report is not None:
            self.cautions.clear()
            with self.cautions:
                ui.label(valid.report.verdict).classes("text-weight-medium")
                widgets.show_warnings(valid.report)
            self.show_report()

    def show_report(self) -> None:
        """The report of the run, if it is opened."""
        self.report.clear()
        if self.more.value and self.shown is not None and self.shown.report is not None:
            with self.report:
                if isinstance(self.shown.figures.life, guideload.Life):
                    _show_places(self.shown.figures.life)
                widgets.show_report(replace(self.shown.report, warnings=[]))

    def _draw(self, answer: Answer) -> None:
        time = answer.time
        low, high = (float(time[0] + (time[-1] - time[0]) * share / 100.0) for share in self.window)
        instant, place = answer.peak
        peak = [float(time[instant]), float(answer.loads[instant, place])]
        series = []
        for i, name in enumerate(answer.names):
            mark = {"data": [{"coord": peak}] if i == place else []} | MARK
            style = {"type": "solid" if i < 6 else "dashed"}
            points = envelope(time, answer.loads[:, i], low, high, FINE)
            series.append(
                widgets.line(name, points, widgets.carriage_color(i), markPoint=mark, lineStyle=style)
            )
        options = widgets.chart_options(series, TITLE)
        options["xAxis"] |= {"min": float(time[0]), "max": float(time[-1])}
        widgets.redraw(self.chart, options)

    def _zoomed(self, event: GenericEventArguments) -> None:
        """The stretch in view is drawn finer."""
        where = (event.args.get("batch") or [event.args])[0]
        if "start" in where and self.shown is not None:
            self.window = (float(where["start"]), float(where["end"]))
            self._draw(self.shown)

    def _whole(self) -> None:
        self.window = (0.0, 100.0)
        self.chart.run_chart_method("dispatchAction", {"type": "dataZoom", "start": 0, "end": 100})


def _show_places(life: guideload.Life) -> None:
    """A chart of where along the rails the life is used."""
    total = sum(float(one.damage.sum()) for one in life.places)
    series = []
    for i, one in enumerate(life.places if total else ()):
        middles = 0.5 * (one.edges[1:] + one.edges[:-1])
        points = envelope(middles, 100.0 * one.density / total, middles[0], middles[-1])
        series.append(
            widgets.line(f"rail {one.rail}", points, widgets.carriage_color(i), areaStyle={"opacity": 0.15})
        )
    if series:
        title = "Life by place: share of all damage [%/m] over the place on the rail [m]"
        options = widgets.chart_options(series, title) | {"yAxis": {"type": "value", "min": 0}}
        widgets.new_chart("Life by place", options)
