"""The commands `guideload monitor ...`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.errors import ArgumentError, ValueRefused
from guideload.cli import options
from guideload.cli.exit_codes import InputError
from guideload.cli.inputs import paths, read_machine, read_motion
from guideload.cli.outputs import unwritable
from guideload.cli.terminal import print_text, status

if TYPE_CHECKING:
    from guideload.motion.moves import Moves

# Endings of the files that are written, and their languages.
ENDINGS = {".rs": "Rust", ".h": "C"}


@click.group()
def monitor() -> None:
    """The load monitor of a controller: loads and life used, from encoder counts."""


@monitor.command()
@options.machine_argument
@options.trace_argument
@click.option("--period", required=True, help='Time between two samples, e.g. "1 ms".')
@click.option("--travel-per-count", required=True, help='Travel of the cart per count, e.g. "20 um".')
@click.option(
    "--lag", type=int, default=20, show_default=True, help="Samples after the instant of the loads."
)
@click.option("--encoder-bits", type=int, default=32, show_default=True, help="Width of the counter.")
@click.option("--ticks", type=int, default=1, show_default=True, help="Time stamps per period; 1: numbers.")
@click.option("--max-acceleration", help="What the axis cannot exceed; by default 5 times that of TRACE.")
@click.option("--most-missing", type=int, default=8, show_default=True, help="Samples missing in a row.")
@click.option("--load-limit", help="Limit of the equivalent load, whose passing is counted.")
@click.option("--bin", "width", default="500 N", show_default=True, help="Width of a bin of the histogram.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="File to write: .rs (Rust) or .h (C).",
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
    output: Path,
    overwrite: bool,
    **given: Any,
) -> None:
    """Write the constants of a monitor for a machine, as source text for a controller.

    TRACE is a typical motion. The smoother of the monitor is chosen for it; its error is part of the output.
    """
    import numpy as np

    from guideload.base.atomic import atomic_write
    from guideload.monitor.design import designed
    from guideload.monitor.settings import MonitorSettings
    from guideload.monitor.source import c_source, rust_source

    if output.suffix not in ENDINGS:
        raise InputError(f"{output}: expected a file that ends in {' or '.join(ENDINGS)}")
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
    text = rust_source(design) if output.suffix == ".rs" else c_source(design)
    if output.resolve() in [path.resolve() for path in paths(machine_file, trace_file)]:
        raise InputError(f"{output} is an input")
    try:
        with atomic_write(output, replace=overwrite) as draft:
            draft.write_text(text, encoding="utf-8")
    except OSError as error:
        raise unwritable(output, error) from None
    print_text(
        f"Wrote {output}. On the given motion the peak loads are within {100.0 * design.peak_error:.1f} % and the "
        f"loads within {design.load_error:.0f} N rms: smoother of order {design.order}, time constant "
        f"{1e3 * design.time_constant * settings.period:.3g} ms, lag {1e3 * settings.lag * settings.period:.3g} ms."
    )


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
