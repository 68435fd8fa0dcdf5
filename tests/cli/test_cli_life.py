"""The commands life and catalogue, and life in the report of a run."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest
from command_line import TRACE, guideload, write_rated
from unrendered import leave_unrendered

from guideload.base.number_text import kilometres, rounded
from guideload.catalogue.conditions import RuleName
from guideload.cli.inputs import EXAMPLES
from guideload.cli.options import RULES
from guideload.life.life import life_of
from guideload.machine.machine import Machine
from guideload.reports.life import life_report
from guideload.simulation.simulation import simulate
from guideload.traces.reading import motion_from_trace, read_trace

CATALOGUE = EXAMPLES / "catalogue.toml"


@pytest.fixture(scope="module")
def machine_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The packaged example with products."""
    return write_rated(tmp_path_factory.mktemp("machine"))


def test_rules_on_the_command_line_are_those_of_a_file() -> None:
    assert get_args(RuleName) == RULES


def test_life_tells_the_answer_with_its_band_and_draws_the_rails(machine_file: Path, tmp_path: Path) -> None:
    picture = tmp_path / "rails.png"
    options = ("--rule", "hiwin", "--life", "90000 km", "--reliability", "0.95", "-o", picture)
    text = guideload("life", machine_file, TRACE, *options).stdout
    assert picture.stat().st_size > 10_000
    machine = Machine.from_toml(machine_file)
    conditions = machine.life.model_copy(update={"rule": "hiwin", "reliability": 0.95, "life": "90000 km"})
    life = life_of(simulate(machine, motion_from_trace(read_trace(TRACE), machine.drive)), conditions)
    assert life_report(life).text() in text
    band = life.band
    assert band is not None and (band.lower < band.upper).all()
    for one, low, high in zip(life.carriages, band.lower, band.upper, strict=True):
        assert 0.5 * low < one.life < 2.0 * high
    words = " ".join(text.split())
    hours, wanted = (rounded(life.hours(travel)) for travel in (life.machine, 9e7))
    answer = (
        f"last {hours} h if the motion repeats at once (wanted: {kilometres(9e7)} km, {wanted} h), that is"
    )
    assert answer in " ".join(text.split("\n"))
    assert "NOT REACHED: life." in words and "HIWIN" in words


def test_a_run_tells_life_if_its_carriages_name_products(
    machine_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_unrendered(monkeypatch)

    def run(machine: Path, name: str) -> tuple[str, str]:
        """The text of a run in one row, and the first box of its HTML report."""
        page = tmp_path / f"{name}.html"
        text = guideload(
            "run", machine, TRACE, "-o", tmp_path / name, "--no-pictures", "--report", page
        ).stdout
        box = page.read_text(encoding="utf-8").partition('<div class="answer')[2].partition("</div>")[0]
        return " ".join(text.split()), box

    text, box = run(machine_file, "out")
    assert "Life and static safety" in text and "HGH25CA" in text
    assert 'least for application "normal"' in text
    # Warned: values of the product were not compared with the maker's page.
    assert box.startswith(' warned">') and "The static safety is reached." in box
    file = machine_file.with_name("thomson.toml")
    file.write_text(machine_file.read_text(encoding="utf-8") + '[life]\nrule = "rexroth"\n', encoding="utf-8")
    text, box = run(file, "other")
    assert "Life and static safety are not computed: carriage 1a carries a " in text
    assert box.startswith(' warned">') and "are not computed: carriage 1a" in box


def test_check_shows_the_products(machine_file: Path) -> None:
    text = " ".join(guideload("check", machine_file).stdout.split())
    assert "product HGH25CA (HIWIN; C 34.9 kN for 50 km, C0 52.8 kN): carriage 1a, 1b, 2a and 2b" in text


def test_init_writes_a_catalogue_that_check_and_show_take(tmp_path: Path) -> None:
    file = tmp_path / "catalogue.toml"
    guideload("init", "--catalogue", file)
    assert "4 products, all valid" in guideload("catalogue", "check", file).stdout
    assert "HSR35LA" in guideload("catalogue", "show", file).stdout
    shown = guideload("catalogue", "show", file, "HGH25CA").stdout
    assert "static: 52\u202f800" in shown and "end seal" in shown
    assert shown.count("not compared with the source") == 1
