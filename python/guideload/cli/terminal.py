"""Printing: reports to standard output in its encoding, progress to standard error."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import click


def output_encoding() -> str:
    """The encoding of standard output."""
    return getattr(sys.stdout, "encoding", None) or "utf-8"


def print_text(text: str) -> None:
    """Print to standard output; characters that its encoding lacks are replaced."""
    encoding = output_encoding()
    click.echo(text.rstrip("\n").encode(encoding, errors="replace").decode(encoding))


def status(doing: str) -> AbstractContextManager[Any]:
    """Show what is being done, on standard error and only if that is a terminal."""
    if not sys.stderr.isatty():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(f"{doing} ...")
