"""Exit codes of the command line.

0 success, 1 the computation failed, 2 the input was refused, 3 all numbers are written but a picture is missing,
4 a watched carriage passed its limit, 130 Ctrl-C, 143 and 129 SIGTERM and SIGHUP.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import click

from guideload.base.errors import PictureError

PICTURE_MISSING = 3
LIMIT_PASSED = 4
INTERRUPTED = 130


class InputError(click.ClickException):
    """The input was refused."""

    exit_code = 2


class CommandInterrupted(click.ClickException):
    """Ctrl-C ended the command."""

    exit_code = INTERRUPTED

    def __init__(self) -> None:
        super().__init__("interrupted; nothing is half written")


def picture_failure(draw: Callable[[], object]) -> PictureError | None:
    """Draw pictures; returns the error if some of them fail, so that the numbers are written nevertheless."""
    try:
        draw()
    except PictureError as error:
        return error
    return None


def exit_if(*failures: PictureError | None) -> None:
    """End the command with a warning and exit code 3 if pictures failed."""
    texts = [str(failure) for failure in failures if failure is not None]
    for text in texts:
        click.echo(f"Warning: {text}.", err=True)
    if texts:
        sys.exit(PICTURE_MISSING)
