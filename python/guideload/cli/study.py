"""The commands study, a Monte Carlo study that can be resumed, and probability, of exceeding a limit."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from guideload.base.visible_text import visible
from guideload.cli import outputs
from guideload.cli.exit_codes import INTERRUPTED, InputError, exit_if, picture_failure
from guideload.cli.options import InputFile, folder_option, no_pictures_option, report_option
from guideload.cli.terminal import print_report, print_text, status

if TYPE_CHECKING:
    from guideload.base.errors import PictureError
    from guideload.plots.run import Pictures
    from guideload.reports.report import Report
    from guideload.study.execution import Progress
    from guideload.study.result import StudyResult
    from guideload.study.study import Study


seed_option = click.option(
    "--seed", type=click.IntRange(min=0), help="Seed of all random numbers, instead of the file's."
)
threads_option = click.option(
    "--threads", type=click.IntRange(min=1), help="Number of threads; default: number of cores."
)


@click.command()
@click.argument("study_file", metavar="STUDY.TOML", type=InputFile)
@folder_option(required=True)
@click.option("--resume", is_flag=True, help="Resume the study in the folder, if there is one.")
@click.option("--overwrite", is_flag=True, help="Replace the study in the folder.")
@click.option("--samples", type=click.IntRange(min=1), help="Number of samples, instead of the file's.")
@seed_option
@threads_option
@click.option(
    "--cluster",
    metavar="ADDRESS",
    help="Run on the workers of a Dask scheduler, which see the folder: tcp://host:8786.",
)
@click.option("--strict", is_flag=True, help="Fail if a second method disagrees on some samples.")
@no_pictures_option
@report_option
def study(
    study_file: Path,
    output: Path,
    resume: bool,
    overwrite: bool,
    samples: int | None,
    seed: int | None,
    threads: int | None,
    cluster: str | None,
    strict: bool,
    no_pictures: bool,
    report: Path | None,
) -> None:
    """Find how the loads scatter if the machine varies.

    This is a Monte Carlo study: the distribution of the loads of a machine with varied parameters. Samples are
    written in chunks. After Ctrl-C the report covers the samples that are done. --resume runs the others, also
    after a crash, and gives the same result to the last bit.
    """
    from guideload.study.execution import StudyInterrupted, run_study

    if resume and overwrite:
        raise click.UsageError("--resume keeps the study in the folder and --overwrite replaces it: give one")
    if report is not None:
        outputs.require_file(report, [outputs.PAGE], overwrite or resume, study_file, folder=output)
    again = _resume_command(click.get_current_context())
    may_resume, interrupted, failure = resume, "", None
    try:
        with status("reading"):
            described = _read(study_file, output if resume else None, samples, seed)
        _require_folder(output, resume, overwrite, described.inputs)
        may_resume = True
        try:
            with _bar() as progress:
                result = run_study(
                    described, output, threads=threads, cluster=cluster, resume=resume, progress=progress
                )
        except StudyInterrupted as error:
            result = error.result
            interrupted = f"Interrupted: {result.finished} of {result.runs} runs are done. To resume: {again}"
        for path, reason in result.store.damaged.items():
            click.echo(visible(f"{path} was damaged ({reason}): its samples were run again."), err=True)
        if result.finished:
            found, pictures, failure = _write(result, output, not no_pictures)
            print_report(found)
            if report is not None:
                from guideload import html_report

                page = html_report.study_page(result, pictures)
                outputs.write_page(page, report, overwrite or resume, output)
            print_text(f"Wrote {output}." if report is None else f"Wrote {output} and {report}.")
            if strict and not interrupted:
                result.raise_if_doubtful()
    except SystemExit:  # a signal
        click.echo(f"Terminated. To resume: {again}" if may_resume else "Terminated.", err=True)
        raise
    except KeyboardInterrupt:  # before the first sample, or during the report
        interrupted = f"Interrupted. To resume: {again}" if may_resume else "Interrupted."
    if interrupted:
        click.echo(visible(interrupted), err=True)
        sys.exit(INTERRUPTED)
    exit_if(failure)


def _resume_command(context: click.Context) -> str:
    """The command line that resumes the study of a call: its own options, and --resume."""
    words = ["guideload", "study", str(context.params["study_file"])]
    for option in context.command.params:
        value = context.params[option.name or ""]
        if not isinstance(option, click.Option) or option.name in ("resume", "overwrite"):
            continue
        if option.is_flag:
            words += [option.opts[0]] if value else []
        elif value is not None:
            words += [option.opts[0], str(value)]
    return shlex.join([*words, "--resume"])


def _read(study_file: Path, resumed: Path | None, samples: int | None, seed: int | None) -> Study:
    """The study of a file with options of the command line. Without a seed there, the seed of the resumed study."""
    from guideload.study.metadata import StudyMetadata, read_json
    from guideload.study.options import read_study
    from guideload.study.study import Study

    seedless = seed is None and "seed" not in read_study(study_file)[0]
    if seedless and resumed is not None and read_json(resumed):
        seed = StudyMetadata.read(resumed).seed
    return Study.from_toml(study_file, samples=samples, seed=seed)


def _require_folder(output: Path, resume: bool, overwrite: bool, inputs: tuple[Path, ...]) -> None:
    """Raise InputError unless the folder is new or empty, or holds a study that may be resumed or replaced.

    Removes a study that is to be replaced. Raises InputError if one of its files is in `inputs`.
    """
    from guideload.study.metadata import read_json
    from guideload.study.storage import begun_only, remove, study_files

    if read_json(output) is None:
        if not begun_only(output):
            outputs.require_free(output, {"": {*outputs.STUDY}}, overwrite, inputs)
    elif resume or overwrite:
        outputs.require_free(output, {"": {*outputs.STUDY}}, True, inputs)
        outputs.require_unread(study_files(output), inputs)
    else:
        raise InputError(
            f"{output} holds a study: --resume resumes it, --overwrite replaces it; or give another folder"
        )
    if overwrite:
        remove(output)  # refused while another process runs it
        outputs.remove_own_files(output)  # the report must not stand beside samples of another study
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise outputs.unwritable(output, error) from None


@contextmanager
def _bar() -> Iterator[Progress | None]:
    """A progress bar with rate and remaining time, if standard error is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None, rate="")

        def progress(done: int, runs: int) -> None:
            if bar.tasks[0].total is None:  # the rate excludes samples of earlier runs
                bar.reset(task, total=runs, completed=done)
            speed = bar.tasks[0].speed
            bar.update(task, completed=done, rate=f"{speed:,.0f} samples/s" if speed else "")

        yield progress


def _write(
    result: StudyResult, output: Path, with_pictures: bool
) -> tuple[Report, Pictures | None, PictureError | None]:
    """Write summary, report and pictures of the finished samples.

    Returns the report, the pictures, which a page may show too, and the error of those that could not be drawn.
    """
    from guideload.reports.study import study_report

    found, pictures, failure = study_report(result), None, None
    try:
        with outputs.atomic_output(output, {"": {*outputs.STUDY}}, overwrite=True) as folder:
            with status("writing the summary"):
                result.to_json(folder / "summary.json")
                (folder / "report.txt").write_text(found.text(), encoding="utf-8")
            if with_pictures:
                with status("drawing the pictures"):
                    from guideload.plots.saving import save_each
                    from guideload.plots.study import study_drawings

                    drawn = pictures = study_drawings(result)
                    failure = picture_failure(lambda: save_each(drawn, folder))
    except InputError:
        raise  # of the folder: it has to be mended first
    except click.ClickException as error:
        stored = "the samples are stored: --resume writes the report"
        raise click.ClickException(f"{error.message}; {stored}") from error
    return found, pictures, failure


@click.command()
@click.argument("study_file", metavar="STUDY.TOML", type=InputFile)
@click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar="NAME=VALUE",
    help='A limit instead of the file\'s, of the machine or a carriage, such as "peak_resultant=9 kN" or '
    '"life[1a]=500 km"; repeatable.',
)
@click.option(
    "--error",
    type=click.FloatRange(0, 100, True, True),
    default=10,
    help="Wanted standard error, in % of the probability.",
)
@click.option(
    "--most-runs",
    type=click.IntRange(min=20_000),
    default=1_000_000,
    help="Maximum runs for each limit, at least 20000; the first ten populations may exceed it.",
)
@seed_option
@threads_option
def probability(
    study_file: Path,
    limits: tuple[str, ...],
    error: float,
    most_runs: int,
    seed: int | None,
    threads: int | None,
) -> None:
    """Find the probability that a machine exceeds a limit.

    Subset simulation finds probabilities down to 1e-9, too small to be counted among the samples of a study. The
    limits and the varied parameters are those of a study file; its number of samples does not matter.
    """
    from guideload.reports.study import probability_report
    from guideload.study.rare import exceedance_probability, wanted_limits
    from guideload.study.study import Study

    with status("reading"):
        plan = Study.from_toml(study_file, seed=seed).plan()
        wanted = wanted_limits(plan, limits)
    for name, limit in wanted.items():
        with status(f"running machines towards the limit on {name}"):
            found = exceedance_probability(
                plan, name, limit, coefficient_of_variation=error / 100, most_runs=most_runs, threads=threads
            )
        print_report(probability_report(found, plan.metadata))
