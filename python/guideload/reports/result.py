"""Results as text, every definition said beside its figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console, RenderableType
from rich.text import Text

from guideload.audit.audit import LABEL
from guideload.base.numbers import load_in_table
from guideload.machine.machine import DOFS
from guideload.reports.elements import WIDTH, heading, new_table, remark, section, to_text
from guideload.reports.machine import modes_table, nominal_lines, weight_lines

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from guideload.base.arrays import Array
    from guideload.motion.motion import Motion
    from guideload.simulation.result import Result

DEFINITIONS = (
    "Forces of the body on the carriage, global axes, static load included; moments about the carriage's "
    "centre. Peak and static: of the resultant sqrt(Fy^2 + Fz^2). Dyn.: the largest distance of (Fy, Fz), "
    "and of (Mx, My, Mz), from its static value; share: that of the force over the peak. All at the samples."
)


def result_report(result: Result, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The report of a run: peaks, drive, what the held dofs carry, modes, motion, method, audit."""
    return to_text(
        [
            *heading(result.machine),
            *section("Peak loads of the carriages"),
            *peaks_tables(result, width),
            *remark(*result.audit.warnings, DEFINITIONS, *band_lines(result)),
            *weight_lines(result.machine),
            *section("Drive and held dofs"),
            *reaction_lines(result),
            *section("Natural modes"),
            modes_table(result.machine, result.modes),
            *remark(*nominal_lines(result.machine, "frequencies")),
            *section("Motion"),
            *_motion_of_result(result.data),
            *section("Solution"),
            *solution_lines(result.data),
            *section("Audit"),
            *audit_lines(result, width),
        ],
        width,
        encoding,
    )


def comparison(results: Mapping[str, Result], width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The table of peaks of several runs of one machine under one motion, one below the other."""
    parts: list[RenderableType] = []
    for title, result in results.items():
        parts += section(f"{title}: free {', '.join(result.machine.free)}")
        parts += peaks_tables(result, width)
        parts += remark(*result.audit.warnings)
        parts += weight_lines(result.machine)
    bands = dict.fromkeys(line for result in results.values() for line in band_lines(result))
    return to_text([*parts, *remark(DEFINITIONS, *bands)], width, encoding)


def motion_report(motion: Motion, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """What was understood of a trace."""
    return to_text([*section("Motion"), *motion_lines(motion)], width, encoding)


def peaks_tables(result: Result, width: int = WIDTH) -> list[RenderableType]:
    """A row per carriage; see `DEFINITIONS`. One table if it fits the width, else the moments in a second."""
    force_headings = ("peak\nN", "at\ns", "|Fy|\nN", "|Fz|\nN", "static\nN", "dyn.\nN", "share\n%")
    moment_headings = ("|Mx|\nN m", "|My|\nN m", "|Mz|\nN m", "dyn.\nN m")
    whole = new_table("carriage", *force_headings, *moment_headings)
    forces, moments = new_table("carriage", *force_headings), new_table("carriage", *moment_headings)
    loads = ("peak_Fy_N", "peak_Fz_N", "static_resultant_N", "dynamic_resultant_N")
    all_peaks = result.peaks()
    for name, peaks in all_peaks.iterrows():
        peak = float(peaks["peak_resultant_N"])
        force = (
            load_in_table(peak),
            f"{peaks['time_of_peak_s']:.3f}",
            *(load_in_table(float(peaks[load])) for load in loads),
            f"{100 * float(peaks['dynamic_resultant_N']) / peak:.1f}" if peak else "0.0",
        )
        moment = (
            *(load_in_table(float(peaks[f"peak_M{axis}_Nm"])) for axis in "xyz"),
            load_in_table(float(peaks["dynamic_moment_Nm"])),
        )
        whole.add_row(Text(str(name)), *force, *moment)
        forces.add_row(Text(str(name)), *force)
        moments.add_row(Text(str(name)), *moment)
    needed = Console(width=10 * width, color_system=None).measure(whole).maximum
    return [*([whole] if needed <= width else [forces, moments]), *_bands_table(all_peaks)]


def _bands_table(all_peaks: pd.DataFrame) -> list[RenderableType]:
    """A row per carriage: what the trace leaves open about its peak, if anything is known of that."""
    if "noise_share_percent" not in all_peaks:
        return []
    table = new_table("carriage", "peak\nN", "band\nfrom N", "band\nto N", "noise\n%")
    for name, peaks in all_peaks.iterrows():
        loads = (float(peaks[column]) for column in ("peak_resultant_N", "peak_lower_N", "peak_upper_N"))
        share = f"{float(peaks['noise_share_percent']):.2g}"
        table.add_row(Text(str(name)), *(load_in_table(load) for load in loads), share)
    return [table] if table.row_count else []


def band_lines(result: Result) -> list[str]:
    """What the bands of the peaks are, if there are any."""
    if "band_method" not in result.data.attrs:
        return []
    return [
        "Band: where the largest resultant of the true motion lies with 95 %, given the samples, whenever it is; "
        "the estimate is smooth, so its own peak tends to lie low in the band, or below it. Noise: 1.96 standard "
        "deviations of the resultant at the instant of the peak, over the peak. "
        f"From: {result.data.attrs['band_method']}."
    ]


def audit_lines(result: Result, width: int = WIDTH) -> list[str]:
    """The audit's figures, further lines of one below its text; the warnings stand below the peaks."""
    indent = " " * LABEL
    return [text for line in result.audit.lines for text in wrap(line, width, subsequent_indent=indent)]


def reaction_lines(result: Result) -> list[RenderableType]:
    """The drive force and the largest reaction of every other held dof, and the loads of the extra links."""
    data = result.data
    table = new_table("", "largest", "at\ns", "static")
    table.add_column("")
    time = data["time"].values
    reactions, at_rest = _by_label(data, "reaction", "dof"), _by_label(data, "static_reaction", "dof")
    for dof in (dof for dof in DOFS if dof not in result.machine.free):
        reaction = reactions[dof]
        instant = int(np.abs(reaction).argmax())
        row = (load_in_table(reaction[instant]), f"{time[instant]:.3f}", load_in_table(float(at_rest[dof])))
        what = "drive force, held x" if dof == "x" else f"reaction at L, held {dof}"
        table.add_row(what, *row, "N m" if dof.startswith("r") else "N")
    loads, at_rest = _by_label(data, "link_load", "link"), _by_label(data, "static_link_load", "link")
    for link in result.machine.links:
        load = loads[link.name]
        instant = int(np.abs(load).argmax())
        row = (load_in_table(load[instant]), f"{time[instant]:.3f}", load_in_table(float(at_rest[link.name])))
        table.add_row(Text(f"link {link.name}"), *row, "N")
    return [table] if table.row_count else ["All dofs are free: there is no reaction."]


def _by_label(data: xr.Dataset, name: str, dim: str) -> dict[str, Array]:
    """The history, or the number, of each label of a dimension."""
    return dict(zip(data[dim].values.tolist(), data[name].transpose(dim, ...).values, strict=True))


def motion_lines(motion: Motion) -> list[str]:
    """Source, duration, samples, largest speed and acceleration, and what was chosen on reading the trace."""
    return _motion_lines(motion.time, motion.velocity, motion.acceleration, motion.source, motion.notes)


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
    if changes := int(attrs["contact_changes"]):
        lines.append(f"{changes} contact changes, each located between the samples")
    lines.append(
        f"load scale {load_in_table(scale)} N: largest link load at rest plus quasi-static under the motion's peaks"
    )
    return lines


def _motion_of_result(data: xr.Dataset) -> list[str]:
    """The same of the motion that a result was computed for, at the reported instants."""
    velocity = data["cart_velocity"].transpose("time", "axis").values if "cart_velocity" in data else None
    acceleration = data["cart_acceleration"].transpose("time", "axis").values
    notes = [note for note in str(data.attrs["motion_notes"]).split("\n") if note]
    return _motion_lines(data["time"].values, velocity, acceleration, str(data.attrs["motion_source"]), notes)


def _motion_lines(
    time: Array, velocity: Array | None, acceleration: Array, source: str, notes: Iterable[str]
) -> list[str]:
    steps = np.diff(time)
    steps = steps[steps > 0]
    if steps.size:
        uniform = steps.max() - steps.min() <= 1e-6 * steps.max()
        step = f"{1e3 * float(np.median(steps)):.4g} ms" + ("" if uniform else " (median; not uniform)")
        extent = f"{np.ptp(time):.4g} s, {time.size} samples, every {step}"
    else:
        extent = f"a single instant, {time[0]:.4g} s"
    speed = "" if velocity is None else f"speed {_largest(velocity):.4g} m/s, "
    return [
        *([source] if source else []),
        extent,
        f"largest {speed}acceleration {_largest(acceleration):.4g} m/s2",
        *notes,
    ]


def _largest(vectors: Array) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())
