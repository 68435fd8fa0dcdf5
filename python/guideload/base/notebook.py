"""How objects look in a notebook: a line and a table."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from guideload.base.number_text import digits

if TYPE_CHECKING:
    import pandas as pd


def as_html(line: str, table: pd.DataFrame) -> str:
    """A line of text, and below it a table whose numbers have four digits."""
    shown = table.to_html(float_format=lambda value: digits(value, 4), border=0) if table.size else ""
    return f"<p>{escape(line)}</p>\n{shown}"
