"""The motion: planned moves as a form, or a measured trace, with what was read of it."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any

import numpy as np
from nicegui import ui
from nicegui.events import UploadEventArguments

import guideload
from guideload.app import widgets
from guideload.app.envelope import envelope
from guideload.app.form import Form
from guideload.app.guard import LARGEST_BODY
from guideload.app.hub import Hub, Part

SIGMAS = 1.96  # of the 95 % band
UNITS = {"acceleration": "m/s2", "velocity": "m/s", "position": "m"}
NO_TRACES = (".toml", ".html", ".json", ".png", ".svg", ".md", ".py", ".nc")
TOO_LARGE = "The file is too large: guideload long-run reads any length"
BLUE, BAND = "#0072B2", "#9aa3ad"


class MotionView(Part):
    """Planned moves or a trace, and the motion along the rails."""

    def __init__(self, hub: Hub) -> None:
        self.hub, self.session = hub, hub.session
        self.inspected: tuple[guideload.Motion, guideload.Inspection] | None = None
        self.drawn: object = None  # motion, quantity and inspection of the chart
        with ui.row().classes("w-full"):
            kinds = {"moves": "planned moves", "trace": "measured trace"}
            self.kind = ui.toggle(kinds, value="trace" if self.session.state.trace else "moves")
            self.kind.props("dense no-caps").on_value_change(lambda: self._choose_kind())
            self.quantity = ui.select(list(UNITS), value="acceleration", label="chart of")
            self.quantity.classes("mid").on_value_change(lambda: self._draw())
            self.problem = ui.label().style(f"color: {widgets.COLORS['bad']}").props("role=alert")
            self.problem.mark("motion problem")
        self.chart = widgets.new_chart("Motion of the cart")
        with ui.column() as self.moves:
            self.form = Form(self.session, "moves", ("moves", "limits", ""))
        with ui.column() as self.trace:
            with ui.row():
                self.names = ui.select([], label="trace in this folder", clearable=True)
                self.names.classes("wide").on_value_change(lambda e: self._choose(e.value or ""))
                ui.upload(
                    label="or drop a trace here (CSV, text, NumPy, Parquet, MATLAB)",
                    auto_upload=True,
                    max_file_size=LARGEST_BODY,
                    on_upload=self._uploaded,
                    on_rejected=lambda: ui.notify(TOO_LARGE),
                ).props("flat bordered dense").classes("trace-drop")
            self.report = ui.column().mark("inspection")
        self._show_kind()

    def show_state(self) -> None:
        """The moves, and the traces of the folder."""
        self.form.show()
        trace = self.session.state.trace
        files = (one for one in self.session.folder.root.iterdir() if one.is_file() and one.name[0] != ".")
        names = sorted(one.name for one in files if one.suffix.lower() not in NO_TRACES)
        if trace and trace not in names:
            names.append(trace)
        if self.names.options != names or (self.names.value or "") != trace:
            self.names.set_options(names, value=trace or None)
        if trace and self.kind.value != "trace":
            self.kind.value = "trace"

    def show_answer(self) -> None:
        """The motion of the last answer."""
        problems, answer = self.hub.problems, self.hub.last_valid
        self.form.show_problems(problems)
        self.problem.text = next((one.text for one in problems if one.part == "trace"), "")
        if answer is None:
            return
        self._draw()
        if answer.report is not None and answer.state.trace:
            ui.timer(0.0, self._inspect, once=True)
        if not answer.state.trace or self.problem.text:
            self.report.clear()

    def _show_kind(self) -> None:
        measured = self.kind.value == "trace"
        self.moves.set_visibility(not measured)
        self.trace.set_visibility(measured)

    def _choose_kind(self) -> None:
        """The planned moves are run as soon as they are chosen; a trace has yet to be named."""
        self._show_kind()
        if self.kind.value == "moves":
            self.session.change(replace(self.session.state, trace=""))

    def _choose(self, name: str) -> None:
        if name and name != self.session.state.trace:
            self.session.change(replace(self.session.state, trace=name))

    async def _uploaded(self, event: UploadEventArguments) -> None:
        content = await event.file.read()
        with widgets.errors_shown():
            self._choose(self.session.add_trace(event.file.name, content))

    async def _inspect(self) -> None:
        """What was read of the trace: samples, clock, gaps, noise, and what the smoothing made of it."""
        answer = self.hub.last_valid
        if answer is None or not answer.state.trace:
            return
        if self.inspected is None or self.inspected[0] is not answer.motion:
            file = self.session.folder.path(answer.state.trace)
            machine = answer.machine
            try:
                found = await asyncio.to_thread(
                    lambda: guideload.Inspection.of(guideload.read_trace(file), machine)
                )
            except guideload.GuideloadError:
                return  # the answer says it
            self.inspected = answer.motion, found
            self._draw()
        self.report.clear()
        with self.report:
            widgets.show_report(guideload.reports.encoder_report(self.inspected[1]))

    def _draw(self) -> None:
        answer = self.hub.last_valid
        if answer is None:
            return
        motion, name = answer.motion, str(self.quantity.value)
        if self.drawn == (motion, name, self.inspected):
            return
        self.drawn = motion, name, self.inspected
        values = getattr(motion, name)
        series: list[dict[str, Any]] = []
        if values is not None:
            along = values[:, 0]
            span = float(motion.time[0]), float(motion.time[-1])
            known = self.inspected
            if known is not None and known[0] is motion and name == "acceleration":
                deviation = known[1].deviation
                if deviation is not None and deviation.shape == along.shape and not known[1].of_motor:
                    for sign in (1.0, -1.0):
                        edge = envelope(motion.time, along + sign * SIGMAS * np.asarray(deviation), *span)
                        series.append(widgets.line("95 % band", edge, BAND, lineStyle={"type": "dashed"}))
            series.append(widgets.line(name, envelope(motion.time, along, *span), BLUE))
        widgets.redraw(self.chart, widgets.chart_options(series, f"{name} [{UNITS[name]}] over time [s]"))
