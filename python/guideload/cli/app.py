"""The command `guideload app`."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import click

from guideload.cli import options
from guideload.cli.exit_codes import InputError

NEEDED = ("nicegui", "tomlkit")  # the extra guideload[app]


@click.command()
@click.argument("machine_file", metavar="[MACHINE.TOML]", type=options.InputFile, required=False)
@click.argument("motion_file", metavar="[TRACE]", type=options.InputFile, required=False)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=0, help="Port of the page.  [default: a free one]"
)
@click.option("--no-browser", is_flag=True, help="Print the link only, and open no browser.")
def app(machine_file: Path | None, motion_file: Path | None, port: int, no_browser: bool) -> None:
    """Show the machine on a page, with loads and life at once.

    The page is served to this computer's browser only, and reads and writes files below the current folder. It opens
    MACHINE.TOML, by default machine.toml, and TRACE, a measured motion or a motion file, by default moves.toml; Save
    writes them.
    """
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        raise InputError(f'{missing[0]} is not installed; the page needs: pip install "guideload[app]"')
    from guideload.app.serve import serve

    serve(Path(), machine_file or Path("machine.toml"), motion_file, port, browser=not no_browser)
