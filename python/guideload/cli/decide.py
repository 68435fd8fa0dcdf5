"""The commands by which one decides: size, limit, compare and sensitivities."""

from __future__ import annotations

import itertools
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.errors import ValueRefused
from guideload.cli import options
from guideload.cli.exit_codes import InputError
from guideload.cli.inputs import (
    is_motion_file,
    paths,
    read_machine,
    read_motion,
    read_moves,
    read_riders,
    requirements,
)
from guideload.cli.reporting import Shown, draws_report, shows_report
from guideload.cli.terminal import status

if TYPE_CHECKING:
    from guideload.machine.machine import Machine
    from guideload.motion.moves import Moves
    from guideload.reports.report import Report
    from guideload.simulation.start import Start

MOST_ROWS = 40  # of candidates of `size` in the terminal
FIGURES = ("peak_resultant", "mean_load", "life")  # of `sensitivities`


@click.command()
@shows_report
@options.machine_argument
@options.trace_argument
@click.option(
    "--from",
    "catalogue_file",
    type=options.InputFile,
    help="Catalogue file.  [default: the packaged catalogues]",
)
@click.option(
    "--product",
    "products",
    multiple=True,
    help='Products to try: a name, or words of maker and name such as "HIWIN 25"; repeatable.',
)
@options.requirement_options
@options.rider_option
@options.trace_options
@options.report_option
def size(
    machine_file: Path,
    trace_file: Path | Moves,
    catalogue_file: Path | None,
    products: tuple[str, ...],
    riders: tuple[str, ...],
    report: Path | None,
    **reading: Any,
) -> Shown:
    """Find the smallest product of a catalogue that holds.

    The product must reach the required life and static safety under a motion, within the limits of product and drive.
    """
    from guideload.catalogue.catalogue import Catalogue
    from guideload.catalogue.packaged import only_maker, packaged_catalogue
    from guideload.reports.sizing import sizing_report
    from guideload.sizing.size import LARGER
    from guideload.sizing.size import size as find

    with status("reading"):
        machine = read_machine(machine_file)
        conditions = requirements(machine, reading)
        motion = read_motion(trace_file, machine, **reading)
        moved = read_riders(machine, machine_file, riders)
        if catalogue_file is None:
            catalogue = packaged_catalogue(only_maker(products))
        else:
            catalogue = Catalogue.from_toml(catalogue_file)
    with status("running the candidates"):
        found = find(
            machine,
            motion,
            catalogue,
            products=products or None,
            conditions=conditions,
            riders=moved,
            larger=None if report else LARGER,
        )
    shown = sizing_report(machine, found, MOST_ROWS)
    return Shown(shown, page=lambda pages: pages.sizing_page(machine, found))


@click.command()
@shows_report
@options.machine_argument
@options.trace_argument
@click.option(
    "--of",
    "quantity",
    type=click.Choice(["pace", "payload", "overhang", "speed", "acceleration", "deceleration", "jerk"]),
    default="pace",
    show_default=True,
    help="What grows until a requirement fails: pace of the motion, payload [kg], shift of the centre of mass [m], or "
    "a limit of planned moves.",
)
@click.option(
    "--at",
    type=options.Vector("m"),
    help='Payload\'s place from L, e.g. "0 mm,300 mm,0 mm".  [default: 0,0,0]',
)
@click.option("--direction", type=options.Vector("1"), help="Direction of the overhang.  [default: 1,0,0]")
@options.requirement_options
@options.trace_options
def limit(
    machine_file: Path,
    trace_file: Path | Moves,
    quantity: Any,
    at: tuple[float, float, float] | None,
    direction: tuple[float, float, float] | None,
    **reading: Any,
) -> Report:
    """Find how fast, how heavy or how far out a machine may work.

    The limit is where a requirement fails. The requirements are life, static safety, and the limits of products and
    drive.
    """
    from guideload.reports.sizing import limit_report
    from guideload.sizing.limits import largest

    places: dict[str, Any] = {"at": at, "direction": direction}
    places = {name: value for name, value in places.items() if value is not None}
    for name, of in (("at", "payload"), ("direction", "overhang")):
        if name in places and quantity != of:
            raise click.UsageError(f"--{name} needs --of {of}, got --of {quantity}")
    with_forces = any(reading[name] is not None for name in reading if name.startswith("forces"))
    if with_forces and quantity in ("speed", "acceleration", "deceleration", "jerk"):
        raise click.UsageError(
            f"--of {quantity} plans the moves anew at every try, but forces have fixed time stamps: leave --forces "
            "out, or use --of pace"
        )
    with status("reading"):
        machine = read_machine(machine_file)
        conditions = requirements(machine, reading)
        reading_only = {name: value for name, value in reading.items() if not name.startswith("forces")}
        moves = None if with_forces else read_moves(trace_file, **reading_only)
        motion = moves or read_motion(trace_file, machine, **reading)
    with status("searching the limit"):
        found = largest(machine, motion, quantity, conditions=conditions, **places)
    return limit_report(machine, found, conditions)


@click.command()
@draws_report
@options.motion_argument("files", "MACHINE.TOML... TRACE...", nargs=-1)
@click.option(
    "--product",
    "products",
    multiple=True,
    help='Packaged product with preload class for all carriages, e.g. "HGH25CA ZA"; repeatable: one run each.',
)
@options.rider_option
@options.trace_options
def compare(
    files: tuple[Path | Moves, ...], products: tuple[str, ...], riders: tuple[str, ...], **reading: Any
) -> Shown:
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

    def title(machine_file: Path, trace_file: Path | Moves, product: str) -> str:
        motion = trace_file.stem if isinstance(trace_file, Path) else "--move"
        names = [machine_file.stem] * (len(machines) > 1) + [motion] * (len(traces) > 1)
        return " ".join(filter(None, (*names, product)))

    titles = Counter(itertools.starmap(title, itertools.product(machines, traces, products or ("",))))
    [(name, count)] = titles.most_common(1)
    if count > 1:
        raise click.UsageError(
            f'{count} runs have the name "{name}": rename a file, or leave out a product that is given twice'
        )
    results = {}
    for machine_file in machines:
        with status(f"running {machine_file}"):
            equipped = _equipped(machine_file, products)
            moved = read_riders(equipped[0][1], machine_file, riders)
            for trace_file, (product, machine) in itertools.product(traces, equipped):
                motion = read_motion(trace_file, machine, **reading)
                results[title(machine_file, trace_file, product)] = simulate(machine, motion, riders=moved)
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
        equipped = [(text, with_product(machine, *product_and_class(text))) for text in products]
        return equipped or [("", machine)]
    except ValueRefused as refused:
        raise InputError(f"--product: {refused}") from None


@click.command()
@draws_report
@options.machine_argument
@options.trace_argument
@click.option(
    "--of",
    "figure",
    type=click.Choice(FIGURES),
    default=FIGURES[0],
    show_default=True,
    help="Result to differentiate.",
)
@click.option("--carriage", help="Carriage; by default the most loaded one.")
@click.option(
    "--to",
    multiple=True,
    metavar="PARAMETER",
    help='Parameters to vary, such as "carriages.*.stiffness_y"; repeatable.',
)
@options.start_option
@options.trace_options
def sensitivities(
    machine_file: Path,
    trace_file: Path | Moves,
    figure: str,
    carriage: str | None,
    to: tuple[str, ...],
    start: Start,
    **given: Any,
) -> Shown:
    """Show which numbers of a machine drive a load or a life.

    The influence of each number follows from exact derivatives of one run. The picture is a tornado diagram. A
    derivative shows what a small change does: for the scatter of values, run a study.
    """
    from guideload.reports.sensitivities import sensitivities_report
    from guideload.sensitivity.influence import rank_influences

    with status("reading"):
        machine = read_machine(machine_file)
        motion = read_motion(trace_file, machine, **given)
    with status("computing derivatives"):
        found = rank_influences(machine, motion, figure, to, carriage, start)
    report = sensitivities_report(machine, motion, found)
    return Shown(report, lambda plots: plots.influence(machine, found))
