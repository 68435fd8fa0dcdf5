"""Public functions for programs that show guideload to a user: files as text, templates, schemas, reports."""

from pathlib import Path

import pytest
from command_line import EXAMPLES

import guideload
from guideload import ArgumentError, ConfigError, Machine, Moves, Study
from guideload.base.atomic import atomic_folder, atomic_write
from guideload.base.errors import ArgumentTypeError, WriteError
from guideload.base.methods import CHOICES, METHODS


def test_each_integration_method_of_a_run_has_its_row() -> None:
    assert CHOICES == ("auto", *METHODS)


@pytest.mark.parametrize("kind", ["two-rails", "one-rail", "gantry", "vertical", "manipulator"])
def test_the_machine_of_a_text_is_that_of_the_saved_file(kind: str, tmp_path: Path) -> None:
    text, file = guideload.file_template(kind), tmp_path / "machine.toml"
    file.write_text(text, encoding="utf-8")
    assert Machine.from_text(text, file) == Machine.from_toml(file)


def test_the_moves_of_a_text_are_those_of_the_saved_file() -> None:
    text = guideload.file_template("moves")
    assert Moves.from_text(text) == Moves.from_toml(EXAMPLES / "moves.toml")
    assert Moves.from_text(text, "own.toml").motion().source == "own.toml"


@pytest.mark.parametrize("reader", [Machine, Moves])
def test_a_text_that_is_no_toml_is_refused_with_its_row(reader: type[Machine] | type[Moves]) -> None:
    with pytest.raises(ConfigError, match=r"^its.toml, row 2: expected TOML"):
        reader.from_text("a = 1\nb =\n", "its.toml")


def test_names_of_files_in_a_text_are_relative_to_its_folder(tmp_path: Path) -> None:
    text = guideload.file_template("one-rail").replace(
        'name = "A"', 'name = "A"\nstraightness_file = "profile.csv"'
    )
    (tmp_path / "profile.csv").write_text("x [mm],dy [um],dz [um]\n-500,0,0\n0,9,0\n500,0,0\n")
    profile = Machine.from_text(text, tmp_path / "machine.toml").rails[0].straightness
    assert profile is not None and len(profile) == 3


def test_an_unknown_template_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ArgumentError, match="kind: expected one of two-rails, one-rail, .* got 'sun'"):
        guideload.file_template("sun")


def test_an_unknown_kind_of_file_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ArgumentError, match='kind: expected one of machine, .* got "sun"'):
        guideload.file_schema("sun")  # type: ignore[arg-type]


def test_a_path_with_a_null_character_is_named() -> None:
    for read in (Machine.from_toml, Moves.from_toml):
        with pytest.raises(ConfigError, match="a name with a NUL character"):
            read("a\0b.toml")
    for write in (atomic_write(Path("a\0b")), atomic_folder(Path("a\0b"), list, lambda *_: None)):
        with pytest.raises(WriteError, match=r"^a\\x00b: cannot be written: .* no NUL character"), write:
            pass
    with pytest.raises(ArgumentTypeError, match="^file: expected text or a path, got 3"):
        Study.from_toml(3)  # type: ignore[arg-type]
