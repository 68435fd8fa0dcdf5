"""Sample stores: complete chunks of one study or none, and damage is found."""

import json
import os
import subprocess
import sys
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from study_standin import contents, plan

from guideload.base.errors import ArgumentError, RunError
from guideload.study import storage as stores
from guideload.study.metadata import FILE, FORMAT, StudyMetadata, read_json
from guideload.study.plan import Plan
from guideload.study.storage import Chunk, FolderStore, SampleStore, begun_only, chunks_in, open_store, remove


def chunk(of: Plan, start: int, stop: int) -> Chunk:
    values = of.values(start, stop)
    rows, failed = of.batch().run(values, 1)
    return Chunk(start, values, rows, {start + i: reason for i, reason in failed})


def resumed(of: Plan, folder: Path, resume: bool = True) -> AbstractContextManager[SampleStore]:
    return open_store(of.metadata, folder, resume)


def refused(error: type[Exception], words: str, of: Plan, folder: Path, resume: bool = True) -> None:
    with pytest.raises(error, match=words), resumed(of, folder, resume):
        raise AssertionError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """300 samples of a study, of which 100 to 199 are missing."""
    study = plan(300)
    with resumed(study, tmp_path / "out", resume=False) as store:
        for start in (200, 0):
            store.add(chunk(study, start, start + 100))
    return tmp_path / "out"


def test_a_folder_returns_the_same_as_memory(folder: Path) -> None:
    study = plan(300)
    memory = SampleStore(study.metadata)
    for start in (0, 200):
        memory.add(chunk(study, start, start + 100))
    opened = FolderStore.open(folder)
    assert (opened.columns, opened.runs, opened.done) == (memory.columns, 300, 200)
    assert contents(opened) == contents(memory)
    for table, other in zip(opened.tables(), memory.tables(), strict=True):
        assert table.schema.equals(other.schema, check_metadata=True)
        assert table.to_pandas().equals(other.to_pandas())  # NaN equals NaN here
    empty = {*opened.reasons(), *range(100, 200)}  # it failed or was not run
    assert all(set(np.flatnonzero(np.isnan(opened.column(one)))) == empty for one in study.metadata.columns)
    values = study.values(0, 300)
    values[100:200] = np.nan
    np.testing.assert_array_equal(opened.column(study.factors[0].name), values[:, 0])


def test_other_programs_read_the_chunks(folder: Path) -> None:
    table = parquet.read_table(folder / "samples").to_pandas()
    assert sorted(table["sample"]) == [*range(100), *range(200, 300)]
    assert dict(table.set_index("sample")["reason"].dropna()) == FolderStore.open(folder).reasons()


def test_missing_samples_are_split_at_multiples_of_the_chunk(folder: Path) -> None:
    opened = FolderStore.open(folder)
    assert list(opened.missing(1000)) == [(100, 200)]
    assert list(opened.missing(64)) == [(100, 128), (128, 192), (192, 200)]
    assert list(SampleStore(plan(10).metadata).missing(4)) == [(0, 4), (4, 8), (8, 10)]


def test_columns_are_read_a_few_at_a_time(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    at_once = contents(FolderStore.open(folder))
    monkeypatch.setattr(stores, "READ_AHEAD", 1)
    assert contents(FolderStore.open(folder)) == at_once


def test_an_unknown_column_is_refused_with_the_nearest(folder: Path) -> None:
    with pytest.raises(ArgumentError, match=r"column: expected one of .*body\.mass.*, got 'body.mas'"):
        FolderStore.open(folder).column("body.mas")


def test_no_byte_of_a_chunk_changes_unnoticed(folder: Path) -> None:
    path = chunks_in(folder)[0]
    chunks_in(folder)[1].unlink()
    good, before = path.read_bytes(), contents(FolderStore.open(folder))
    rng, metadata, found = np.random.default_rng(1), plan(300).metadata, 0
    for at in rng.choice(len(good), 200, replace=False):
        spoilt = bytearray(good)
        spoilt[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(spoilt)
        try:
            there = FolderStore(folder, metadata, read_all=True)
        except RunError:  # the fingerprint itself
            found += 1
            continue
        found += bool(there.damaged)
        assert there.damaged or contents(there) == before  # the format has bytes that nobody reads
    assert found > 150


def test_damaged_chunks_are_removed_when_a_study_is_resumed(folder: Path) -> None:
    first, second = chunks_in(folder)
    first.write_bytes(first.read_bytes()[:-1000])  # ended too early
    complete = second.read_bytes()
    renamed = second.rename(second.with_name("chunk-000000150-000000250.parquet"))
    with resumed(plan(300), folder) as there:
        assert there.done == 0
        assert len(there.damaged) == 2 and "samples [200, 300]" in there.damaged[renamed]
        assert chunks_in(folder) == []
    second.write_bytes(complete)
    with resumed(plan(300), folder) as there:
        assert there.ranges() == [(200, 300)]


def test_overlapping_chunks_count_once(folder: Path) -> None:
    FolderStore.open(folder).add(chunk(plan(300), 50, 150))  # as by another process, without a lock
    with resumed(plan(300), folder) as there:
        assert there.ranges() == [(0, 100), (200, 300)]
    assert len(chunks_in(folder)) == 2


def test_damage_found_while_reading_is_reported(folder: Path) -> None:
    opened = FolderStore.open(folder)
    path = chunks_in(folder)[0]
    spoilt = bytearray(path.read_bytes())
    spoilt[3000:3008] = bytes(8)  # numbers of a page
    path.write_bytes(spoilt)
    with pytest.raises(RunError, match="chunk-000000000-000000100.parquet is damaged .* resuming the study"):
        contents(opened)


@pytest.mark.parametrize(
    ("keys", "difference"),
    [
        (dict(seed=2), "seed: 1 there, 2 here"),
        (dict(mass=1300), "body.mass: uniform from 1125 to 1375 kg there, uniform from 1170 to 1430 kg here"),
        (dict(mass=1300), "machine.body.mass: 1250.0 there, 1300"),
    ],
)
def test_another_study_is_refused_with_the_difference(
    folder: Path, keys: dict[str, int], difference: str
) -> None:
    before = sorted(folder.rglob("*"))
    refused(ArgumentError, f"holds another study.*{difference}.*another folder", plan(300, **keys), folder)
    assert sorted(folder.rglob("*")) == before


def test_a_study_is_not_begun_over_another(folder: Path) -> None:
    refused(ArgumentError, "holds a study", plan(300), folder, resume=False)
    (folder / FILE).unlink()
    refused(ArgumentError, "is not of this study", plan(300), folder, resume=False)
    refused(RunError, "of another study", plan(300, 2), folder)
    with resumed(plan(300), folder) as there:  # the chunks themselves say whose they are
        assert there.done == 200
    assert StudyMetadata.read(folder) == plan(300).metadata


def test_a_study_is_resumed_with_more_samples_and_not_with_fewer(folder: Path) -> None:
    with resumed(plan(500), folder) as there:
        assert (there.done, there.runs) == (200, 500)
    assert FolderStore.open(folder).runs == 500
    refused(ArgumentError, "study of 500 runs", plan(300), folder)


def test_metadata_is_written_anew_whenever_a_study_is_resumed(folder: Path) -> None:
    before = (folder / FILE).read_text()
    values = json.loads(before) | {"limits": {"peak_resultant_N": 1.0}}  # not in the fingerprint
    (folder / FILE).write_text(json.dumps(values))
    with resumed(plan(300), folder):
        assert (folder / FILE).read_text() == before  # before any sample


@pytest.mark.parametrize("number", [None, 1, 2])
def test_another_format_is_refused_and_can_be_replaced(folder: Path, number: int | None) -> None:
    values = json.loads((folder / FILE).read_text()) | {"format": number}
    if number is None:  # of guideload 0.1.0, whose chunks had another name too
        del values["format"]
        path = chunks_in(folder)[0]
        path.rename(path.with_name(path.name.replace("chunk", "part")))
    (folder / FILE).write_text(json.dumps(values))
    words = f"expected format {FORMAT}, got {number or 1}: another version of guideload.*--overwrite"
    refused(ArgumentError, words, plan(300), folder)
    with pytest.raises(ArgumentError, match=words):
        FolderStore.open(folder)
    remove(folder)
    assert not list(folder.iterdir())


def test_metadata_that_is_not_ours_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text('{"mine": 1}')
    with pytest.raises(ArgumentError, match=r"study\.json: expected the metadata"):
        remove(tmp_path)
    refused(ArgumentError, r"study\.json", plan(300), tmp_path)
    assert (tmp_path / FILE).read_text() == '{"mine": 1}'
    with pytest.raises(ArgumentError, match="holds no study"):
        FolderStore.open(tmp_path / "nowhere")
    assert read_json(tmp_path / "nowhere") is None


def test_remove_takes_the_study_and_nothing_else(folder: Path) -> None:
    (folder / "notes.txt").write_text("mine")
    (folder / "samples" / "chunk-notes.parquet").write_text("mine")
    remove(folder)
    assert sorted(path.name for path in folder.rglob("*")) == ["chunk-notes.parquet", "notes.txt", "samples"]


def test_drafts_are_neither_read_nor_left_behind(folder: Path) -> None:
    draft = folder / "samples" / ".chunk-000000100-000000200.parquet.draft"
    draft.mkdir()
    for name in (".lock", "chunk-000000100-000000200.parquet"):
        (draft / name).write_bytes(b"PAR1")
    assert FolderStore.open(folder).done == 200
    with resumed(plan(300), folder) as there:
        assert there.done == 200
    assert not draft.exists()


def test_a_folder_that_was_only_begun_is_recognised(tmp_path: Path) -> None:
    assert begun_only(tmp_path)
    (tmp_path / "samples").mkdir()
    (tmp_path / "samples" / ".lock").touch()
    (tmp_path / ".study.json.draft").mkdir()
    assert begun_only(tmp_path)
    (tmp_path / "notes.txt").touch()
    assert not begun_only(tmp_path)


def test_two_processes_do_not_write_one_study(folder: Path) -> None:
    script = "import sys; from guideload.base.atomic import exclusive_lock; from pathlib import Path\n"
    script += "with exclusive_lock(Path(sys.argv[1])): print('in')"
    with resumed(plan(300), folder):
        command = [sys.executable, "-c", script, folder / "samples"]
        second = subprocess.run(command, capture_output=True, text=True)
    assert f"another process (number {os.getpid()}) is writing here; wait for it" in second.stderr
    assert second.stdout == ""
