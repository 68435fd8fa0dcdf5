"""The table [report] of a machine file: what stands at the head of a report that someone signs."""

from __future__ import annotations

from datetime import date
from typing import Annotated

from pydantic import BeforeValidator

from guideload.base.config import ConfigModel, optional
from guideload.machine.components import Name

SIGN = "_" * 20  # where to sign on paper


def _day(value: object) -> object:
    """A date as text; that of the day on which the file is read for "today"."""
    return str(date.today() if value == "today" else value) if isinstance(value, date | str) else value


class ReportHead(ConfigModel):
    """The head of all reports of the machine; keys that are left out are not shown."""

    project: Name | None = optional("name or number of the project")
    customer: Name | None = optional("for whom the machine is built")
    drawing: Name | None = optional("number of the drawing, with its revision")
    author: Name | None = optional("who computed it")
    checked_by: Name | None = optional("who checks it; the head has a line to sign in any case")
    date: Annotated[Name, BeforeValidator(_day)] | None = optional(
        'a day, e.g. 2026-03-31; "today" is that of the run'
    )

    @property
    def lines(self) -> list[str]:
        """A line for each key that is given: `Project: Gantry 12`; then one to sign. None without any key."""
        given = self.model_dump(exclude_none=True, exclude={"checked_by"})
        lines = [f"{key.capitalize()}: {value}" for key, value in given.items()]
        checked = "" if self.checked_by is None else f"{self.checked_by} "
        return [*lines, f"Checked by: {checked}{SIGN} Date: {SIGN}"] if lines or checked else []
