"""The command `guideload compare`."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.errors import ValueRefused
from guideload.cli import options
from guideload.cli.exit_codes import InputError
from guideload.cli.inputs import is_motion_file, paths, read_machine, read_motion
from guideload.cli.reporting import Shown, draws_report
from guideload.cli.terminal import status

if TYPE_CHECKING:
    from guideload.machine.machine import Machine
    from guideload.motion.moves import Moves


@click.command()
@draws_report
@options.or_moves("files", "MACHINE.TOML... TRACE...", nargs=-1)
@click.option(
    "--product",
    "products",
    multiple=True,
    help='Packaged product with preload class for all carriages, e.g. "HGH25CA ZA"; repeatable: one run each.',
)
@options.trace_options
def compare(files: tuple[Path | Moves, ...], products: tuple[str, ...], **reading: Any) -> Shown:
    """Compare machines, motions or products side by side.

    A file that ends in .toml is a machine, or a motion if it has [[moves]]; all others are traces. Every machine runs
    under every motion.
    """
    from guideload.reports.compare import comparison_report
    from guideload.simulation.simulation import simulate

    machines = [file for file in paths(*files) if file.suffix.lower() == ".toml" and not is_motion_file(file)]
    traces = [file for file in files if file not in machines]
    runs = len(machines) * len(traces) * max(len(products), 1)
    if runs < 2:
        raise click.UsageError(
            "expected machine files (.toml) and traces or motion files, together at least two runs; --product, given "
            "twice, compares two products"
        )
    results = {}
    for machine_file in machines:
        with status(f"running {machine_file}"):
            for trace_file, (product, machine) in itertools.product(
                traces, _equipped(machine_file, products)
            ):
                title = _title(machine_file, trace_file, len(machines) > 1, len(traces) > 1)
                title = " ".join(filter(None, (title, product)))
                results[title] = simulate(machine, read_motion(trace_file, machine, **reading))
    if len(results) < runs:
        raise click.UsageError(
            "two files or products have the same name: rename one, so that the runs can be told apart"
        )
    report = comparison_report(results)
    return Shown(
        report, lambda plots: plots.comparison(results)[0], lambda pages: pages.comparison_page(results)
    )


def _equipped(machine_file: Path, products: tuple[str, ...]) -> list[tuple[str, Machine]]:
    """The machine with each product on its carriages; without products as it is."""
    from guideload.catalogue.packaged import product_and_class
    from guideload.sizing.size import with_product

    machine = read_machine(machine_file)
    try:
        return [(text, with_product(machine, *product_and_class(text))) for text in products] or [
            ("", machine)
        ]
    except ValueRefused as refused:
        raise InputError(f"--product: {refused}") from None


def _title(machine: Path, trace: Path | Moves, machines: bool, traces: bool) -> str:
    motion = trace.stem if isinstance(trace, Path) else "--move"
    return " ".join([machine.stem] * machines + [motion] * traces)
