"""Reports of sizing: the ranked candidates, and the largest pace, payload, overhang or limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import RenderableType
from rich.text import Text

from guideload.base.number_text import counted, load_in_table
from guideload.reports.elements import new_table, remark, section, to_text
from guideload.reports.life import kilometres, unverified_lines

if TYPE_CHECKING:
    from guideload.catalogue.conditions import LifeConditions
    from guideload.machine.machine import Machine
    from guideload.sizing.limits import Limit
    from guideload.sizing.requirements import Margins
    from guideload.sizing.size import Candidate, Sizing

DEFINITIONS = (
    "Ranked by the dynamic load rating for 100 km. Life: of all carriages together; S0: static safety of the weakest "
    "carriage; margin: smallest ratio of figure to requirement; the criterion that has it fails first. The product "
    "gives ratings and, if its record has them, stiffness, preload and length; damping is scaled so that damping "
    "ratios stay, and the mass stays."
)
UNITS = {
    "pace": "times the given pace",
    "payload": "kg more",
    "overhang": "m more",
    "speed": "m/s as the limit of the speed",
    "acceleration": "m/s2 as the limit of the acceleration",
    "deceleration": "m/s2 as the limit of the deceleration",
    "jerk": "m/s3 as the limit of the jerk",
}


def sizing_report(machine: Machine, sizing: Sizing, encoding: str = "utf-8") -> str:
    """The answer, a row per candidate, and the reasons of those that could not be run."""
    return to_text(sizing_parts(machine, sizing), encoding=encoding)


def sizing_parts(machine: Machine, sizing: Sizing) -> list[RenderableType]:
    """The elements of `sizing_report`."""
    table = new_table(
        "product", "life\nkm", "S0\n", "margin", "drive\nN", "mode 1\nHz", texts=("fails first",)
    )
    for one in sizing.candidates:
        if one.life is None or one.margins is None:
            continue
        mark = "* " if one is sizing.smallest else "  " if one.holds else "- "
        force = "" if one.drive_force != one.drive_force else load_in_table(one.drive_force)
        table.add_row(
            Text(mark + one.name),
            kilometres(one.life.machine),
            f"{one.life.weakest.static.safety:.2f}",
            f"{one.margins.smallest:.2f}",
            force,
            f"{one.first_mode:.3g}",
            one.margins.first_to_fail,
        )
    products = [one.product for one in sizing.candidates if one.life is not None]
    failed = [f"{one.name}: {one.reason}." for one in sizing.candidates if one.reason]
    not_run = [f"{counted(len(failed), 'candidate')} could not be run, see below."] if failed else []
    marks = "* the smallest that holds; - does not hold." if table.row_count else ""
    return [
        *remark(" ".join([_answer(machine, sizing), *not_run]), *unverified_lines(products)),
        *([table] if table.row_count else []),
        *remark(marks, DEFINITIONS),
        *([*section("Not run"), *remark(*failed)] if failed else []),
    ]


def _answer(machine: Machine, sizing: Sizing) -> str:
    wanted = requirements(sizing.conditions)
    found = sizing.smallest
    if found is None:
        return f"{machine.name}: none of {counted(len(sizing.candidates), 'candidate')} reaches {wanted}."
    assert found.margins is not None
    held = f"{machine.name}: the smallest product that reaches {wanted} is {found.name}: {_words(found.margins)}."
    smaller = [one for one in sizing.candidates if one.size < found.size and one.margins is not None]
    return held if not smaller else f"{held} The next smaller one does not: {_next(smaller[-1])}."


def _next(one: Candidate) -> str:
    assert one.margins is not None
    return f"{one.name}: {_words(one.margins)}"


def _words(margins: Margins) -> str:
    return f"{margins.first_to_fail} is {margins.smallest:.2f} times what is wanted"


def requirements(conditions: LifeConditions) -> str:
    """The requirements in words: `20 000 km with 90 % reliability and a static safety of 3`."""
    safety = f"a static safety of {conditions.least_safety:g}"
    if conditions.life is None:
        return safety
    return (
        f"{kilometres(conditions.life)} km with {100 * conditions.reliability:g} % reliability and {safety}"
    )


def limit_report(machine: Machine, limit: Limit, conditions: LifeConditions, encoding: str = "utf-8") -> str:
    """The largest value of a quantity, and what would fail beyond it."""
    wanted = requirements(conditions)
    if limit.value == float("inf"):
        text = f"{machine.name}: the requirement ({wanted}) is met at every {limit.quantity} that was tried."
    else:
        text = (
            f"{machine.name}: the requirement ({wanted}) is met up to {limit.value:.4g} {UNITS[limit.quantity]}. "
            f"Beyond it {limit.margins.first_to_fail} fails first."
        )
    figures = ", ".join(f"{name} {ratio:.3g}" for name, ratio in limit.margins.ratios.items())
    return to_text([*remark(text, f"Figures over requirements there: {figures}.")], encoding=encoding)
