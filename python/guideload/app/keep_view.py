"""What is kept: files, the report, and the commands that repeat what the page shows."""

from __future__ import annotations

import asyncio
import shlex

from nicegui import ui

import guideload
from guideload.app import widgets
from guideload.app.answer import Answer
from guideload.app.hub import Hub, Part

REPORT = "report.html"


class KeepView(Part):
    """Save, report, and commands."""

    def __init__(self, hub: Hub) -> None:
        self.session = hub.session
        with ui.row():
            self.name = ui.input("report", value=REPORT)
            widgets.work_button(hub, "Write the report", self._write, icon="description")
        self.done = ui.label().props("role=status").mark("kept")
        ui.label("The commands that repeat what the page shows, in its folder:")
        self.commands = widgets.show_commands("")

    def show_state(self) -> None:
        """The commands."""
        folder = self.session.folder.root
        lines = [f'cd "{folder}"', self.session.command(), self.session.command("life", "")]
        self.commands.content = "\n".join(lines)

    async def _write(self, answer: Answer) -> None:
        """The HTML report of the run, in a thread: its pictures take a second."""
        self.done.text = ""  # of an earlier report
        path = self.session.folder.path(str(self.name.value or REPORT))
        name = self.session.folder.name(path)
        if path.suffix != ".html":
            raise guideload.GuideloadError(f"{path.name}: expected a name that ends with .html")
        result = await asyncio.to_thread(guideload.simulate, answer.machine, answer.motion)
        await asyncio.to_thread(guideload.html_report.save, result, path)
        page = path.read_text(encoding="utf-8")
        command = self.session.command(options=f"--report {shlex.quote(name)}")
        self.done.text = f"Wrote {name}, the report of `{command}`."
        ui.download.content(page, path.name)
