"""SampleStore of a study: whole or not there, of one study, and what is spoilt is found."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from study_standin import plan

from guideload.base.errors import ArgumentError, RunError
from guideload.study import manifest
from guideload.study import store as parts
from guideload.study.folder import begun_only, remove, written
from guideload.study.plan import Plan
from guideload.study.store import Chunk, FolderStore, MemoryStore, SampleStore, parts_in


def part(of: Plan, start: int, stop: int) -> Chunk:
    values = of.values(start, stop)
    rows, failed = of.batch().run(values, 1)
    return Chunk(start, values, rows, {start + i: reason for i, reason in failed})


def columns(of: SampleStore) -> dict[str, bytes]:
    return {name: of.column(name).tobytes() for name in of.columns}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """300 samples of a study, of which 100 to 199 are missing."""
    study = plan(300)
    with written(study, tmp_path / "out", resume=False) as begun:
        for start in (200, 0):
            begun.add(part(study, start, start + 100))
    return tmp_path / "out"


def test_a_folder_gives_back_what_memory_does(folder: Path) -> None:
    study = plan(300)
    memory = MemoryStore([*(factor.name for factor in study.factors), *study.columns], study.runs)
    for start in (0, 200):
        memory.add(part(study, start, start + 100))
    opened = FolderStore.open(folder)
    assert (opened.columns, opened.runs, opened.done) == (memory.columns, 300, 200)
    assert columns(opened) == columns(memory)
    assert opened.reasons() == memory.reasons()
    for table, other in zip(opened.tables(), memory.tables(), strict=True):
        assert table.schema.equals(other.schema, check_metadata=True)
        assert table.to_pandas().equals(other.to_pandas())  # NaN equals NaN here
    for name in study.columns:  # NaN where it failed or was not run, nowhere else
        empty = {*opened.reasons(), *range(100, 200)}
        assert set(np.flatnonzero(np.isnan(opened.column(name)))) == empty
    values = study.values(0, 300)
    values[100:200] = np.nan
    np.testing.assert_array_equal(opened.column(study.factors[0].name), values[:, 0])


def test_other_programs_read_the_parts(folder: Path) -> None:
    table = parquet.read_table(folder / "samples").to_pandas()
    assert sorted(table["sample"]) == [*range(100), *range(200, 300)]
    assert dict(table.set_index("sample")["reason"].dropna()) == FolderStore.open(folder).reasons()


def test_what_is_missing_is_cut_at_multiples_of_the_chunk(folder: Path) -> None:
    opened = FolderStore.open(folder)
    assert list(opened.missing(1000)) == [(100, 200)]
    assert list(opened.missing(64)) == [(100, 128), (128, 192), (192, 200)]
    empty = MemoryStore(opened.columns, 10)
    assert list(empty.missing(4)) == [(0, 4), (4, 8), (8, 10)]


def test_columns_are_read_a_few_at_a_time(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    at_once = columns(FolderStore.open(folder))
    monkeypatch.setattr(parts, "READ_AHEAD", 1)
    assert columns(FolderStore.open(folder)) == at_once


def test_an_unknown_column_is_refused_with_the_nearest(folder: Path) -> None:
    with pytest.raises(ArgumentError, match=r"column: expected one of .*body\.mass.*, got 'body.mas'"):
        FolderStore.open(folder).column("body.mas")


def test_no_byte_of_a_part_changes_unnoticed(folder: Path) -> None:
    study = plan(300)
    path = parts_in(folder)[0]
    opened = FolderStore.open(folder)
    good, before = path.read_bytes(), columns(opened)
    rng = np.random.default_rng(1)
    found = 0
    for at in rng.choice(len(good), 200, replace=False):
        spoilt = bytearray(good)
        spoilt[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(spoilt)
        there = FolderStore(folder, opened.columns, 300, study.fingerprint())
        try:
            there.find(read_all=True)
        except RunError:  # the fingerprint itself
            found += 1
            continue
        found += bool(there.damaged)
        assert there.damaged or columns(there) == before  # the format has bytes that nobody reads
    assert found > 150


def test_damaged_parts_are_removed_when_a_study_goes_on(folder: Path) -> None:
    first, second = parts_in(folder)
    first.write_bytes(first.read_bytes()[:-1000])  # ended too early
    whole_one = second.read_bytes()
    second.rename(second.with_name("part-000000150-000000250.parquet"))
    with written(plan(300), folder, resume=True) as there:
        assert there.done == 0
        assert len(there.damaged) == 2
        assert "says [200, 300]" in there.damaged[folder / "samples" / "part-000000150-000000250.parquet"]
        assert parts_in(folder) == []
    second.write_bytes(whole_one)
    with written(plan(300), folder, resume=True) as there:
        assert there.ranges() == [(200, 300)]


def test_a_part_that_covers_another_counts_once(folder: Path) -> None:
    study = plan(300)
    FolderStore.open(folder).add(part(study, 50, 150))  # as by another process, without a lock
    with written(study, folder, resume=True) as there:
        assert there.ranges() == [(0, 100), (200, 300)]
    assert len(parts_in(folder)) == 2


def test_damage_that_is_met_when_reading_is_told(folder: Path) -> None:
    opened = FolderStore.open(folder)
    path = parts_in(folder)[0]
    spoilt = bytearray(path.read_bytes())
    spoilt[3000:3008] = bytes(8)  # numbers of a page
    path.write_bytes(spoilt)
    with pytest.raises(RunError, match="part-000000000-000000100.parquet is damaged .* resuming the study"):
        columns(opened)


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (plan(300, seed=2), "seed: 1 there, 2 here"),
        (
            plan(300, mass=1300),
            "body.mass: uniform from 1125 to 1375 kg there, uniform from 1170 to 1430 kg here",
        ),
        (plan(300, mass=1300), "machine.body.mass: 1250.0 there, 1300"),
    ],
)
def test_another_study_is_refused_and_the_difference_told(folder: Path, other: Plan, said: str) -> None:
    before = sorted(folder.rglob("*"))
    with (
        pytest.raises(ArgumentError, match=f"holds another study.*{said}.*another folder"),
        written(other, folder, resume=True),
    ):
        raise AssertionError
    assert sorted(folder.rglob("*")) == before


def test_a_study_is_not_begun_over_another(folder: Path) -> None:
    with (
        pytest.raises(ArgumentError, match="holds a study already"),
        written(plan(300), folder, resume=False),
    ):
        raise AssertionError
    (folder / "study.json").unlink()
    with pytest.raises(ArgumentError, match="would be mixed"), written(plan(300), folder, resume=False):
        raise AssertionError
    with pytest.raises(RunError, match="of another study"), written(plan(300, 2), folder, resume=True):
        raise AssertionError
    with written(plan(300), folder, resume=True) as there:  # the parts themselves tell whose they are
        assert there.done == 200
    assert manifest.read(folder) is not None


def test_a_study_goes_on_with_more_samples_and_not_with_fewer(folder: Path) -> None:
    with written(plan(500), folder, resume=True) as there:
        assert (there.done, there.runs) == (200, 500)
    assert FolderStore.open(folder).runs == 500
    with pytest.raises(ArgumentError, match="study of 500 runs"), written(plan(300), folder, resume=True):
        raise AssertionError


def test_the_manifest_is_written_anew_whenever_a_study_goes_on(folder: Path) -> None:
    file = folder / manifest.MANIFEST
    before = file.read_text()
    told = json.loads(before)
    told["studied"]["limits"] = {"peak_resultant": 1.0}  # of before: no part of the fingerprint
    file.write_text(json.dumps(told))
    with written(plan(300), folder, resume=True):
        assert file.read_text() == before  # before any sample


def test_a_manifest_that_is_not_ours_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "study.json").write_text('{"mine": 1}')
    with pytest.raises(ArgumentError, match=r"study\.json: expected the manifest"):
        remove(tmp_path)
    with pytest.raises(ArgumentError, match=r"study\.json"), written(plan(300), tmp_path, resume=True):
        raise AssertionError
    assert (tmp_path / "study.json").read_text() == '{"mine": 1}'
    with pytest.raises(ArgumentError, match="holds no study"):
        FolderStore.open(tmp_path / "nowhere")


def test_remove_takes_the_study_and_nothing_else(folder: Path) -> None:
    (folder / "notes.txt").write_text("mine")
    (folder / "samples" / "part-notes.parquet").write_text("mine")
    remove(folder)
    left = sorted(path.name for path in folder.rglob("*"))
    assert left == ["notes.txt", "part-notes.parquet", "samples"]


def test_drafts_are_neither_read_nor_kept(folder: Path) -> None:
    draft = folder / "samples" / ".part-000000100-000000200.draft.parquet"
    draft.write_bytes(b"PAR1")
    assert FolderStore.open(folder).done == 200
    with written(plan(300), folder, resume=True) as there:
        assert there.done == 200
    assert not draft.exists()


def test_a_folder_that_was_only_begun_is_known(tmp_path: Path) -> None:
    assert begun_only(tmp_path)
    (tmp_path / "samples").mkdir()
    (tmp_path / "samples" / ".lock").touch()
    (tmp_path / ".study.draft.json").touch()
    assert begun_only(tmp_path)
    (tmp_path / "notes.txt").touch()
    assert not begun_only(tmp_path)


def test_two_processes_do_not_write_one_study(folder: Path) -> None:
    script = (
        "from study_standin import plan; from guideload.study.folder import written; from pathlib import Path\n"
        f"with written(plan(300), Path({str(folder)!r}), True): print('in')"
    )
    path = os.pathsep.join(
        filter(None, [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH")])
    )
    with written(plan(300), folder, resume=True):
        second = subprocess.run(
            [sys.executable, "-c", script],
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
        )
    assert "another process is writing in this folder" in second.stderr
    assert second.stdout == ""
