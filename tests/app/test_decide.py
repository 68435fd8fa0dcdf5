"""Candidates that hold come first; one that is taken into the machine file gives the machine that sizing has run."""

import pytest

pytest.importorskip("nicegui", reason="the extra guideload[app] is not installed")

import guideload
from guideload.app.decide_view import holding_first, product_changes
from guideload.app.document import with_values


@pytest.mark.parametrize(
    ("kind", "product"),
    [
        ("two-rails", "HGH25CA"),
        ("one-rail", "HGH25CA"),
        ("gantry", "HGH25CA"),
        ("vertical", "HGH25CA"),
        ("manipulator", "HGH25CA"),
        ("two-rails", "MGN12H"),
        ("two-rails", "SHS30V"),
    ],
)
def test_a_product_that_is_taken_gives_the_machine_of_its_candidate(kind: str, product: str) -> None:
    text = guideload.file_template(kind)
    machine = guideload.Machine.from_text(text)
    motion = guideload.Moves.from_text(guideload.file_template("moves").replace("2048", "512")).motion()
    found = guideload.sizing.size(machine, motion, guideload.packaged_catalogue(), products=[product])
    for candidate in found.candidates:
        assert candidate.machine is not None
        taken = guideload.Machine.from_text(with_values(text, product_changes(candidate)))
        life = guideload.life_of(guideload.simulate(taken, motion))
        # The damping is written with six digits.
        assert life.machine == pytest.approx(candidate.life, rel=1e-4)
        assert taken.carriages[0].laws == candidate.machine.carriages[0].laws


def test_candidates_that_hold_come_first_and_each_group_keeps_the_ranking() -> None:
    text = with_values(guideload.file_template("two-rails"), {("life", "life"): "20000 h"})
    machine = guideload.Machine.from_text(text)
    motion = guideload.Moves.from_text(guideload.file_template("moves").replace("2048", "512")).motion()
    found = guideload.sizing.size(machine, motion, guideload.packaged_catalogue(), products=["HIWIN 20"])
    shown = holding_first(found)
    holds = [one.holds for one in shown.candidates]
    assert True in holds and False in holds and holds == sorted(holds, reverse=True)
    for group in (True, False):
        assert [one for one in shown.candidates if one.holds is group] == [
            one for one in found.candidates if one.holds is group
        ]
    assert shown.smallest is found.smallest is shown.candidates[0]
    answers = [guideload.reports.sizing_report(machine, one).answer for one in (found, shown)]
    assert answers[0] == answers[1]
