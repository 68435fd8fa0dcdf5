"""The load monitor beside the machine: what `guideload monitor watch` writes into its folder, live."""

from __future__ import annotations

import time
from typing import Any

from nicegui import ui

import guideload
from guideload.app import widgets
from guideload.app.hub import Hub, Part

LOOK = 0.5  # s between two looks at the folder, into which a watch writes as often
SILENT = 3.0  # s: a watch that has not written for so long is dead, or its computer is
TITLE = "Largest resultant of Fy and Fz in each 0.1 s [N], over time since the first sample [s]"
NONE = "No watch has written into a folder below this one yet. The commands below begin one."


class MonitorView(Part):
    """The loads that a watch sees now, and what it has seen."""

    def __init__(self, hub: Hub) -> None:
        self.session = hub.session
        self.shown: guideload.WatchState | None = None
        with ui.row().classes("w-full no-wrap"):
            self.folder = ui.select([], label="folder of a watch", on_change=lambda: self._look())
            self.folder.classes("mid")
            self.sign = ui.label().classes("text-weight-medium").props("role=status").mark("watch")
        self.answer = ui.label()
        self.warnings = ui.label().style(f"color: {widgets.COLORS['near']}").classes("whitespace-pre-line")
        self.chart = widgets.new_chart("Loads of the last minute", _options([]))
        self.table = ui.table(rows=[], row_key="id").props("hide-bottom").mark("monitor")
        self.input = ui.label().classes("text-caption")
        ui.label("The commands that make a monitor of this machine, and show here what it sees:")
        self.commands = widgets.show_commands("")
        self.show_state()
        ui.timer(LOOK, self._look)

    def show_state(self) -> None:
        """The folders of watches, and the commands."""
        root = self.session.folder.root
        files = [*root.glob(f"*/{guideload.WatchState.FILE}"), *root.glob(f"*/*/{guideload.WatchState.FILE}")]
        names = [file.parent.relative_to(root).as_posix() for file in sorted(files)]
        if self.folder.options != names:
            kept = self.folder.value if self.folder.value in names else next(iter(names), None)
            self.folder.set_options(names, value=kept)
        build = '--period "1 ms" --travel-per-count "1 um" -o monitor.toml'
        watch = "guideload monitor watch monitor.toml --follow samples.csv -o loads"
        self.commands.content = f"{self.session.command('monitor build', build)}\n{watch}"

    def _look(self) -> None:
        """What the watch has written, if the view is in sight."""
        if not self.in_view:
            return
        if self.folder.value is None:
            self.show_state()
        if self.folder.value is None:
            self._say("open", NONE)
            return
        try:
            state = guideload.WatchState.read(self.session.folder.path(str(self.folder.value)))
        except guideload.GuideloadError as error:
            self._say("bad", str(error))
            return
        silence = time.time() - state.written
        if state.ended:
            self._say("open", f"ended {time.strftime('%d %b %H:%M:%S', time.localtime(state.written))}")
        elif silence > SILENT:
            self._say("bad", f"no sign of life for {silence:.0f} s: the watch was killed")
        else:
            self._say("good", f"live: {state.status['samples_per_s']:.0f} samples/s")
        if state != self.shown:
            self.shown = state
            self._show(state)

    def _say(self, level: guideload.reports.Level, words: str) -> None:
        self.sign.text = words
        self.sign.style(f"color: {widgets.COLORS[level]}")

    def _show(self, state: guideload.WatchState) -> None:
        report = guideload.reports.monitor_report(state.status)
        self.answer.text = " ".join(report.answer)
        self.warnings.text = "\n".join(report.warnings)
        carriages, samples = (section.parts[0] for section in report.sections)
        assert isinstance(carriages, guideload.reports.Table)
        self.table.columns, self.table.rows = widgets.table_content(carriages)
        self.input.text = str(samples)
        series = []
        for i, one in enumerate(state.status["carriages"], start=1):
            points = [[point[0], point[i]] for point in state.points]
            series.append(widgets.line(one["name"], points, widgets.carriage_color(i - 1)))
        widgets.redraw(self.chart, _options(series))


def _options(series: list[dict[str, Any]]) -> dict[str, Any]:
    options = widgets.chart_options(series, TITLE)
    del options["dataZoom"]
    options["grid"]["bottom"] = 8
    return options
