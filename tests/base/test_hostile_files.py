"""Files that are too deep, too long, too many or meant to mislead: each is refused with its row, in linear work."""

import re
import sys
from pathlib import Path

import pytest
from command_line import MACHINE, guideload

from guideload.base import toml
from guideload.base.errors import MOST_PROBLEMS, ConfigError, ValueRefused, shown
from guideload.base.units import factor, quantity
from guideload.base.visible_text import HIDDEN, visible
from guideload.machine.machine import Machine

GOOD = Path(MACHINE).read_text(encoding="utf-8")


def refused(folder: Path, text: str) -> ConfigError:
    file = folder / "machine.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        Machine.from_toml(file)
    assert str(caught.value).startswith(f"{file}, row ")
    return caught.value


@pytest.mark.parametrize(
    "row",
    [
        "a = " + "[" * 5000 + "]" * 5000,
        "a = " + "[" * 5000,
        "a = " + "{b=" * 5000 + "1" + "}" * 5000,
        ".".join("a" * 20_000) + " = 1",
        "[" + ".".join("a" * 20_000) + "]",
        "[" + " . ".join(['"a"'] * 20_000) + "]",
        "a = " + "9" * 5000,
        "a" * 5000 + " = 1",
        "a = " + "[" * 30 + "]" * 30,
    ],
    ids=lambda row: f"{row[:12]}...",
)
def test_what_is_nested_too_deep_or_too_long_is_refused_with_its_row(tmp_path: Path, row: str) -> None:
    error = refused(tmp_path, f'name = "x"\n{row}\n')
    assert error.row == 2
    assert "at most 20 levels" in str(error) or "at most 1000 characters" in str(error)


def test_a_string_may_hold_brackets_and_dots(tmp_path: Path) -> None:
    name = "[" * 100 + "." * 100 + "x" * 2000
    file = tmp_path / "machine.toml"
    for quotes in ('"', '"""', "'", "'''"):
        written = f"name = {quotes}{name}{quotes}\n"
        file.write_text(written + GOOD[GOOD.index("[body]") :], encoding="utf-8")
        assert Machine.from_toml(file).name == name


def test_no_character_is_read_twice() -> None:
    """The tokens cover the text in order: also strings that never end, of which each could be searched to its end."""
    for text in ('"""\n' + 'x\\"""\n' * 3000, "'''\n" + "'\n" * 3000, '"\n' * 3000, '"""a\\"""b' * 3000):
        tokens = list(toml.TOKEN.finditer(text))
        assert sum(match.end() - match.start() for match in tokens) == len(text)


def test_all_problems_are_counted_and_the_first_described(tmp_path: Path) -> None:
    count = 300
    many = "".join(f"key_{i} = {i}\n" for i in range(count))
    error = refused(tmp_path, many + GOOD)
    assert (len(error.problems), error.others) == (MOST_PROBLEMS, count - MOST_PROBLEMS)
    assert str(error).endswith(f"\nand {count - MOST_PROBLEMS} more problems")
    assert [problem.row for problem in error.problems] == list(range(1, MOST_PROBLEMS + 1))
    lost = re.sub(r'^rail = "', 'rail = "no such ', GOOD, flags=re.MULTILINE)
    assert all("expected a rail's name" in str(problem) for problem in [refused(tmp_path, lost)])
    one_more = refused(tmp_path, "".join(f"key_{i} = 1\n" for i in range(MOST_PROBLEMS + 1)) + GOOD)
    assert str(one_more).endswith("\nand 1 more problem")


def test_rows_of_a_long_file_are_those_of_its_text(tmp_path: Path) -> None:
    rows = [f"key_{i} = [{i},\n  {{ a = 1.5 }}]" for i in range(2000)]
    file = tmp_path / "machine.toml"
    file.write_text("\n".join(rows), encoding="utf-8")
    _, places = toml.read_toml(file)
    lines = file.read_text(encoding="utf-8").split("\n")
    for i in range(2000):
        assert lines[places[f"key_{i}",].row - 1].startswith(f"key_{i} =")
        assert "a = 1.5" in lines[places[f"key_{i}", 1, "a"].row - 1]


@pytest.mark.parametrize(
    "value", ["1 m" * 1000, "1 " + "m " * 1000, "1 " + "m*" * 1000 + "m", "1" * 10_000 + " m"]
)
def test_a_value_with_too_many_units_is_refused(tmp_path: Path, value: str) -> None:
    with pytest.raises(ValueRefused, match="at most 100 characters"):
        quantity(value, "m")
    with pytest.raises(ValueRefused):
        factor(value, "m")
    error = refused(tmp_path, GOOD.replace('mass = "1250 kg"', f'mass = "{value}"'))
    assert error.key == "body.mass" and len(str(error)) < 600


def test_the_longest_units_are_understood() -> None:
    unit = "m" + " m" * 40
    assert len(unit) < 90 and quantity(f"2 {unit}", unit) == 2.0


@pytest.mark.parametrize("depth", [50, sys.getrecursionlimit() * 3])
def test_any_value_can_be_shown(depth: int) -> None:
    nested: list[object] = []
    for _ in range(depth):
        nested = [nested]
    for value in (nested, 10**5000, {(1, 2): 3}, "\x1b[2J\u202e" * 100):
        assert len(shown(value)) <= 80 and not HIDDEN.search(shown(value))


def test_hidden_characters_are_escaped_and_no_others() -> None:
    assert visible("\x1b]0;x\x07 \x9b \u202eb \udcff \x00") == r"\x1b]0;x\x07 \x9b \u202eb \udcff \x00"
    for text in ("Wägen 轨道 نص 👩‍👩‍👧", "two\nrows\twith a tab"):
        assert visible(text) == text


def test_an_error_echoes_no_control_character(tmp_path: Path) -> None:
    syntax = "name = \x1b]0;owned\x07\n", 'name = "\u202ea" b\n', "a = \x9b\n", "a\x00 = 1\n"
    for text in (*syntax, '"\\u001b[2J" = 1\n' + GOOD, "'\u202e' = 1\n" + GOOD):
        error = refused(tmp_path, text)
        assert error.row == 1 and not HIDDEN.search(str(error).replace("\n", ""))


def test_names_of_files_are_escaped(tmp_path: Path) -> None:
    file = tmp_path / "a\x1b[31m\u202e\udcff.toml"
    folder = file.parent / "x\x1b" / "y"
    for arguments in (("check", file), ("run", file, file, "-o", tmp_path / "out"), ("init", folder)):
        message = guideload(*arguments, code=2).stderr
        assert r"\x1b" in message and not HIDDEN.search(message.replace("\n", ""))
