"""The command `guideload identify`: numbers of a machine from measured data."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from guideload.base.errors import PictureError
from guideload.cli.exit_codes import exit_if, picture_failure
from guideload.cli.options import InputFile, folder_option, no_pictures_option, overwrite_option
from guideload.cli.outputs import IDENTIFICATION, atomic_output
from guideload.cli.terminal import print_report, print_text, status

if TYPE_CHECKING:
    from guideload.identification.description import IdentifyFile
    from guideload.identification.measured import Measured
    from guideload.identification.next_measurement import RankedMeasurement
    from guideload.identification.result import Identification
    from guideload.machine.machine import Machine
    from guideload.reports.report import Report


class Answer(NamedTuple):
    """What the command found: the identification, candidates ranked by a figure, and the report."""

    found: Identification
    candidates: tuple[RankedMeasurement, ...]
    figure: str
    report: Report


@click.command()
@click.argument("identify_file", metavar="IDENTIFY.TOML", type=InputFile)
@folder_option()
@no_pictures_option
@overwrite_option
def identify(identify_file: Path, output: Path | None, no_pictures: bool, overwrite: bool) -> None:
    """Find real stiffness and damping from measurements.

    The uncertainty is stated with them. The file names the machine, its unknown numbers and the measured data. -o
    writes a folder with the machine file with the identified values, a study file with their uncertainty, report,
    numbers and pictures.
    """
    from guideload.identification.description import read_identify

    with status("reading"):
        described, machine, data = read_identify(identify_file)
    if output is None:
        print_report(_report(identify_file, described, machine, data).report)
        return
    inputs = (identify_file, *(identify_file.parent / name for name in described.files))
    with atomic_output(output, {"": set(IDENTIFICATION)}, overwrite, inputs) as folder:
        answer = _report(identify_file, described, machine, data)
        failure = _write(answer, described, identify_file.parent, folder, output, not no_pictures)
    print_report(answer.report)
    print_text(f"Wrote {output}.")
    exit_if(failure)


def _report(file: Path, described: IdentifyFile, machine: Machine, data: list[Measured]) -> Answer:
    """The identification and its report, with comparison of models and ranking of candidates if the file has some."""
    from guideload.identification.description import (
        candidate_measurements,
        identified_alternatives,
        target_quantity,
    )
    from guideload.identification.model_comparison import compare
    from guideload.identification.next_measurement import rank_measurements
    from guideload.identification.result import identify as identified
    from guideload.reports.identification import identification_report

    with status("searching"):
        found = identified(machine, described.unknown, data)
        levels = compare(identified_alternatives(described, file, found)) if described.alternatives else ()
        figure = target_quantity(described, file, found)
        derivatives = None if figure is None else figure.derivatives
        candidates = rank_measurements(found, candidate_measurements(described, file, found), derivatives)
    report = identification_report(found, levels, candidates, figure)
    return Answer(found, candidates, "all unknowns" if figure is None else figure.name, report)


def _write(
    answer: Answer, described: IdentifyFile, source: Path, folder: Path, output: Path, pictures: bool
) -> PictureError | None:
    """Write all files into the draft folder; output: the folder that it becomes."""
    from guideload.identification.result import json_text
    from guideload.identification.written_files import machine_text, study_text

    found = answer.found
    texts = {
        "report.txt": answer.report.text(),
        "identification.json": json_text(found),
        "machine.toml": machine_text(found, source / described.machine, output),
    }
    if described.trace is not None:
        trace = os.path.relpath(source / described.trace, output).replace(os.sep, "/")
        texts["study.toml"] = study_text(found, "machine.toml", trace)
    for name, text in texts.items():
        (folder / name).write_bytes(text.encode())
    failure = None
    if pictures:
        with status("drawing the pictures"):
            from guideload import plots

            failure = picture_failure(
                lambda: plots.save_identification(found, folder, answer.candidates, answer.figure)
            )
    return failure
