"""Report of a frequency response: static value and largest resonance of every point."""

from __future__ import annotations

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from guideload.machine.machine import Machine
from guideload.machine.response import DRIVE, FrequencyResponse
from guideload.reports.elements import dofs_line, new_table, remark, to_text

ROUNDING = 1e-9  # of the peak: a smaller static value is none
NOTE = (
    "Amplitude of the displacement in the carriage frame, linearised at rest. Static: for a constant source. Peak: the "
    "largest at the computed frequencies, and the phase by which the displacement leads the source there."
)


def response_report(machine: Machine, response: FrequencyResponse, encoding: str = "utf-8") -> str:
    """The report of a frequency response: a row per point and direction."""
    table = new_table("point", "static\n", "peak\n", "at\nHz", "ratio\n", "phase\ndeg", texts=("along",))
    for i, name in enumerate(response.points):
        for axis in range(3):
            magnitude = response.magnitude[:, i, axis]
            at, static = int(magnitude.argmax()), abs(float(response.static[i, axis]))
            small = static <= ROUNDING * magnitude[at]
            ratio = "" if small or np.isnan(static) else f"{magnitude[at] / static:.3g}"
            still = "free" if np.isnan(static) else "0" if small else f"{1e6 * static:.3g}"
            row = still, f"{1e6 * magnitude[at]:.3g}", f"{response.frequency[at]:.4g}", ratio
            phase = f"{response.phase[at, i, axis]:.0f}" if magnitude[at] > 0.0 else ""
            table.add_row(Text(name if axis == 0 else ""), *row, phase, "xyz"[axis])
    parts: list[RenderableType] = [
        *remark(f"{machine.name}: response to {source_words(response)}, in um per {source_unit(response)}."),
        dofs_line(machine),
        table,
        *remark(NOTE),
    ]
    return to_text(parts, encoding=encoding)


def source_words(response: FrequencyResponse) -> str:
    """What acts, where and along which direction."""
    axes = dict(zip("xyz", np.eye(3).tolist(), strict=True))
    named = [axis for axis, vector in axes.items() if vector == response.direction.tolist()]
    along = named[0] if named else "(" + ", ".join(f"{part:.3g}" for part in response.direction) + ")"
    what = "the acceleration of the drive" if response.source == DRIVE else f"a force at {response.source}"
    return f"{what} along {along}"


def source_unit(response: FrequencyResponse) -> str:
    """Unit of the source."""
    return "m/s2" if response.source == DRIVE else "N"
