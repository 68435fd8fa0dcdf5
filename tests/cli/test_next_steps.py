"""`guideload` alone: what is here, and commands that work."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner
from command_line import guideload, write_trace
from unrendered import leave_unrendered

from guideload.cli.inputs import EXAMPLES
from guideload.cli.main import main

EXAMPLES_BY_KIND = {name: name for name in ("machine", "catalogue", "study", "identify")} | {
    "motion": "moves"
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    leave_unrendered(monkeypatch)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def told() -> tuple[str, list[list[str]]]:
    """The text, and the arguments of the commands that it names; every one of them ends with success."""
    text = guideload().stdout
    assert max(map(len, text.splitlines())) <= 80
    commands = [
        shlex.split(line.partition("   (")[0])[1:]
        for line in text.splitlines()
        if line.startswith("  guideload")
    ]
    assert "All commands: guideload --help" in text
    return text, commands


def run_all(commands: list[list[str]], *left_out: str) -> None:
    for arguments in commands:
        if arguments[0] not in left_out:
            ended = CliRunner().invoke(main, arguments)
            assert ended.exit_code == 0, (arguments, ended.output)


def test_step_by_step_from_an_empty_folder_to_a_life(folder: Path) -> None:
    text, commands = told()
    assert text.startswith("Here is neither") and commands[0][0] == "init"
    run_all(commands[:1])
    text, commands = told()
    assert text.startswith("Here: machine.toml (machine).")
    run_all(commands)  # it writes the moves
    moves = Path("moves.toml").read_text(encoding="utf-8")
    for long, short in (("repeat = 2", "repeat = 1"), ("1.2 m", "0.2 m"), ('dwell = "0.5 s"', "")):
        assert long in moves
        moves = moves.replace(long, short)  # `size` runs them 181 times
    Path("moves.toml").write_text(moves, encoding="utf-8")
    text, commands = told()
    assert "machine.toml (machine), moves.toml (motion)" in text and "No life yet" in text
    run_all(commands, "run")
    machine = Path("machine.toml").read_text(encoding="utf-8")
    machine = machine.replace("stiffness_y", 'product = "HGH25CA"\npreload_class = "ZA"\nstiffness_y')
    Path("machine.toml").write_text(machine, encoding="utf-8")
    text, commands = told()
    assert (
        "No life yet" not in text and ["life", "machine.toml", "moves.toml", "--life", "20000 h"] in commands
    )
    ended = CliRunner().invoke(main, [*commands[2], "--no-bands"])
    assert "carriages last" in " ".join(ended.output.split())


def test_every_kind_of_file_is_known_by_its_content(folder: Path) -> None:
    examples = {
        kind: (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")
        for kind, name in EXAMPLES_BY_KIND.items()
    }
    for name, text in (examples | {"duty": '[[cases]]\nname = "laden"\n'}).items():
        (folder / f"a {name}.toml").write_text(text, encoding="utf-8")
    found = " ".join(guideload().stdout.split())
    for name in (*examples, "duty"):
        assert f"'a {name}.toml' ({name})" in found


def test_a_record_with_a_space_in_its_name_is_judged_first(folder: Path) -> None:
    (folder / "machine.toml").write_bytes((EXAMPLES / "manipulator.toml").read_bytes())
    write_trace(folder / "a record.csv", 1200, 0.5)
    text, commands = told()
    assert ["encoder", "a record.csv"] in commands and "(record)" in text
    run_all(commands, "run", "init", "demo")


@pytest.mark.parametrize(
    ("text", "words"), [("[body]\nmass = 1", "lists what is wrong"), ("a = [", "is no valid TOML")]
)
def test_a_wrong_file_is_named(folder: Path, text: str, words: str) -> None:
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    shown, commands = told()
    assert words in shown and ["check", "machine.toml"] in commands
