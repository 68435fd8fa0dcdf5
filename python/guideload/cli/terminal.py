"""Printing of reports to standard output, and of progress to standard error."""

from __future__ import annotations

import shutil
import sys
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any

import click

from guideload.base.visible_text import visible

if TYPE_CHECKING:
    from guideload.reports.report import Report

NARROWEST = 40  # characters


def output_encoding() -> str:
    """The encoding of standard output."""
    return getattr(sys.stdout, "encoding", None) or "utf-8"


def print_text(text: str) -> None:
    """Print to standard output; control characters are escaped, characters outside its encoding replaced."""
    encoding = output_encoding()
    click.echo(visible(text).rstrip("\n").encode(encoding, errors="replace").decode(encoding))


def print_report(report: Report) -> None:
    """Print a report in the encoding of standard output and the width of the terminal, or COLUMNS; 80 without any."""
    width = max(shutil.get_terminal_size().columns, NARROWEST)
    print_text(report.text(width, output_encoding()))


def status(doing: str) -> AbstractContextManager[Any]:
    """Show the current activity on standard error, if it is a terminal."""
    if not sys.stderr.isatty():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(f"{doing} ...")
