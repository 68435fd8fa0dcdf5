"""The report of a run over a long record: answer, table of the carriages, definitions."""

from __future__ import annotations

from guideload.audit.motion_plausibility import life_warnings
from guideload.audit.plausibility import machine_warnings
from guideload.base.arrays import Array
from guideload.base.number_text import (
    counted,
    digits,
    fixed,
    kilometres,
    load_in_table,
    number,
    seconds,
)
from guideload.life.limits import cycles_notes
from guideload.long_runs.long_run import LongRun
from guideload.reports.life import (
    duty_text,
    life_risk,
    life_verdict,
    life_words,
    rating_formulas,
    risk_text,
    unverified_lines,
)
from guideload.reports.report import Column, Definitions, Report, Section, Table
from guideload.simulation.peaks import RESULTANT

DEFINITION = (
    "R: resultant of Fy and Fz, its largest value and when. P_m: mean equivalent load over the distance. Life: "
    "the travel that the carriage reaches if the record repeats. S0: static safety C0/P0 at the worst instant (ISO "
    "14728-2)."
)

MOST_REPAIRS = 10  # of later blocks that are named
MOST_WARNINGS = 10  # of the motion that are shown


def long_run_report(run: LongRun) -> Report:
    """The whole report."""
    rated = [one.product for one in run.criteria]
    return Report.of(
        run.machine,
        "long record",
        answer=[f"{run.machine.name}: {_answer(run)}"],
        warnings=[*_warnings(run), *unverified_lines(rated)],
        sections=[
            Section(
                "Carriages",
                _carriages_table(run),
                Definitions(DEFINITION if rated else DEFINITION.partition(" P_m")[0]),
            ),
            Section("Formulas", *(rating_formulas(run.criteria) if rated else ())),
            Section("Motion", _motion_lines(run)),
        ],
        failed=not run.holds,
    )


def _warnings(run: LongRun) -> list[str]:
    """Of the motion of all blocks, of the machine, and of the life."""
    of_motion = [text for block in run.blocks for text in block.warnings]
    found = of_motion[:MOST_WARNINGS]
    if (more := len(of_motion) - MOST_WARNINGS) > 0:
        found.append(f"Warning: {counted(more, 'more warning')} of the motion, in later blocks.")
    found += machine_warnings(run.machine)
    if run.criteria:
        found += [f"Warning: {note}." for note in cycles_notes(run.machine.life, run.duration)]
        found += life_warnings(run.hours(run.machine_life)) if run.distance > 0.0 else ()
    return found


def _motion_lines(run: LongRun) -> list[str]:
    """Notes on the motion of the first block, and what was repaired in later ones."""
    first = run.blocks[0].notes
    later = dict.fromkeys(note for block in run.blocks[1:] for note in block.notes)
    repairs = [note for note in later if note.startswith("repair") and note not in first]
    lines = [*first, *repairs[:MOST_REPAIRS]]
    if (more := len(repairs) - MOST_REPAIRS) > 0:
        lines.append(f"{counted(more, 'more repair')} in later blocks")
    return lines


def _answer(run: LongRun) -> str:
    largest = run.peaks.largest[:, RESULTANT]
    worst = int(largest.argmax())
    text = (
        f"{run.samples} samples over {digits(run.duration / 3600.0, 4)} h, in {counted(len(run.blocks), 'block')}, "
        f"method {run.method}. The largest load is {load_in_table(float(largest[worst]))} N, on carriage "
        f"{run.peaks.carriages[worst]} at {seconds(run.peaks.time_of_largest[worst, RESULTANT])} s."
    )
    if not run.criteria:
        return f"{text} No carriage has a product with ratings, so there is no life."
    (safeties, times), conditions = run.safeties, run.machine.life
    weakest = int(safeties.argmin())
    verdict = life_verdict(run.machine_life, run.wanted, float(safeties[weakest]), conditions)
    text = (
        f"{verdict} {text} The smallest static safety is {fixed(safeties[weakest], 2)} (least: "
        f"{number(conditions.least_safety)}), on carriage {run.criteria[weakest].name} at {seconds(times[weakest])} s."
    )
    if not run.distance > 0.0:
        return f"{text} The cart does not move along x, so there is no mean load and no life."
    duty = "of such operation" if conditions.cycles_per_hour is None else duty_text(conditions)
    words = life_words(run.machine_life, run.repetition, conditions, duty, run.wanted)
    return (
        f"{text} In {kilometres(run.distance)} km of travel the probability that a carriage fails is "
        f"{risk_text(run.used)}; with {words}. {life_risk(run.machine_life, run.wanted, conditions)}"
    ).rstrip()


def _carriages_table(run: LongRun) -> Table:
    peaks = run.peaks
    columns = [
        Column("carriage", peaks.carriages),
        Column("R", peaks.largest[:, RESULTANT], "N", "load"),
        Column("at", peaks.time_of_largest[:, RESULTANT], "s", "3 decimals"),
    ]
    if run.criteria:
        row = {one.index: k for k, one in enumerate(run.criteria)}  # of the carriages with ratings
        rows = [row.get(i) for i in range(len(peaks.carriages))]

        def rated(label: str, values: Array, unit: str, kind: str) -> Column:
            return Column(label, [None if k is None else float(values[k]) for k in rows], unit, kind)

        safeties, times = run.safeties
        columns += [
            rated("P_m", run.mean_loads, "N", "load"),
            rated("life", run.repetition.hours(1.0) * run.lives, "h", "hours"),
            rated("life", run.lives, "km", "life"),
            rated("S0", safeties, "", "factor"),
            rated("at", times, "s", "3 decimals"),
            Column("product", [None if k is None else run.criteria[k].product.name for k in rows]),
        ]
    return Table(*columns)
