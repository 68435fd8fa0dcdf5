"""Reports of results: largest load, warnings, tables, definitions, audit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from guideload.audit.audit import LABEL
from guideload.audit.figures import STATICS
from guideload.audit.histories import payload_changes
from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.methods import METHODS
from guideload.base.number_text import between, digits, fixed, joined, load_in_table, scientific, seconds
from guideload.base.quantities import Quantities
from guideload.drive.requirements import drive_requirements
from guideload.machine.machine import DOFS
from guideload.motion.motion import Motion
from guideload.reports.assumptions import moments_x, no_roll, placement_lines
from guideload.reports.drive import drive_parts, drive_warnings
from guideload.reports.guides import guides_section
from guideload.reports.life import run_life
from guideload.reports.machine import modes_section
from guideload.reports.points import points_section
from guideload.reports.report import Column, Definitions, Report, Section, Table, Value, warnings_by_title
from guideload.simulation.result import Result

PLACE_DECIMALS = 9  # of m: what lies below is the rounding of a sum of travels
DEFINITIONS = (
    "Forces of the body on the carriage, in its rail's axes, static load included; moments about the carriage's "
    "centre. Peak, static: resultant sqrt(Fy^2 + Fz^2). Factor: dynamic factor, peak over that of a static "
    f"calculation with {STATICS}, without rail errors. Dyn.: largest |load - static load|, of (Fy, Fz) and of "
    "(Mx, My, Mz); share: dyn. force over peak."
)


@checked
def result_report(result: Result) -> Report:
    """The report of a run: largest load, warnings, life, peaks, reactions, modes, motion, method, audit."""
    machine, life, needed = result.machine, run_life(result), drive_requirements(result)
    beyond = [name for name, margin in needed.margins.items() if margin < 1.0]
    drive = [f"NOT REACHED by the drive: {joined(beyond)}."] if beyond else []
    return Report.of(
        machine,
        "load of the guides",
        answer=[_largest_load(result), *drive, *life.answer],
        warnings=[*result.audit.warnings, *drive_warnings(needed), *life.warnings],
        sections=[
            _peaks_section(result),
            *life.sections,
            guides_section(result),
            points_section(result),
            Section("Drive and held dofs", *drive_parts(result, needed), _held_dofs(result)),
            modes_section(machine, result.modes),
            Section("Motion of the cart", _run_motion_lines(result.quantities), *_rider_lines(result)),
            Section("Solution", _solution_lines(result.quantities)),
            Section("Audit", audit_table(result)),
        ],
        failed=life.failed or bool(beyond),
    )


def comparison(results: Mapping[str, Result]) -> Report:
    """Largest load, warnings and peaks of several runs of one machine."""
    bands = dict.fromkeys(line for result in results.values() for line in _band_lines(result))
    definitions = dict.fromkeys(map(_definitions, results.values()))
    return Report(
        title=f"Comparison: {', '.join(results)}",
        warnings=warnings_by_title({title: one.audit.warnings for title, one in results.items()}),
        sections=[
            *(
                Section(
                    f"{title}: free {', '.join(result.machine.free)}",
                    _largest_load(result),
                    *_peaks_tables(result),
                )
                for title, result in results.items()
            ),
            Section("Definitions", *definitions, *bands),
        ],
    )


def _largest_load(result: Result) -> str:
    """The largest load with place, time, credible band and dynamic share."""
    models, largest, band = result.audit.simpler_models, result.largest_load(), ""
    at, peak = largest.index, largest.size
    if result.machine.carriages:
        kind, peaks = "carriage", result.peak_columns
        dynamic = peaks["dynamic_resultant_N"][at]
        if "peak_lower_N" in peaks:
            lower, upper = (load_in_table(peaks[f"peak_{end}_N"][at]) for end in ("lower", "upper"))
            if lower != upper:
                band = f" (noise of the trace alone: {lower} to {upper} N, 95 %)"
    else:
        kind, dynamic = "link", models.dynamic[at]
    return (
        f"{result.machine.name}: the largest load is {load_in_table(peak)} N, on {kind} {largest.name} at "
        f"{seconds(largest.time)} s{band}. Its dynamic part is {load_in_table(dynamic)} N, "
        f"{fixed(100.0 * dynamic / peak if peak else 0.0, 1)} %; the peak is "
        f"{fixed(models.dynamic_factor[at], 2)} times that of a static calculation with {STATICS}."
    )


def _peaks_section(result: Result) -> Section:
    title = "Peak loads of the carriages"
    if not result.machine.carriages:
        return Section(title)
    terms = Definitions(_definitions(result), *_band_lines(result))
    return Section(title, *_peaks_tables(result), *placement_lines(result.machine), terms)


def _definitions(result: Result) -> str:
    known = "peak_resultant" in result.quantities
    peaks = f"Peaks are those at {'any time' if known else 'the reported instants'}."
    return " ".join(filter(None, (DEFINITIONS, peaks, no_roll(result.machine))))


def _peaks_tables(result: Result) -> list[Table]:
    """Tables of forces, moments and, if there are any, credible bands: a row per carriage. See `DEFINITIONS`."""
    peaks, factors = result.peak_columns, result.audit.simpler_models.dynamic_factor
    peak, dynamic = peaks["peak_resultant_N"], peaks["dynamic_resultant_N"]
    share = np.divide(100.0 * dynamic, peak, out=np.zeros_like(peak), where=peak > 0.0)
    names = Column("carriage", [carriage.name for carriage in result.machine.carriages])

    def load(label: str, column: str, unit: str = "N") -> Column:
        return Column(label, peaks[column], unit, "load")

    forces = Table(
        names,
        load("peak", "peak_resultant_N"),
        Column("at", peaks["time_of_peak_s"], "s", "3 decimals"),
        load("|Fy|", "peak_Fy_N"),
        load("|Fz|", "peak_Fz_N"),
        load("static", "static_resultant_N"),
        Column("factor", factors[: len(peak)], "", "factor"),
        load("dyn.", "dynamic_resultant_N"),
        Column("share", share, "%", "1 decimal"),
    )
    roll = Column("|Mx|", moments_x(result.machine, peaks["peak_Mx_Nm"]), "N m", "load")
    axes = (roll, *(load(f"|M{axis}|", f"peak_M{axis}_Nm", "N m") for axis in "yz"))
    tables = [forces, Table(names, *axes, load("dyn.", "dynamic_moment_Nm", "N m"))]
    if "noise_share_percent" in peaks:
        noise = Column("noise", peaks["noise_share_percent"], "%", "2 digits")
        ends = (load(f"band {end}", f"peak_{name}_N") for end, name in (("from", "lower"), ("to", "upper")))
        tables.append(Table(names, load("peak", "peak_resultant_N"), *ends, noise))
    return tables


def _band_lines(result: Result) -> list[str]:
    """Definition of the credible bands of the peaks; empty without bands."""
    attributes = result.quantities.attrs
    if "band_method" not in attributes:
        return []
    return [
        "Band: 95 % credible band of the largest resultant at any time, if noise of the trace is the only uncertainty. "
        "The estimated motion is smoother than the true one, so its peak is often low in the band, or below it. Noise: "
        "1.96 standard deviations of the resultant at the time of the peak, over the peak. Method: "
        f"{attributes['band_method']}."
    ]


def audit_table(result: Result) -> Table:
    """The figures of the audit that are not negligible."""
    lines = result.audit.lines
    return Table(
        Column("figure", [line[:LABEL].strip() for line in lines]),
        Column("finding", [line[LABEL:] for line in lines]),
    )


def _held_dofs(result: Result) -> Table:
    """Reactions of the held dofs but x, and loads of the extra links."""
    data, machine = result.quantities, result.machine
    rows: list[tuple[Value, ...]] = []

    def add(name: str, history: Array, static: Array, unit: str) -> None:
        at = int(np.abs(history).argmax())
        rows.append((name, float(history[at]), data["time"][at], float(static), unit))

    reactions, static = data.by_label("reaction"), data.by_label("static_reaction")
    for dof in (dof for dof in DOFS[1:] if dof not in machine.free):
        add(f"reaction at L, held {dof}", reactions[dof], static[dof], "N m" if dof.startswith("r") else "N")
    loads, static = data.by_label("link_load"), data.by_label("static_link_load")
    for link in machine.links:
        add(f"link {link.name}", loads[link.name], static[link.name], "N")
    headings = [("",), ("largest", "", "load"), ("at", "s", "3 decimals"), ("static", "", "load"), ("unit",)]
    return Table.by_rows(headings, rows)


def _rider_lines(result: Result) -> list[str]:
    """A sentence for each moving rider: its travel, and the force of its drive."""
    data = result.quantities
    if "rider_force" not in data:
        return []
    lines = []
    for i, name in enumerate(data["rider"]):
        place, speed, acceleration, force = (
            data[f"rider_{history}"][:, i] for history in ("position", "velocity", "acceleration", "force")
        )
        fastest, strongest = (digits(np.abs(history).max()) for history in (speed, acceleration))
        low, high = (round(float(end), PLACE_DECIMALS) + 0.0 for end in (place.min(), place.max()))
        lines.append(
            f"rider {name}: from {between(low, high, '4 digits')} m, up to {fastest} m/s and "
            f"{strongest} m/s2; force of its drive up to {load_in_table(np.abs(force).max())} N"
        )
    return lines


def motion_lines(motion: Motion) -> list[str]:
    """Source, duration, samples, largest speed and acceleration of a motion, and notes from its trace."""
    histories = motion.time, motion.velocity, motion.acceleration
    return [*_motion_lines(*histories, motion.source, motion.notes, _samples(motion.sample_times))]


def _run_motion_lines(data: Quantities) -> list[str]:
    """`motion_lines` of the motion of a result, at the reported instants."""
    velocity = data["cart_velocity"] if "cart_velocity" in data else None
    source, notes = str(data.attrs["motion_source"]), str(data.attrs["motion_notes"]).split("\n")
    time, attributes = data["time"], data.attrs
    stamps = int(attributes.get("motion_samples", time.size))  # results of older versions lack it
    count, samples = int(attributes.get("cart_samples", stamps)), _samples(time)
    if count < time.size and attributes["instants"] != "given":
        step = digits(1e3 * float(attributes.get("cart_step_s", attributes["motion_step_s"])), 4)
        where = ["riders, process forces, payloads or rails change"] if count < stamps else []
        where += ["loads are not linear between the samples"] if stamps < time.size else []
        samples = (
            f"{count} samples, every {step} ms (median); histories have {time.size} instants, also where "
        )
        samples += " and where ".join(where)
    return [*_motion_lines(time, velocity, data["cart_acceleration"], source, filter(None, notes), samples)]


def _samples(time: Array) -> str:
    """Number and distance of samples (n,) [s]; empty for a single instant."""
    steps = np.diff(time)
    steps = steps[steps > 0]
    if not steps.size:
        return ""
    uniform = "" if steps.max() - steps.min() <= 1e-6 * steps.max() else " (median; not uniform)"
    return f"{time.size} samples, every {digits(1e3 * float(np.median(steps)), 4)} ms{uniform}"


def _motion_lines(
    time: Array, velocity: Array | None, acceleration: Array, source: str, notes: Iterable[str], samples: str
) -> Iterator[str]:
    if source:
        yield source
    if samples:
        yield f"{digits(np.ptp(time), 4)} s, {samples}"
    else:
        yield f"a single instant, {digits(time[0], 4)} s"
    speed = "" if velocity is None else f"speed {digits(_largest_norm(velocity), 4)} m/s, "
    yield f"largest {speed}acceleration {digits(_largest_norm(acceleration), 4)} m/s2"
    yield from notes


def _largest_norm(vectors: Array) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


def _payload_lines(data: Quantities) -> list[str]:
    """When payloads come and go; empty without payloads."""
    changes = payload_changes(data)
    stays = [f"from {digits(time, 4)} s {joined(names) if names else 'none'}" for time, names in changes]
    law = "static values are those at the start, natural modes those without payloads"
    return [f"payloads: {', '.join(stays)}; {law}"] if changes else []


def _solution_lines(data: Quantities) -> list[str]:
    """Method and its reason; step or tolerance, if the method has one; number of contact changes, if any."""
    attributes = data.attrs
    lines = [f"method {attributes['method']}: {attributes['method_reason']}"]
    if "step_s" in attributes:
        lines.append(f"fixed step {digits(1e3 * float(attributes['step_s']), 4)} ms, without error control")
    elif attributes["method"] != "exact":
        scale, rtol = float(attributes["load_scale_N"]), float(attributes["rtol"])
        lines += [
            f"error tolerance of the link loads {scientific(rtol)} of the load scale, {digits(rtol * scale, 1)} "
            f"N; {attributes['steps']} steps, {attributes['rejected_steps']} rejected",
            f"load scale {load_in_table(scale)} N: largest link load at rest plus quasi-static link load under the "
            "peaks of the motion",
        ]
    if attributes.get("start", "rest") != "rest":
        lines.append(
            "start: static equilibrium under the weight, the first acceleration and the first external load, as if "
            "they had acted for long"
        )
    lines += _payload_lines(data)
    if changes := int(attributes["contact_changes"]):
        located = METHODS[attributes["method"]].locates_changes
        how = "located between the samples" if located else "counted from step to step"
        lines.append(f"{changes} contact changes, {how}")
    return lines
