"""The machine: in space, where parts are dragged or stepped, and as a form."""

from __future__ import annotations

from typing import Any

from nicegui import ui

import guideload
from guideload.app import document, widgets
from guideload.app.form import Form
from guideload.app.hub import Hub, Part
from guideload.app.scene import MachineScene

KINDS = {
    "two-rails": "two rails",
    "one-rail": "one rail",
    "gantry": "gantry",
    "vertical": "vertical axis",
    "manipulator": "packaged example",
}
SECTIONS = ("", "body", "rails", "carriages", "carriage_types", "drive", "friction", "points", "links")
MORE = ("payloads", "base", "life", "report")
STEPS = {1e-3: "1 mm", 1e-2: "10 mm", 1e-1: "100 mm"}
CENTER = "center of mass"


class MachineView(Part):
    """Scene, steps of the keyboard, and form of the machine file."""

    def __init__(self, hub: Hub) -> None:
        self.hub, self.session = hub, hub.session
        self.drags = 0
        with ui.row().classes("w-full"):
            self.kind = ui.select(KINDS, label="start from", on_change=lambda e: self._start(e.value))
            self.kind.classes("mid").mark("kind")
            self.instant = ui.slider(min=0, max=1, step=1, on_change=lambda: self.show_answer())
            self.instant.props('aria-label="Instant of the loads"').classes("col")
            self.time = ui.label().classes("text-caption")
            self.at_peak = ui.checkbox(
                "at the largest load", value=True, on_change=lambda: self.show_answer()
            )
        self.scene = MachineScene(self._dragged)
        self._build_steps()
        self.form = Form(self.session, "machine", (*SECTIONS, *MORE))

    def _build_steps(self) -> None:
        """Parts without a mouse: choose one, and step it along an axis."""
        with ui.row().classes("w-full no-wrap"):
            self.part = ui.select([CENTER], value=CENTER, label="move").classes("mid")
            self.step = ui.select(STEPS, value=1e-2, label="by")
            self.buttons = {}
            for axis, name in enumerate("xyz"):
                for sign, word in ((-1, "-"), (1, "+")):
                    button = ui.button(f"{name} {word}", on_click=lambda a=axis, s=sign: self._stepped(a, s))
                    self.buttons[axis, sign] = button.props("outline no-wrap").mark(f"step {name}{word}")
            ui.label("or drag them; Ctrl + wheel: zoom").classes("text-caption").style("width: 110px")
            ui.space()
            self.mode = ui.select({-1: "none"}, value=-1, label="mode (damping)").classes("mid")
            self.mode.on_value_change(lambda: self._show_mode())
        self.part.on_value_change(lambda: self._allow_axes())

    def show_state(self) -> None:
        """The values of the session; of a drag where it rests, because each draws the whole page anew."""
        if not self.session.open_step:
            self.form.show()

    def show_answer(self) -> None:
        """The machine and its loads at the instant chosen."""
        answer = self.hub.last_valid
        if self.hub.problems or answer is None or answer.report is not None:
            self.form.show()
            self.form.show_problems(self.hub.problems)
        if answer is None:
            return
        time = answer.time
        if self.instant.props["max"] != time.size - 1:
            self.instant.props(f"max={time.size - 1}")
        if self.at_peak.value:
            self.instant.value = answer.peak[0]
        instant = min(int(self.instant.value or 0), time.size - 1)
        self.time.text = f"{time[instant]:.3f} s"
        parts = [one.name for one in answer.machine.carriages] + [CENTER]
        if self.part.options != parts:
            self.part.set_options(parts, value=self.part.value if self.part.value in parts else CENTER)
        self.scene.show(answer, instant)
        if answer.report is not None:
            self._show_mode()

    def _show_mode(self) -> None:
        """The natural modes to choose from, and the one chosen in space."""
        if self.hub.last_valid is None:
            return
        modes = guideload.Modes.of(self.hub.last_valid.machine)
        column = guideload.reports.Column
        frequencies = column("", modes.frequency, kind="3 digits").cells
        ratios = column("", modes.damping_ratio, kind="percent").cells
        both = enumerate(zip(frequencies, ratios, strict=True))
        names = {-1: "none"} | {i: f"{frequency} Hz ({ratio})" for i, (frequency, ratio) in both}
        chosen = int(self.mode.value) if self.mode.value in names else -1
        if self.mode.options != names:
            self.mode.set_options(names, value=chosen)
        self.scene.vibrate(modes.shape[chosen] if chosen >= 0 else None)

    def _start(self, kind: str | None) -> None:
        """Begin with the file of a kind of machine; Undo brings the old one back."""
        if kind is not None:
            self.kind.value = None
            with widgets.errors_shown():
                self.session.start(kind)

    # ---- places of parts

    def _allow_axes(self) -> None:
        for (axis, _), button in self.buttons.items():
            button.set_enabled(axis == 0 or self.part.value == CENTER)

    def _dragged(self, name: str, place: tuple[float, float, float], ended: bool) -> None:
        """Write the place of a part, in whole millimetres."""
        written = [f"{round(1e3 * value)} mm" for value in place]
        changes: dict[document.Path, Any] = {
            ("body", "center_of_mass", axis): text for axis, text in enumerate(written)
        }
        if name != CENTER:
            changes = {("carriages", int(name.split()[1]), "x"): written[0]}
        with widgets.errors_shown():
            self.session.set("machine", changes, merge=f"drag {self.drags} of {name}")
        self.drags += ended

    def _stepped(self, axis: int, sign: int) -> None:
        """Move the chosen part along one axis; its other coordinates stay as they are written."""
        with widgets.errors_shown():
            machine = self.hub.solver.machine(self.session.state)
            index = next((i for i, one in enumerate(machine.carriages) if one.name == self.part.value), None)
            if index is None:
                path: document.Path = ("body", "center_of_mass", axis)
                place = machine.body.center_of_mass[axis]
            else:
                path, place = ("carriages", index, "x"), machine.carriages[index].x
            stepped = round(1e3 * (place + sign * float(self.step.value)), 6)
            self.session.set("machine", {path: f"{stepped:.12g} mm"})
