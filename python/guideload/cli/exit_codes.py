"""Exit codes of the command line: 0 success, 1 the computation failed, 2 the input was refused, 130 Ctrl-C."""

from __future__ import annotations

import click

INTERRUPTED = 130


class InputError(click.ClickException):
    """The input was refused."""

    exit_code = 2


class CommandInterrupted(click.ClickException):
    """Ctrl-C ended the command."""

    exit_code = INTERRUPTED

    def __init__(self) -> None:
        super().__init__("interrupted; nothing was written")
