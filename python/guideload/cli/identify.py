"""The command `guideload identify`: numbers of a machine from measured data."""

from __future__ import annotations

import os
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from guideload.cli.exit_codes import exit_if, picture_failure
from guideload.cli.options import InputFile, folder_option, no_pictures_option, overwrite_option
from guideload.cli.outputs import IDENTIFICATION, atomic_output
from guideload.cli.terminal import print_report, print_text, status

if TYPE_CHECKING:
    from guideload.identification.description import IdentifyFile
    from guideload.identification.result import Identification
    from guideload.reports.report import Report


@click.command()
@click.argument("identify_file", metavar="IDENTIFY.TOML", type=InputFile)
@folder_option()
@no_pictures_option
@overwrite_option
def identify(identify_file: Path, output: Path | None, no_pictures: bool, overwrite: bool) -> None:
    """Find real stiffness and damping from measurements.

    Each value has its uncertainty. The file names the machine, its unknown numbers and the measured data. -o writes a
    folder: a machine file with the identified values, a study file with their uncertainty, report, numbers and
    pictures.
    """
    from guideload.identification.description import IdentifyFile
    from guideload.identification.model_comparison import compare
    from guideload.identification.next_measurement import rank_measurements
    from guideload.reports.identification import identification_report

    with status("reading"):
        described = IdentifyFile.from_toml(identify_file)
    inputs = (identify_file, *(identify_file.parent / name for name in described.files.values() if name))
    folder, failure = None, None
    with ExitStack() as stack:
        if output is not None:
            names = {"": set(IDENTIFICATION)}
            folder = stack.enter_context(atomic_output(output, names, overwrite, inputs))
        with status("searching"):
            found = described.identified()
            levels = compare(described.identified_alternatives(found)) if described.alternatives else ()
            figure = described.target_quantity(found)
            derivatives = None if figure is None else figure.derivatives
            wanted = described.candidate_measurements(found)
            candidates = rank_measurements(found, wanted, derivatives)
        report = identification_report(found, levels, candidates, figure)
        if folder is not None and output is not None:
            _write(found, report, described, identify_file.parent, folder, output)
            if not no_pictures:
                from guideload import plots

                name = "all unknowns" if figure is None else figure.name
                with status("drawing the pictures"):
                    failure = picture_failure(
                        lambda: plots.save_identification(found, folder, candidates, name)
                    )
    print_report(report)
    if output is not None:
        print_text(f"Wrote {output}.")
    exit_if(failure)


def _write(
    found: Identification, report: Report, described: IdentifyFile, source: Path, folder: Path, output: Path
) -> None:
    """Write all texts into the draft folder; source: the folder of the file, output: that which the draft becomes."""
    from guideload.identification.result import json_text
    from guideload.identification.written_files import machine_text, study_text

    texts = {
        "report.txt": report.text(),
        "identification.json": json_text(found),
        "machine.toml": machine_text(found, source / described.machine, output),
    }
    if described.trace is not None:
        trace = os.path.relpath(source / described.trace, output).replace(os.sep, "/")
        texts["study.toml"] = study_text(found, "machine.toml", trace)
    for name, text in texts.items():
        (folder / name).write_bytes(text.encode())
