"""What the page computes: loads, life, static safety, drive and settling of a state, as figures with a judgement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import guideload
from guideload.app import document
from guideload.app.files import Folder
from guideload.app.state import Session, State

Array = NDArray[np.float64]
Step = Callable[[str], None]


@dataclass(frozen=True)
class Problem:
    """Why there is no answer. part: "machine", "moves" or "trace"; path: of the value in its file, () if none."""

    part: str
    path: document.Path
    text: str


@dataclass(frozen=True, eq=False)
class Refusal:
    """A state that has no answer, and why."""

    state: State
    problems: tuple[Problem, ...]

    @property
    def verdict(self) -> tuple[guideload.reports.Level, str]:
        """The first reason, in the words of the command line."""
        return "bad", self.problems[0].text


@dataclass(frozen=True, eq=False)
class Answer:
    """What a state comes to."""

    state: State
    machine: guideload.Machine
    motion: guideload.Motion
    result: guideload.Result  # of the run; of a measured motion without its credible bands
    time: Array  # (n,) s, of the samples
    loads: Array  # (n, carriage) resultant of Fy and Fz [N], or of a machine without carriages (n, link)
    peak: tuple[int, int]  # index of the instant and of the carriage, or link, of the largest load
    figures: guideload.reports.KeyFigures
    # of the run, as the command line prints it; None until the page is at rest for a moment
    report: guideload.reports.Report | None = None

    @property
    def verdict(self) -> tuple[guideload.reports.Level, str]:
        """The worst judgement, and its reason."""
        return self.figures.verdict

    @property
    def names(self) -> list[str]:
        """Names of the carriages, or links, of `loads`."""
        return [one.name for one in self.machine.carriages or self.machine.links]


class Solver:
    """Computes answers; it keeps the last motion, because smoothing a trace takes far longer than a run."""

    def __init__(self, session: Session) -> None:
        self.folder: Folder = session.folder
        self.machine_name, self.moves_name = session.machine_name, session.moves_name
        self._motion: tuple[Any, guideload.Motion] | None = None
        self._read: dict[Path, int | None] = {}  # files that the last state names: times of their change [ns]

    @property
    def is_outdated(self) -> bool:
        """Whether a file that the last state names was changed since it was read."""
        return any(_changed_at(file) != when for file, when in self._read.items())

    def answer(self, state: State, step: Step) -> Answer | Refusal:
        """Figures without the judgement of the run. step: called with what begins; it may raise to end the work."""
        part = "machine"
        try:
            step("machine")
            machine = self.machine(state)
            part = "trace" if state.trace else "moves"
            step("motion")
            motion = self.motion(state, machine)
            step("loads")
            part = "machine"
            # The credible bands of a measured motion take longer than the run: they are in the report.
            result = guideload.simulate(machine, replace(motion, uncertainty=None))
            time, loads = _histories(result)
            step("life and drive")
            peak = _peak(result, between=False)
            figures = guideload.reports.key_figures(result, audited=False)
        except guideload.ConfigError as error:
            own = error.file == str(self.folder.path(self.machine_name))
            name = self.machine_name if own else error.file
            found = [Problem(part, one.path, one.text(name)) for one in error.problems]
            return Refusal(state, tuple(found))
        except guideload.GuideloadError as error:
            return Refusal(state, (Problem(part, (), str(error)),))
        return Answer(state, machine, motion, result, time, loads, peak, figures)

    def judged(self, answer: Answer, step: Step) -> Answer | Refusal:
        """The answer with the report of the run: its warnings, credible bands and the factor f_W."""
        try:
            step("credible bands" if answer.motion.uncertainty else "judgement")
            known = answer.motion.uncertainty is None
            result = answer.result if known else guideload.simulate(answer.machine, answer.motion)
            figures = guideload.reports.key_figures(result)
            step("report")
            report = guideload.reports.result_report(result)
        except guideload.GuideloadError as error:
            return Refusal(answer.state, (Problem("machine", (), str(error)),))
        return replace(answer, peak=_peak(result, between=True), figures=figures, report=report)

    def machine(self, state: State) -> guideload.Machine:
        """The machine of a state, whose links support it. Raises GuideloadError."""
        file = self.folder.path(self.machine_name)
        named = self.folder.named(document.values(state.machine), file)
        self._read = {one: _changed_at(one) for one in named}
        machine = guideload.Machine.from_text(state.machine, file)
        if any(rider.motion for rider in machine.riders):
            raise guideload.GuideloadError("riders: the page moves no riders; guideload run does")
        _ = machine.scene
        return machine

    def motion(self, state: State, machine: guideload.Machine) -> guideload.Motion:
        """The motion of a state; the last one is kept. Raises GuideloadError."""
        if state.trace:
            file = self.folder.path(state.trace)
            self._read = self._read | {file: _changed_at(file)}
            key: Any = (file, self._read[file], machine.drive)
        else:
            key = state.moves
        if self._motion is None or self._motion[0] != key:
            if state.trace:
                trace = guideload.read_trace(file)
                motion = guideload.motion_from_trace(trace, drive=machine.drive)
            else:
                motion = guideload.Moves.from_text(state.moves, self.moves_name).motion()
            self._motion = key, motion
        return self._motion[1]


def _changed_at(file: Path) -> int | None:
    """When a file was changed [ns]; None if there is none."""
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return None


def _peak(result: guideload.Result, between: bool) -> tuple[int, int]:
    largest = result.largest_load(between)
    return largest.instant, largest.index


def _histories(result: guideload.Result) -> tuple[Array, Array]:
    """Time and loads of an answer; without the other quantities, which take as long as the run."""
    time, loads = result.history("time"), result.carriage_loads
    assert time is not None
    if result.machine.carriages:
        return time, np.hypot(loads[:, :, 1], loads[:, :, 2])
    return time, np.abs(result.quantities["link_load"])
