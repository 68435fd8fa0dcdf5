"""The figures of a run that decide, each judged by what is required: the cards of the page and of the HTML report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from guideload.audit.figures import STATICS
from guideload.base.arguments import checked
from guideload.base.errors import LifeError
from guideload.base.number_text import (
    beside,
    digits,
    fixed,
    joined,
    kilometres,
    length_in_table,
    load_in_table,
    milliseconds,
    number,
    rounded,
    seconds,
)
from guideload.drive.requirements import DriveRequirements, drive_requirements
from guideload.life.life import Life, life_of
from guideload.machine.machine import Machine
from guideload.reports.drive import RPM
from guideload.simulation.result import Result
from guideload.sizing.requirements import margins_of

Level = Literal["good", "near", "bad", "open"]
LEVELS: tuple[Level, ...] = ("open", "good", "near", "bad")
NEAR = 1.2  # margin below which a requirement is nearly missed: catalogues are no better than some percent


@dataclass(frozen=True)
class KeyFigure:
    """A figure: its name, its value and where or how it is meant.

    level   "good", "near" (by less than a fifth) or "bad" where something is required, else "open"; reason: in words
    """

    name: str
    value: str
    place: str = ""
    level: Level = "open"
    reason: str = ""


@dataclass(frozen=True, eq=False)
class KeyFigures:
    """The key figures of a run.

    margins     figure over requirement of each criterion, as in `Margins.ratios`
    life        of the carriages, or why there is none
    not_judged  why the life of a carriage is not judged, though other things are; empty if all is judged or nothing
    """

    figures: tuple[KeyFigure, ...]
    margins: dict[str, float]
    life: Life | str
    not_judged: str

    @property
    def verdict(self) -> tuple[Level, str]:
        """The worst judgement, and its reason."""
        worst = max(self.figures, key=lambda one: LEVELS.index(one.level))
        if worst.level == "bad":
            return "bad", f"Does not hold. {worst.name}: {worst.reason}"
        if self.not_judged:
            return "near", f"Not all is judged: {self.not_judged}"
        if worst.level == "near":
            return "near", f"Holds with little margin. {worst.name}: {worst.reason}"
        if worst.level == "open":
            wanted = "name a product of the carriages, and a life to be reached"
            return "open", f"Nothing is required yet: {wanted}"
        smallest = min(self.margins, key=lambda name: self.margins[name])
        open_life = "" if "life" in self.margins else ". No life to be reached is given"
        return "good", f"Holds. Smallest margin: {beside(self.margins[smallest], 1.0)}, {smallest}{open_life}"


@checked
def key_figures(result: Result, *, audited: bool = True) -> KeyFigures:
    """Largest load, life, static safety, dynamic factor, drive force and settling of a run, judged.

    audited: with what takes longer than the run itself, the dynamic factor and the peak between the samples.
    Raises ArgumentError if the result reports no instant, and for friction and a motion without velocity.
    """
    life, drive = _life(result), drive_requirements(result)
    factor = fixed(float(np.nanmax(result.audit.simpler_models.dynamic_factor)), 2) if audited else "..."
    margins = margins_of(life, drive).ratios if isinstance(life, Life) else drive.margins
    kind, largest = "carriage" if result.machine.carriages else "link", result.largest_load(audited)
    where = f"on {kind} {largest.name} at {seconds(largest.time)} s"
    meant = f"largest of a {kind}: peak over the peak of a static calculation with {STATICS}"
    figures = (
        KeyFigure("Largest load", f"{load_in_table(largest.size)} N", where),
        *_life_figures(life, margins, audited),
        KeyFigure("Dynamic factor", factor, meant),
        *_drive_figures(drive, margins),
        *_settling(result),
    )
    return KeyFigures(figures, dict(margins), life, _not_judged(result.machine, life, margins))


def _not_judged(machine: Machine, life: Life | str, margins: dict[str, float]) -> str:
    bare = [one.name for one in machine.carriages if one.product is None]
    if isinstance(life, str) and len(bare) < len(machine.carriages):
        return life
    if not bare or not margins:
        return ""
    return f"no product with ratings is named at carriage{'s' if len(bare) > 1 else ''} {joined(bare)}"


def _judged(margins: dict[str, float], name: str, required: str) -> tuple[Level, str]:
    """Level and reason of a figure by its margin, the figure over what is required."""
    margin = margins.get(name)
    if margin is None:
        return "open", ""
    level: Level = "bad" if margin < 1.0 else "near" if margin < NEAR else "good"
    return level, f"{beside(margin, 1.0)} times {required}"


def _life(result: Result) -> Life | str:
    if not any(result.machine.product_of_carriage):
        return "no carriage names a product with ratings"
    try:
        return life_of(result)
    except LifeError as error:
        return str(error)


def _life_figures(life: Life | str, margins: dict[str, float], audited: bool) -> Iterator[KeyFigure]:
    if isinstance(life, str):
        yield KeyFigure("Life", "not known", life)
        return
    target, weakest, least = life.conditions.life, life.weakest, life.conditions.least_safety
    wanted = "" if target is None else f"the {target.text} to be reached"
    alone = f"carriage {life.shortest.name} alone {rounded(life.hours(life.shortest.life))} h"
    place = f"{kilometres(life.machine)} km, all carriages together; {alone}"
    yield KeyFigure(
        "Life", f"{rounded(life.hours(life.machine))} h", place, *_judged(margins, "life", wanted)
    )
    at = f"carriage {weakest.name} at {seconds(weakest.static.largest.time)} s"
    if audited:
        at += f", {weakest.worst.phase}"
    judgement = _judged(margins, "static safety", f"the least of {number(least)}")
    yield KeyFigure("Static safety", fixed(weakest.static.safety, 2), at, *judgement)


def _drive_figures(drive: DriveRequirements, margins: dict[str, float]) -> Iterator[KeyFigure]:
    force, rms = load_in_table(drive.peak_force), load_in_table(drive.rms_force)
    judgement = _judged(margins, "drive force", "the motion needs")
    yield KeyFigure("Drive force", f"{force} N", f"rms {rms} N", *judgement)
    motor = drive.with_peaks.motor
    if motor is not None and drive.motor is not None:
        turns = RPM * float(np.abs(motor.speed).max())
        words = f"rms {digits(drive.motor.rms_torque)} N m, {fixed(turns)} rpm"
        names = [name for name in margins if "motor" in name or "screw" in name]
        worst = min(names, key=lambda name: margins[name], default="")
        level, reason = _judged(margins, worst, "what the motion needs")
        judgement = level, f"{worst} is {reason}" if reason else ""
        yield KeyFigure("Motor", f"{digits(float(np.abs(motor.torque).max()))} N m", words, *judgement)
    for name in ("speed", "acceleration"):
        if name in margins:
            level, reason = _judged(margins, name, f"the {name} of the motion")
            yield KeyFigure(f"Limit of {name}", reason, "of the product", level, reason)


def _settling(result: Result) -> Iterator[KeyFigure]:
    if not any(point.settle_window for point in result.machine.points):
        return
    for one in result.settling():
        if one.spans:
            known = one.time[np.isfinite(one.time)]
            late = one.time.size - known.size
            value = f"{milliseconds(float(known.max()))} ms" if known.size else "not seen"
            window = f"longest, to within {length_in_table(1e6 * one.window)} um"
            reason = f"it does not settle after {late} of {one.time.size} moves" if late else ""
            yield KeyFigure(f"Settling of {one.point}", value, window, "near" if late else "open", reason)
