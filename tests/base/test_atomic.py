"""Laws of atomic writes: all or nothing, and nothing left behind."""

from pathlib import Path

import pytest

from guideload.base.atomic import atomic_folder, atomic_write
from guideload.base.errors import RunError, WriteError


@pytest.mark.parametrize("durable", [False, True])
def test_a_file_is_written_completely_or_not_at_all(tmp_path: Path, durable: bool) -> None:
    path = tmp_path / "loads.nc"
    with atomic_write(path, durable=durable) as draft:
        draft.write_text("first")
        assert not path.exists() and draft.suffix == ".nc"
    with pytest.raises(KeyboardInterrupt), atomic_write(path, durable=durable) as draft:
        draft.write_text("second, half")
        raise KeyboardInterrupt
    assert path.read_text() == "first"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_is_written_completely_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "out"
    with pytest.raises(KeyboardInterrupt), atomic_folder(folder, lambda: None, Path.rename) as draft:
        (draft / "half").touch()
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())
    with atomic_folder(folder, lambda: None, Path.rename) as draft:
        (draft / "all").touch()
        assert not folder.exists()
    assert [path.name for path in folder.iterdir()] == ["all"]
    assert list(folder.parent.iterdir()) == [folder]


def test_an_error_names_the_file_and_the_reason(tmp_path: Path) -> None:
    path = tmp_path / "nowhere" / "x.csv"
    with (
        pytest.raises(WriteError, match=f"x.csv: cannot be written: there is no folder {path.parent}"),
        atomic_write(path),
    ):
        pass
    with (
        pytest.raises(RunError, match="x.csv: cannot be written: no memory"),
        atomic_write(tmp_path / "x.csv"),
    ):
        raise OSError("no memory")
    assert not list(tmp_path.iterdir())
