"""The command `guideload study`: the loads of many machines that differ as real ones do."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from guideload.cli.errors import InputError
from guideload.cli.options import InputFile, folder_option, no_pictures_option
from guideload.cli.outputs import (
    STUDY,
    atomic_output,
    require_free,
    require_unread,
    unwritable,
    write_manifest,
)
from guideload.cli.terminal import output_encoding, print_text, status

if TYPE_CHECKING:
    from guideload.study.execution import Progress
    from guideload.study.result import StudyResult
    from guideload.study.study import Study

INTERRUPTED = 130  # the exit code of a program that Ctrl-C ended


@click.command()
@click.argument("study_file", metavar="STUDY.TOML", type=InputFile)
@folder_option(required=True)
@click.option("--resume", is_flag=True, help="Go on with the study in the folder, if one was begun there.")
@click.option("--overwrite", is_flag=True, help="Replace the study in the folder.")
@click.option("--samples", type=click.IntRange(min=1), help="How many are drawn, instead of the file's.")
@click.option("--seed", type=click.IntRange(min=0), help="Seed of all draws, instead of the file's.")
@click.option(
    "--threads", type=click.IntRange(min=1), help="Threads to run on; as many as there are cores if left out."
)
@no_pictures_option
def study(
    study_file: Path,
    output: Path,
    resume: bool,
    overwrite: bool,
    samples: int | None,
    seed: int | None,
    threads: int | None,
    no_pictures: bool,
) -> None:
    """Run a study: the distribution of the loads where the parameters of a machine scatter.

    Samples are written as they are done. Ctrl-C leaves a result of those, and --resume goes on, also after a
    crash: nothing that was written is lost, and the end is the same to the last bit.
    """
    from guideload.study.execution import StudyInterrupted, run_study

    if resume and overwrite:
        raise click.UsageError("--resume keeps what is in the folder and --overwrite replaces it: give one")
    again = _command(study_file, output, samples, seed, threads, no_pictures)
    may_go_on = resume
    try:
        with status("reading"):
            described = _read(study_file, output if resume else None, samples, seed)
        _require_folder(output, resume, overwrite, described.inputs)
        may_go_on = True
        try:
            with _bar() as progress:
                result = run_study(described, output, threads=threads, resume=resume, progress=progress)
            left = ""
        except StudyInterrupted as interrupted:
            result = interrupted.result
            left = f"Interrupted: {result.finished} of {result.runs} runs are done. To go on: {again}"
        for path, reason in result.parts.damaged.items():
            click.echo(f"{path} was damaged ({reason}): its samples were run again.", err=True)
        if result.finished:
            _write(result, output, not no_pictures)
            from guideload.reports.study import study_report

            print_text(study_report(result, encoding=output_encoding()))
            print_text(f"Wrote {output}.")
    except KeyboardInterrupt:  # before the first sample, or once more while the report was made
        left = f"Interrupted. To go on: {again}" if may_go_on else "Interrupted."
    if left:
        click.echo(left, err=True)
        sys.exit(INTERRUPTED)


def _command(
    study_file: Path,
    output: Path,
    samples: int | None,
    seed: int | None,
    threads: int | None,
    no_pictures: bool,
) -> str:
    """The command that goes on with a study."""
    given = {"--samples": samples, "--seed": seed, "--threads": threads}
    options = [text for name, value in given.items() if value is not None for text in (name, str(value))]
    pictures = ["--no-pictures"] if no_pictures else []
    return shlex.join(
        ["guideload", "study", str(study_file), "-o", str(output), *options, *pictures, "--resume"]
    )


def _read(study_file: Path, resumed: Path | None, samples: int | None, seed: int | None) -> Study:
    """The study of a file, with what the command line gives; where nothing tells the seed, that of the folder."""
    from guideload.study import manifest
    from guideload.study.study import Study, read_study

    if seed is None and resumed is not None and "seed" not in read_study(study_file)[0]:
        there = manifest.read(resumed)
        seed = None if there is None else there["studied"]["seed"]
    return Study.from_toml(study_file, samples=samples, seed=seed)


def _require_folder(output: Path, resume: bool, overwrite: bool, inputs: tuple[Path, ...]) -> None:
    """Before anything runs: the folder is new or empty, or holds a study that may go on, or be replaced.

    One that is to be replaced is removed here, unless that would take a file of `inputs`.
    """
    from guideload.study import manifest
    from guideload.study.folder import begun_only, files_of, remove

    if manifest.read(output) is None:
        if not (resume and begun_only(output)):
            require_free(output, {"": {*STUDY}}, overwrite, inputs)
    elif resume or overwrite:
        require_free(output, {"": {*STUDY}}, True, inputs)
        require_unread(files_of(output), inputs)
    else:
        raise InputError(
            f"{output} holds a study: --resume goes on with it, --overwrite replaces it; or give another folder"
        )
    if overwrite:
        remove(output)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(output, error) from None


@contextmanager
def _bar() -> Iterator[Progress | None]:
    """A bar with rate and time left, on a terminal only and apart from the output."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        ProgressColumn,
        Task,
        TimeRemainingColumn,
    )
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task: Task) -> Text:
            speed = task.finished_speed or task.speed
            return Text("" if speed is None else f"{speed:,.0f} scenes/s")

    columns = (BarColumn(), MofNCompleteColumn(), Rate(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def progress(done: int, runs: int) -> None:
            if bar.tasks[0].total is None:
                bar.reset(
                    task, total=runs, completed=done
                )  # so that runs of before do not count for the rate
            bar.update(task, completed=done)

        yield progress


def _write(result: StudyResult, output: Path, pictures: bool) -> None:
    """Summary, report and pictures of what is done, beside the samples."""
    from guideload.reports.study import study_report

    try:
        with atomic_output(output) as folder:
            with status("writing the summary"):
                result.to_json(folder / "summary.json")
                (folder / "report.txt").write_text(study_report(result), encoding="utf-8")
            if pictures:
                with status("drawing the pictures"):
                    from guideload.plots.study import save_study

                    save_study(result, folder)
            write_manifest(folder)
    except OSError as error:
        reason = f"{output}: the report cannot be written: {error.strerror or error}"
        raise click.ClickException(f"{reason}; the samples are kept, --resume writes it") from error
