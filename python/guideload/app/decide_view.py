"""Decisions: which product holds, how far the machine may go, how it scatters, and which of two variants is better."""

from __future__ import annotations

import asyncio
import tempfile
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from nicegui import ui

import guideload
from guideload.app import document, widgets
from guideload.app.answer import Answer
from guideload.app.hub import Hub, Part

QUANTITIES = ["pace", "payload", "overhang", "speed", "acceleration", "deceleration", "jerk"]
FIGURES = {"peak_resultant_N": "largest load [N]", "life_km": "life [km]", "static_safety": "static safety"}
DRIVEN = {"peak_resultant": "largest load", "mean_load": "mean load", "life": "life"}
BARS = 14  # of the tornado
CHUNK, LOOK, BINS = 32, 0.5, 40  # machines between two looks at a study, seconds between them, bars
# What a product gives, so that the file of the machine does not say it again.
OF_PRODUCT = ("type", "length", "width", "rolling", "stiffness_pitch", "stiffness_yaw", "stiffness_roll")
OF_AXIS = ("stiffness", "curve", "preload", "clearance")


class DecideView(Part):
    """Size, limit, study and comparison of variants; each says the command that repeats it."""

    def __init__(self, hub: Hub) -> None:
        self.session = hub.session
        self.sizing: guideload.sizing.Sizing | None = None
        self.kept: Answer | None = None
        with ui.expansion("Size: the smallest product that holds", value=True):
            with ui.row():
                self.words = ui.input("products, e.g. HIWIN 25", value="HIWIN").classes("wide")
                widgets.work_button(hub, "Size", self._size)
            self.sized = ui.column().mark("sizes")
        with ui.expansion("Limit: how fast, how heavy, how far out"):
            with ui.row():
                self.quantity = ui.select(QUANTITIES, value="pace", label="what grows").classes("mid")
                widgets.work_button(hub, "Find the limit", self._limit)
            self.limited = ui.column().mark("limits")
        with ui.expansion("Drivers: which numbers of the machine drive a figure"):
            with ui.row():
                self.driven = ui.select(DRIVEN, value="peak_resultant", label="figure").classes("mid")
                widgets.work_button(hub, "Find the drivers", self._drivers)
            self.drivers = ui.column().mark("drivers")
        with ui.expansion("Study: how the figures scatter"):
            with ui.row():
                self.samples = ui.number("machines", value=1000, min=8, max=100000, precision=0)
                self.mass = ui.number("mass +- [%]", value=10, min=0, max=90)
                self.stiffness = ui.number("stiffness +- [%]", value=20, min=0, max=90)
                self.figure = ui.select(FIGURES, value="peak_resultant_N", label="figure").classes("mid")
                self.least = ui.input("limit, e.g. 6 kN").classes("mid")
                widgets.work_button(hub, "Run the study", self._study)
            self.progress = ui.label().classes("text-caption").props("role=status")
            self.histogram = widgets.new_chart("Histogram of the study")
            self.histogram.set_visibility(False)
            self.studied = ui.column().mark("study")
        with ui.expansion("Variants: two machines side by side"):
            with ui.row():
                widgets.work_button(hub, "Keep this machine as A", self._keep)
                widgets.work_button(hub, "Compare A with now", self._compare)
            self.compared = ui.column().mark("comparison")

    # ---- size

    async def _size(self, answer: Answer) -> None:
        machine, motion, words = answer.machine, answer.motion, str(self.words.value or "").strip()
        catalogue, products = guideload.packaged_catalogue(), [words] if words else None
        sizing = guideload.sizing
        found = await asyncio.to_thread(
            sizing.size, machine, motion, catalogue, products=products, larger=sizing.LARGER
        )
        self.sizing = found = holding_first(found)
        self.sized.clear()
        with self.sized:
            ui.label("Those that hold come first. Take one, or click its row.").classes("text-caption")
            report = guideload.reports.sizing_report(machine, found)
            for line in report.answer:
                ui.label(line)
            names = [one.name for one in found.candidates]
            with ui.row():
                chosen = ui.select(names, value=names[0], label="product").classes("wide")
                ui.button("Take", on_click=lambda: self._take(str(chosen.value))).props("unelevated")
            for section in report.sections:
                for part in section.parts:
                    if (table := widgets.show_part(part)) is not None:
                        # Two characters mark the smallest, and those that do not hold.
                        table.on("rowClick", lambda event: self._take(str(event.args[1]["0"])[2:]))
            widgets.show_commands(self.session.command("size", f'--product "{words}"' if words else ""))

    def _take(self, name: str) -> None:
        """Write the product into every carriage; damping keeps its ratio, as in the run of the candidate."""
        assert self.sizing is not None
        one = next(one for one in self.sizing.candidates if one.name == name)
        if one.machine is None:
            ui.notify(f"{name}: {one.reason}", type="negative")
            return
        with widgets.errors_shown():
            self.session.set("machine", product_changes(one))
        ui.notify(f"All carriages are {name} now; Undo takes it back")

    # ---- limit

    async def _limit(self, answer: Answer) -> None:
        quantity: Any = self.quantity.value
        motion: Any = answer.motion
        if quantity in QUANTITIES[3:] and not answer.state.trace:
            motion = guideload.Moves.from_text(answer.state.moves, self.session.moves_name)
        found = await asyncio.to_thread(guideload.sizing.largest, answer.machine, motion, quantity)
        self.limited.clear()
        with self.limited:
            widgets.show_report(guideload.reports.limit_report(answer.machine, found, answer.machine.life))
            widgets.show_commands(self.session.command("limit", f"--of {quantity}"))

    # ---- drivers

    async def _drivers(self, answer: Answer) -> None:
        """A tornado: the change of the figure by a small change of each number."""
        figure = str(self.driven.value)
        rank = guideload.sensitivity.rank_influences
        found = await asyncio.to_thread(rank, answer.machine, answer.motion, figure)
        names = [f"{one.name} + {step}" for one, step in zip(found.columns, found.steps, strict=True)]
        changes = [float(f"{one:.4g}") for one in found.changes[:BARS]]
        bars = {"type": "bar", "color": "#0072B2", "data": changes}
        title = f"{DRIVEN[figure]} of carriage {found.carriage}: effect of a small change [{found.unit}]"
        options = widgets.chart_options([bars], title)
        options["yAxis"] = {"type": "category", "data": names[:BARS], "inverse": True}
        options["xAxis"] = {"type": "value"}
        del options["dataZoom"]
        self.drivers.clear()
        with self.drivers:
            widgets.new_chart("Tornado of the drivers", options).classes("tornado")
            widgets.show_commands(self.session.command("sensitivities", f"--of {figure}"))

    # ---- study

    async def _study(self, answer: Answer) -> None:
        figure, limit = str(self.figure.value), str(self.least.value or "").strip()
        rated = figure != "peak_resultant_N"
        name = figure.rpartition("_")[0] if figure != "static_safety" else figure
        study = guideload.Study(
            machine=answer.machine,
            motion=answer.motion,
            samples=int(self.samples.value or 0),
            seed=1,
            quantities=("resultant", *(("load",) if rated else ())),
            statistics=("max",),
            limits={name: document.typed(limit, {})} if limit else {},
            vary=self._varied(),
        )
        with tempfile.TemporaryDirectory(prefix="guideload-study-") as folder:
            output = f"{folder}/study"
            counts = [(0, study.samples)]  # written by the thread of the study
            options: Any = {"chunk": CHUNK, "progress": lambda *now: counts.append(now)}
            work = asyncio.create_task(asyncio.to_thread(guideload.run_study, study, output, **options))
            ended: set[Any] = set()
            while not ended:
                ended = (await asyncio.wait([work], timeout=LOOK))[0]
                self.progress.text = "{} of {} machines".format(*counts[-1])
                # What cannot be read yet is read at the next look.
                with suppress(guideload.GuideloadError):
                    if not ended and counts[-1][0] >= CHUNK:
                        self._draw(guideload.StudyResult.load(output), figure)
            result = await work
            self._draw(result, figure)
            self.studied.clear()
            with self.studied:
                widgets.show_report(guideload.reports.study_report(result))

    def _varied(self) -> Any:
        """What scatters: the mass evenly, the stiffness of each carriage by a lognormal distribution."""
        mass, stiffness = (max(float(one.value or 0.0), 1e-3) for one in (self.mass, self.stiffness))
        axes = [f"carriages.*.stiffness_{axis}" for axis in "yz"]
        law = {"each": "carriage", "distribution": "lognormal", "sigma": stiffness / 100.0}
        return (
            {"path": "body.mass", "distribution": "uniform", "plus_minus": f"{mass:g} %"},
            {"name": "stiffness", "path": axes, **law},
        )

    def _draw(self, result: guideload.StudyResult, figure: str) -> None:
        """The histogram of what has run."""
        values = result.column(figure)
        values = values[np.isfinite(values)]
        if not values.size:
            return
        counts, edges = np.histogram(values, BINS)
        middles = 0.5 * (edges[1:] + edges[:-1])
        self.histogram.set_visibility(True)
        bars = {"type": "bar", "barWidth": "99%", "color": "#0072B2"}
        bars["data"] = np.column_stack([middles.round(4), counts]).tolist()
        options = widgets.chart_options([bars], f"{FIGURES[figure]} of {values.size} machines")
        widgets.redraw(self.histogram, options | {"yAxis": {"type": "value", "min": 0}})

    # ---- variants

    async def _keep(self, answer: Answer) -> None:
        self.kept = answer
        ui.notify("Kept as A: change the machine, then compare")

    async def _compare(self, answer: Answer) -> None:
        if self.kept is None:
            ui.notify("Keep a machine as A first")
            return
        results = {"A": self.kept.result, "now": answer.result}
        report = await asyncio.to_thread(guideload.reports.comparison_report, results)
        self.compared.clear()
        with self.compared:
            widgets.show_report(report)


def holding_first(found: guideload.sizing.Sizing) -> guideload.sizing.Sizing:
    """The candidates that hold before the others; the ranking of the package stays in each group."""
    return replace(found, candidates=tuple(sorted(found.candidates, key=lambda one: not one.holds)))


def product_changes(candidate: guideload.sizing.Candidate) -> dict[document.Path, Any]:
    """The values of the machine file with which its carriages are the candidate's, as in its run."""
    changes: dict[document.Path, Any] = {}
    assert candidate.machine is not None
    laws = bool(candidate.product.stiffness_source(candidate.preload_class))
    gone = (*OF_PRODUCT, *(f"{key}_{axis}" for key in OF_AXIS for axis in "yz"))
    for i, carriage in enumerate(candidate.machine.carriages):
        values: dict[str, Any] = {"product": candidate.product.name, "preload_class": candidate.preload_class}
        if laws:
            values |= dict.fromkeys(gone)
            values |= {
                f"damping_{axis}": f"{getattr(carriage, f'damping_{axis}') / 1e3:.6g} kN s/m" for axis in "yz"
            }
        changes |= {("carriages", i, key): value for key, value in values.items()}
    return changes
