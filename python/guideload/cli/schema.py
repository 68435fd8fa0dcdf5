"""The command `guideload schema`: JSON schema of the files, for editors."""

from __future__ import annotations

from typing import get_args

import click

from guideload.cli.options import FileKind


@click.command()
@click.argument("kind", type=click.Choice(get_args(FileKind)))
def schema(kind: FileKind) -> None:
    """Print the JSON schema of a kind of file, for editors.

    They complete keys and check values by it.
    """
    from guideload.base.finite import finite_json
    from guideload.cli.file_schema import file_schema

    click.echo(finite_json(file_schema(kind), indent=2, ascii_only=False))
    click.echo(f"Save it as {kind}.schema.json; editors use it for a file with this first row:", err=True)
    click.echo(f"#:schema {kind}.schema.json", err=True)
