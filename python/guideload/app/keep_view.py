"""What is kept: files, the report, and the commands that repeat what the page shows."""

from __future__ import annotations

import asyncio

from nicegui import ui

import guideload
from guideload.app.form import Refused
from guideload.app.hub import Hub, Part
from guideload.app.words import show_commands

REPORT = "report.html"


class KeepView(Part):
    """Save, report, and commands."""

    def __init__(self, hub: Hub, attempt: Refused) -> None:
        self.hub, self.session, self.attempt = hub, hub.session, attempt
        with ui.row().classes("items-center gap-2"):
            self.name = ui.input("report", value=REPORT).props("dense outlined").classes("field")
            self.write = ui.button("Write the report", icon="description", on_click=self._write)
            self.write.props("dense no-caps unelevated")
        self.done = ui.label().props("role=status").mark("kept")
        ui.label("The commands that repeat what the page shows, in its folder:")
        self.commands = show_commands("")

    def show_state(self) -> None:
        """The commands."""
        folder = self.session.folder.root
        lines = [f'cd "{folder}"', self.session.command(), self.session.command("life", "")]
        self.commands.content = "\n".join(lines)

    async def _write(self) -> None:
        """The HTML report of the run, in a thread: its pictures take a second."""
        answer = self.hub.sound
        if answer is None or answer is not self.hub.answer:
            ui.notify("There is no answer yet, or the machine has a problem: see the answer at the right")
            return
        machine, motion = answer.machine, answer.motion
        self.done.text = "writing the report"
        try:
            path = self.session.folder.path(str(self.name.value or REPORT))
            if path.suffix != ".html":
                raise guideload.GuideloadError(f"{path.name}: expected a name that ends with .html")
            result = await asyncio.to_thread(guideload.simulate, machine, motion)
            await asyncio.to_thread(guideload.html_report.save, result, path)
        except (guideload.GuideloadError, OSError) as error:
            self.done.text = str(error)
            return
        page = path.read_text(encoding="utf-8")
        self.done.text = f"Wrote {self.session.folder.name(path)}, the report of `{self.session.command()}`."
        ui.download.content(page, path.name)
