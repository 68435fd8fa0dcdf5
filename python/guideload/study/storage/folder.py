"""The folder of a study: create, resume or remove it without touching other studies or files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from guideload.base.atomic import DRAFT, LOCK, draft_folder, draft_of, exclusive_lock, is_draft
from guideload.base.errors import ArgumentError, RunError
from guideload.study.description.metadata import FILE, StudyMetadata, read_json
from guideload.study.storage.store import HISTORIES, SAMPLES, FolderStore, SampleStore, chunks_in


@contextmanager
def open_store(metadata: StudyMetadata, folder: Path | None, resume: bool) -> Iterator[SampleStore]:
    """A writable store of a study: in memory, or in a folder that is locked against other processes.

    A folder with a study is refused unless `resume` is true and the study is the same: then all bytes of its chunks are
    checked, and damaged chunks are removed, so that they are run again.
    """
    if folder is None:
        yield SampleStore(metadata)
        return
    _require_ours(folder, metadata, resume)
    with ExitStack() as held:
        try:
            (folder / SAMPLES).mkdir(parents=True, exist_ok=True)
            held.enter_context(exclusive_lock(folder / SAMPLES))
            _require_ours(folder, metadata, resume)  # another process may have started a study meanwhile
            store = FolderStore(folder, metadata, read_all=True)
            _remove_drafts(folder)
            for path in store.damaged:
                path.unlink(missing_ok=True)
            metadata.write(folder)  # also on resuming: runs, limits and life may have changed
        except OSError as error:
            reason = error.strerror or error
            raise RunError(f"{error.filename or folder}: cannot be written: {reason}") from error
        yield store


def _require_ours(folder: Path, metadata: StudyMetadata, resume: bool) -> None:
    there = read_json(folder)
    if there is not None and resume:
        metadata.require_resumable(folder)
    elif there is not None:
        raise ArgumentError(f"{folder} holds a study ({folder / FILE}): resume it, or give another folder")
    elif not resume and (others := [*chunks_in(folder), *folder.glob(HISTORIES)]):
        raise ArgumentError(f"{others[0]} is not of this study; give another folder")


def _remove_drafts(folder: Path) -> None:
    """Remove the drafts that a killed writer may have left.

    A draft of a chunk may also be held by a worker of an interrupted run, which ends its chunk; it stays.
    """
    for draft in (draft_of(folder / name) for name in (FILE, HISTORIES)):
        _remove_draft(draft, folder)
    for draft in (folder / SAMPLES).glob(f".chunk-*.parquet{DRAFT}"):
        with suppress(RunError):
            _remove_draft(draft, folder)


def _remove_draft(draft: Path, folder: Path) -> None:
    if draft.is_dir() and is_draft(draft):
        with draft_folder(draft, folder):
            pass


def begun_only(folder: Path) -> bool:
    """Whether a folder holds only a study that ended before its metadata was written."""
    names = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    return names <= {SAMPLES, DRAFT, draft_of(folder / FILE).name} and not chunks_in(folder)


def files_of(folder: Path) -> list[Path]:
    """The paths of the files of a study, the metadata last; some may not exist."""
    return [*chunks_in(folder), folder / HISTORIES, folder / FILE]


def remove(folder: Path) -> None:
    """Remove the files of the study in a folder, the metadata last; all other files stay.

    Raises ArgumentError if guideload did not write the metadata, RunError if another process is writing the study.
    """
    if read_json(folder) is None:
        return
    samples = folder / SAMPLES
    samples.mkdir(exist_ok=True)
    with exclusive_lock(samples):
        _remove_drafts(folder)
        for path in files_of(folder):
            path.unlink(missing_ok=True)
    (samples / LOCK).unlink(missing_ok=True)
    if not any(samples.iterdir()):
        samples.rmdir()
