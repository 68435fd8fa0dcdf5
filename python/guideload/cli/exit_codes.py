"""Exit codes of the command line: 0 success, 1 the computation failed, 2 the input was refused."""

from __future__ import annotations

import click


class InputError(click.ClickException):
    """The input was refused."""

    exit_code = 2
