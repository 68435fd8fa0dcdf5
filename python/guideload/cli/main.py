"""The command line `guideload`; its exit codes are in `exit_codes`.

A module that takes long to import is imported by the commands that need it, so that `--help` is immediate and
`run --no-pictures` does not import matplotlib.
"""

from __future__ import annotations

import atexit
import gc
import os
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
from guideload.cli.catalogue import catalogue
from guideload.cli.compare import compare
from guideload.cli.duty import duty
from guideload.cli.encoder import encoder
from guideload.cli.exit_codes import CommandInterrupted, InputError
from guideload.cli.identify import identify
from guideload.cli.life import life
from guideload.cli.long_run import long_run
from guideload.cli.machine import check, init, modes
from guideload.cli.method_comparison import chart, stability
from guideload.cli.monitor import monitor
from guideload.cli.probability import probability
from guideload.cli.response import response
from guideload.cli.run import demo, run
from guideload.cli.schema import schema
from guideload.cli.sensitivities import sensitivities
from guideload.cli.signals import ended_in_order
from guideload.cli.sizing import limit, size
from guideload.cli.study import study


class Commands(click.Group):
    """Turns errors of the library into messages and exit codes; lists the commands in the order of their use."""

    def invoke(self, ctx: click.Context) -> Any:
        # Set before numpy is imported: for small matrices more threads of OpenBLAS only cost time, 0.3 s.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        atexit.register(gc.freeze)  # saves the search for garbage in all modules at exit, 0.25 s
        try:
            return ended_in_order(super().invoke, ctx)
        except (ArgumentError, ConfigError, LifeError, SceneError, TraceError) as error:
            raise InputError(str(error)) from error
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


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="guideload")
def main() -> None:
    """Dynamic load of linear rolling guides, from a measured or planned motion to the load of every carriage.

    Start with `guideload demo`, or with `guideload init`, which writes a machine.toml to fill in.
    """


for command in (
    demo,
    init,
    check,
    modes,
    response,
    encoder,
    run,
    life,
    size,
    limit,
    sensitivities,
    compare,
    duty,
    long_run,
    study,
    identify,
    probability,
    monitor,
    chart,
    stability,
    catalogue,
    schema,
):
    main.add_command(command)
