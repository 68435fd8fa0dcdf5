"""Step limits as text: what keeps the steps of rk45 short, and what the methods do to a vibration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType

from guideload.base.numbers import milliseconds
from guideload.methods.step_stability import METHODS, NEAR
from guideload.reports.elements import WIDTH, heading, new_table, remark, section, to_text
from guideload.reports.machine import nominal_lines
from guideload.reports.result import motion_lines
from guideload.simulation.stability_function import per_period

if TYPE_CHECKING:
    from rich.table import Table

    from guideload.methods.step_stability import Cost, Stability

STEPS_PER_PERIOD = (4, 10, 30, 100)

STEP_DEFINITIONS = (
    "Stable: the longest fixed step of rk45 at which the motion of this eigenvalue cannot grow. exact and "
    "implicit are stable at any step."
)
RING_DEFINITIONS = (
    "Of an undamped mode, over one period, beside the truth: the part of the amplitude that the method itself "
    "takes away, and the phase by which it leads. Both fall with the fifth (rk45) and ninth (implicit) power "
    "of the step or faster. exact makes neither error, with any step."
)


def stability_report(stability: Stability, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The report of step limits: eigenvalues, predicted and measured step, cost, errors per period."""
    parts: list[RenderableType] = [
        *heading(stability.machine),
        *section("How long a step may be"),
        eigenvalues_table(stability),
        *remark(STEP_DEFINITIONS, *step_lines(stability), *nominal_lines(stability.machine, "eigenvalues")),
        *section("What a motion costs"),
        *motion_lines(stability.motion),
        costs_table(stability),
        *remark(*cost_lines(stability)),
        *section("What a method does to a vibration"),
        ring_table(),
        *remark(RING_DEFINITIONS, *damping_lines(stability)),
    ]
    return to_text(parts, width, encoding)


def eigenvalues_table(stability: Stability) -> Table:
    """A row per eigenvalue, one for each pair: damped frequency, damping, longest stable step of rk45."""
    table = new_table("", "eigenvalue\n1/s", "rings at\nHz", "damping\nratio %", "stable\nms")
    table.add_column("moves mostly in")
    for index in _upper(stability):
        value = stability.eigenvalues[index]
        size = float(np.abs(value))
        rings = value.imag > 0.0
        table.add_row(
            "limit" if index == stability.limiting else "",
            f"{value.real:.4g}" + (f" ±{value.imag:.4g}i" if rings else ""),
            f"{value.imag / (2.0 * np.pi):.4g}" if rings else "none",
            f"{abs(100.0 * value.real / size):.3g}" if rings else "over 100",
            f"{1e3 * stability.longest_steps[index]:.4g}",
            ", ".join(stability.moving(index)),
        )
    return table


def step_lines(stability: Stability) -> list[str]:
    """Predicted and measured step, and in words what sets it."""
    predicted, measured = stability.predicted_step, stability.measured_step
    value = stability.eigenvalues[stability.limiting]
    dofs = ", ".join(stability.moving(stability.limiting))
    mode = f"the mode in {dofs}" if dofs else "a mode"
    if value.imag == 0.0:
        why = (
            f"{mode} that dies away within {milliseconds(-3.0 / value.real, 4)} ms: nothing of it is left to see, yet "
            "it sets the step of rk45 for as long as the run lasts"
        )
    elif -value.real <= 1e-3 * abs(value):
        why = (
            f"{mode} that rings at {value.imag / (2.0 * np.pi):.4g} Hz almost without damping: rk45 adds to what "
            "rings, slowly, from fewer than 6.3 steps per period on"
        )
    else:
        why = f"{mode} that rings at {value.imag / (2.0 * np.pi):.4g} Hz"
    return [
        f"rk45 is stable up to {milliseconds(predicted, 4)} ms by theory. Runs with a fixed step begin to grow without "
        f"bound at {milliseconds(measured, 4)} ms, {100.0 * abs(measured / predicted - 1.0):.1f} % from it. What "
        f"limits it is {why}."
    ]


def costs_table(stability: Stability) -> Table:
    """A row per method: the steps that samples and stability ask for, those counted, the time."""
    table = new_table("method", "needed\nsteps", "counted\nsteps", "rejected\nsteps", "time\nms")
    table.add_column("")
    for cost in stability.costs:
        table.add_row(cost.method, str(cost.needed), *_counted(cost), cost.note)
    return table


def cost_lines(stability: Stability) -> list[str]:
    """What sets the steps of rk45, and what it would cost less with."""
    lines = [
        "Needed: no step of rk45 is longer than stable, and none passes a sample, but rk45 and implicit pass those on "
        f"a straight line where no contact changes. rtol {stability.rtol:g}."
    ]
    exact, rk45, implicit = stability.costs
    if stability.limited_by == "samples":
        share = stability.sample_interval / stability.predicted_step
        lines.append(
            f"The samples set the steps of rk45: they are {share:.2g} of its longest stable step apart. "
            "Its stability costs nothing here."
        )
    elif stability.limited_by == "tolerance":
        lines.append("The tolerance sets the steps of rk45, not its stability: they are shorter than stable.")
    else:
        counted = rk45.steps or rk45.needed
        other = implicit.steps or implicit.needed
        samples = np.count_nonzero(np.diff(stability.motion.time))
        advice = f"Use {'exact or implicit' if exact.steps else 'implicit'} here."
        lines.append(
            f"Stability sets the steps of rk45, whatever the tolerance: {counted / samples:.3g} to each sample, "
            f"{counted / other:.3g} times those of implicit. "
            f"{advice if counted > NEAR * samples else 'That costs little here.'}"
        )
    return lines


def ring_table() -> Table:
    """Amplitude lost and phase gained per period by rk45 and implicit, for some steps per period."""
    table = new_table(
        "steps per\nperiod", "rk45\nlost", "implicit\nlost", "rk45\nleads rad", "implicit\nleads rad"
    )
    for steps in STEPS_PER_PERIOD:
        errors = [per_period(method, steps) for method in METHODS[1:]]
        losses = [_small(lost) for lost, _ in errors]
        table.add_row(str(steps), *losses, *(_small(lead) for _, lead in errors))
    return table


def damping_lines(stability: Stability) -> list[str]:
    """What implicit takes from the fastest vibration of the scene when it steps from sample to sample."""
    ringing = stability.eigenvalues[stability.eigenvalues.imag > 0.0]
    if not ringing.size:
        return ["Nothing rings in this machine: every eigenvalue is real."]
    value = ringing[ringing.imag.argmax()]
    steps = 2.0 * np.pi / value.imag / stability.sample_interval
    lost, _ = per_period("implicit", steps, float(-value.real / np.abs(value)))
    verdict = "a peak that is real stays" if abs(lost) < 0.01 else "take a faster trace to see its peaks"
    return [
        f"The fastest vibration of this machine, {value.imag / (2.0 * np.pi):.4g} Hz, has {steps:.3g} samples to a "
        "period. Stepping from sample to sample, implicit changes its amplitude by "
        f"{_small(abs(lost))} per period: {verdict}."
    ]


def _upper(stability: Stability) -> list[int]:
    """Indices of the eigenvalues, of a pair the one with positive imaginary part."""
    return [int(i) for i in np.flatnonzero(stability.eigenvalues.imag >= 0.0)]


def _counted(cost: Cost) -> tuple[str, str, str]:
    if cost.steps is None or cost.seconds is None:
        return "not run", "", ""
    return str(cost.steps), str(cost.rejected), f"{1e3 * cost.seconds:.3g}"


def _small(value: float) -> str:
    """An error of a period, or that it drowns in rounding."""
    return f"{value:.1e}" if abs(value) >= 1e-13 else "< 1e-13"
