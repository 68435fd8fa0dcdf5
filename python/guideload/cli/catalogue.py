"""The commands for a catalogue file: check, show."""

from __future__ import annotations

from pathlib import Path

import click

from guideload.base.errors import ValueRefused
from guideload.base.number_text import counted
from guideload.cli import options
from guideload.cli.exit_codes import InputError
from guideload.cli.terminal import print_report, print_text

catalogue_argument = click.argument("catalogue_file", metavar="CATALOGUE.TOML", type=options.InputFile)


@click.group()
def catalogue() -> None:
    """Check and show catalogues of carriages; `guideload init --catalogue` writes one with examples."""


@catalogue.command()
@catalogue_argument
def check(catalogue_file: Path) -> None:
    """Check a catalogue file, and tell what its records lack."""
    from guideload.catalogue.catalogue import Catalogue

    found = Catalogue.from_toml(catalogue_file)
    lines = [f"{catalogue_file}: {counted(len(found.products), 'product')}, all valid.", *found.remarks()]
    print_text("\n".join(lines))


@catalogue.command()
@catalogue_argument
@click.argument("product", required=False)
def show(catalogue_file: Path, product: str | None) -> None:
    """Show the products of a catalogue, or all values of one PRODUCT."""
    from guideload.catalogue.catalogue import Catalogue
    from guideload.reports.catalogue import catalogue_report, product_report

    found = Catalogue.from_toml(catalogue_file)
    if product is None:
        print_report(catalogue_report(found))
        return
    try:
        print_report(product_report(found[product]))
    except ValueRefused as refused:
        raise InputError(f"{catalogue_file}: {refused}") from None
