"""Whatever ends a writer, outputs are those of one run, and the next run leaves nothing of the last behind."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path

import click
import pytest
from command_line import MACHINE, TRACE, guideload, names, refused, write_trace
from faults import each

from guideload.base.atomic import atomic_folder, atomic_write, draft_path
from guideload.base.errors import RunError, WriteError
from guideload.cli.inputs import EXAMPLES
from guideload.cli.outputs import MANIFEST, atomic_output

OLD, NEW = ("loads.csv", "loads.json", "scene.png"), ("loads.nc", "report.txt", "scene.png")
KINDS = pytest.mark.parametrize("kind", ["kill", "full disk"])
BELOW = pytest.mark.parametrize(
    "below", ["", "guides"]
)  # in the folder itself, and in one below as `demo` writes


def write(out: Path, names: tuple[str, ...], text: str, below: str, overwrite: bool = True) -> None:
    with atomic_output(out, {below: {*names}}, overwrite) as draft:
        for name in names:
            (draft / below / name).write_text(text)


def written(out: Path, below: str) -> dict[str, str]:
    """Text by name of what a user sees."""
    folder = out / below
    there = folder.iterdir() if folder.is_dir() else ()
    return {path.name: path.read_text() for path in there if not path.name.startswith(".") and path.is_file()}


def whole(names: tuple[str, ...], text: str) -> dict[str, str]:
    return dict.fromkeys(names, text)


def hidden(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob(".*")} - {MANIFEST}


def fresh(folder: Path) -> Path:
    """An empty folder, whatever was in it."""
    subprocess.run(["rm", "-rf", folder], check=True)
    folder.mkdir()
    return folder


@KINDS
@BELOW
def test_a_new_folder_is_whole_or_not_there(tmp_path: Path, kind: str, below: str) -> None:
    home = tmp_path / "home"
    out, faults = home / "results" / "out", 0
    for faults in each(home, kind, partial(fresh, home), partial(write, out, NEW, "new", below)):
        assert not out.exists() or written(out, below) == whole(NEW, "new"), faults
        assert kind == "kill" or not hidden(home), faults
        write(out, OLD, "next", below)
        assert written(out, below) == whole(OLD, "next") and not hidden(home), faults
    assert faults > 10


@KINDS
@BELOW
def test_old_and_new_files_are_never_together(tmp_path: Path, kind: str, below: str) -> None:
    out, faults = tmp_path / "out", 0
    old, new = whole(OLD, "old"), whole(NEW, "new")

    def prepare() -> None:
        fresh(out)
        (out / "notes.txt").write_text("mine")
        write(out, OLD, "old", below)

    def visible() -> dict[str, str]:
        assert (out / "notes.txt").read_text() == "mine"
        return {name: text for name, text in written(out, below).items() if name != "notes.txt"}

    for faults in each(out, kind, prepare, partial(write, out, NEW, "new", below)):
        assert visible().items() <= old.items() or visible().items() <= new.items(), faults
        # Refused, but it completes what was begun.
        with pytest.raises(click.ClickException, match="is not empty"):
            write(out, NEW, "refused", below, overwrite=False)
        assert visible() in (old, new) and not hidden(out), faults
        write(out, NEW, "next", below)
        assert visible() == whole(NEW, "next") and not hidden(out), faults
    assert faults > 15


@KINDS
@pytest.mark.parametrize("replace", [True, False])
def test_a_file_is_whole_and_its_draft_is_cleared(tmp_path: Path, kind: str, replace: bool) -> None:
    home, faults = tmp_path / "home", 0
    path = home / "picture.png"

    def prepare() -> None:
        fresh(home)
        if replace:
            path.write_text("old")

    def act() -> None:
        with atomic_write(path, durable=True, replace=replace) as draft:
            draft.write_text("new")

    for faults in each(home, kind, prepare, act):
        assert (path.read_text() if path.exists() else "old") in ("old", "new")
        assert kind == "kill" or not hidden(home), faults
        path.unlink(missing_ok=True)
        act()
        assert path.read_text() == "new" and not hidden(home), faults
    assert faults > 5


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_an_error_in_the_block_leaves_nothing_behind(tmp_path: Path, kind: str) -> None:
    def written() -> AbstractContextManager[Path]:
        out = tmp_path / "new" / "out"
        return atomic_folder(out, lambda: None, Path.rename) if kind == "folder" else atomic_write(file)

    file = tmp_path / "loads.nc"
    file.write_text("first")
    with pytest.raises(KeyboardInterrupt), written() as draft:
        (draft / "half" if kind == "folder" else draft).write_text("half")
        assert kind == "folder" or draft.suffix == ".nc"
        raise KeyboardInterrupt
    assert [*tmp_path.rglob("*")] == [file] and file.read_text() == "first"


def test_an_error_names_the_file_and_the_reason(tmp_path: Path) -> None:
    folder, reason = tmp_path / "nowhere", "x.csv: cannot be written: "
    with (
        pytest.raises(WriteError, match=f"{reason}there is no folder {folder}"),
        atomic_write(folder / "x.csv"),
    ):
        pass
    with pytest.raises(WriteError, match=f"{reason}no memory"), atomic_write(tmp_path / "x.csv"):
        raise OSError("no memory")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("has_links", [True, False])
def test_a_file_that_must_not_be_replaced_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_links: bool
) -> None:
    if not has_links:
        monkeypatch.setattr(
            os, "link", lambda *_: os.stat(tmp_path / "no such file")
        )  # as a disk without links
    path = tmp_path / "machine.toml"
    with pytest.raises(RunError, match="File exists"), atomic_write(path, replace=False) as draft:
        draft.write_text("ours")
        path.write_text("another's, meanwhile")
    assert path.read_text() == "another's, meanwhile" and not hidden(tmp_path)
    with atomic_write(tmp_path / "new.toml", replace=False) as draft:
        draft.write_text("ours")
    assert (tmp_path / "new.toml").read_text() == "ours" and not hidden(tmp_path)


# Each writes one thing, where nothing is: a file, or a folder.
AT_ONCE = {
    "report": ["modes", "{gantry}", "--report", "{out}.html"],
    "folder": ["run", "{machine}", "{trace}", "--no-pictures", "-o", "{out}"],
    "table": ["response", "{gantry}", "--csv", "{out}.csv"],
    "study": ["study", "{study}", "--samples", "50", "--no-pictures", "-o", "{out}"],
    "init": ["init", "{out}.toml"],
}


@pytest.mark.parametrize("words", AT_ONCE.values(), ids=AT_ONCE)
def test_of_two_commands_at_once_one_writes(tmp_path: Path, words: list[str]) -> None:
    """Both find the place free when they begin; the later one must not replace what the earlier one has written."""
    place = tmp_path / "place"
    place.mkdir()
    names = {
        "machine": MACHINE,
        "trace": write_trace(tmp_path / "trace.csv", 800, 0.1),
        "gantry": EXAMPLES / "gantry.toml",
        "study": EXAMPLES / "study.toml",
        "out": place / "z",
    }
    command = [sys.executable, "-m", "guideload", *(word.format(**names) for word in words)]
    both = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)
    ]
    said = [process.communicate(timeout=300) for process in both]
    wrote = [process.returncode == 0 for process in both]
    assert sorted(wrote) == [False, True], said
    assert ["Wrote" in out for out, _ in said] == wrote, said
    (_, refusal) = said[wrote.index(False)]
    assert any(word in refusal for word in ("is writing here", "exists", "is not empty", "holds a study")), (
        refusal
    )
    assert len([path for path in place.iterdir() if not path.name.startswith(".")]) == 1
    assert not hidden(place) - {".lock"}  # of the study's samples


SECOND = """
import sys
from pathlib import Path
from guideload.base.atomic import atomic_write
from guideload.cli.outputs import atomic_output
try:
    with atomic_output(Path(sys.argv[1]), {}, True) if sys.argv[2] == "folder" else atomic_write(Path(sys.argv[1])):
        print("in")
except Exception as error:
    print(error)
"""


@pytest.mark.parametrize("exists", [True, False])
@pytest.mark.parametrize("kind", ["folder", "file"])
def test_a_second_writer_is_refused_and_the_first_is_not_disturbed(
    tmp_path: Path, exists: bool, kind: str
) -> None:
    out = tmp_path / "out"
    if exists:
        out.mkdir() if kind == "folder" else out.touch()
    second = [sys.executable, "-c", SECOND, str(out), kind]

    def said() -> str:
        return subprocess.run(second, capture_output=True, text=True, check=True).stdout

    def writer() -> AbstractContextManager[Path]:
        return atomic_output(out, {}, True) if kind == "folder" else atomic_write(out)

    def in_thread() -> None:
        with pytest.raises(RunError, match="another thread of this process is writing here"), writer():
            pass
        refused.append(True)

    refused: list[bool] = []
    with writer() as draft:
        process = "" if sys.platform == "win32" else f" (number {os.getpid()})"
        way_out = "wait for it, end it first, or give another place to write"
        assert said() == f"{out}: another process{process} is writing here; {way_out}\n"
        assert draft.exists()
        thread = threading.Thread(target=in_thread)
        thread.start()
        thread.join()
        assert refused
        assert draft.exists()
    assert said() == "in\n"
    assert not hidden(tmp_path)


@pytest.mark.parametrize("make", [Path.touch, lambda path: (path / "mine").mkdir(parents=True)])
def test_what_is_not_a_draft_of_ours_stays(tmp_path: Path, make: Callable[[Path], None]) -> None:
    for path in (tmp_path / "x.png", tmp_path / "out"):
        make(draft_path(path))
    before = sorted(tmp_path.rglob("*"))
    with (
        pytest.raises(RunError, match=r"\.x\.png\.draft is in the way; move it"),
        atomic_write(tmp_path / "x.png"),
    ):
        pass
    with pytest.raises(click.ClickException, match=r"\.out\.draft is in the way; move it"):
        write(tmp_path / "out", NEW, "new", "")
    assert sorted(tmp_path.rglob("*")) == before


def test_a_folder_that_appears_during_the_run_is_not_mixed_into(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with (
        pytest.raises(click.ClickException, match="is not empty"),
        atomic_output(out, {"": {*NEW}}, False) as draft,
    ):
        (draft / "loads.nc").write_text("new")
        out.mkdir()
        (out / "notes.txt").write_text("mine")
    assert [path.name for path in tmp_path.rglob("*")] == ["out", "notes.txt"]


def test_o_is_a_folder_or_a_file_as_its_ending_says(tmp_path: Path) -> None:
    """The diagram of `chart` may be written alone; a folder with the name of a file is refused."""
    picture = tmp_path / "chart.png"
    chart = ("chart", MACHINE, TRACE, "--budget", 0.2, "-o", picture)
    guideload(*chart)
    assert picture.read_bytes().startswith(b"\x89PNG") and names(tmp_path) == {"chart.png"}
    assert "exists" in refused(*chart) and "--no-pictures" in refused(*chart, "--no-pictures", "--overwrite")
    for name in ("out.png", "out.nc", "report.html"):
        message = refused("run", MACHINE, TRACE, "-o", tmp_path / name)
        assert "expected a folder, got" in message and "names a file" in message
    message = refused(*chart[:-1], tmp_path / "chart.txt")
    assert "expected a folder or a picture" in message and "names a file" in message
