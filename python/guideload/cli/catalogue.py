"""The commands for catalogues, packaged ones and files of a user: list, find, show, check."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.errors import ValueRefused
from guideload.base.number_text import counted
from guideload.cli import options
from guideload.cli.exit_codes import InputError
from guideload.cli.terminal import print_report, print_text

if TYPE_CHECKING:
    from guideload.catalogue.catalogue import Catalogue

file_argument = click.argument("file", metavar="[CATALOGUE.TOML]", type=options.InputFile, required=False)


@click.group()
def catalogue() -> None:
    """Find carriages in the packaged catalogues or in your own.

    `guideload init --catalogue` writes a catalogue file with examples.
    """


@catalogue.command("list")
@file_argument
def list_series(file: Path | None) -> None:
    """List makers and series, with their sizes and number of products."""
    from guideload.reports.catalogue import series_report

    print_report(series_report(_catalogue(file)))


@catalogue.command()
@click.option("--maker", help="Maker, e.g. THK.")
@click.option("--series", help="Series, e.g. HG.")
@click.option("--size", help="Size, e.g. 25.")
@click.option("--type", "kind", type=click.Choice(("ball", "roller")), help="Rolling elements.")
@click.option(
    "--least-C",
    "least",
    type=options.Quantity("N"),
    metavar="TEXT",
    help='Least dynamic load rating for 100 km of travel, e.g. "30 kN".',
)
@click.option(
    "--longest-body",
    "longest",
    type=options.Quantity("m"),
    metavar="TEXT",
    help='Longest steel body, e.g. "80 mm".',
)
@file_argument
def find(file: Path | None, **wanted: Any) -> None:
    """Find products, sorted by their dynamic load rating."""
    if file is not None and not file.exists() and not file.suffix:
        hint = f"`guideload catalogue show {file}` shows a product, and --series or --size find some"
        raise click.UsageError(f"{file}: expected a catalogue file; {hint}")
    from guideload.catalogue.catalogue import Catalogue
    from guideload.reports.catalogue import catalogue_report

    found = _catalogue(file).selected(**wanted)
    if not found:
        raise InputError(
            "no product is so: leave an option out; `guideload catalogue list` shows makers and series"
        )
    print_report(catalogue_report(Catalogue(products=found)))


@catalogue.command()
@click.argument("names", metavar="[CATALOGUE.TOML] [PRODUCT]", nargs=-1)
def show(names: tuple[str, ...]) -> None:
    """Show all values of a PRODUCT, or all products."""
    from guideload.catalogue.packaged import packaged_product
    from guideload.reports.catalogue import catalogue_report, product_report

    file = Path(names[0]) if names and names[0].lower().endswith(".toml") else None
    products = names if file is None else names[1:]
    if len(products) > 1:
        raise click.UsageError(
            f"expected one product, got {' '.join(products)}: put a name with spaces in quotes"
        )
    if not products:
        return print_report(catalogue_report(_catalogue(file)))
    try:
        found = packaged_product(*products) if file is None else _catalogue(file)[products[0]]
    except ValueRefused as refused:
        raise InputError(str(refused) if file is None else f"{file}: {refused}") from None
    print_report(product_report(found))


@catalogue.command()
@click.argument("catalogue_file", metavar="CATALOGUE.TOML", type=options.InputFile)
def check(catalogue_file: Path) -> None:
    """Check a catalogue file, and show what its records lack."""
    found = _catalogue(catalogue_file)
    lines = [f"{catalogue_file}: {counted(len(found.products), 'product')}, all valid.", *found.remarks()]
    print_text("\n".join(lines))


def _catalogue(file: Path | None) -> Catalogue:
    """The catalogue of a file, or all packaged products."""
    from guideload.catalogue.catalogue import Catalogue
    from guideload.catalogue.packaged import packaged_catalogue

    return packaged_catalogue() if file is None else Catalogue.from_toml(file)
