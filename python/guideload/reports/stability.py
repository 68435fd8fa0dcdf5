"""The report of step stability: longest stable step of rk45, steps and time of a run, numerical damping."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType

from guideload.base.number_text import milliseconds
from guideload.method_comparison.step_stability import METHODS, NEAR
from guideload.reports.elements import WIDTH, heading, new_table, remark, section, to_text
from guideload.reports.machine import nominal_lines
from guideload.reports.run import motion_lines
from guideload.simulation.stability_function import error_per_period

if TYPE_CHECKING:
    from rich.table import Table

    from guideload.method_comparison.step_stability import Cost, Stability

STEPS_PER_PERIOD = (4, 10, 30, 100)
ROUNDING = 1e-13  # in the error over one period
ALMOST_UNDAMPED = 1e-3  # damping ratio

STEP_DEFINITIONS = (
    "Stable: longest fixed step at which rk45 does not amplify the motion of this eigenvalue. The other methods are "
    "stable at any step."
)
PERIOD_DEFINITIONS = (
    "Lost, leads: relative loss of amplitude (negative: gain) and phase lead of an undamped mode over one period, "
    "against the exact solution. Both fall with the fifth (rk45) and ninth (implicit) power of the step or faster. "
    "exact and exponential have neither error at any step."
)


def stability_report(stability: Stability, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The report: longest stable step, eigenvalues, steps and time of a run, amplitude and phase errors."""
    parts: list[RenderableType] = [
        *heading(stability.machine),
        *section("Longest stable step of rk45"),
        *step_lines(stability),
        eigenvalues_table(stability),
        *remark(STEP_DEFINITIONS, *nominal_lines(stability.machine, "eigenvalues")),
        *section("Cost of a motion"),
        cost_line(stability),
        *motion_lines(stability.motion),
        costs_table(stability),
        *remark(
            "Needed steps: rk45 stays below its longest stable step, and steps end at samples. rk45 and implicit step "
            f"over samples on a straight line if no contact changes. rtol {stability.rtol:g}."
        ),
        *section("Numerical damping of a vibration"),
        damping_line(stability),
        periods_table(),
        *remark(PERIOD_DEFINITIONS),
    ]
    return to_text(parts, width, encoding)


def step_lines(stability: Stability) -> list[str]:
    """The longest stable step of rk45, and the mode that limits it."""
    value = stability.eigenvalues[stability.limiting]
    dofs = ", ".join(stability.moving(stability.limiting))
    mode = f"the mode in {dofs}" if dofs else "a mode"
    if value.imag == 0.0:
        mode += (
            f" that decays within {milliseconds(-3.0 / value.real, 4)} ms, but limits the step of "
            "rk45 for the whole run"
        )
    else:
        mode += f" that vibrates at {_hertz(value)}"
        if -value.real <= ALMOST_UNDAMPED * abs(value):
            mode += " almost without damping: with fewer than 6.3 steps per period rk45 slowly adds to its amplitude"
    return [
        f"rk45 is stable up to {milliseconds(stability.predicted_step, 4)} ms: at longer fixed steps its solution "
        f"grows without bound. The limit is set by {mode}."
    ]


def eigenvalues_table(stability: Stability) -> Table:
    """A row per eigenvalue or conjugate pair: damped frequency, damping ratio, longest stable step of rk45."""
    table = new_table("", "eigenvalue\n1/s", "damped\nHz", "damping\nratio %", "stable\nms")
    table.add_column("moves mostly in")
    for index in np.flatnonzero(stability.eigenvalues.imag >= 0.0).tolist():
        value = stability.eigenvalues[index]
        vibrates = value.imag > 0.0
        table.add_row(
            "limit" if index == stability.limiting else "",
            f"{value.real:.4g}" + (f" ±{value.imag:.4g}i" if vibrates else ""),
            _hertz(value).removesuffix(" Hz") if vibrates else "none",
            f"{abs(100.0 * value.real / abs(value)):.3g}" if vibrates else "over 100",
            f"{1e3 * stability.longest_steps[index]:.4g}",
            ", ".join(stability.moving(index)),
        )
    return table


def cost_line(stability: Stability) -> str:
    """What limits the steps of rk45, and which method needs fewer."""
    exact, rk45, implicit, *exponential = stability.costs
    if stability.limited_by == "samples":
        share = stability.sample_interval / stability.predicted_step
        return (
            f"The samples limit the steps of rk45: their step is {share:.2g} of its longest stable step. "
            "Stability is no limit here."
        )
    if stability.limited_by == "tolerance":
        return "The tolerance limits the steps of rk45: they are shorter than the longest stable step."
    counted = rk45.steps or rk45.needed
    samples = np.count_nonzero(np.diff(stability.motion.time))
    advice = "This takes little time here."
    if counted > NEAR * samples:
        stable = "exact or " if exact.steps else "exponential or " if exponential else ""
        advice = f"Use {stable}implicit here."
    return (
        f"Stability limits the steps of rk45 at any tolerance: {counted / samples:.3g} per sample, "
        f"{counted / (implicit.steps or implicit.needed):.3g} times as many as implicit. {advice}"
    )


def costs_table(stability: Stability) -> Table:
    """A row per method: steps that samples and stability require, steps of the run, time."""
    table = new_table("method", "needed\nsteps", "counted\nsteps", "rejected\nsteps", "time\nms")
    table.add_column("")
    for cost in stability.costs:
        table.add_row(cost.method, str(cost.needed), *_counted(cost), cost.note)
    return table


def damping_line(stability: Stability) -> str:
    """Numerical damping of the fastest vibration by implicit with steps from sample to sample."""
    vibrating = stability.eigenvalues[stability.eigenvalues.imag > 0.0]
    if not vibrating.size:
        return "No mode of this machine vibrates: every eigenvalue is real."
    value = vibrating[vibrating.imag.argmax()]
    steps = 2.0 * np.pi / value.imag / stability.sample_interval
    lost, _ = error_per_period("implicit", steps, float(-value.real / np.abs(value)))
    verdict = "its peaks are accurate" if abs(lost) < 0.01 else "use a faster trace to see its peaks"
    return (
        f"The fastest vibration of this machine, {_hertz(value)}, has {steps:.3g} samples per period. With steps "
        f"from sample to sample, implicit changes its amplitude by {_small(abs(lost))} per period: {verdict}."
    )


def periods_table() -> Table:
    """Loss of amplitude and phase lead per period, of rk45 and implicit, for some numbers of steps per period."""
    table = new_table(
        "steps per\nperiod", "rk45\nlost", "implicit\nlost", "rk45\nleads rad", "implicit\nleads rad"
    )
    for steps in STEPS_PER_PERIOD:
        errors = [error_per_period(method, steps) for method in METHODS[1:]]
        table.add_row(str(steps), *(_small(method[i]) for i in (0, 1) for method in errors))
    return table


def _hertz(eigenvalue: complex) -> str:
    return f"{eigenvalue.imag / (2.0 * np.pi):.4g} Hz"


def _counted(cost: Cost) -> tuple[str, str, str]:
    if cost.steps is None or cost.seconds is None:
        return "not run", "", ""
    return str(cost.steps), str(cost.rejected), f"{1e3 * cost.seconds:.3g}"


def _small(error: float) -> str:
    return f"{error:.1e}" if abs(error) >= ROUNDING else "< 1e-13"
