"""The command `guideload schema`: JSON schema of the files, for editors."""

from __future__ import annotations

import json
from typing import Literal

import click


@click.command()
@click.argument("kind", type=click.Choice(["machine", "study", "catalogue", "motion", "duty", "identify"]))
def schema(kind: Literal["machine", "study", "catalogue", "motion", "duty", "identify"]) -> None:
    """Print the JSON schema of a kind of file, for completion and checks in an editor."""
    from guideload.cli.file_schema import file_schema

    click.echo(json.dumps(file_schema(kind), indent=2, ensure_ascii=False))
    click.echo(f"Save it as {kind}.schema.json; editors use it for a file with this first row:", err=True)
    click.echo(f"#:schema {kind}.schema.json", err=True)
