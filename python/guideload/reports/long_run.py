"""The report of a run over a long record: answer, table of the carriages, definitions."""

from __future__ import annotations

from rich.console import RenderableType
from rich.text import Text

from guideload.base.number_text import counted, load_in_table, percent
from guideload.long_runs.long_run import RESULTANT, LongRun
from guideload.reports.elements import heading, new_table, remark, section, to_text
from guideload.reports.life import kilometres, rating_formulas, unverified_lines

DEFINITION = (
    "R: resultant of Fy and Fz, its largest value and when. P_m: mean equivalent load over the distance. Life: "
    "the travel that the carriage reaches if the record repeats. S0: static safety C0/P0 at the worst instant (ISO "
    "14728-2)."
)

MOST_REPAIRS = 10  # of later blocks that are named


def long_run_report(run: LongRun, encoding: str = "utf-8") -> str:
    """The whole report."""
    return to_text(long_run_parts(run), encoding=encoding)


def long_run_parts(run: LongRun) -> list[RenderableType]:
    """The elements of the report."""
    rated = [one.product for one in run.criteria]
    return [
        *heading(run.machine),
        *remark(_answer(run), *unverified_lines(rated)),
        *section("Carriages"),
        _carriages_table(run),
        *remark(DEFINITION if rated else DEFINITION.partition(" P_m")[0]),
        *([*section("Formulas"), *remark(*rating_formulas(run.criteria))] if rated else ()),
        *section("Motion"),
        *_motion_lines(run),
    ]


def _motion_lines(run: LongRun) -> list[str]:
    """Notes on the motion of the first block, and what was repaired in later ones."""
    first = run.blocks[0].notes
    later = dict.fromkeys(
        note for block in run.blocks[1:] for note in block.notes if note.startswith("repair")
    )
    repairs = [note for note in later if note not in first]
    more = len(repairs) - MOST_REPAIRS
    return [
        *first,
        *repairs[:MOST_REPAIRS],
        *([f"{counted(more, 'more repair')} in later blocks"] if more > 0 else []),
    ]


def _answer(run: LongRun) -> str:
    largest = run.peaks.largest[:, RESULTANT]
    worst = int(largest.argmax())
    text = (
        f"{run.samples} samples over {run.duration / 3600.0:.4g} h, in {counted(len(run.blocks), 'block')}, method "
        f"{run.method}. The largest load is {load_in_table(float(largest[worst]))} N, on carriage "
        f"{run.peaks.carriages[worst]} at {run.peaks.time_of_largest[worst, RESULTANT]:.3f} s."
    )
    if not run.criteria:
        return f"{text} No carriage has a product with ratings, so there is no life."
    safeties, times = run.safeties
    weakest = int(safeties.argmin())
    text += (
        f" The smallest static safety is {safeties[weakest]:.2f}, on carriage {run.criteria[weakest].name} at "
        f"{times[weakest]:.3f} s."
    )
    if not run.distance > 0.0:
        return f"{text} The cart does not move along x, so there is no mean load and no life."
    life, reliability = run.machine_life, run.machine.life.reliability
    return (
        f"{text} In {kilometres(run.distance)} km of travel the probability that a carriage fails is "
        f"{percent(run.used)}; with a probability of {100 * reliability:g} % all carriages last {kilometres(life)} km, "
        f"that is {run.hours(life):.0f} h of such operation."
    )


def _carriages_table(run: LongRun) -> RenderableType:
    peaks, rated = run.peaks, {one.index: k for k, one in enumerate(run.criteria)}
    numbers = ("R\nN", "at\ns", *(("P_m\nN", "life\nkm", "S0\n", "at\ns") if rated else ()))
    table = new_table("carriage", *numbers, texts=("product",) if rated else ())
    for i, name in enumerate(peaks.carriages):
        row = [
            load_in_table(float(peaks.largest[i, RESULTANT])),
            f"{peaks.time_of_largest[i, RESULTANT]:.3f}",
        ]
        if i in rated:
            k = rated[i]
            safeties, times = run.safeties
            row += [
                load_in_table(float(run.mean_loads[k])),
                kilometres(float(run.lives[k])),
                f"{safeties[k]:.2f}",
                f"{times[k]:.3f}",
                run.criteria[k].product.name,
            ]
        table.add_row(Text(name), *map(Text, row))
    return table
