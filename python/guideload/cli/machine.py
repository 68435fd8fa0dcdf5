"""The commands for a machine file: init, check, modes."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.atomic import atomic_write
from guideload.cli import options
from guideload.cli.exit_codes import InputError
from guideload.cli.inputs import EXAMPLES, read_machine, read_optional_motion
from guideload.cli.machine_kinds import KINDS
from guideload.cli.outputs import picture_draft, unwritable
from guideload.cli.terminal import output_encoding, print_text

if TYPE_CHECKING:
    from guideload.motion.moves import Moves


@click.command()
@click.argument("path", type=options.InputFile, required=False)
@click.option(
    "--study",
    "kind",
    flag_value="study",
    help="Write a study.toml, for a study of machine.toml with varied parameters.",
)
@click.option(
    "--catalogue", "kind", flag_value="catalogue", help="Write a catalogue.toml with example carriages."
)
@click.option("--moves", "kind", flag_value="moves", help="Write a moves.toml, a motion of planned moves.")
@click.option(
    "--kind",
    "machine_kind",
    type=click.Choice(("two-rails", *KINDS)),
    help="Kind of machine: a short file, or two-rails, which explains every key; by default two-rails.",
)
def init(path: Path | None, kind: str | None, machine_kind: str | None) -> None:
    """Write a commented machine.toml, study.toml, catalogue.toml or moves.toml to fill in.

    PATH is the name of the file, or a folder.
    """
    if kind is not None and machine_kind is not None:
        raise InputError(f"--kind is a kind of machine, and --{kind} writes another file: give one of them")
    name = f"{kind or 'machine'}.toml"
    path = path or Path(name)
    if path.is_dir():
        path /= name
    if machine_kind in KINDS:
        template = KINDS[machine_kind].text
    else:
        template = (EXAMPLES / name).read_text(encoding="utf-8")
    if kind == "study":  # the example names the packaged machine and trace
        template = template.replace('"manipulator.toml"', '"machine.toml"')
        template = template.replace('"manipulator.csv"', '"trace.csv"')
    try:
        with atomic_write(path, replace=False) as draft:
            draft.write_bytes(template.encode())
    except OSError as error:
        if error.errno != errno.EEXIST:
            raise unwritable(path, error) from None
        option = f" --{kind}" if kind else f" --kind {machine_kind}" if machine_kind else ""
        raise InputError(
            f"{path} exists and is not replaced; give another name: guideload init NAME.toml{option}"
        ) from None
    if kind == "catalogue":
        print_text(f"Wrote {path}. Add your carriages, then: guideload catalogue check {path}")
    elif kind == "moves":
        print_text(f"Wrote {path}. Fill it in, then: guideload run machine.toml {path} -o out/")
    elif kind == "study":
        inputs = "put machine.toml (from `guideload init`) and trace.csv, a measured motion, into its folder"
        print_text(f"Wrote {path}. Fill it in and {inputs}, then: guideload study {path} -o out/")
    else:
        print_text(f"Wrote {path}. Fill it in, then: guideload check {path}")


@click.command()
@options.machine_argument
@options.optional_trace_argument
@options.trace_options
def check(machine_file: Path, trace_file: Path | Moves | None, **reading: Any) -> None:
    """Check a machine, and optionally a trace, and show their contents.

    With a trace the report also shows which modes of the machine the trace can show.
    """
    from guideload.reports.machine import machine_report

    machine = read_machine(machine_file)
    motion = read_optional_motion(trace_file, machine, **reading)
    print_text(machine_report(machine, encoding=output_encoding()))
    if motion is not None:
        from guideload.motion.resolution import TraceResolution
        from guideload.reports.run import motion_report
        from guideload.reports.trace import resolution_report

        print_text(motion_report(motion, encoding=output_encoding()))
        resolution = TraceResolution.of_motion(machine, motion)
        print_text("\n" + resolution_report(resolution, encoding=output_encoding()))


@click.command()
@options.machine_argument
@options.picture_option
@options.overwrite_picture_option
def modes(machine_file: Path, output: Path | None, overwrite: bool) -> None:
    """Show natural frequencies, damping ratios and mode shapes."""
    from guideload.machine.modes import Modes
    from guideload.reports.machine import modes_report

    with picture_draft(output, overwrite, machine_file) as draft:
        machine = read_machine(machine_file)
        found = Modes.of(machine)
        if draft is not None:
            from guideload import plots

            plots.save(plots.modes(machine, found)[0], draft)
    print_text(modes_report(machine, found, encoding=output_encoding()))
    if output is not None:
        print_text(f"Wrote {output}.")
