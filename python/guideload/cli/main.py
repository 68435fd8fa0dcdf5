"""The command line `guideload`; its exit codes are in `exit_codes`.

A module that takes long to import is imported by the commands that need it, so that `--help` is immediate and
`run --no-pictures` does not import matplotlib.
"""

from __future__ import annotations

import atexit
import gc
import os
import re
from pathlib import Path
from typing import Any

import click

from guideload.base.errors import (
    ArgumentError,
    ConfigError,
    GuideloadError,
    LifeError,
    SceneError,
    TraceError,
)
from guideload.base.visible_text import visible
from guideload.cli.app import app
from guideload.cli.catalogue import catalogue
from guideload.cli.decide import compare, limit, sensitivities, size
from guideload.cli.encoder import encoder
from guideload.cli.exit_codes import CommandInterrupted, InputError
from guideload.cli.identify import identify
from guideload.cli.life import duty, life
from guideload.cli.long_run import long_run
from guideload.cli.machine import check, init, modes, schema
from guideload.cli.method_comparison import chart, stability
from guideload.cli.monitor import monitor
from guideload.cli.next_steps import next_steps
from guideload.cli.response import response
from guideload.cli.run import demo, run
from guideload.cli.signals import ended_in_order
from guideload.cli.study import probability, study
from guideload.cli.terminal import print_text

# In messages of the library, how Python gives an argument before the option that does: "rate=1000 (--rate 1000)".
PYTHON = re.compile(r"\b[a-z_]+=[^;:]*? \((--[^()]+)\)")


class Commands(click.Group):
    """Turns errors of the library into messages and exit codes; lists the commands in the order of their use."""

    def invoke(self, ctx: click.Context) -> Any:
        # Set before numpy is imported: for small matrices more threads of OpenBLAS only cost time, 0.3 s.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        atexit.register(gc.freeze)  # saves the search for garbage in all modules at exit, 0.25 s
        try:
            return ended_in_order(super().invoke, ctx)
        except (ArgumentError, ConfigError, LifeError, SceneError, TraceError) as error:
            raise InputError(PYTHON.sub(r"\1", str(error))) from error
        except click.ClickException as error:
            # click declares the message final, and shows it as it is
            object.__setattr__(error, "message", visible(error.message))
            raise
        except KeyboardInterrupt:
            raise CommandInterrupted from None
        except MemoryError as error:
            raise click.ClickException(f"not enough memory: {error}".removesuffix(": ")) from error
        except BrokenPipeError:  # the reader, such as `head`, closed the pipe: click exits without a message
            raise
        except (GuideloadError, OSError) as error:
            raise click.ClickException(visible(str(error))) from error

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The commands in groups, each with the first sentence of its help."""
        for title, commands in GROUPS.items():
            with formatter.section(title):
                rows = [(str(one.name), one.get_short_help_str(LONGEST)) for one in commands]
                formatter.write_dl([(name.ljust(len("sensitivities")), text) for name, text in rows])


@click.group(
    cls=Commands, context_settings={"help_option_names": ["-h", "--help"]}, invoke_without_command=True
)
@click.version_option(package_name="guideload")
@click.pass_context
def main(ctx: click.Context) -> None:
    """Dynamic load of linear rolling guides, from a measured or planned motion to the load of every carriage.

    `guideload` alone says what to do next in this folder. Begin with `guideload demo`, or with `guideload init`, which
    writes a machine.toml to fill in.
    """
    if ctx.invoked_subcommand is None:
        print_text("\n".join(next_steps(Path())))


LONGEST = 61  # characters of a one-line text, so that its line ends before column 80
GROUPS: dict[str, tuple[click.Command, ...]] = {
    "Describe a machine": (demo, init, check, app, modes, catalogue, schema),
    "Compute loads and life": (run, life, duty, long_run, study, probability, response),
    "Decide": (size, limit, compare, sensitivities),
    "Measure": (encoder, identify, monitor),
    "Methods": (chart, stability),
}
for command in (command for commands in GROUPS.values() for command in commands):
    main.add_command(command)
