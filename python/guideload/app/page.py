"""One tab of the page: its views side by side with the answer."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib.resources import files

from nicegui import ui
from nicegui.events import KeyEventArguments

from guideload.app import widgets
from guideload.app.answer_view import AnswerView
from guideload.app.decide_view import DecideView
from guideload.app.hub import Hub, Part
from guideload.app.keep_view import KeepView
from guideload.app.machine_view import MachineView
from guideload.app.monitor_view import MonitorView
from guideload.app.motion_view import MotionView

VIEWS: dict[str, tuple[str, Callable[[Hub], Part]]] = {
    "Machine": ("precision_manufacturing", MachineView),
    "Motion": ("timeline", MotionView),
    "Decide": ("balance", DecideView),
    "Keep": ("save_alt", KeepView),
    "Monitor": ("monitor_heart", MonitorView),
}


class Page(Part):
    """A tab; all tabs show the same session."""

    def __init__(self, hub: Hub) -> None:
        self.hub, self.session = hub, hub.session
        self.offering: object = None  # what the row of offers shows

    def build(self) -> None:
        """Make the elements; called when the browser opens the page."""
        ui.add_css(files(__package__).joinpath("page.css").read_text(encoding="utf-8"))
        ui.colors(primary="#1f4e79")
        self.client = ui.context.client
        self._build_header()
        self.offer = ui.row().classes("offer w-full")
        with ui.element("main").classes("page"):
            with ui.element("div").classes("views"):
                self._build_views()
            self.answer = AnswerView(self.hub)
        self.hub.views.append(self)
        self.client.on_delete(lambda: self.hub.views.remove(self))
        self.show_state()
        self.show_answer()

    def _build_header(self) -> None:
        with ui.header().classes("items-center no-wrap top"):
            self.title = ui.label().classes("text-weight-medium")
            self.unsaved = ui.label().props("role=status")
            ui.space()
            self.undo = self._button("undo", "Undo", self.session.undo)
            self.redo = self._button("redo", "Redo", self.session.redo)
            self._button("save", "Save", self.save)
        ui.keyboard(self._key)

    def _build_views(self) -> None:
        with ui.tabs().props("dense no-caps align=left inline-label") as tabs:
            names = [ui.tab(name, icon=icon).mark(name) for name, (icon, _) in VIEWS.items()]
        with ui.tab_panels(tabs, value=names[0], animated=False, keep_alive=True).classes("w-full"):
            self.parts: dict[str, Part] = {}
            for tab, (name, (_, make)) in zip(names, VIEWS.items(), strict=True):
                with ui.tab_panel(tab):
                    self.parts[name] = make(self.hub)
        # The one in view; the others are brought up to date when they come into view.
        self.part = next(iter(self.parts.values()))
        tabs.on_value_change(lambda event: self._turn_to(event.value))

    def _turn_to(self, name: str) -> None:
        self.part.in_view = False
        self.part = self.parts[name]
        self.part.in_view = True
        self.part.show_state()
        self.part.show_answer()

    def _button(self, icon: str, words: str, action: Callable[[], object]) -> ui.button:
        return ui.button(words, icon=icon, on_click=lambda: _attempt(action)).props("flat color=white")

    def _key(self, event: KeyEventArguments) -> None:
        """Ctrl-Z, Ctrl-Y and Ctrl-S, outside fields, where the browser has its own."""
        actions = {"z": self.session.undo, "y": self.session.redo, "s": self.save}
        action = actions.get(str(event.key.name).lower())
        if event.action.keydown and event.modifiers.ctrl and action is not None:
            _attempt(action)

    def save(self) -> None:
        """Write the files."""
        written = self.session.save()
        ui.notify(
            f"Wrote {' and '.join(written)}." if written else "Nothing to write: the files are as the page."
        )

    # ---- what changed

    def show_state(self) -> None:
        """Header, offer, and the views of the state."""
        with self.client:
            session = self.session
            self.title.text = f"guideload  {session.machine_name}  {session.motion_name}"
            self.unsaved.text = f"not saved: {', '.join(session.unsaved)}" if session.unsaved else "saved"
            self.undo.set_enabled(bool(session.past))
            self.redo.set_enabled(bool(session.future))
            self._show_offer()
            self.part.show_state()

    def show_answer(self) -> None:
        """The answer, and what the views take from it."""
        with self.client:
            self.answer.show()
            self.part.show_answer()

    def show_progress(self, what: str) -> None:
        """What a long run does."""
        with self.client:
            self.answer.show_progress(what)

    def _show_offer(self) -> None:
        """What an earlier server left unsaved, and files that another program changed."""
        session = self.session
        if (session.offered, session.notice) == self.offering:
            return
        self.offering = session.offered, session.notice
        self.offer.clear()
        with self.offer:
            if session.offered is not None:
                when = time.strftime("%d %b %H:%M:%S", time.localtime(session.offered.time))
                ui.label(f"Unsaved changes of {when} were found: the page ended before they were saved.")
                for words, taken in (("Take them", True), ("Leave them", False)):
                    ui.button(words, on_click=lambda taken=taken: session.take_offered(taken))
            if session.notice:
                ui.label(session.notice).style(f"color: {widgets.COLORS['bad']}")
            if session.clashes:
                ui.button("Reload", on_click=lambda: _attempt(session.reload))
        self.offer.set_visibility(session.offered is not None or bool(session.notice))


def _attempt(action: Callable[[], object]) -> None:
    with widgets.errors_shown():
        action()
