"""The commands `guideload monitor ...`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.number_text import joined
from guideload.cli import options
from guideload.cli.inputs import paths, read_machine, read_motion
from guideload.cli.options import Quantity
from guideload.cli.outputs import file_draft, require_file
from guideload.cli.terminal import print_text, status
from guideload.cli.watch import watch

if TYPE_CHECKING:
    from guideload.monitor.design import Design
    from guideload.motion.moves import Moves

ENDINGS = (".rs", ".h", ".toml")  # Rust, C, a file for `monitor watch`


@click.group()
def monitor() -> None:
    """Build or run a load monitor of a controller or a PC.

    The monitor computes loads and the life used from encoder counts.
    """


monitor.add_command(watch)


@monitor.command()
@options.machine_argument
@options.trace_argument
@click.option("--period", type=Quantity("s"), required=True, help='Time between two samples, e.g. "1 ms".')
@click.option(
    "--travel-per-count",
    type=Quantity("m"),
    required=True,
    help='Travel of the cart per count, e.g. "20 um".',
)
@click.option("--lag", type=int, default=20, show_default=True, help="Output delay in samples.")
@click.option("--encoder-bits", type=int, default=32, show_default=True, help="Bits of the counter.")
@click.option("--ticks", type=int, default=1, show_default=True, help="Clock ticks per sample period.")
@click.option(
    "--max-acceleration",
    type=Quantity("m/s^2"),
    help="Largest acceleration the axis can have; by default 5 times that of TRACE.",
)
@click.option(
    "--most-missing",
    type=int,
    default=8,
    show_default=True,
    help="Most consecutive samples that may be lost.",
)
@click.option(
    "--load-limit", type=Quantity("N"), help="Limit of the equivalent load; exceedances are counted."
)
@click.option(
    "--bin",
    "width",
    type=Quantity("N"),
    default="500 N",
    show_default=True,
    help="Width of a bin of the histogram.",
)
@click.option(
    "-o",
    "--output",
    "outputs",
    type=options.FilePath,
    required=True,
    multiple=True,
    help="File to write: .rs (Rust), .h (C) or .toml (for `guideload monitor watch`); repeatable.",
)
@options.overwrite_picture_option
@options.trace_options
def build(
    machine_file: Path,
    trace_file: Path | Moves,
    period: float,
    travel_per_count: float,
    max_acceleration: float | None,
    load_limit: float | None,
    width: float,
    encoder_bits: int,
    outputs: tuple[Path, ...],
    overwrite: bool,
    **given: Any,
) -> None:
    """Write a monitor for a machine: its constants, as source text for a controller, or a file for `watch`.

    TRACE is a typical motion. The smoother of the monitor is chosen for it; its error is part of the output.
    """
    import numpy as np

    from guideload.monitor.design import designed
    from guideload.monitor.settings import MonitorSettings

    for output in outputs:
        require_file(output, ENDINGS, overwrite, *paths(machine_file, trace_file))
    whole = {name: given.pop(name) for name in ("lag", "ticks", "most_missing")}
    with status("reading"):
        machine = read_machine(machine_file)
        motion = read_motion(trace_file, machine, **given)
    largest = float(np.abs(motion.acceleration[:, 0]).max())
    settings = MonitorSettings(
        period=period,
        travel_per_count=travel_per_count,
        max_acceleration=5.0 * largest if max_acceleration is None else max_acceleration,
        load_limit=load_limit,
        bin=width,
        encoder_bits=encoder_bits,
        **whole,
    )
    with status("choosing the smoother"):
        design = designed(machine, motion, settings)
    for output in outputs:
        _write(design, output, machine_file, overwrite)
    lag, constant = (1e3 * samples * settings.period for samples in (settings.lag, design.time_constant))
    print_text(
        f"Wrote {joined(map(str, outputs))}. On the given motion the peak loads are within "
        f"{100.0 * design.peak_error:.1f} % and the loads within {design.load_error:.0f} N rms: smoother of order "
        f"{design.order}, time constant {constant:.3g} ms, lag {lag:.3g} ms."
    )


def _write(design: Design, output: Path, machine_file: Path, overwrite: bool) -> None:
    """Write one file of a monitor."""
    from guideload.monitor.description import monitor_text
    from guideload.monitor.source import c_source, rust_source

    ending = output.suffix.lower()
    if ending == ".toml":
        smoother = (design.order, design.time_constant)
        text = monitor_text(design.settings, *smoother, machine_file, output.parent, design.title)
    else:
        text = rust_source(design) if ending == ".rs" else c_source(design)
    with file_draft(output, overwrite) as draft:
        draft.write_text(text, encoding="utf-8")
