"""The commands `guideload monitor ...`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.errors import ArgumentError, ValueRefused
from guideload.base.number_text import joined
from guideload.cli import options
from guideload.cli.exit_codes import InputError
from guideload.cli.inputs import paths, read_machine, read_motion
from guideload.cli.outputs import require_unread, unwritable
from guideload.cli.terminal import print_text, status
from guideload.cli.watch import watch

if TYPE_CHECKING:
    from guideload.monitor.design import Design
    from guideload.motion.moves import Moves

# Endings of the files that are written, and what they are.
ENDINGS = {".rs": "Rust", ".h": "C", ".toml": "monitor file"}


@click.group()
def monitor() -> None:
    """Build or run a load monitor of a controller or a PC.

    It computes loads and life used from encoder counts.
    """


monitor.add_command(watch)


@monitor.command()
@options.machine_argument
@options.trace_argument
@click.option("--period", required=True, help='Time between two samples, e.g. "1 ms".')
@click.option("--travel-per-count", required=True, help='Travel of the cart per count, e.g. "20 um".')
@click.option("--lag", type=int, default=20, show_default=True, help="Output delay in samples.")
@click.option("--encoder-bits", type=int, default=32, show_default=True, help="Width of the counter.")
@click.option("--ticks", type=int, default=1, show_default=True, help="Clock ticks per sample period.")
@click.option("--max-acceleration", help="What the axis cannot exceed; by default 5 times that of TRACE.")
@click.option(
    "--most-missing", type=int, default=8, show_default=True, help="Longest accepted run of lost samples."
)
@click.option("--load-limit", help="Limit of the equivalent load; exceedances are counted.")
@click.option("--bin", "width", default="500 N", show_default=True, help="Width of a bin of the histogram.")
@click.option(
    "-o",
    "--output",
    "outputs",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    multiple=True,
    help="File to write: .rs (Rust), .h (C) or .toml (for `guideload monitor watch`); repeatable.",
)
@options.overwrite_picture_option
@options.trace_options
def build(
    machine_file: Path,
    trace_file: Path | Moves,
    period: str,
    travel_per_count: str,
    max_acceleration: str | None,
    load_limit: str | None,
    width: str,
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

    _require_writable(outputs, overwrite, paths(machine_file, trace_file))
    whole = {name: given.pop(name) for name in ("lag", "ticks", "most_missing")}
    with status("reading"):
        machine = read_machine(machine_file)
        motion = read_motion(trace_file, machine, **given)
    largest = float(np.abs(motion.acceleration[:, 0]).max())
    settings = MonitorSettings(
        period=_si("period", period, "s"),
        quantum=_si("travel-per-count", travel_per_count, "m"),
        max_acceleration=_si("max-acceleration", max_acceleration, "m/s^2", 5.0 * largest),
        limit=_si("load-limit", load_limit, "N", float("inf")),
        bin=_si("bin", width, "N"),
        counter_bits=encoder_bits,
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


def _require_writable(outputs: tuple[Path, ...], overwrite: bool, inputs: tuple[Path, ...]) -> None:
    """Raise InputError unless all files have a known ending and may be written: before the computation."""
    for output in outputs:
        if output.suffix not in ENDINGS:
            raise InputError(f"{output}: expected a file that ends in {', '.join(ENDINGS)}")
        if output.exists() and not overwrite:
            raise InputError(f"{output} exists; give another name, or --overwrite")
    require_unread(outputs, inputs)


def _write(design: Design, output: Path, machine_file: Path, overwrite: bool) -> None:
    """Write one file of a monitor."""
    from guideload.base.atomic import atomic_write
    from guideload.monitor.description import monitor_text
    from guideload.monitor.source import c_source, rust_source

    if output.suffix == ".toml":
        smoother = (design.order, design.time_constant)
        text = monitor_text(design.settings, *smoother, machine_file, output.parent, design.title)
    else:
        text = rust_source(design) if output.suffix == ".rs" else c_source(design)
    try:
        with atomic_write(output, replace=overwrite) as draft:
            draft.write_text(text, encoding="utf-8")
    except OSError as error:
        raise unwritable(output, error) from None


def _si(name: str, text: str | None, unit: str, default: float | None = None) -> float:
    """The SI number of an option."""
    from guideload.base.units import quantity

    if text is None:
        assert default is not None
        return default
    try:
        value: float | str = float(text)
    except ValueError:
        value = text
    try:
        return quantity(value, unit)
    except ValueRefused as error:
        raise ArgumentError(f"--{name}: {error}") from None
