"""Report of a frequency response: static value and largest resonance of every point."""

from __future__ import annotations

import numpy as np

from guideload.audit.plausibility import machine_warnings
from guideload.base.number_text import digits
from guideload.machine.machine import Machine
from guideload.machine.response import DRIVE, FrequencyResponse
from guideload.reports.assumptions import without_payloads
from guideload.reports.report import Column, Definitions, Report, Section, Table, known_or_empty

NOTE = (
    "Amplitude of the displacement in the travelling frame, linearised at rest. Static: for a constant source. Peak: "
    "the largest at the computed frequencies, and the phase by which the displacement leads the source there."
)


def response_report(machine: Machine, response: FrequencyResponse) -> Report:
    """The report of a frequency response: a row per point and direction."""
    shape = (-1, 3 * len(response.points))
    magnitude, phase = response.magnitude.reshape(shape), response.phase.reshape(shape)
    at, each = magnitude.argmax(axis=0), np.arange(magnitude.shape[1])
    peak, static = magnitude[at, each], np.abs(response.static).ravel()
    for values in (peak, static):
        values[values <= response.least] = 0.0
    moved = peak > 0.0
    ratio = np.divide(peak, static, out=np.full_like(peak, np.nan), where=static != 0.0)
    table = Table(
        Column("point", [name if axis == "x" else "" for name in response.points for axis in "xyz"]),
        Column("along", [axis for _ in response.points for axis in "xyz"]),
        Column("static", ["free" if np.isnan(one) else one for one in 1e6 * static], kind="3 digits"),
        Column("peak", 1e6 * peak, kind="3 digits"),
        Column("at", known_or_empty(np.where(moved, response.frequency[at], np.nan)), "Hz", "4 digits"),
        Column("ratio", known_or_empty(ratio), kind="3 digits"),
        Column("phase", known_or_empty(np.where(moved, phase[at, each], np.nan)), "deg", "whole"),
    )
    return Report.of(
        machine,
        "frequency response",
        answer=[
            f"{machine.name}: response to {source_words(response)}, in um per {source_unit(response)}.",
            *without_payloads(machine),
        ],
        warnings=machine_warnings(machine),
        sections=[Section("Points", table, Definitions(NOTE))],
    )


def source_words(response: FrequencyResponse) -> str:
    """What acts, where and along which direction."""
    axes = dict(zip("xyz", np.eye(3).tolist(), strict=True))
    named = [axis for axis, vector in axes.items() if vector == response.direction.tolist()]
    along = named[0] if named else "(" + ", ".join(map(digits, response.direction)) + ")"
    what = "the acceleration of the drive" if response.source == DRIVE else f"a force at {response.source}"
    return f"{what} along {along}"


def source_unit(response: FrequencyResponse) -> str:
    """Unit of the source."""
    return "m/s2" if response.source == DRIVE else "N"
