"""The JSON schema of machine and study files: the packaged examples are valid, what the program refuses is not."""

import json
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from jsonschema import Draft202012Validator

from guideload.cli.inputs import EXAMPLES
from guideload.cli.main import main

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


FILES = {
    "machine.toml": "machine",
    "manipulator.toml": "machine",
    "study.toml": "study",
    "catalogue.toml": "catalogue",
    "moves.toml": "motion",
    "gantry.toml": "machine",
    "identify.toml": "identify",
}


@cache
def schema(kind: str) -> Draft202012Validator:
    printed = CliRunner().invoke(main, ["schema", kind], catch_exceptions=False)
    Draft202012Validator.check_schema(json.loads(printed.stdout))
    return Draft202012Validator(json.loads(printed.stdout))


@pytest.mark.parametrize(("name", "kind"), FILES.items())
def test_packaged_files_are_valid(name: str, kind: str) -> None:
    values = tomllib.loads((EXAMPLES / name).read_text(encoding="utf-8"))
    assert not list(schema(kind).iter_errors(values))


def test_packaged_catalogues_are_valid() -> None:
    for file in (EXAMPLES.parent / "catalogues").glob("*.toml"):
        assert not list(schema("catalogue").iter_errors(tomllib.loads(file.read_text(encoding="utf-8"))))


@pytest.mark.parametrize(
    ("arguments", "kind", "name"),
    [
        ([], "machine", "machine"),
        (["--study"], "study", "study"),
        (["--moves"], "motion", "moves"),
        (["--catalogue"], "catalogue", "catalogue"),
    ],
    ids=["machine", "study", "motion", "catalogue"],
)
def test_the_file_that_init_writes_is_valid(
    arguments: list[str], kind: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    CliRunner().invoke(main, ["init", *arguments], catch_exceptions=False)
    values = tomllib.loads((tmp_path / f"{name}.toml").read_text(encoding="utf-8"))
    assert not list(schema(kind).iter_errors(values))


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("machine", {"gravitiy": [0, -9.81, 0]}),
        ("machine", {"free": ["y", "w"]}),
        ("machine", {"body": {"mass": "1 kg"}}),
        (
            "machine",
            {"body": {"mass": 0, "center_of_mass": [0, 0, 0], "inertia": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}},
        ),
        ("machine", {"rails": [{"name": "1", "position": [0, 0, 0]}]}),
        ("machine", {"life": {"rule": "best"}}),
        ("machine", {"life": {"life": 20000}}),
        ("catalogue", {"products": [{"name": "p"}]}),
        ("study", {"sample": 10}),
        ("study", {"samples": 1.5}),
        ("study", {"life": {"rating": "27 kN"}}),
        ("motion", {"repeats": 2}),
        ("motion", {"repeat": 0}),
        ("motion", {"repeat": 1.5}),
        ("motion", {"moves": []}),
        ("motion", {"moves": [{"distance": 1, "profile": "triangle"}]}),
        ("motion", {"limits": {"speed": 0}}),
        ("study", {"vary": [{"path": "body.mass", "distribution": "gaussian"}]}),
        ("duty", {"cases": [{"name": "a", "motion": "m.toml", "cycles": 1, "change": {"mass": 1}}]}),
        ("duty", {"cases": [{"name": "a", "motion": "m.toml", "cycles": 1, "change": "mass"}]}),
    ],
    ids=str,
)
def test_what_the_program_refuses_is_not_valid(kind: str, change: dict[str, Any]) -> None:
    names = {"machine": "manipulator", "study": "study", "motion": "moves", "catalogue": "catalogue"}
    file = EXAMPLES / f"{names[kind]}.toml" if kind in names else None
    values = tomllib.loads(file.read_text(encoding="utf-8")) if file else {}
    assert list(schema(kind).iter_errors(values | change))


@pytest.mark.parametrize(
    "change", [{"body": {"mass": "1400 kg"}}, {"free": ["y"]}, {"carriages": [{"name": "a"}], "name": "b"}]
)
def test_a_change_of_a_duty_file_has_the_form_of_a_machine_file(change: dict[str, Any]) -> None:
    case = {"name": "a", "motion": "moves.toml", "cycles": 900, "change": change}
    assert not list(schema("duty").iter_errors({"machine": "machine.toml", "cases": [case]}))


def test_a_number_tells_its_unit_and_may_be_text() -> None:
    length = schema("machine").schema["$defs"]["Carriage"]["properties"]["length"]
    assert length["type"] == ["number", "string"]
    assert length["description"].endswith("[m]")
    assert length["exclusiveMinimum"] == 0
