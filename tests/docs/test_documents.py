"""README and all pages are true: their code runs, their TOML is accepted, their numbers are the program's.

The blocks of a page run one after the other in one folder; TOML below `<!-- write: NAME -->` is put into that file,
with `from FILE` into a copy of another one (see `write`). The folder holds the packaged examples (and the trace as
trace.csv) unless the page begins with `<!-- folder: empty -->`. The Rust of the README is a documentation test of the
crate.
"""

import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from unrendered import leave_unrendered

from guideload import Machine, Moves, Study
from guideload.cli.inputs import EXAMPLES
from guideload.cli.main import main
from guideload.duty.description import DutyFile
from guideload.identification.description import IdentifyFile

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs"))

import pictures  # noqa: E402
import refresh  # noqa: E402

PAGES = {str(page.relative_to(ROOT)): page.read_text(encoding="utf-8") for page in refresh.pages()}
SCRIPTS = sorted((ROOT / "docs" / "examples").glob("*.py"))
FENCE = re.compile(r"(?:^<!-- write: ([^\n]*) -->\n)?^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)
WRITE = re.compile(r"(\S+)(?: from (\S+))?(?:, below (\S+))?(?:, without (.+))?")


def blocks(text: str) -> list[tuple[str, str]]:
    """Language and text of each block of code."""
    return [(language, code) for _, language, code in FENCE.findall(text)]


def with_code(*languages: str) -> list[str]:
    return [
        name for name, text in PAGES.items() if any(language in languages for language, _ in blocks(text))
    ]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the packaged examples, as working directory. Pictures are drawn there, but not rendered."""
    leave_unrendered(monkeypatch)
    monkeypatch.chdir(tmp_path)
    for file in EXAMPLES.glob("*.*"):
        Path(file.name).write_bytes(file.read_bytes())
    Path("trace.csv").write_bytes((EXAMPLES / "manipulator.csv").read_bytes())
    study = Path("study.toml").read_text(encoding="utf-8")
    Path("study.toml").write_text(study.replace("10_000", "500"), encoding="utf-8")  # soon done
    return tmp_path


# ---- code


@pytest.mark.parametrize("page", with_code("python", "sh"))
def test_code_of_a_page_runs(page: str, folder: Path) -> None:
    shown = [name for _, name, _, _ in refresh.BLOCK.findall(PAGES[page])]
    if not refresh.ON_PAGE.keys() & set(shown):  # else the numbers on the page are of the whole trace
        shorten_traces()
    if "<!-- folder: empty -->" in PAGES[page]:
        for file in folder.iterdir():
            file.unlink()
    names: dict[str, Any] = {"__name__": "page"}
    printed: dict[tuple[str, ...], str] = {}
    for written, language, code in FENCE.findall(PAGES[page]):
        if written:
            write(written, code)
        elif language == "python":
            exec(compile(code, page, "exec"), names)
        elif language == "sh":
            for command in commands(code):
                printed[tuple(command[1:])] = run(command)
    for _, name, inside, _ in refresh.BLOCK.findall(PAGES[page]):
        if name in refresh.ON_PAGE:
            command, choose = refresh.ON_PAGE[name]
            assert inside == f"{refresh.chosen(printed[command], choose)}\n", name


def shorten_traces() -> None:
    """Only the first third of the packaged trace, which is simulated sooner."""
    for name in ("manipulator.csv", "trace.csv"):
        rows = Path(name).read_text(encoding="utf-8").splitlines(keepends=True)
        Path(name).write_text("".join(rows[:1800]), encoding="utf-8")


def write(how: str, rows: str) -> None:
    """A file with the rows of a block: at the end of another file or below a header, without rows of some keys."""
    found = WRITE.fullmatch(how)
    assert found, how
    name, source, below, keys = found.groups()
    text = Path(source).read_text(encoding="utf-8") if source else ""
    dropped = tuple(keys.split(", ")) if keys else ()
    text = "".join(
        row for row in text.splitlines(keepends=True) if not dropped or not row.startswith(dropped)
    )
    assert not below or below in text, how
    text = text.replace(below, f"{below}\n{rows}") if below else f"{text}\n{rows}"
    Path(name).write_text(text, encoding="utf-8")


def commands(code: str) -> Iterator[list[str]]:
    """The words of each command, without comments; `.venv/bin/x` as x."""
    for row in code.replace("\\\n", " ").splitlines():
        for part in row.split("&&"):
            words = [word.removeprefix(".venv/bin/") for word in shlex.split(part, comments=True)]
            if words:
                yield words


def run(words: list[str]) -> str:
    """What a guideload command prints; of others, that the files they name exist."""
    if words[0] != "guideload":
        for word in words:
            if re.fullmatch(r"(tests|docs|rust)/[\w./-]+", word) and "_build" not in word:
                assert (ROOT / word).exists(), " ".join(words)
        return ""
    output = words.index(">") if ">" in words else len(words)
    given = b""
    if "<" in words:
        output = words.index("<")
        given = Path(words[output + 1]).read_bytes()
    done = CliRunner().invoke(main, words[1:output], input=given, catch_exceptions=False)
    assert done.exit_code == 0, f"{' '.join(words)}: {done.output}"
    if ">" in words:
        Path(words[output + 1]).write_text(done.stdout, encoding="utf-8")
    return str(done.stdout)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_an_example_runs_and_is_short(script: Path, folder: Path) -> None:
    code = script.read_text(encoding="utf-8")
    assert len(code.splitlines()) < 40
    assert f"examples/{script.name}" in PAGES["docs/examples.md"]
    exec(compile(code, str(script), "exec"), {"__name__": "__main__"})


# ---- machine and study files


@pytest.mark.parametrize("page", with_code("toml"))
def test_toml_of_a_page_is_accepted(page: str, folder: Path) -> None:
    for language, text in blocks(PAGES[page]):
        if language == "toml":
            accept(text)


def accept(text: str) -> None:
    """A machine, a part of one, a study, a motion, or keys of a carriage, one row each."""
    if not re.search(r"^\[", text, re.MULTILINE):
        for row in text.splitlines():
            law_of(row)
        return
    values = tomllib.loads(text)
    if "unknown" in values:
        assert IdentifyFile(**values).unknown
    elif "cases" in values:
        assert DutyFile(**values).cases
    elif "moves" in values:
        assert Moves(**values).motion().exact
    elif "vary" in values or "limits" in values:
        Path("study.toml").write_text(text, encoding="utf-8")
        Path("machine.toml").write_bytes((EXAMPLES / "manipulator.toml").read_bytes())
        assert Study.from_toml("study.toml").vary
    else:
        base = tomllib.loads((EXAMPLES / "manipulator.toml").read_text(encoding="utf-8"))
        machine = Machine(**(values if "body" in values else base | values))
        assert machine.scene is not None  # the body is supported


def law_of(keys: str) -> str:
    """The kind of the law along y of the packaged carriage with these keys, a law in place of its stiffness."""
    carriage, values = Machine.from_toml(EXAMPLES / "machine.toml").carriages[0], tomllib.loads(keys)
    replaced = {"stiffness_y": None} if values.keys() & {"stiffness_y", "curve_y"} else {}
    return carriage.model_copy(update={**replaced, **values}).laws[0].kind


def test_every_law_of_the_machine_page_is_one() -> None:
    """The rows of its block, each a law; and what the text below adds to the first."""
    text = PAGES["docs/how-to/describe-a-machine.md"]
    rows = next(
        code.splitlines() for language, code in blocks(text) if language == "toml" and "curve_y" in code
    )
    added = {key: re.search(rf"`({key} = .*?)`", text) for key in ("clearance_y", "preload_y", "rolling")}
    clearance, preload, rolling = (found[1] for found in added.values() if found)
    kinds = [law_of(row) for row in (*rows, f"{rows[0]}\n{clearance}", f"{rows[0]}\n{preload}\n{rolling}")]
    assert kinds == ["linear", "sided", "curve", "sided", "preloaded"]


# ---- numbers, pictures, links


def test_numbers_are_those_of_the_program() -> None:
    """Where they are not: python docs/refresh.py. Some blocks are compared where the code of their page runs."""
    assert not refresh.stale(left_out=refresh.ON_PAGE)


def test_every_picture_is_shown_and_made_by_a_script() -> None:
    shown = {
        Path(name).stem for text in PAGES.values() for name in re.findall(r"!\[.*?\]\((.*?\.png)\)", text)
    }
    script = (ROOT / "tests" / "benchmarks" / "measured.py").read_text(encoding="utf-8")
    cases = re.findall(r'^    "([\w-]+)": \(', script, re.MULTILINE)
    of_benchmarks = {"speed-accuracy", "monte-carlo", "monitor-lag", "torture"}
    of_benchmarks |= {f"measured-{case}" for case in cases}
    of_page = re.findall(r'take\(driver, "(\w+)"\)', (ROOT / "docs" / "app_pictures.py").read_text("utf-8"))
    assert (
        shown
        == {path.stem for path in pictures.IMAGES.glob("*.png")}
        == pictures.PICTURES.keys() | of_benchmarks | {f"app-{name}" for name in of_page}
    )


@pytest.mark.parametrize("page", PAGES)
def test_files_that_a_page_names_exist(page: str) -> None:
    text = re.sub(r"^```.*?^```", "", PAGES[page], flags=re.DOTALL | re.MULTILINE)
    targets = [target.split("#")[0] for target in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in target]
    here = (ROOT / page).parent
    assert not [target for target in targets if target and not (here / target).exists()]
    named = re.findall(r"`((?:tests|docs|rust|python)/[\w./-]*\w)`", text)
    assert not [name for name in named if not (ROOT / name).exists() and "_build" not in name]


def test_the_readme_is_one_page() -> None:
    assert len(PAGES["README.md"].splitlines()) <= 120


def test_a_wrong_number_would_be_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "page.md"
    page.write_text("<!-- begin: weight -->\n1 N\n<!-- end: weight -->\n", encoding="utf-8")
    monkeypatch.setattr(refresh, "ROOT", tmp_path)
    monkeypatch.setattr(refresh, "pages", lambda: [page])
    assert refresh.stale() == ["page.md: weight"]
