"""Printing of reports to standard output, and of progress to standard error."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import click

from guideload.base.visible_text import visible


def output_encoding() -> str:
    """The encoding of standard output."""
    return getattr(sys.stdout, "encoding", None) or "utf-8"


def print_text(text: str) -> None:
    """Print to standard output; control characters are escaped, characters outside its encoding replaced."""
    encoding = output_encoding()
    click.echo(visible(text).rstrip("\n").encode(encoding, errors="replace").decode(encoding))


def status(doing: str) -> AbstractContextManager[Any]:
    """Show the current activity on standard error, if it is a terminal."""
    if not sys.stderr.isatty():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(f"{doing} ...")
