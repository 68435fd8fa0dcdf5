"""What the page computes: loads, life, static safety, drive and settling of a state, as figures with a judgement."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import guideload
from guideload.app import document
from guideload.app.files import Folder
from guideload.app.state import Session, State

Level = Literal["good", "near", "bad", "open"]
Array = NDArray[np.float64]
Step = Callable[[str], None]
NEAR = 1.2  # margin below which a requirement is nearly missed: catalogues are no better than some percent
LEVELS: tuple[Level, ...] = ("open", "good", "near", "bad")
RPM = 60.0 / (2.0 * math.pi)  # per rad/s


@dataclass(frozen=True)
class Problem:
    """Why there is no answer. part: "machine", "moves" or "trace"; path: of the value in its file, () if none."""

    part: str
    path: document.Path
    text: str


@dataclass(frozen=True)
class Figure:
    """A figure of the answer: its name, its value and where or how it is meant, and how it is judged, in words."""

    name: str
    value: str
    place: str = ""
    level: Level = "open"
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Refusal:
    """A state that has no answer, and why."""

    state: State
    problems: tuple[Problem, ...]

    @property
    def verdict(self) -> tuple[Level, str]:
        """The first reason, in the words of the command line."""
        return "bad", self.problems[0].text


@dataclass(frozen=True, eq=False)
class Answer:
    """What a state comes to.

    result    of the run; of a measured motion without its credible bands
    time      (n,) s, of the samples
    loads     (n, carriage) resultant of Fy and Fz [N], or of a machine without carriages (n, link)
    life      or why there is none
    report    of the run, as the command line prints it; None until the page is at rest for a moment
    """

    state: State
    machine: guideload.Machine
    motion: guideload.Motion
    result: guideload.Result
    time: Array
    loads: Array
    life: guideload.Life | str
    margins: dict[str, float]
    drive: guideload.drive.DriveRequirements
    report: guideload.reports.Report | None = None
    figures: tuple[Figure, ...] = ()

    @property
    def verdict(self) -> tuple[Level, str]:
        """The worst judgement, and its reason."""
        worst = max(self.figures, key=lambda one: LEVELS.index(one.level))
        if worst.level == "bad":
            return "bad", f"Does not hold. {worst.name}: {worst.reason}"
        if worst.level == "near":
            return "near", f"Holds with little margin. {worst.name}: {worst.reason}"
        if worst.level == "open":
            return (
                "open",
                "Nothing is required yet: name a product of the carriages, and a life to be reached",
            )
        open_life = "" if "life" in self.margins else ". No life to be reached is given"
        return (
            "good",
            f"Holds. Smallest margin: {min(self.margins, key=lambda name: self.margins[name])}{open_life}",
        )

    @cached_property
    def peak(self) -> tuple[int, int]:
        """Index of the instant and of the carriage, or link, with the largest load."""
        instant, place = np.unravel_index(int(self.loads.argmax()), self.loads.shape)
        return int(instant), int(place)

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

    def answer(self, state: State, step: Step) -> Answer | Refusal:
        """Figures without the judgement of the run. step: is told what begins, and may raise to end the work."""
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
            step("life")
            life = life_or_reason(result)
            step("drive")
            drive = guideload.drive.drive_requirements(result)
            margins = (
                drive.margins if isinstance(life, str) else guideload.sizing.margins_of(life, drive).ratios
            )
        except guideload.ConfigError as error:
            own = error.file == str(self.folder.path(self.machine_name))
            name = self.machine_name if own else error.file
            found = [Problem(part, one.path, one.text(name)) for one in error.problems]
            return Refusal(state, tuple(found))
        except guideload.GuideloadError as error:
            return Refusal(state, (Problem(part, (), str(error)),))
        answer = Answer(state, machine, motion, result, time, loads, life, dict(margins), drive)
        return replace(answer, figures=tuple(_figures(answer)))

    def judged(self, answer: Answer, step: Step) -> Answer | Refusal:
        """The answer with the report of the run: its warnings, credible bands and the factor f_W."""
        try:
            step("credible bands" if answer.motion.uncertainty else "judgement")
            known = answer.motion.uncertainty is None
            result = answer.result if known else guideload.simulate(answer.machine, answer.motion)
            _ = result.audit
            step("report")
            report = guideload.reports.result_report(result)
        except guideload.GuideloadError as error:
            return Refusal(answer.state, (Problem("machine", (), str(error)),))
        found = replace(answer, report=report)
        return replace(found, figures=tuple(_figures(found, result)))

    def machine(self, state: State) -> guideload.Machine:
        """The machine of a state, whose links support it. Raises GuideloadError."""
        file = self.folder.path(self.machine_name)
        self.folder.require_inside(document.values(state.machine), file)
        machine = guideload.Machine.from_text(state.machine, file)
        if any(rider.motion for rider in machine.riders):
            raise guideload.GuideloadError("riders: the page moves no riders; guideload run does")
        _ = machine.scene
        return machine

    def motion(self, state: State, machine: guideload.Machine) -> guideload.Motion:
        """The motion of a state; the last one is kept. Raises GuideloadError."""
        if state.trace:
            file = self.folder.path(state.trace)
            key: Any = (file, file.stat().st_mtime_ns if file.exists() else 0, machine.drive)
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


def _histories(result: guideload.Result) -> tuple[Array, Array]:
    """Time and loads of an answer; without the other quantities, which take as long as the run."""
    time, loads = result.history("time"), result.carriage_loads
    assert time is not None
    if result.machine.carriages:
        return time, np.hypot(loads[:, :, 1], loads[:, :, 2])
    return time, np.abs(result.quantities["link_load"])


def life_or_reason(result: guideload.Result) -> guideload.Life | str:
    """The life of a result, or why there is none."""
    if not any(one.product for one in result.machine.carriages):
        return "no carriage names a product with ratings"
    try:
        return guideload.life_of(result)
    except guideload.LifeError as error:
        return str(error)


def text(value: float, kind: str) -> str:
    """A number as the reports write it; kind: of `guideload.reports.Column`."""
    return guideload.reports.Column("", [value], kind=kind).cells[0]


def judged(margins: dict[str, float], name: str, required: str) -> tuple[Level, str]:
    """Level and reason of a figure by its margin, the figure over what is required."""
    margin = margins.get(name)
    if margin is None:
        return "open", ""
    level: Level = "bad" if margin < 1.0 else "near" if margin < NEAR else "good"
    return level, f"{text(margin, '3 digits')} times {required}"


def _figures(answer: Answer, result: guideload.Result | None = None) -> Iterator[Figure]:
    """result: of the whole motion with its judgement, if it is known already."""
    (instant, place), time, margins = answer.peak, answer.time, answer.margins
    kind = "carriage" if answer.machine.carriages else "link"
    where = f"on {kind} {answer.names[place]} at {text(time[instant], 'time')} s"
    largest = answer.loads[instant, place]
    if result is not None and answer.machine.carriages:  # between the samples too
        largest = result.peak_columns["peak_resultant_N"].max()
    yield Figure("Largest load", f"{text(largest, 'load')} N", where)
    life = answer.life
    if isinstance(life, str):
        yield Figure("Life", "not known", life)
    else:
        target = life.conditions.life
        wanted = "" if target is None else f"the {target.text} to be reached"
        km = f"{text(life.machine, 'life')} km, shortest: carriage {life.shortest.name}"
        value = f"{text(life.hours(life.machine), 'hours')} h"
        yield Figure("Life", value, km, *judged(margins, "life", wanted))
        weakest, least = life.weakest, life.conditions.least_safety
        words = f"the least of {text(least, 'number')}"
        safety = text(weakest.static.safety, "factor")
        at = f"carriage {weakest.name} at {text(time[weakest.static.instant], 'time')} s"
        if result is not None:
            at += f", {weakest.worst.phase}"
        yield Figure("Static safety", safety, at, *judged(margins, "static safety", words))
    if result is None:
        yield Figure("f_W", "...", "dynamic factor: peak over quasi-static peak")
    else:
        factor = float(np.nanmax(result.audit.simpler_models.dynamic_factor))
        yield Figure("f_W", text(factor, "factor"), "dynamic factor: peak over quasi-static peak")
    yield from _drive_figures(answer.drive, margins)
    yield from _settling(answer.result)


def _drive_figures(drive: guideload.drive.DriveRequirements, margins: dict[str, float]) -> Iterator[Figure]:
    rms = f"rms {text(drive.rms_force, 'load')} N"
    force = f"{text(drive.peak_force, 'load')} N"
    yield Figure("Drive force", force, rms, *judged(margins, "drive force", "the motion needs"))
    if (motor := drive.motor) is not None:
        torque = f"{text(float(np.abs(motor.torque).max()), '3 digits')} N m"
        turns = text(RPM * float(np.abs(motor.speed).max()), "count")
        words = f"rms {text(motor.rms_torque, '3 digits')} N m, {turns} rpm"
        names = [name for name in margins if "motor" in name or "screw" in name]
        worst = min(names, key=lambda name: margins[name], default="")
        yield Figure(
            "Motor torque", torque, words, *judged(margins, worst, f"what the motion needs ({worst})")
        )
    for name in ("speed", "acceleration"):
        if name in margins:
            level, reason = judged(margins, name, f"the {name} of the motion")
            yield Figure(f"Limit of {name}", reason, "of the product", level, reason)


def _settling(result: guideload.Result) -> Iterator[Figure]:
    if not any(point.settle_window for point in result.machine.points):
        return
    for one in result.settling():
        if one.spans:
            known = one.time[np.isfinite(one.time)]
            late = one.time.size - known.size
            value = f"{text(float(known.max()), 'milliseconds')} ms" if known.size else "not seen"
            window = f"longest, to within {text(1e6 * one.window, 'length')} um"
            reason = f"it does not settle after {late} of {one.time.size} moves" if late else ""
            yield Figure(f"Settling of {one.point}", value, window, "near" if late else "open", reason)
