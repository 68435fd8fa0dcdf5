"""Reports of results: largest load, warnings, tables, definitions, audit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from guideload.audit.audit import LABEL
from guideload.audit.histories import payload_changes
from guideload.base.number_text import joined, load_in_table
from guideload.machine.machine import DOFS
from guideload.reports.drive import drive_parts
from guideload.reports.elements import WIDTH, dofs_line, new_table, remark, section, to_text
from guideload.reports.life import life_answer, life_of_run, life_section
from guideload.reports.machine import modes_table, nominal_lines, weight_lines
from guideload.reports.points import points_section

if TYPE_CHECKING:
    from guideload.base.arrays import Array
    from guideload.base.quantities import Quantities
    from guideload.motion.motion import Motion
    from guideload.simulation.result import Result

ANSWER = ("peak_resultant_N", "time_of_peak_s", "dynamic_resultant_N")
MOMENT_HEADINGS = ("|Mx|\nN m", "|My|\nN m", "|Mz|\nN m", "dyn.\nN m")
DEFINITIONS = (
    "Forces of the body on the carriage, in its rail's axes, static load included; moments about the carriage's "
    "centre. Peak, static: resultant sqrt(Fy^2 + Fz^2). f_W: dynamic factor, peak over quasi-static peak (statics "
    "with m a). Dyn.: largest |load - static load|, of (Fy, Fz) and of (Mx, My, Mz); share: dyn. force over peak. "
    "All values are those at the samples."
)


def result_report(result: Result, encoding: str = "utf-8") -> str:
    """The report of a run: largest load, warnings, life, peaks, reactions, modes, motion, method, audit."""
    machine, life = result.machine, life_of_run(result)
    return to_text(
        [
            *answer(result),
            *life_answer(life),
            dofs_line(machine),
            *_peaks_section(result),
            *life_section(life),
            *points_section(result),
            *reactions_section(result),
            *section("Natural modes"),
            modes_table(machine, result.modes),
            *remark(*nominal_lines(machine, "frequencies")),
            *section("Motion"),
            *motion_lines_of(result.quantities),
            *remark(*rider_lines(result)),
            *section("Solution"),
            *solution_lines(result.quantities),
            *section("Audit"),
            *audit_lines(result),
        ],
        encoding=encoding,
    )


def rider_lines(result: Result) -> list[str]:
    """A sentence for each moving rider: its travel, and the force of its drive."""
    data = result.quantities
    if "rider_force" not in data:
        return []
    lines = []
    for i, name in enumerate(data["rider"]):
        place, speed, acceleration, force = (
            data[f"rider_{history}"][:, i] for history in ("position", "velocity", "acceleration", "force")
        )
        lines.append(
            f"rider {name}: from {place.min():.4g} to {place.max():.4g} m, up to {np.abs(speed).max():.3g} m/s and "
            f"{np.abs(acceleration).max():.3g} m/s2; force of its drive up to {load_in_table(np.abs(force).max())} N"
        )
    return lines


def comparison(results: Mapping[str, Result], encoding: str = "utf-8") -> str:
    """Largest load, warnings and peaks of several runs of one machine."""
    parts: list[RenderableType] = []
    for title, result in results.items():
        parts += section(f"{title}: free {', '.join(result.machine.free)}")
        parts += [*answer(result), *peaks_tables(result), *weight_lines(result.machine)]
    bands = dict.fromkeys(line for result in results.values() for line in band_lines(result))
    return to_text([*parts, *remark(DEFINITIONS, *bands)], encoding=encoding)


def motion_report(motion: Motion, encoding: str = "utf-8") -> str:
    """The report of a motion: source, duration, samples, largest values, notes from its trace."""
    return to_text([*section("Motion"), *motion_lines(motion)], encoding=encoding)


def answer(result: Result) -> list[RenderableType]:
    """The largest load with place, time, credible band and dynamic share; then the warnings."""
    data, models, band = result.quantities, result.audit.simpler_models, ""
    if result.machine.carriages:
        kind, peaks = "carriage", result.peak_columns
        at = int(peaks["peak_resultant_N"].argmax())
        peak, time, dynamic = (peaks[column][at] for column in ANSWER)
        if "peak_lower_N" in peaks:
            ends = (load_in_table(peaks[f"peak_{end}_N"][at]) for end in ("lower", "upper"))
            band = f" (95 % credible band {' to '.join(ends)} N)"
    else:
        kind, loads = "link", np.abs(data["link_load"])
        instant, at = divmod(int(loads.argmax()), loads.shape[1])
        peak, time, dynamic = loads[instant, at], data["time"][instant], models.dynamic[at]
    place, share = f"{kind} {models.names[at]}", 100.0 * dynamic / peak if peak else 0.0
    text = (
        f"{result.machine.name}: the largest load is {load_in_table(peak)} N, on {place} at {time:.3f} s{band}. "
        f"Its dynamic part is {load_in_table(dynamic)} N, {share:.1f} %; the peak is "
        f"{models.dynamic_factor[at]:.2f} times the quasi-static peak (statics with m a). {result.audit.verdict}"
    )
    return remark(text, *result.audit.warnings)


def _peaks_section(result: Result) -> list[RenderableType]:
    if not result.machine.carriages:
        return []
    notes = [*remark(DEFINITIONS, *band_lines(result)), *weight_lines(result.machine)]
    return [*section("Peak loads of the carriages"), *peaks_tables(result), *notes]


def peaks_tables(result: Result) -> list[RenderableType]:
    """Tables of forces, moments and, if there are any, credible bands: a row per carriage. See `DEFINITIONS`."""
    peaks = {column: values.tolist() for column, values in result.peak_columns.items()}
    factors = result.audit.simpler_models.dynamic_factor
    headings = ("peak\nN", "at\ns", "|Fy|\nN", "|Fz|\nN", "static\nN", "f_W\n", "dyn.\nN", "share\n%")
    forces, moments = new_table("carriage", *headings), new_table("carriage", *MOMENT_HEADINGS)
    bands = new_table("carriage", "peak\nN", "band\nfrom N", "band\nto N", "noise\n%")
    for i, carriage in enumerate(result.machine.carriages):
        name, row = Text(carriage.name), {column: values[i] for column, values in peaks.items()}
        loads = {column: load_in_table(value) for column, value in row.items()}
        peak, time, dynamic = loads["peak_resultant_N"], f"{row['time_of_peak_s']:.3f}", "dynamic_resultant_N"
        share = 100.0 * row[dynamic] / row["peak_resultant_N"] if row["peak_resultant_N"] else 0.0
        across = (loads[column] for column in ("peak_Fy_N", "peak_Fz_N", "static_resultant_N"))
        forces.add_row(name, peak, time, *across, f"{factors[i]:.2f}", loads[dynamic], f"{share:.1f}")
        moments.add_row(name, *(loads[f"peak_M{axis}_Nm"] for axis in "xyz"), loads["dynamic_moment_Nm"])
        if "noise_share_percent" in row:
            noise = f"{row['noise_share_percent']:.2g}"
            bands.add_row(name, peak, loads["peak_lower_N"], loads["peak_upper_N"], noise)
    return [forces, moments, *([bands] if bands.row_count else [])]


def band_lines(result: Result) -> list[str]:
    """Definition of the credible bands of the peaks; empty without bands."""
    attributes = result.quantities.attrs
    if "band_method" not in attributes:
        return []
    return [
        "Band: 95 % credible band of the largest resultant under the true motion, given the samples, at any time. The "
        "estimated motion is smoother than the true one, so its peak is often low in the band, or below it. Noise: "
        "1.96 standard deviations of the resultant at the time of the peak, over the peak. Method: "
        f"{attributes['band_method']}."
    ]


def audit_lines(result: Result) -> list[str]:
    """The lines of the audit, wrapped and indented by the width of the labels."""
    indent = " " * LABEL
    return [text for line in result.audit.lines for text in wrap(line, WIDTH, subsequent_indent=indent)]


def reactions_section(result: Result) -> list[RenderableType]:
    """Force and torque of the drive, reactions of the other held dofs, loads of extra links."""
    data, machine = result.quantities, result.machine
    time = data["time"]
    table = new_table("", "largest", "at\ns", "static", texts=("",))

    def add(title: str, history: Array, static: Array, unit: str) -> None:
        at = int(np.abs(history).argmax())
        table.add_row(
            Text(title), load_in_table(history[at]), f"{time[at]:.3f}", load_in_table(float(static)), unit
        )

    reactions, static = data.by_label("reaction"), data.by_label("static_reaction")
    for dof in (dof for dof in DOFS[1:] if dof not in machine.free):
        add(f"reaction at L, held {dof}", reactions[dof], static[dof], "N m" if dof.startswith("r") else "N")
    loads, static = data.by_label("link_load"), data.by_label("static_link_load")
    for link in machine.links:
        add(f"link {link.name}", loads[link.name], static[link.name], "N")
    return [*section("Drive and held dofs"), *drive_parts(result), *([table] if table.row_count else [])]


def motion_lines(motion: Motion) -> list[str]:
    """Source, duration, samples, largest speed and acceleration of a motion, and notes from its trace."""
    return [*_motion_lines(motion.time, motion.velocity, motion.acceleration, motion.source, motion.notes)]


def motion_lines_of(data: Quantities) -> list[str]:
    """`motion_lines` of the motion of a result, at the reported instants."""
    velocity = data["cart_velocity"] if "cart_velocity" in data else None
    source, notes = str(data.attrs["motion_source"]), str(data.attrs["motion_notes"]).split("\n")
    return [*_motion_lines(data["time"], velocity, data["cart_acceleration"], source, filter(None, notes))]


def _motion_lines(
    time: Array, velocity: Array | None, acceleration: Array, source: str, notes: Iterable[str]
) -> Iterator[str]:
    if source:
        yield source
    steps = np.diff(time)
    steps = steps[steps > 0]
    if steps.size:
        uniform = steps.max() - steps.min() <= 1e-6 * steps.max()
        step = f"{1e3 * float(np.median(steps)):.4g} ms" + ("" if uniform else " (median; not uniform)")
        yield f"{np.ptp(time):.4g} s, {time.size} samples, every {step}"
    else:
        yield f"a single instant, {time[0]:.4g} s"
    speed = "" if velocity is None else f"speed {_largest(velocity):.4g} m/s, "
    yield f"largest {speed}acceleration {_largest(acceleration):.4g} m/s2"
    yield from notes


def _largest(vectors: Array) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


def payload_lines(data: Quantities) -> list[str]:
    """When payloads come and go; empty without payloads."""
    changes = payload_changes(data)
    stays = [f"from {time:.4g} s {joined(names) if names else 'none'}" for time, names in changes]
    law = "static values are those at the start, natural modes those without payloads"
    return [f"payloads: {', '.join(stays)}; {law}"] if changes else []


def solution_lines(data: Quantities) -> list[str]:
    """Method and its reason; step or tolerance, if the method has one; number of contact changes, if any."""
    attributes = data.attrs
    lines = [f"method {attributes['method']}: {attributes['method_reason']}"]
    if "step_s" in attributes:
        lines.append(f"fixed step {1e3 * float(attributes['step_s']):.4g} ms, without error control")
    elif attributes["method"] != "exact":
        scale, rtol = float(attributes["load_scale_N"]), float(attributes["rtol"])
        lines += [
            f"error tolerance of the link loads {rtol:.1g} of the load scale, {rtol * scale:.1g} N; "
            f"{attributes['steps']} steps, {attributes['rejected_steps']} rejected",
            f"load scale {load_in_table(scale)} N: largest link load at rest plus quasi-static link load under the "
            "peaks of the motion",
        ]
    if attributes.get("start", "rest") != "rest":
        lines.append(
            "start: static equilibrium under the weight, the first acceleration and the first external load, as if "
            "they had acted for long"
        )
    lines += payload_lines(data)
    if changes := int(attributes["contact_changes"]):
        located = attributes["method"] != "exponential"
        how = "located between the samples" if located else "counted from step to step"
        lines.append(f"{changes} contact changes, {how}")
    return lines
