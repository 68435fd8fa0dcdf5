"""What the page computes is what the command line computes, and one run at a time."""

import asyncio
import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("tomlkit", reason="the extra guideload[app] is not installed")

from app_folder import PRODUCTS, write_project

import guideload
from guideload.app import document
from guideload.app.answer import Answer, Refusal, Solver
from guideload.app.envelope import BUCKETS, envelope
from guideload.app.files import Folder
from guideload.app.hub import Hub
from guideload.app.runner import SHORT, Runner
from guideload.app.state import Session, State


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(Folder(write_project(tmp_path)))


def answered(session: Session) -> Answer:
    solver = Solver(session)
    answer = solver.answer(session.state, lambda name: None)
    assert isinstance(answer, Answer)
    whole = solver.judged(answer, lambda name: None)
    assert isinstance(whole, Answer)
    return whole


def refused(session: Session) -> Refusal:
    answer = Solver(session).answer(session.state, lambda name: None)
    assert isinstance(answer, Refusal)
    return answer


def test_the_figures_are_those_of_the_library(session: Session) -> None:
    session.set("machine", PRODUCTS | {("life", "life"): "100000 h"})
    answer = answered(session)
    machine = guideload.Machine.from_text(session.state.machine)
    result = guideload.simulate(machine, guideload.Moves.from_text(session.state.moves).motion())
    life = guideload.life_of(result)
    figures = answer.figures
    assert isinstance(figures.life, guideload.Life) and figures.life.machine == life.machine
    instant, place = answer.peak
    assert answer.loads[instant, place] == result.quantities["resultant"].max()
    peaks = result.peaks()["peak_resultant_N"]
    assert answer.names[place] == peaks.idxmax()
    shown = figures.figures[0].value.removesuffix(" N").replace("\N{NARROW NO-BREAK SPACE}", "")
    assert float(shown) == pytest.approx(peaks.max(), abs=0.5)
    assert figures.margins == guideload.sizing.margins_of(life).ratios
    assert answer.report is not None
    assert answer.report.text() == guideload.reports.result_report(result).text()
    level, words = answer.verdict
    assert (level == "bad") == (not life.holds) and ("Does not hold" in words) == (not life.holds)


def test_a_wrong_value_is_refused_in_the_words_of_the_command_line(session: Session) -> None:
    session.set("machine", {("body", "mass"): "12 kN", ("carriages", 1, "x"): "far"})
    found = refused(session)
    assert {one.path for one in found.problems} == {("body", "mass"), ("carriages", 1, "x")}
    with pytest.raises(guideload.ConfigError) as error:
        guideload.Machine.from_text(session.state.machine)
    assert "\n".join(one.text for one in found.problems) == str(error.value)


def test_words_in_place_of_a_product_are_refused_with_the_products_that_have_them(session: Session) -> None:
    path = ("carriages", 1, "product")
    session.set("machine", {path: "HIWIN 25", (*path[:2], "preload_class"): "ZA"})
    (problem,) = refused(session).problems
    named = problem.text.partition("did you mean")[2]
    assert problem.path == path and '"HGH25CA"' in named and '"HGH20CA"' not in named


def test_a_length_that_no_machine_has_is_warned_of(session: Session) -> None:
    """As `guideload check` warns: of a number in mm that was read in m."""
    session.set("machine", {("carriages", 1, "x"): "300 m"})
    report = answered(session).report
    assert report is not None and "carriages[1].x is 300 m, beyond 20 m: is it in mm?" in str(report.warnings)


def test_files_that_a_machine_in_a_folder_names_are_beside_it(tmp_path: Path) -> None:
    text = guideload.file_template("one-rail").replace(
        'name = "A"', 'name = "A"\nstraightness_file = "profile.csv"'
    )
    (tmp_path / "axis").mkdir()
    (tmp_path / "axis" / "machine.toml").write_text(text)
    session = Session(Folder(tmp_path), "axis/machine.toml", "axis/moves.toml")
    assert "axis/machine.toml, row" in refused(session).problems[0].text
    (tmp_path / "axis" / "profile.csv").write_text("x [mm],dy [um],dz [um]\n-9000,0,0\n0,9,0\n9000,0,0\n")
    assert answered(session).machine.rails[0].straightness is not None


def test_a_rider_that_moves_is_refused_rather_than_left_at_rest(session: Session) -> None:
    tensor = [[0.5, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.3]]
    rider = {"name": "slide", "mass": "25 kg", "center_of_mass": [0.0, 0.3, 0.0], "inertia": tensor}
    session.add("machine", "riders", rider | {"direction": [0, 0, 1]})
    assert answered(session).machine.riders[0].motion is None
    session.set("machine", {("riders", 0, "motion"): "slide.toml"})
    assert "the page moves no riders" in refused(session).problems[0].text


def test_wrong_moves_and_traces_are_told_apart(session: Session) -> None:
    session.set("moves", {("moves", 0, "distance"): "1 kg"})
    assert [(one.part, one.path) for one in refused(session).problems] == [
        ("moves", ("moves", 0, "distance"))
    ]
    (session.folder.root / "broken.csv").write_text("time,speed\n0,1\n0,x\n")
    session.change(replace(session.state, trace="broken.csv"))
    assert refused(session).problems[0].part == "trace"
    session.change(replace(session.state, trace="../there.csv"))
    assert "expected a file below" in refused(session).problems[0].text


def test_a_body_without_support_is_a_problem_of_the_machine(session: Session) -> None:
    for _ in range(3):
        session.drop("machine", "carriages", 0)
    assert refused(session).problems[0].part == "machine"


@given(st.integers(2, 5000), st.integers(0, 2**32), st.floats(0, 1), st.floats(0, 1))
def test_an_envelope_keeps_the_extremes_of_every_stretch(count: int, seed: int, a: float, b: float) -> None:
    """At any zoom the chart has the largest and smallest value of the whole, and of the stretch in view."""
    values = np.random.default_rng(seed).normal(size=count)
    time = np.arange(count) / 1000.0
    low, high = sorted((a * time[-1], b * time[-1]))
    points = np.array(envelope(time, values, low, high))
    assert len(points) <= 4 * BUCKETS and np.all(np.diff(points[:, 0]) > 0)
    inside = (time >= low) & (time <= high)
    kept = (points[:, 0] >= low - 1e-6) & (points[:, 0] <= high + 1e-6)
    for stretch, seen in ((np.full(count, True), np.full(len(points), True)), (inside, kept)):
        if stretch.any():  # five digits are written
            assert np.isclose(values[stretch].max(), points[seen, 1].max(), rtol=1e-4)
            assert np.isclose(values[stretch].min(), points[seen, 1].min(), rtol=1e-4)


class Slow(Solver):
    """A solver whose runs take a time, and end between two steps."""

    def __init__(self, session: Session, steps: int) -> None:
        super().__init__(session)
        self.steps, self.finished, self.begun = steps, list[str](), 0

    def answer(self, state: State, step: object) -> Refusal:
        self.begun += 1
        for n in range(self.steps):
            step(f"part {n}")
            time.sleep(0.02)
        self.finished.append(state.machine)
        return Refusal(state, ())


def run_while_changing(session: Session, steps: int, changes: int) -> tuple[Slow, list[str], list[str]]:
    """Change the state every 5 ms, and wait for the last answer."""
    solver, seen, told = Slow(session, steps), list[str](), list[str]()

    async def page() -> None:
        runner = Runner(solver, lambda answer: seen.append(answer.state.machine), told.append)
        for n in range(changes):
            runner.request(State(f"machine {n}", ""))
            await asyncio.sleep(0.005)
        assert runner.task is not None
        await runner.task

    asyncio.run(page())
    return solver, seen, told


def test_the_newest_state_wins_and_one_run_waits_at_most(session: Session) -> None:
    solver, seen, told = run_while_changing(session, steps=1, changes=40)
    assert seen[-1] == "machine 39" and not told
    assert solver.begun < 40 and solver.finished == sorted(
        solver.finished, key=lambda text: int(text.split()[1])
    )


def test_a_long_run_is_overtaken_and_tells_what_it_does(session: Session) -> None:
    steps = int(10 * SHORT / 0.02)
    solver, seen, told = run_while_changing(session, steps=steps, changes=60)
    assert solver.finished == ["machine 59"] and set(seen) == {"machine 59"}
    assert told[-1] == "" and any(text.startswith("part") for text in told)


def test_a_file_that_the_state_names_is_read_again_when_it_changes(session: Session, tmp_path: Path) -> None:
    """A straightness file that is missing at first, and a trace of which another program writes the first half."""
    machine = document.with_values(session.state.machine, {("rails", 0, "straightness_file"): "profile.csv"})
    trace = guideload.file_template("trace")
    (tmp_path / "measured.csv").write_text(trace)
    session.change(State(machine, session.state.moves, "measured.csv"))

    async def page() -> list[Answer | None]:
        hub = Hub(session)
        hub.start()
        answers = [await hub.newest()]
        for name, text in (
            ("profile.csv", "x [m],dy [um],dz [um]\n-9,0,0\n0,9,0\n9,0,0\n"),
            ("measured.csv", trace[: trace.index("\n", len(trace) // 2) + 1]),
        ):
            (tmp_path / name).write_text(text)
            os.utime(tmp_path / name, ns=(0, 0))  # of another time, however coarse the clock of the disk is
            hub.look()
            answers.append(await hub.newest())
            hub.look()
            assert hub.runner is not None and not hub.runner.is_behind
        return answers

    none, first, second = asyncio.run(page())
    assert none is None and first is not None and second is not None
    assert first.machine.rails[0].straightness is not None
    assert second.time.size == pytest.approx(first.time.size / 2, rel=0.1)


def test_work_begins_with_the_answer_of_the_present_state(session: Session) -> None:
    async def page() -> list[Answer | None]:
        hub = Hub(session)
        hub.start()
        answers = [await hub.newest()]
        for mass in ("2000 kg", "2000 N"):
            session.set("machine", {("body", "mass"): mass})
            answers.append(await hub.newest())
        return answers

    before, after, refused = asyncio.run(page())
    assert before is not None and after is not None and refused is None
    assert after.machine.body.mass == 2000.0 != before.machine.body.mass


class SlowJudge(Solver):
    """A solver whose judgements take a second, without a step between."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        first = super().answer(session.state, lambda name: None)
        assert isinstance(first, Answer)
        self.first = first

    def answer(self, state: State, step: object) -> Answer:
        return replace(self.first, state=state)

    def judged(self, answer: Answer, step: object) -> Answer:
        time.sleep(1.0)
        return replace(answer, report=guideload.reports.Report("judged"))


def test_a_newer_state_does_not_wait_for_a_judgement(session: Session) -> None:
    """Its answer comes before the judgement of the old state ends, which nobody gets."""
    solver, seen = SlowJudge(session), list[tuple[str, bool]]()

    async def page() -> None:
        runner = Runner(
            solver,
            lambda answer: seen.append((answer.state.machine, answer.report is not None)),
            lambda _: None,
        )
        runner.request(State("old", ""))
        while not runner.judgements._work_queue.empty() or not runner.judgements._threads:
            await asyncio.sleep(0.01)
        runner.request(State("new", ""))
        assert runner.task is not None
        await runner.task

    asyncio.run(page())
    assert seen == [("old", False), ("new", False), ("new", True)]
