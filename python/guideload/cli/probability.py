"""The command `guideload probability`: small probabilities that machines of a study exceed a limit."""

from __future__ import annotations

from pathlib import Path

import click

from guideload.cli.options import InputFile
from guideload.cli.terminal import print_report, status


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
@click.option("--seed", type=click.IntRange(min=0), help="Seed of all random numbers, instead of the file's.")
@click.option("--threads", type=click.IntRange(min=1), help="Number of threads; default: number of cores.")
def probability(
    study_file: Path,
    limits: tuple[str, ...],
    error: float,
    most_runs: int,
    seed: int | None,
    threads: int | None,
) -> None:
    """Find the probability that a machine exceeds a limit.

    By subset simulation, down to 1e-9: for probabilities which a study of some thousand samples cannot count. The
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
