"""How machines and results look in a notebook: their numbers in a table, names escaped."""

import re

import lives
import studies
from moves import GENTLE

import guideload
from guideload.base.number_text import digits


def test_a_notebook_shows_the_table_of_each_object() -> None:
    result = guideload.simulate(lives.cart(), lives.moved(GENTLE))
    life = guideload.life_of(result)
    for shown, table in ((result, result.peaks()), (life, life.table())):
        cells = re.findall(r"<t[hd]>([^<]*)</t[hd]>", shown._repr_html_())
        numbers = table.select_dtypes("number").to_numpy().ravel()
        assert {*table.index, *(digits(value, 4) for value in numbers)} <= {*cells}


def test_a_study_shows_its_summary() -> None:
    result = studies.study(200)
    assert all(f">{name}<" in result._repr_html_() for name, _ in result.summary().index)


def test_names_are_text() -> None:
    machine = lives.cart().model_copy(update={"name": "<b>axis & co</b>"})
    assert "<b>" not in machine._repr_html_() and "&lt;b&gt;axis &amp; co" in machine._repr_html_()


def test_a_result_without_carriages_is_a_line() -> None:
    links = [
        guideload.Link(name=name, point=point, direction=direction, stiffness=1e8, damping=1e4)
        for name, point, direction in (
            ("1", (0.3, 0, 0.3), (0, 1, 0)),
            ("2", (0.3, 0, -0.3), (0, 1, 0)),
            ("3", (-0.3, 0, 0.3), (0, 1, 0)),
            ("4", (0.3, 0, 0), (0, 0, 1)),
            ("5", (-0.3, 0, 0), (0, 0, 1)),
        )
    ]
    machine = lives.cart().model_copy(update={"carriages": (), "rails": (), "links": tuple(links)})
    shown = guideload.simulate(machine, lives.moved(GENTLE))._repr_html_()
    assert "<table" not in shown and "largest load" in shown
