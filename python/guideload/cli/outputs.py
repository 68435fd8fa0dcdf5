"""Writing of files and folders: complete or not at all; files of others are never replaced."""

from __future__ import annotations

import errno
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from guideload.base.atomic import DRAFT, atomic_folder, atomic_write, draft_folder, draft_path
from guideload.cli.exit_codes import InputError

if TYPE_CHECKING:
    import pandas as pd

FORMATS = {"netcdf": "loads.nc", "parquet": "loads.parquet", "csv": "loads.csv"}
PICTURES = ("scene.png", "figures_7_to_11.png", "resultant.png", "moments.png", "modes.png", "spectrum.png")
OF_POINTS = "points.png"  # of a machine with [[points]]
CHART = ("chart.png", "chart.csv")
STUDY_PICTURES = ("distributions.png", "exceedance.png", "tornado.png", "scatter.png", "histories.png")
LIFE_PICTURES = ("life.png", "static_safety.png", "failure.png")  # of a study whose carriages have ratings
RECORD_PICTURES = [f"record_{number}.png" for number in range(1, 10)]  # as in plots/identification.py
IDENTIFICATION_PICTURES = (
    "numbers.png",
    "correlation.png",
    "modal_tests.png",
    "frequency_responses.png",
    "next_measurements.png",
    *RECORD_PICTURES,
)
IDENTIFICATION = ("machine.toml", "study.toml", "identification.json", "report.txt", *IDENTIFICATION_PICTURES)
STUDY = ("summary.json", "report.txt", *STUDY_PICTURES, *LIFE_PICTURES)  # beside the samples
OUTPUTS = (*FORMATS.values(), "loads.json", *PICTURES, OF_POINTS, *CHART, *STUDY, *IDENTIFICATION)
MANIFEST = ".guideload"  # hidden file in every output folder: the names of the files that guideload wrote
MANIFEST_TITLE = "Files that guideload wrote into this folder; --overwrite replaces these and no others:"
PAGE = ".html"  # ending of the reports of --report, which have any name
PICTURE_ENDINGS = (".png", ".svg", ".pdf", ".eps", ".jpg", ".tif", ".webp")


def _own_files(folder: Path) -> set[str]:
    """Names of the files that guideload wrote into a folder, from its manifest; other names in it are ignored."""
    try:
        lines = (folder / MANIFEST).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return set()
    if lines[:1] != [MANIFEST_TITLE]:
        return set()
    pages = {name for name in lines[1:] if name == Path(name).name and Path(name).suffix.lower() == PAGE}
    return {*lines[1:], MANIFEST} & {*OUTPUTS, MANIFEST} | pages


def require_free(
    output: Path, names: Mapping[str, set[str]], overwrite: bool, inputs: tuple[Path, ...] = ()
) -> None:
    """Raise InputError unless a folder is new or empty, or its files were written by guideload and may be replaced.

    names: files to be written into each folder below `output`. inputs: files that must not be replaced.
    """
    if not output.is_dir() or not any(path.name != DRAFT for path in output.iterdir()):
        return
    if not overwrite:
        raise InputError(
            f"the folder {output} is not empty; give another one, or --overwrite to replace the files of an "
            "earlier run in it"
        )
    for below, written in names.items():
        folder = output / below
        ours = _own_files(folder)
        for name in sorted({*written, MANIFEST} - ours):
            if (folder / name).exists() or (folder / name).is_symlink():
                raise InputError(
                    f"{folder / name} was not written by an earlier run, so --overwrite does not replace it; "
                    "move it, or give another folder"
                )
        require_unread([folder / name for name in sorted(ours)], inputs)


def require_unread(replaced: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise InputError if a file that is to be replaced or removed is one of the `inputs` of this run."""
    there = [path for path in inputs if path.exists()]
    for file in replaced:
        for path in there:
            if file.exists() and path.samefile(file):
                raise InputError(
                    f"{path} is read by this run and would be replaced; give another place to write"
                )


def unwritable(path: Path, error: OSError) -> InputError:
    """The InputError of a path that cannot be written, with the path as the user gave it."""
    above = next((folder for folder in path.absolute().parents if folder.exists()), path)
    if not above.is_dir():
        return InputError(f"{path}: {above} is a file, not a folder")
    if error.errno == errno.ENOENT:
        return InputError(f"{path}: there is no folder {path.parent}")
    return InputError(f"{path}: cannot be written: {error.strerror or error}")


def require_file(
    file: Path, endings: Iterable[str], overwrite: bool, *inputs: Path, folder: Path | None = None
) -> None:
    """Raise InputError unless a file may be written: before the computation, as it is written after it.

    inputs: files that must not be replaced. folder: output folder of the run, which need not exist yet.
    """
    if file.suffix.lower() not in endings:
        raise InputError(f"{file}: expected a name that ends in {', '.join(endings)}")
    if file.exists() and not overwrite:
        raise InputError(f"{file} exists; give another name, or --overwrite")
    require_unread([file], inputs)
    if not file.parent.is_dir() and (folder is None or file.parent.absolute() != folder.absolute()):
        raise unwritable(file, FileNotFoundError(errno.ENOENT, "no such folder"))
    if file.parent.is_dir():
        try:
            with draft_folder(draft_path(file), file):  # a draft can be made beside it
                pass
        except OSError as error:
            raise unwritable(file, error) from None


@contextmanager
def file_draft(file: Path, overwrite: bool) -> Iterator[Path]:
    """Draft that replaces a file when the block ends without an error. Raises InputError if it cannot be written."""
    try:
        with atomic_write(file, replace=overwrite) as draft:
            yield draft
    except OSError as error:
        raise unwritable(file, error) from error


def write_page(page: str, file: Path, overwrite: bool, folder: Path | None) -> None:
    """Write an HTML report. In `folder`, the output folder of the run, it is one of the files that guideload wrote."""
    from guideload.html_report import save_page

    if folder is not None and file.parent.absolute() == folder.absolute():
        with file_draft(folder / MANIFEST, overwrite=True) as draft:
            names = sorted({*_own_files(folder), file.name} - {MANIFEST})
            draft.write_text("\n".join([MANIFEST_TITLE, *names]) + "\n", encoding="utf-8")
    save_page(page, file, replace=overwrite)


def write_table(table: pd.DataFrame, file: Path, overwrite: bool) -> None:
    """Write a table without its index, as CSV or by its ending as Parquet. Raises NotFinite, InputError."""
    from guideload.base.finite import require_finite_table

    require_finite_table(table)
    with file_draft(file, overwrite) as draft:
        (table.to_parquet if file.suffix.lower() == ".parquet" else table.to_csv)(draft, index=False)


@contextmanager
def atomic_output(
    output: Path, names: Mapping[str, set[str]], overwrite: bool, inputs: tuple[Path, ...] = ()
) -> Iterator[Path]:
    """Draft folder whose files are moved to `output` when the block ends; on an error the draft is removed.

    It is created at once, so that a path that cannot be written is refused before the computation starts.
    Files of an earlier run in `output` are replaced or removed; other files stay. The other arguments and the
    InputError are those of `require_free`. Raises RunError while another process writes into `output`, and
    ClickException for an OSError of the writing in the block.
    """

    def check() -> None:
        require_free(output, names, overwrite, inputs)

    with ExitStack() as stack:
        try:
            draft = stack.enter_context(atomic_folder(output, check, _move))
        except OSError as error:
            raise unwritable(output, error) from None
        try:
            for below in names:
                (draft / below).mkdir(exist_ok=True)
            yield draft
            for folder in [draft / below for below in names]:
                # All files of the draft, so that --overwrite may replace them later.
                lines = [MANIFEST_TITLE, *sorted(path.name for path in folder.iterdir())]
                (folder / MANIFEST).write_text("\n".join(lines) + "\n", encoding="utf-8")
            stack.close()
        except OSError as error:
            file = error.filename
            if isinstance(file, str) and not {draft, output} & {Path(file), *Path(file).parents}:
                raise  # of a file that the block reads
            raise click.ClickException(f"{output}: cannot be written: {error.strerror or error}") from error


def remove_own_files(folder: Path) -> None:
    """Remove the files that guideload wrote into a folder; the manifest stays, as it is no output."""
    for name in _own_files(folder) - {MANIFEST}:
        (folder / name).unlink(missing_ok=True)


def _move(draft: Path, folder: Path) -> None:
    """Move the files of a draft into a folder. May be killed at any point and called again.

    The files of the earlier run are removed first, so that old and new files are never together. The new manifest comes
    before the new files: files that it names and that are missing are still in the draft.
    """
    manifests = [path for path in (draft / MANIFEST, *draft.glob(f"*/{MANIFEST}")) if path.exists()]
    targets = {path: folder / path.relative_to(draft) for path in manifests}
    for target in targets.values():
        remove_own_files(target.parent)
    for path, target in targets.items():
        target.parent.mkdir(exist_ok=True)
        path.replace(target)
    for path in [path for path in draft.rglob("*") if path.is_file()]:
        path.replace(folder / path.relative_to(draft))
    shutil.rmtree(draft)
