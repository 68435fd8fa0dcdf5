"""`guideload identify`: from an identify file to a machine and a study file that the program reads."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import guideload, refused
from hammer_tests import CORNERS, hammer_test, in_toml, unknown

from guideload import Machine, Study
from guideload.identification.model import Model
from guideload.identification.unknowns import UnknownTable

MOVES = '[[moves]]\ndistance = "0.1 m"\n[limits]\nspeed = "0.5 m/s"\nacceleration = "2 m/s^2"\njerk = "50 m/s^3"\n'
UNKNOWN = """
[[unknown]]
path = "carriages.*.stiffness_y"
each = "carriage"
[[unknown]]
path = "carriages.*.stiffness_z"
each = "carriage"
[[unknown]]
name = "damping"
path = ["carriages.*.damping_y", "carriages.*.damping_z"]
"""
TABLES = (
    UnknownTable(path="carriages.*.stiffness_y", each="carriage"),
    UnknownTable(path="carriages.*.stiffness_z", each="carriage"),
    UnknownTable(path=("carriages.*.damping_y", "carriages.*.damping_z"), name="damping"),
)
TRUTH = np.array([-0.3, -0.45, -0.2, -0.5, -0.3, -0.6, -0.3, -0.6, -0.4])
TRUE_Y = 120e6 * np.exp(TRUTH[:4])  # N/m


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An identify file of a hammer test with 1 % noise, with its machine, a motion, and what the command wrote."""
    folder = tmp_path_factory.mktemp("identify")
    points = "".join(f'\n[[points]]\nname = "p{i}"\nat = {list(at)}\n' for i, at in enumerate(CORNERS))
    text = (Path(__file__).parents[1] / "data" / "cart.toml").read_text(encoding="utf-8")
    (folder / "machine.toml").write_text(text + points, encoding="utf-8")
    (folder / "moves.toml").write_text(MOVES, encoding="utf-8")
    machine = Machine.from_toml(folder / "machine.toml")
    model = Model(machine, unknown(machine, *TABLES))
    test = hammer_test(
        model, TRUTH, np.random.default_rng(5), noise=(0.01, 0.01, 0.01), levels=(0.01, 0.01, 0.01)
    )
    head = 'machine = "machine.toml"\ntrace = "moves.toml"\n'
    (folder / "identify.toml").write_text(head + UNKNOWN + in_toml(test), encoding="utf-8")
    shown = guideload("identify", folder / "identify.toml", "-o", folder / "out", "--no-pictures").stdout
    (folder / "shown.txt").write_text(shown, encoding="utf-8")
    return folder


def test_stiffnesses_within_3_percent_and_the_pair_that_cannot_be_separated(folder: Path) -> None:
    """Springs along z at one x act alike, wherever they are across: only their sum can be identified."""
    found = json.loads((folder / "out" / "identification.json").read_text(encoding="utf-8"))
    identified = {one["name"]: one["value"] for one in found["estimates"] if one["is_identified"]}
    errors = [
        identified[f"carriages[{name}].stiffness_y"] for name in ("1a", "1b", "2a", "2b")
    ] / TRUE_Y - 1.0
    assert np.sqrt(np.mean(errors**2)) < 0.03
    assert len(identified) == 5
    words = [one["words"] for one in found["undetermined"]]
    assert words[0].startswith("stiffness_z of carriages 1a and 2a: only their sum, ")
    assert float(words[0].split()[-5]) == pytest.approx(240 * np.exp(-0.3), rel=0.03)
    shown = (folder / "shown.txt").read_text(encoding="utf-8")
    assert words[1] in " ".join(shown.split()) and "5 of 9 numbers identified" in shown


def test_the_machine_file_keeps_its_text_and_has_the_values(folder: Path) -> None:
    before = (folder / "machine.toml").read_text(encoding="utf-8").splitlines()
    after = (folder / "out" / "machine.toml").read_text(encoding="utf-8").splitlines()
    changed = [new for old, new in zip(before, after, strict=True) if old != new]
    assert len(changed) == 16 and all(
        "from hammer test" in row or "NOT identified by" in row for row in changed
    )
    machine = Machine.from_toml(folder / "out" / "machine.toml")
    found = json.loads((folder / "out" / "identification.json").read_text(encoding="utf-8"))
    value = next(one["value"] for one in found["estimates"] if one["name"] == "damping")
    assert [one.damping_z for one in machine.carriages] == pytest.approx([value] * 4, rel=1e-5)


def test_the_study_draws_what_the_data_left_uncertain(folder: Path) -> None:
    """Medians and spreads of the draws, and the sum that is known far better than its parts."""
    study = Study.from_toml(folder / "out" / "study.toml")
    plan = study.plan()
    drawn = plan.values(0, plan.runs)
    names = [one.name for one in plan.metadata.parameters]
    pair = [names.index(f"carriages[{name}].stiffness_z") for name in ("1a", "2a")]
    parts = drawn[:, pair]
    assert np.std(np.log(parts), axis=0).min() > 0.4
    assert (
        np.std(parts.sum(axis=1)) / np.mean(parts.sum(axis=1))
        < np.std(parts[:, 0]) / np.mean(parts[:, 0]) / 2
    )


ALTERNATIVE = """[[alternatives]]
name = "other"
[[alternatives.unknown]]
path = "body.masss"
[[modal_tests]]"""
AS_ABOVE = """[[alternatives]]
name = "as above"
machine = "machine.toml"
[[modal_tests]]"""
NEXT = """
[[candidates]]
kind = "record"
motion = "moves.toml"
at = ["p4 y", "p4 x"]
accuracy = "0.05 m/s^2"
[[candidates]]
kind = "record"
motion = "moves.toml"
sensor = "load"
at = ["1a Fz"]
accuracy = "5 N"
[figure]
quantity = "peak_resultant"
motion = "moves.toml"
"""


def test_measurements_are_ranked_by_a_peak_load(folder: Path) -> None:
    """With its value and interval now; the file of its motion or duty must exist."""
    text = (folder / "identify.toml").read_text(encoding="utf-8") + NEXT
    (folder / "next.toml").write_text(text, encoding="utf-8")
    shown = " ".join(guideload("identify", folder / "next.toml").stdout.split())
    assert "Interval: uncertainty of peak load of carriage" in shown
    assert "load of 1a Fz under moves.toml" in shown and shown.count("acceleration of p4") == 2
    assert re.search(
        r"Now the peak load of carriage \w+ is \d+ N, and with a probability of 95 % from", shown
    )
    wrong = text.replace('"peak_resultant"\nmotion = "moves.toml"', '"life"\nduty = "none.toml"')
    (folder / "wrong.toml").write_text(wrong, encoding="utf-8")
    assert "figure.duty: expected a file that exists" in refused("identify", folder / "wrong.toml")


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('"p0 y"', '"p9 y"', "modal_tests[0]: expected a point and an axis"),
        ("frequency_noise = ", 'frequency_noise = "-1 %"#', "modal_tests[0].frequency_noise: expected > 0"),
        ("*.stiffness_y", "*.stifness_y", "unknown[0].path: expected a known path"),
        ("*.stiffness_z", "*.stiffness_y", "unknown[1].path: expected one entry for each value"),
        ('"damping"', '"carriages[1a].stiffness_y"', "unknown[2].name: expected a unique name"),
        ("[[unknown]]", 'figure = "damping"\n[[unknown]]', "expected no figure without [[candidates]]"),
        ('machine = "machine', 'machine = "none', "machine: expected a file that exists"),
        ("[[modal_tests]]", ALTERNATIVE, "alternatives[0].unknown[0].path: expected a known path"),
        ("[[modal_tests]]", AS_ABOVE, "alternatives: expected each name once"),
        ("frequency = ", "number = 99\nfrequency = ", "modal_tests[0]: expected at most 5, the modes"),
    ],
)
def test_a_wrong_file_is_refused_with_its_row_and_key(
    folder: Path, before: str, after: str, words: str
) -> None:
    text = (folder / "identify.toml").read_text(encoding="utf-8")
    (folder / "wrong.toml").write_text(text.replace(before, after, 1), encoding="utf-8")
    message = refused("identify", folder / "wrong.toml")
    assert words in message and re.search(r"wrong\.toml(, row \d+)?: ", message)
    if "path" in words:
        place = text.index(before) + max(after.find("path"), 0)
        row = 1 + text.replace(before, after, 1)[:place].count("\n")
        assert f"wrong.toml, row {row}: {words.partition(':')[0]}: " in message
