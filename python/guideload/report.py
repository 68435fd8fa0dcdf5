"""Results as text: tables that fit a terminal and a file, every definition said beside its figures."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from guideload.audit import LABEL
from guideload.machine import DOFS
from guideload.modes import Modes, moving_dofs
from guideload.motion import Motion

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from guideload.machine import Machine
    from guideload.result import Result

WIDTH = 80

# Guides carry machines at tens to hundreds of Hz, damped by some percent. What lies beyond these limits is a slip
# of units: N/mm read as N/m lowers the frequencies 32 times.
SLOWEST_MODE = 1.0  # Hz
LARGEST_DAMPING = 2.0  # of critical


DEFINITIONS = (
    "Forces of the body on the carriage, global axes, static load included; moments about the carriage's "
    "centre. Peak and static: of the resultant sqrt(Fy^2 + Fz^2). Dyn.: the largest distance of (Fy, Fz), "
    "and of (Mx, My, Mz), from its static value; share: that of the force over the peak. All at the samples."
)


STATIC_DEFINITIONS = "Forces of the body on the carriage, global axes; moments about the carriage's centre."


def result_report(result: Result, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The report of a run: peaks, drive, what the held dofs carry, modes, motion, method, audit."""
    return to_text(
        [
            *_heading(result.machine),
            *_section("Peak loads of the carriages"),
            *peaks_tables(result, width),
            *_remark(*result.audit.warnings, DEFINITIONS),
            *weight_lines(result.machine),
            *_section("Drive and held dofs"),
            *reaction_lines(result),
            *_section("Natural modes"),
            modes_table(result.machine, result.modes),
            *_section("Motion"),
            *motion_lines(_motion_of(result.data)),
            *_section("Solution"),
            *solution_lines(result.data),
            *_section("Audit"),
            *audit_lines(result, width),
        ],
        width,
        encoding,
    )


def comparison(results: Mapping[str, Result], width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The table of peaks of several runs of one machine under one motion, one below the other."""
    parts: list[RenderableType] = []
    for title, result in results.items():
        parts += _section(f"{title}: free {', '.join(result.machine.free)}")
        parts += peaks_tables(result, width)
        parts += _remark(*result.audit.warnings)
        parts += weight_lines(result.machine)
    return to_text([*parts, *_remark(DEFINITIONS)], width, encoding)


def machine_report(machine: Machine, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """What was understood of a machine, and its static loads."""
    body = machine.body
    weight = body.mass * float(np.linalg.norm(machine.gravity))
    principal = np.linalg.eigvalsh(body.central_inertia())
    parts: list[RenderableType] = [
        *_heading(machine),
        *_section("Body and drive"),
        f"mass {body.mass:g} kg, weight {number(weight)} N",
        f"centre of mass {_millimetres(body.center_of_mass)} from L",
        f"principal moments of inertia about it {', '.join(f'{j:.4g}' for j in principal)} kg m2",
    ]
    if machine.drive is not None:
        per_turn = 2e3 * np.pi * machine.drive.speed_per_motor_speed
        parts.append(f"drive: the cart moves {per_turn:.4g} mm per turn of the motor")
    table = _table("carriage", "x\nmm", "y\nmm", "z\nmm", "length\nmm", "ky\nN/um", "kz\nN/um")
    for heading in ("by\nkN s/m", "bz\nkN s/m"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("rail", overflow="fold")
    for carriage, center in zip(machine.carriages, machine.carriage_centers, strict=True):
        places = (*center, carriage.length)
        table.add_row(
            Text(carriage.name),
            *(f"{1e3 * place:g}" for place in places),
            *(f"{1e-6 * k:g}" for k in (carriage.stiffness_y, carriage.stiffness_z)),
            *(f"{1e-3 * b:g}" for b in (carriage.damping_y, carriage.damping_z)),
            Text(carriage.rail),
        )
    links = len(machine.link_table().names)
    own = f", {len(machine.links)} of them extra: {', '.join(link.name for link in machine.links)}"
    parts += [*_section(f"Carriages and links ({links} links{own if machine.links else ''})"), table]
    parts += [*_section("At rest: supported in every free dof"), static_table(machine)]
    notes = unit_notes(Modes.of(machine))
    return to_text([*parts, *_remark(STATIC_DEFINITIONS, *notes), *weight_lines(machine)], width, encoding)


def motion_report(motion: Motion, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """What was understood of a trace."""
    return to_text([*_section("Motion"), *motion_lines(motion)], width, encoding)


def modes_report(machine: Machine, modes: Modes, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The natural modes of a machine."""
    notes = _remark(*unit_notes(modes))
    return to_text([*_heading(machine), modes_table(machine, modes), *notes], width, encoding)


def peaks_tables(result: Result, width: int = WIDTH) -> list[RenderableType]:
    """A row per carriage; see `DEFINITIONS`. One table if it fits the width, else the moments in a second."""
    force_headings = ("peak\nN", "at\ns", "|Fy|\nN", "|Fz|\nN", "static\nN", "dyn.\nN", "share\n%")
    moment_headings = ("|Mx|\nN m", "|My|\nN m", "|Mz|\nN m", "dyn.\nN m")
    whole = _table("carriage", *force_headings, *moment_headings)
    forces, moments = _table("carriage", *force_headings), _table("carriage", *moment_headings)
    loads = ("peak_Fy_N", "peak_Fz_N", "static_resultant_N", "dynamic_resultant_N")
    for name, peaks in result.peaks().iterrows():
        peak = float(peaks["peak_resultant_N"])
        force = (
            number(peak),
            f"{peaks['time_of_peak_s']:.3f}",
            *(number(float(peaks[load])) for load in loads),
            f"{100 * float(peaks['dynamic_resultant_N']) / peak:.1f}" if peak else "0.0",
        )
        moment = (
            *(number(float(peaks[f"peak_M{axis}_Nm"])) for axis in "xyz"),
            number(float(peaks["dynamic_moment_Nm"])),
        )
        whole.add_row(Text(str(name)), *force, *moment)
        forces.add_row(Text(str(name)), *force)
        moments.add_row(Text(str(name)), *moment)
    needed = Console(width=10 * width, color_system=None).measure(whole).maximum
    return [whole] if needed <= width else [forces, moments]


def audit_lines(result: Result, width: int = WIDTH) -> list[str]:
    """The audit's figures, further lines of one below its text; the warnings stand below the peaks."""
    indent = " " * LABEL
    return [text for line in result.audit.lines for text in wrap(line, width, subsequent_indent=indent)]


def unit_notes(modes: Modes) -> list[str]:
    """A warning where the modes are those of no machine on guides: mostly N/mm taken for N/m."""
    odd = []
    if modes.frequency.size and modes.frequency.min() < SLOWEST_MODE:
        odd.append(f"the lowest mode is at {modes.frequency.min():.3g} Hz")
    if modes.damping_ratio.size and modes.damping_ratio.max() > LARGEST_DAMPING:
        odd.append(f"a damping ratio is {100 * modes.damping_ratio.max():.3g} %")
    if not odd:
        return []
    return [
        f"Note: {' and '.join(odd)}: are stiffness and damping in N/m and N s/m? Plain numbers are SI; "
        'others need their unit, as in "350 N/um".'
    ]


def static_table(machine: Machine) -> Table:
    """A row per carriage: its load and moment in static equilibrium, signed."""
    table = _table("carriage", "Fy\nN", "Fz\nN", "Mx\nN m", "My\nN m", "Mz\nN m")
    for carriage, load in zip(machine.carriages, _static_loads(machine), strict=True):
        table.add_row(Text(carriage.name), *(number(float(part)) for part in load[1:]))
    return table


def modes_table(machine: Machine, modes: Modes) -> Table:
    """A row per natural mode: frequency, damping and the dofs that move most."""
    table = _table("mode", "natural\nHz", "damping\nratio %", "damped\nHz")
    table.add_column("moves mostly in")
    for index, frequency in enumerate(modes.frequency):
        ratio = float(modes.damping_ratio[index])
        damped = "none" if ratio >= 1 else f"{float(modes.damped_frequency[index]):.4g}"
        dofs = ", ".join(moving_dofs(machine, np.real(modes.shape[index])))
        table.add_row(str(index + 1), f"{float(frequency):.4g}", f"{100 * ratio:.3g}", damped, dofs)
    return table


def reaction_lines(result: Result) -> list[RenderableType]:
    """The drive force and the largest reaction of every other held dof, and the loads of the extra links."""
    data = result.data
    table = _table("", "largest", "at\ns", "static")
    table.add_column("")
    time = data["time"].values
    for dof in (dof for dof in DOFS if dof not in result.machine.free):
        reaction = data["reaction"].sel(dof=dof).values
        instant = int(np.abs(reaction).argmax())
        row = (
            number(reaction[instant]),
            f"{time[instant]:.3f}",
            number(float(data["static_reaction"].sel(dof=dof))),
        )
        what = "drive force, held x" if dof == "x" else f"reaction at L, held {dof}"
        table.add_row(what, *row, "N m" if dof.startswith("r") else "N")
    for link in result.machine.links:
        load = data["link_load"].sel(link=link.name).values
        instant = int(np.abs(load).argmax())
        row = (
            number(load[instant]),
            f"{time[instant]:.3f}",
            number(float(data["static_link_load"].sel(link=link.name))),
        )
        table.add_row(Text(f"link {link.name}"), *row, "N")
    return [table] if table.row_count else ["All dofs are free: there is no reaction."]


def weight_lines(machine: Machine) -> list[RenderableType]:
    """A warning for every held direction in which the constraint at L, and not the guides, carries weight."""
    reaction, loads = machine.scene.static_reaction(), _static_loads(machine)
    lines = []
    for index, axis in enumerate("xyz"):
        weight = machine.body.mass * machine.gravity[index]
        if axis in machine.free or axis == "x" or weight == 0:
            continue
        held = number(float(reaction[index]))
        carried = number(float(loads[:, index].sum()))
        lines.append(
            f"Note: {axis} of L is held, so the constraint at L carries the weight: {held} N at rest. "
            f"The carriages' static loads along {axis} add up to {carried} N: they carry only its moment. "
            f"Free {axis} as well to see the guides carry the weight."
        )
    return _remark(*lines)


def motion_lines(motion: Motion) -> list[str]:
    """Source, duration, samples, largest speed and acceleration, and what was chosen on reading the trace."""
    steps = np.diff(motion.time)
    steps = steps[steps > 0]
    uniform = steps.max() - steps.min() <= 1e-6 * steps.max()
    step = f"{1e3 * float(np.median(steps)):.4g} ms" + ("" if uniform else " (median; not uniform)")
    speed = "" if motion.velocity is None else f"speed {_largest(motion.velocity):.4g} m/s, "
    return [
        *([motion.source] if motion.source else []),
        f"{np.ptp(motion.time):.4g} s, {motion.time.size} samples, every {step}",
        f"largest {speed}acceleration {_largest(motion.acceleration):.4g} m/s2",
        *motion.notes,
    ]


def solution_lines(data: xr.Dataset) -> list[str]:
    """Method and why it was taken, and the tolerance in terms of the load."""
    attrs = data.attrs
    scale, rtol = float(attrs["load_scale_N"]), float(attrs["rtol"])
    lines = [f"method {attrs['method']}: {attrs['method_reason']}"]
    if "step_s" in attrs:
        lines.append(f"fixed step {1e3 * float(attrs['step_s']):.4g} ms, its error is not controlled")
    elif attrs["method"] != "exact":
        asked = f"error of the link loads held to {rtol:.1g} of the load scale, {rtol * scale:.1g} N"
        lines.append(f"{asked}; {attrs['steps']} steps, {attrs['rejected_steps']} rejected")
    lines.append(
        f"load scale {number(scale)} N: largest link load at rest plus quasi-static under the motion's peaks"
    )
    return lines


def number(value: float) -> str:
    """A load for a table: whole newtons from 100 N up, one decimal below, rounding noise as 0.0."""
    text = f"{value:.{0 if abs(value) >= 100 else 1}f}"
    return text.removeprefix("-") if float(text) == 0 else text


def to_text(parts: Iterable[RenderableType], width: int = WIDTH, encoding: str = "utf-8") -> str:
    """What rich makes of the parts, without colours; signs that the encoding lacks are replaced."""
    buffer = io.BytesIO()
    file = io.TextIOWrapper(buffer, encoding=encoding, errors="replace", newline="\n")
    console = Console(file=file, width=width, highlight=False, markup=False, emoji=False, color_system=None)
    for part in parts:
        console.print(part)
    file.flush()
    lines = [line.rstrip() for line in buffer.getvalue().decode(encoding).splitlines()]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines).strip("\n")) + "\n"


def _table(first: str, *numbers: str) -> Table:
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column(first, overflow="fold")
    for heading in numbers:
        table.add_column(heading, justify="right", no_wrap=True)
    return table


def _heading(machine: Machine) -> list[RenderableType]:
    held = [dof for dof in DOFS if dof not in machine.free]
    return [machine.name, f"free {', '.join(machine.free)}; held {', '.join(held) or 'none'}"]


def _section(title: str) -> list[RenderableType]:
    return ["", Text(title, style="bold")]


def _millimetres(point: Sequence[float]) -> str:
    return f"({', '.join(f'{1e3 * part:g}' for part in point)}) mm"


def _remark(*lines: str) -> list[RenderableType]:
    return [Padding(line, (0, 0, 1, 0)) for line in lines]


def _largest(vectors: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


def _static_loads(machine: Machine) -> NDArray[np.float64]:
    """(carriage, 6) Fx Fy Fz [N], Mx My Mz [N m] at rest."""
    return machine.scene.static_group_loads(machine.links_of_carriages, machine.carriage_centers)


def _motion_of(data: xr.Dataset) -> Motion:
    """The motion that a result was computed for."""
    histories = {name: data.get(f"cart_{name}") for name in ("velocity", "position")}
    return Motion(
        time=data["time"].values,
        acceleration=data["cart_acceleration"].transpose("time", "axis").values,
        source=str(data.attrs["motion_source"]),
        notes=tuple(note for note in str(data.attrs["motion_notes"]).split("\n") if note),
        **{
            name: None if one is None else one.transpose("time", "axis").values
            for name, one in histories.items()
        },
    )
