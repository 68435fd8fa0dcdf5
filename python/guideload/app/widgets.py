"""Parts that several views share: looks of widgets, charts, work with the last answer, reports and their colours."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Any

from nicegui import ui

import guideload
from guideload.app.answer import Answer
from guideload.app.hub import Hub

for _widget, _props, _classes in (
    (ui.input, "dense outlined", "field"),
    (ui.number, "dense outlined", "field"),
    (ui.select, "dense outlined options-dense", "field"),
    (ui.button, "dense no-caps", ""),
    (ui.expansion, "dense header-class=text-weight-medium", "w-full"),
    (ui.table, "dense flat wrap-cells", "w-full"),
    (ui.row, "", "items-center gap-2"),
    (ui.column, "", "w-full gap-1"),
    (ui.echart, "", "history"),
):
    _widget.default_props(_props).default_classes(_classes)

# Contrast on white of at least 4.5 (WCAG AA): 5.2, 6.3, 6.5, 7.6.
COLORS: dict[guideload.reports.Level, str] = {
    "good": "#1b7a34",
    "near": "#8a5a00",
    "bad": "#b3261e",
    "open": "#4a5160",
}
ICONS = dict(zip(COLORS, ("check_circle", "error", "cancel", "radio_button_unchecked"), strict=True))
# Okabe and Ito, as in the pictures of the reports.
CARRIAGES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def carriage_color(index: int) -> str:
    """The colour of a carriage."""
    return CARRIAGES[index % len(CARRIAGES)]


def chart_options(series: list[dict[str, Any]], title: str) -> dict[str, Any]:
    """Options of a chart over time, which can be zoomed."""
    return {
        "animation": False,
        "textStyle": {"color": "#1d2129"},
        "title": {
            "text": title,
            "top": 3,
            "padding": 0,
            "textStyle": {"fontSize": 12, "fontWeight": "normal"},
        },
        "grid": {"left": 8, "right": 20, "top": 46, "bottom": 34, "containLabel": True},
        "legend": {"top": 20, "type": "scroll", "itemHeight": 8, "textStyle": {"fontSize": 11}},
        "tooltip": {"trigger": "axis"},
        "xAxis": {"type": "value", "min": "dataMin", "max": "dataMax", "axisLabel": {"showMaxLabel": False}},
        "yAxis": {"type": "value"},
        "dataZoom": [
            {"type": "inside"},
            {"type": "slider", "height": 16, "bottom": 6, "showDataShadow": False},
        ],
        "series": series,
    }


def line(name: str, data: list[list[float]], color: str, **more: Any) -> dict[str, Any]:
    """A line of a chart through points [time, value]."""
    style = {"width": 1.2} | more.pop("lineStyle", {})
    given = {"name": name, "data": data, "color": color, "lineStyle": style}
    return {"type": "line", "showSymbol": False} | given | more


def new_chart(what: str, options: dict[str, Any] | None = None) -> ui.echart:
    """A chart, still empty; what: it shows, for those who do not see it."""
    return ui.echart(options or chart_options([], "")).props(f'aria-label="{what}"')


def redraw(chart: ui.echart, options: dict[str, Any]) -> None:
    """Give a chart new options; one with as many series as before only what changes with the data.

    That goes to the browser alone: to keep it here, where each list is observed, takes as long as a run.
    """
    if len(chart.options["series"]) == len(options["series"]):
        sent = {key: options[key] for key in ("series", "xAxis", "title") if key in options}
        chart.run_chart_method("setOption", sent)
    else:
        chart.options.clear()
        chart.options.update(options)
        chart.update()


def work_button(hub: Hub, words: str, work: Callable[[Answer], Awaitable[None]], **more: Any) -> ui.button:
    """A button for work with the answer of the present state; while it runs, it cannot be pressed."""

    async def press() -> None:
        button.disable()
        button.props("loading")
        try:
            with errors_shown():
                if (answer := await hub.newest()) is not None:
                    await work(answer)
                else:
                    ui.notify("The machine or its motion has a problem: see the answer at the right")
        finally:
            button.enable()
            button.props(remove="loading")

    button = ui.button(words, on_click=press, **more).props("unelevated")
    return button


@contextmanager
def errors_shown() -> Iterator[None]:
    """Show the reason why something is refused, until the user closes it."""
    try:
        yield
    except (guideload.GuideloadError, OSError) as error:
        ui.notify(str(error), type="negative", multi_line=True, close_button="Close", timeout=0)


def show_commands(commands: str) -> ui.code:
    """Commands that repeat what the page shows, to copy."""
    shown = ui.code(commands, language="bash").classes("w-full")
    shown.copy_button.props('aria-label="Copy the commands"')
    return shown


def show_report(report: guideload.reports.Report) -> None:
    """A report as the command line prints it: answer, warnings, sections."""
    for sentence in report.answer:
        ui.label(sentence).classes("whitespace-pre-line")
    show_warnings(report)
    for section in report.sections:
        if section.parts:
            with ui.expansion(section.title):
                for part in section.parts:
                    show_part(part)


def show_warnings(report: guideload.reports.Report) -> None:
    """What speaks against a result, the worst first."""
    for warning in report.warnings:
        with ui.row().classes("items-start no-wrap gap-1"):
            ui.icon("warning", color=COLORS["near"]).props('aria-label="caution"')
            ui.label(warning).style(f"color: {COLORS['near']}")


def show_part(part: guideload.reports.Part) -> ui.table | None:
    """A part of a report; a table is returned."""
    if isinstance(part, guideload.reports.Table):
        columns, rows = table_content(part)
        return ui.table(columns=columns, rows=rows, row_key="id")
    if isinstance(part, guideload.reports.Definitions):
        ui.label(" ".join(part.texts)).classes("text-caption").style(f"color: {COLORS['open']}")
    elif part:
        for sentence in part if isinstance(part, list) else [part]:
            ui.label(sentence)
    return None


def table_content(table: guideload.reports.Table) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Columns and rows of a table of a report, for `ui.table`."""
    columns = [
        {
            "name": str(i),
            "field": str(i),
            "label": f"{one.label} [{one.unit}]" if one.unit else one.label,
            "align": "right" if one.is_number else "left",
        }
        for i, one in enumerate(table.columns)
    ]
    rows = [{str(i): cell for i, cell in enumerate(cells)} | {"id": n} for n, cells in enumerate(table.rows)]
    return columns, rows
