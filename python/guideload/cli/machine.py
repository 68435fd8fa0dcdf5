"""The commands for a machine file: init, check, modes; and schema, for every kind of file."""

from __future__ import annotations

import errno
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from guideload.base.atomic import atomic_write
from guideload.base.number_text import joined
from guideload.cli import options
from guideload.cli.exit_codes import InputError
from guideload.cli.inputs import MACHINE_KINDS, read_machine, read_optional_motion
from guideload.cli.outputs import unwritable
from guideload.cli.reporting import Shown, draws_report
from guideload.cli.terminal import print_text

if TYPE_CHECKING:
    from guideload.motion.moves import Moves

# What `init` says of a file that it has written, by its kind.
THEN = {
    "machine": "Fill it in, then: guideload check {path}",
    "catalogue": "Add your carriages, then: guideload catalogue check {path}",
    "moves": "Fill it in, then: guideload run machine.toml {path} -o out/",
    "study": "Fill it in and put machine.toml (from `guideload init`) and trace.csv, or moves.toml, into its folder, "
    "then: guideload study {path} -o out/",
}


@click.command()
@click.argument("path", type=options.InputFile, required=False)
@click.option("-o", "--output", type=options.InputFile, help="The same as PATH.")
@click.option(
    "--study", is_flag=True, help="Write a study.toml, for a study of machine.toml with varied parameters."
)
@click.option("--catalogue", is_flag=True, help="Write a catalogue.toml with example carriages.")
@click.option("--moves", is_flag=True, help="Write a moves.toml, a motion of planned moves.")
@click.option(
    "--kind",
    "machine_kind",
    type=click.Choice(("two-rails", *MACHINE_KINDS)),
    help="Kind of machine. two-rails, the default, explains every key; the other files are short.",
)
def init(path: Path | None, output: Path | None, machine_kind: str | None, **files: bool) -> None:
    """Write a commented machine, study, catalogue or moves file.

    PATH is the name of the file, or a folder.
    """
    from guideload.cli.templates import file_template  # loads numpy, which the help does not need

    kind = next((name for name, wanted in files.items() if wanted), None)
    given = [f"--{name}" for name, wanted in files.items() if wanted]
    given += [f"--kind {machine_kind}"] if machine_kind else []
    if len(given) > 1:
        commands = joined(f"`guideload init {one}`" for one in given)
        raise InputError(f"{joined(given)} write different files: run {commands}")
    name = f"{kind or 'machine'}.toml"
    if path and output:
        raise click.UsageError("expected PATH or -o, got both")
    path = path or output or Path(name)
    if path.is_dir():
        path /= name
    template = file_template(kind or machine_kind or "two-rails")
    if kind == "study":  # the example names the packaged machine and trace
        template = template.replace('"manipulator.toml"', '"machine.toml"')
        template = template.replace('"manipulator.csv"', '"trace.csv"      ')
    template = template.replace(f" {name}", f" {path.name}", 1)  # in the command of its head
    try:
        with atomic_write(path, replace=False) as draft:
            draft.write_bytes(template.encode())
    except OSError as error:
        if error.errno != errno.EEXIST:
            raise unwritable(path, error) from None
        command = " ".join(["guideload init NAME.toml", *given])
        raise InputError(f"{path} exists and is not replaced; give another name: {command}") from None
    print_text(f"Wrote {path}. {THEN[kind or 'machine'].format(path=path)}")


@click.command()
@draws_report
@options.machine_argument
@options.optional_trace_argument
@options.trace_options
def check(machine_file: Path, trace_file: Path | Moves | None, **reading: Any) -> Shown:
    """Check a machine and a motion, and show what they contain.

    With a motion the report also shows its moves, and which modes of the machine a trace can show. The picture shows
    the machine in 3D; up is against gravity.
    """
    from guideload.reports.machine import machine_report

    machine = read_machine(machine_file)
    motion = read_optional_motion(trace_file, machine, **reading)
    report = machine_report(machine, motion)
    if motion is None:
        return Shown(report, lambda plots: plots.scene(machine))
    from guideload.motion.resolution import TraceResolution
    from guideload.reports.report import Section
    from guideload.reports.run import motion_lines
    from guideload.reports.trace import resolution_section

    resolution = resolution_section(TraceResolution.of_motion(machine, motion))
    sections = [*report.sections, Section("Motion", motion_lines(motion)), resolution]
    report = replace(report, sections=sections)
    return Shown(report, lambda plots: plots.scene(machine))


@click.command()
@draws_report
@options.machine_argument
def modes(machine_file: Path) -> Shown:
    """Show natural frequencies, damping ratios and mode shapes."""
    from guideload.machine.modes import Modes
    from guideload.reports.machine import modes_report

    machine = read_machine(machine_file)
    found = Modes.of(machine)
    return Shown(modes_report(machine, found), lambda plots: plots.modes(machine, found)[0])


@click.command()
@click.argument("kind", type=click.Choice(get_args(options.FileKind)))
def schema(kind: options.FileKind) -> None:
    """Print the JSON schema of a kind of file, for editors.

    Editors complete keys and check values by the schema.
    """
    from guideload.base.finite import finite_json
    from guideload.cli.file_schema import file_schema

    click.echo(finite_json(file_schema(kind), indent=2, ascii_only=False))
    click.echo(f"Save it as {kind}.schema.json; editors use it for a file with this first row:", err=True)
    click.echo(f"#:schema {kind}.schema.json", err=True)
