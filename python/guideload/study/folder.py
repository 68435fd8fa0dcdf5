"""The folder of a study: begun, gone on with, or removed; never mixed with another study, nor with other files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from guideload.base.atomic import LOCK, draft_of, exclusive_lock
from guideload.base.errors import ArgumentError, RunError
from guideload.study import manifest
from guideload.study.store import HISTORIES, SAMPLES, FolderStore, MemoryStore, SampleStore, parts_in

if TYPE_CHECKING:
    from guideload.study.plan import Plan


@contextmanager
def written(plan: Plan, folder: Path | None, resume: bool) -> Iterator[SampleStore]:
    """The parts of a plan, to be added to: in memory, or in a folder that no other process writes meanwhile.

    A folder with a study in it is refused, unless `resume` and the study is the same: then its parts are checked
    to their last byte, and what is damaged is removed, to be run again.
    """
    columns = [*(factor.name for factor in plan.factors), *plan.columns]
    if folder is None:
        yield MemoryStore(columns, plan.runs)
        return
    _require_ours(folder, plan, resume)
    with ExitStack() as held:
        try:
            (folder / SAMPLES).mkdir(parents=True, exist_ok=True)
            held.enter_context(exclusive_lock(folder / SAMPLES))
            _require_ours(folder, plan, resume)  # another process may just have begun one
            parts = FolderStore(folder, columns, plan.runs, plan.fingerprint())
            parts.find(read_all=True)
            for path in (*parts.damaged, *_drafts(folder)):
                path.unlink(missing_ok=True)
            manifest.write(folder, plan)  # also on resuming: runs, limits and life may be others than before
        except OSError as error:
            reason = error.strerror or error
            raise RunError(f"{error.filename or folder}: cannot be written: {reason}") from error
        yield parts


def _require_ours(folder: Path, plan: Plan, resume: bool) -> None:
    there = manifest.read(folder)
    if there is not None and resume:
        manifest.require_same(folder, there, plan)
    elif there is not None:
        raise ArgumentError(
            f"{folder} holds a study already ({folder / manifest.MANIFEST}): resume it, or give another folder"
        )
    elif not resume and (left := [*parts_in(folder), *folder.glob(HISTORIES)]):
        raise ArgumentError(f"{left[0]} is not of this study and would be mixed with it; give another folder")


def _drafts(folder: Path) -> list[Path]:
    """What a killed writer may have left."""
    left = [draft_of(folder / name) for name in (manifest.MANIFEST, HISTORIES)]
    return [*(path for path in left if path.exists()), *(folder / SAMPLES).glob(".part-*.draft.parquet")]


def begun_only(folder: Path) -> bool:
    """Whether a folder holds no more than what a study leaves that was ended before its manifest was written."""
    names = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    return names <= {SAMPLES, draft_of(folder / manifest.MANIFEST).name} and not parts_in(folder)


def files_of(folder: Path) -> list[Path]:
    """Where the files of the study in a folder are, drafts too, the manifest last; it may lack some of them."""
    return [*parts_in(folder), *_drafts(folder), folder / HISTORIES, folder / manifest.MANIFEST]


def remove(folder: Path) -> None:
    """Remove the files of the study in a folder, the manifest last; whatever else is there stays.

    Raises ArgumentError if the manifest is not ours, RunError if another process is writing the study.
    """
    if manifest.read(folder) is None:
        return
    samples = folder / SAMPLES
    samples.mkdir(exist_ok=True)
    with exclusive_lock(samples):
        for path in files_of(folder):
            path.unlink(missing_ok=True)
    (samples / LOCK).unlink(missing_ok=True)
    if not any(samples.iterdir()):
        samples.rmdir()
