"""Arguments of public functions: a wrong type is one error that names the argument, everywhere the same way."""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile_calls import outcomes

import guideload
from guideload import (
    GuideloadError,
    Machine,
    Motion,
    Moves,
    Result,
    StudyResult,
    html_report,
    read_trace,
    reports,
)
from guideload.base.arguments import checked, real_array
from guideload.base.errors import ArgumentError, ArgumentTypeError, ConfigError, ReadError, TraceError
from guideload.cli.inputs import EXAMPLES
from guideload.parameters.parameters import Parameters
from guideload.reports.life import life_report
from guideload.reports.machine import machine_report
from guideload.sensitivity import VariedMachine
from guideload.simulation.simulation import simulate
from guideload.smoothing.smoothing import smooth

GANTRY = EXAMPLES / "gantry.toml"
HUGE = 10**400


@checked
def example(number: float, names: list[str], flag: bool = False, *, count: int | None = None) -> str:
    return f"{number} {names} {flag} {count}"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("x", []), 'number: expected a number, got "x"'),
        ((True, []), "number: expected a number, got true"),
        ((1j, []), "number: expected a number, got 1j"),
        ((1, "ab"), 'names: expected a list of texts, got "ab"'),
        ((1, ["a", 2]), "names: expected a list of texts, got"),
        ((1, [], 1), "flag: expected True or False, got 1"),
        ((1, [], True, 2), "too many positional arguments"),
        ((1,), "missing a required argument: 'names'"),
    ],
)
def test_a_wrong_type_is_named(arguments: tuple[Any, ...], text: str) -> None:
    with pytest.raises(ArgumentTypeError, match=text) as refusal:
        example(*arguments)
    assert isinstance(refusal.value, TypeError) and isinstance(refusal.value, GuideloadError)


def test_numbers_of_numpy_are_numbers_and_a_number_fits_a_double() -> None:
    assert example(np.float32(0.5), ("a",), np.True_, count=np.int8(3)) == "0.5 ('a',) True 3"
    with pytest.raises(ArgumentError, match="number: expected a number that fits a double, got") as refusal:
        example(HUGE, [])
    assert not isinstance(refusal.value, ArgumentTypeError)
    with pytest.raises(ArgumentTypeError, match="count: expected a whole number or None, got 1.5"):
        example(1, [], count=1.5)


@pytest.mark.parametrize(
    "values",
    [[1j], ["1"], [None], np.ones(2) * 1j, np.array(["2024"], "M8[s]"), [True], [{}],
     np.array(["1", 2.0], object), np.array([True, 2.0], object)],
)  # fmt: skip
def test_what_is_no_real_number_is_no_array(values: Any) -> None:
    with pytest.raises(ArgumentTypeError, match="^x: expected an array of real numbers, got"):
        real_array("x", values)


def test_masked_values_are_refused() -> None:
    """NumPy drops the mask; where nothing is masked the array is one as any other."""
    values = np.ma.array([0.0, 99.0, 2.0, 3.0], mask=[0, 1, 0, 0])
    whole = np.ma.array([0.0, 1.0, 2.0, 3.0], mask=False)
    assert np.array_equal(real_array("x", whole), [0.0, 1.0, 2.0, 3.0])
    for given in (values, [values, values], [1.0, np.ma.masked]):
        with pytest.raises(ArgumentError, match="^x: expected values without a mask"):
            real_array("x", given)
    many, eight = np.ma.array(np.zeros(8), mask=[1] + [0] * 7), np.arange(8.0)
    for call in (
        lambda: Motion.along_x(whole, values),
        lambda: read_trace({"t [s]": eight, "x [m]": many}),
        lambda: read_trace(np.ma.array([eight, eight], mask=[[1] + [0] * 7, [0] * 8]).T),
        lambda: smooth(eight, many, "position"),
    ):
        with pytest.raises(ArgumentError, match="without a mask"):
            call()


def test_an_array_is_a_copy() -> None:
    given = np.arange(3.0)
    for source in (given, given[::2], given.tolist(), np.float64(1.0), given.astype(np.int8)):
        found = real_array("x", source)
        assert found.dtype == np.float64 and np.array_equal(found, source) and found.flags.c_contiguous
        assert not np.shares_memory(found, given)
    with pytest.raises(ArgumentError, match="^x: "):
        real_array("x", [[1.0], [1.0, 2.0]])
    with pytest.raises(ArgumentError, match="^x: expected numbers that fit a double"):
        real_array("x", [HUGE])


def test_every_public_function_checks_its_arguments() -> None:
    functions = {name: getattr(guideload, name) for name in guideload.__all__}
    functions = {name: one for name, one in functions.items() if inspect.isfunction(one)}
    assert len(functions) > 12
    for name, function in functions.items():
        first = next(iter(inspect.signature(function).parameters))
        with pytest.raises(ArgumentTypeError, match=f"{first}: |{name}"):
            function(object())
        with pytest.raises(ArgumentTypeError, match="unknown_argument|missing"):
            function(unknown_argument=1)


@pytest.mark.parametrize("name", ["rtol", "step", "times"])
def test_a_huge_number_of_a_run_is_refused(name: str) -> None:
    machine, motion = Machine.from_toml(GANTRY), Motion.along_x([0.0, 1.0], [0.0, 1.0])
    value = [HUGE] if name == "times" else HUGE
    with pytest.raises(ArgumentError, match=f"^{name}: expected"):
        simulate(machine, motion, method="rk45", **{name: value})


def test_values_of_a_varied_machine_and_limits_of_moves() -> None:
    machine = Machine.from_toml(GANTRY)
    assert len(list(Parameters(machine, Motion.along_x([0.0, 1.0], [0.0, 0.0]))))
    with pytest.raises(ArgumentTypeError, match="values: expected an array of real numbers, got texts"):
        VariedMachine(machine, ["body.mass"]).at("x")
    moves = Moves.from_toml(EXAMPLES / "moves.toml")
    with pytest.raises(ArgumentError, match='name: expected one of speed, .*, got "nope"'):
        moves.with_limit("nope", 2)


def test_a_file_that_cannot_be_read_is_one_kind_of_error(tmp_path: Path) -> None:
    missing = tmp_path / "missing.csv"
    for read in (read_trace, Result.load, StudyResult.load, Machine.from_toml, Moves.from_toml):
        with pytest.raises(ReadError, match="missing.csv"):
            read(missing)
    with pytest.raises(TraceError):
        read_trace(missing)
    with pytest.raises(ConfigError):
        Machine.from_toml(missing)


def test_hostile_values_of_every_argument_are_answered_or_refused(tmp_path: Path) -> None:
    found = list(outcomes(tmp_path))
    wrong = [one for one in found if one[3] not in ("answered", "refused")]
    assert wrong == []
    assert all(
        outcome == "answered" for _, key, _, outcome in found if not key
    )  # the calls themselves are valid
    counts = Counter(outcome for *_, outcome in found)
    assert counts["refused"] > 5000 and counts["answered"] > 200


REPORTS = (reports.result_report, reports.comparison_report, life_report, machine_report)
PAGES = (html_report.run_page, html_report.comparison_page)


@pytest.mark.parametrize("function", [*REPORTS, *PAGES])
def test_reports_and_pages_check_their_arguments(function: Callable[[Any], Any]) -> None:
    with pytest.raises(ArgumentTypeError, match="expected a.*, got 3"):
        function(3)
