"""Duty cycles: damage adds up as in one long record, and what cannot be added is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import guideload, refused, write_rated
from lives import cart, moved
from machines import with_carriages, with_mass
from moves import GENTLE
from texts import one_line

from guideload import LoadCase, duty_cycle, life_of, simulate
from guideload.base.errors import ArgumentError, ArgumentTypeError, ConfigError, LifeError
from guideload.base.number_text import rounded
from guideload.cli.inputs import EXAMPLES
from guideload.duty.duty_cycle import DutyCycle
from guideload.life.mean_load import integrals
from guideload.life.rating_life import system_life
from guideload.motion.motion import Motion
from guideload.reports.duty import duty_report

MOTION = moved(GENTLE, 500.0)


def cases(**life: Any) -> list[LoadCase]:
    machine = cart(life=life)
    return [
        LoadCase("empty", machine, MOTION, 30.0),
        LoadCase("full", with_mass(machine, 2000.0), MOTION, 45.0),
    ]


def test_a_case_in_two_parts_is_that_case() -> None:
    machine = cart()
    parts = duty_cycle([LoadCase("a", machine, MOTION, 10.0), LoadCase("b", machine, MOTION, 30.0)])
    whole = life_of(simulate(machine, MOTION))
    np.testing.assert_allclose(parts.carriage_lives, [one.life for one in whole.carriages], rtol=1e-13)
    arrays = (parts.distances, parts.damage, parts.carriage_lives, parts.mean_loads)
    arrays += (whole.carriages[0].damage, whole.carriages[0].power)
    assert not any(array.flags.writeable for array in arrays)
    assert parts.machine_life == pytest.approx(whole.machine, rel=1e-13)
    np.testing.assert_allclose(parts.shares, [0.25, 0.75], rtol=1e-13)
    once = duty_cycle([LoadCase("a", machine, MOTION, 1.0)], period=float(np.ptp(MOTION.time)))
    assert once.hours(once.machine_life) == pytest.approx(whole.hours(whole.machine), rel=1e-13)


def test_the_life_together_is_that_under_the_mean_load_of_all_cycles() -> None:
    """The integrals of P^p over all cycles, one after the other, give the mean load; the rating formula the life."""
    given = cases(reliability=0.95, life="4000 km")
    duty = duty_cycle(given)
    for k, one in enumerate(duty.carriages):
        power = path = 0.0
        for case, life in zip(given, duty.lives, strict=True):
            loads = np.ascontiguousarray(simulate(case.machine, MOTION).carriage_loads[:, k])
            found = integrals(life.record.travel, loads, one.rule, 3.0, life.record.bows[:, k])
            power, path = power + case.cycles * found[0].sum(), path + case.cycles * found[1].sum()
        assert duty.mean_loads[k] == pytest.approx((power / path) ** (1 / 3), rel=1e-12)
        assert duty.carriage_lives[k] == pytest.approx(float(one.life_under(duty.mean_loads[k])), rel=1e-12)
    assert duty.machine_life == float(system_life(duty.carriage_lives))
    assert duty.failure_probability(duty.machine_life) == pytest.approx(0.05, rel=1e-12)
    table = duty.table()
    np.testing.assert_allclose(table["share_of_damage"].groupby("carriage").sum(), 1.0, rtol=1e-13)
    name, worst = duty.worst
    assert worst.static.safety == table["static_safety"].min()
    assert table["static_safety"].idxmin() == (name, worst.name)


def test_a_life_in_cycles_counts_the_cycles_of_all_cases() -> None:
    """1800 cycles in 8 h: 5 000 000 cycles last 5e6 / 1800 * 8 h, and their travel is that of the cases."""
    machine, shift = cart(life={"life": "5e6 cycles"}), 8.0 * 3600.0
    given = [LoadCase("a", machine, MOTION, 600.0), LoadCase("b", with_mass(machine, 2000.0), MOTION, 1200.0)]
    duty = duty_cycle(given, shift)
    assert duty.wanted is not None
    assert duty.wanted == pytest.approx(5e6 * duty.lives[0].distance, rel=1e-12)
    assert duty.hours(duty.wanted) == pytest.approx(5e6 / 1800.0 * 8.0, rel=1e-12)
    alone = duty_cycle([LoadCase("a", machine, MOTION, 1800.0)], shift)
    assert alone.wanted == pytest.approx(alone.lives[0].wanted, rel=1e-12)
    again = duty_cycle([LoadCase(c.name, c.machine, c.motion, 2.0 * c.cycles) for c in given], 2.0 * shift)
    assert again.wanted == pytest.approx(duty.wanted, rel=1e-12)


def test_cycles_per_hour_are_those_of_the_cases() -> None:
    stated = duty_cycle(cases(cycles_per_hour=75.0))
    bare = duty_cycle(cases())
    assert stated.hours(stated.machine_life) == pytest.approx(bare.hours(bare.machine_life), rel=1e-12)
    with pytest.raises(ArgumentError, match=r"\[life\] states 30, but the cases run 75 cycles per hour"):
        duty_cycle(cases(cycles_per_hour=30.0))


def test_a_case_may_last_longer_than_the_mean_cycle() -> None:
    """Cycles of all cases that fit into the period are no reason to warn."""
    machine, slow = cart(life={"cycles_per_hour": 100.0}), moved(replace(GENTLE, dwell=15.0), 500.0)
    assert np.ptp(slow.time) > 36.0
    duty = duty_cycle(
        [LoadCase("short", machine, MOTION, 90.0), LoadCase("long", machine, slow, 10.0)], 3600.0
    )
    assert "for the motion, which lasts" not in one_line(duty_report(duty).text())


def test_impossible_cases_and_periods_are_refused() -> None:
    one, _ = cases()
    with pytest.raises(ArgumentError, match="a unique name of each case, got empty, empty"):
        duty_cycle([one, one])
    for period in (np.nan, np.inf, 0.0, -1.0):
        with pytest.raises(ArgumentError, match="period: expected a time above 0 s"):
            duty_cycle([one], period=period)
    for name, value in (("cycles", "3"), ("machine", None), ("motion", 1.0), ("name", 2)):
        with pytest.raises(ArgumentTypeError, match=f"^{name}: expected"):
            replace(one, **{name: value})
    with pytest.raises(ArgumentError, match="more than 0 cycles"):
        duty_cycle([replace(one, cycles=np.nan)])
    with pytest.raises(ArgumentError, match="travel: expected at least 0 m"):
        duty_cycle([one]).failure_probability(-1.0)


def test_cases_that_do_not_add_up_are_refused() -> None:
    one, other = cases()
    with pytest.raises(ArgumentError, match=r"take 529\.5 s, longer than the period of 60 s"):
        duty_cycle([one, other], period=60.0)
    judged = LoadCase("strict", cart(life={"reliability": 0.99}), MOTION, 1.0)
    with pytest.raises(
        ArgumentError, match=r"empty and strict have different conditions in the table \[life\]"
    ):
        duty_cycle([one, judged])
    partly = with_carriages(one.machine, "1a", product=None)
    with pytest.raises(ArgumentError, match="different carriages with ratings"):
        duty_cycle([one, LoadCase("partly", partly, MOTION, 1.0)])
    still = Motion.along_x([0.0, 1.0], [0.0, 0.0], velocity=[0.0, 0.0])
    with pytest.raises(LifeError, match="case still: the cart does not move"):
        duty_cycle([one, LoadCase("still", one.machine, still, 1.0)])
    with pytest.raises(ArgumentError, match="more than 0 cycles"):
        duty_cycle([LoadCase("none", one.machine, MOTION, 0.0)])


DUTY = """\
machine = "machine.toml"
period = "8 h"
[[cases]]
name = "empty"
motion = "moves.toml"
cycles = 400
[[cases]]
name = "full"
motion = "manipulator.csv"
cycles = 800
change = { body = { mass = "1500 kg" } }
reading = { smoothing = "savitzky_golay", window = "50 ms" }
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A duty file, with machine, trace and moves beside it."""
    write_rated(tmp_path)
    for name in ("manipulator.csv", "moves.toml"):
        (tmp_path / name).write_bytes((EXAMPLES / name).read_bytes())
    (tmp_path / "duty.toml").write_text(DUTY, encoding="utf-8")
    return tmp_path / "duty.toml"


@pytest.mark.parametrize(
    ("life", "words"),
    [
        ({}, "The static safety is reached."),
        ({"life": "1 km", "safety": 0.1}, "Life and static safety are reached."),
        ({"life": "1e9 km", "safety": 1e3}, "NOT REACHED: life and static safety."),
    ],
)
def test_the_verdict_is_on_what_is_asked_for(life: dict[str, Any], words: str) -> None:
    assert duty_report(duty_cycle(cases(**life))).answer[0].startswith(f"machine: {words} With")


def test_the_command_tells_life_shares_and_the_worst_case(file: Path) -> None:
    page = file.parent / "duty.html"
    text = one_line(guideload("duty", file, "--report", page).stdout)
    duty = DutyCycle.from_toml(file)
    assert duty.cases[1].machine.body.mass == 1500.0 and duty.cases[0].machine.body.mass == 1250.0
    assert f"all carriages last {' '.join(rounded(duty.hours(duty.machine_life)).split())} h" in text
    assert f"uses {100 * duty.shares.max():.1f} % of the life" in text and f"in case {duty.worst[0]}" in text
    assert "Warning: HGH25CA: not checked by a person" in text[: text.index("Cases")]
    assert "Duty cycle" in page.read_text(encoding="utf-8").replace("duty cycle", "Duty cycle")
    assert "--overwrite" in refused("duty", file, "--report", page)


def test_changes_of_a_case_leave_the_rails_as_they_are(file: Path) -> None:
    (file.parent / "rail.csv").write_text("x [m],dy [um],dz [um]\n-5,0,3\n0,1,2\n5,0,3\n", encoding="utf-8")
    text = (file.parent / "machine.toml").read_text(encoding="utf-8")
    text = text.replace('name = "1"', 'name = "1"\nstraightness_file = "rail.csv"', 1)
    (file.parent / "machine.toml").write_text(text, encoding="utf-8")
    plain, changed = (case.machine.rails for case in DutyCycle.from_toml(file).cases)
    assert plain == changed and plain[0].straightness is not None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'name = "full"',
            'name = "empty"',
            'row 8: cases[1].name: expected a unique name, got "empty"; cases[0] has it',
        ),
        ("moves.toml", "none.toml", "row 5: cases[0].motion: expected a file that exists"),
        ('machine = "machine.toml"\n', "", "cases[0]: expected a machine file"),
        ('mass = "1500 kg"', "mass = 0", "row 11: cases[1].change.body.mass: expected > 0 kg"),
        ('mass = "1500 kg"', 'weight = "1 kg"', "row 11: cases[1].change.body.weight: expected a known key"),
        (
            "manipulator.csv",
            "moves.toml",
            "row 12: cases[1].reading: expected no reading beside planned moves",
        ),
        ("cycles = 400", "cycles = 0", "row 6: cases[0].cycles: expected > 0"),
        (
            'reading = { smoothing = "savitzky_golay", window = "50 ms" }',
            "reading = { rte = 3 }",
            "cases[1].reading.rte",
        ),
    ],
)
def test_refusals_name_row_and_key(file: Path, old: str, new: str, words: str) -> None:
    file.write_text(DUTY.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        DutyCycle.from_toml(file)
    assert words in str(caught.value) and "duty.toml" in str(caught.value)
    refused("duty", file)


def test_cases_that_need_more_than_the_period_name_their_file(file: Path) -> None:
    file.write_text(DUTY.replace("8 h", "1 min"), encoding="utf-8")
    with pytest.raises(ArgumentError, match=r"duty\.toml: the cycles of all cases take .* of 60 s"):
        DutyCycle.from_toml(file)


def test_the_schema_has_the_keys_of_a_case() -> None:
    schema = json.loads(guideload("schema", "duty").stdout)
    assert {"name", "motion", "cycles", "machine", "change", "reading"} == set(
        schema["$defs"]["CaseFile"]["properties"]
    )
