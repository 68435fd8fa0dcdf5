"""The report of step stability: longest stable step of rk45, steps and time of a run, numerical damping."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.audit.motion_plausibility import input_warnings
from guideload.base.number_text import digits, joined, milliseconds, number, scientific
from guideload.method_comparison.step_stability import NEAR, ON_ANY, WITHIN, WITHOUT_EDGES, Stability
from guideload.reports.assumptions import nominal_lines
from guideload.reports.report import Column, Definitions, Report, Section, Table, Value
from guideload.reports.run import motion_lines
from guideload.simulation.stability_function import error_per_period

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


def stability_report(stability: Stability) -> Report:
    """The report: longest stable step, eigenvalues, steps, time and error of runs, amplitude and phase errors."""
    machine = stability.machine
    needed = (
        "Needed steps: rk45 stays below its longest stable step, and steps end at samples. rk45 and implicit step "
        f"over samples on a straight line if no contact changes. rtol {number(stability.rtol)}. Error: largest "
        f"difference from a solution at the tightest tolerance, over its largest load; up to {number(WITHIN)} times "
        "rtol is right."
    )
    return Report.of(
        machine,
        "stability of the steps",
        answer=[f"{machine.name}: {_longest_step(stability)}", _cost(stability), _trial(stability)],
        warnings=input_warnings(machine, stability.motion),
        sections=[
            Section(
                "Longest stable step of rk45",
                _eigenvalues_table(stability),
                Definitions(STEP_DEFINITIONS),
                *nominal_lines(machine, "eigenvalues"),
            ),
            Section(
                "Cost of a motion",
                motion_lines(stability.motion),
                _costs_table(stability),
                Definitions(needed),
            ),
            Section("What is hard in this scene", *_difficulties(stability)),
            Section(
                "Numerical damping of a vibration",
                _damping(stability),
                _periods_table(),
                Definitions(PERIOD_DEFINITIONS),
            ),
        ],
    )


def _longest_step(stability: Stability) -> str:
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
        mode += f" that vibrates at {digits(_hertz(value), 4)} Hz"
        if -value.real <= ALMOST_UNDAMPED * abs(value):
            mode += " almost without damping: with fewer than 6.3 steps per period rk45 slowly adds to its amplitude"
    return (
        f"rk45 is stable up to {milliseconds(stability.predicted_step, 4)} ms: at longer fixed steps its solution "
        f"grows without bound. The limit is set by {mode}."
    )


def _eigenvalues_table(stability: Stability) -> Table:
    """A row per eigenvalue or conjugate pair: damped frequency, damping ratio, longest stable step of rk45."""
    headings = [("",), ("eigenvalue", "1/s", "4 digits"), ("damped", "Hz", "4 digits")]
    headings += [("damping ratio", "%", "3 digits"), ("stable", "ms", "4 digits"), ("moves mostly in",)]
    rows: list[tuple[Value, ...]] = []
    for index in np.flatnonzero(stability.eigenvalues.imag >= 0.0).tolist():
        value = stability.eigenvalues[index]
        shown = digits(value.real, 4)
        vibration: tuple[Value, Value] = "none", "over 100"
        if value.imag > 0.0:
            shown += f" ±{digits(value.imag, 4)}i"
            vibration = _hertz(value), 100.0 * abs(value.real / abs(value))
        limit = "limit" if index == stability.limiting else ""
        stable = 1e3 * stability.longest_steps[index]
        rows.append((limit, shown, *vibration, stable, ", ".join(stability.moving(index))))
    return Table.by_rows(headings, rows)


def _cost(stability: Stability) -> str:
    """What limits the steps of rk45, and which method needs fewer."""
    costs = dict(zip((*ON_ANY, *WITHOUT_EDGES), stability.costs, strict=False))
    exact, rk45, implicit = (costs[method] for method in ("exact", "rk45", "implicit"))
    if stability.limited_by == "samples":
        share = stability.sample_interval / stability.predicted_step
        return (
            f"The samples limit the steps of rk45: their step is {digits(share, 2)} of its longest stable step. "
            "Stability is no limit here."
        )
    if stability.limited_by == "tolerance":
        return "The tolerance limits the steps of rk45: they are shorter than the longest stable step."
    counted = rk45.steps or rk45.needed
    samples = np.count_nonzero(np.diff(stability.motion.time))
    advice = "This takes little time here."
    if counted > NEAR * samples:
        stable = "exact or " if exact.steps else "exponential or " if "exponential" in costs else ""
        advice = f"Use {stable}implicit here."
    return (
        f"Stability limits the steps of rk45 at any tolerance: {digits(counted / samples)} per sample, "
        f"{digits(counted / (implicit.steps or implicit.needed))} times as many as implicit. {advice}"
    )


def _costs_table(stability: Stability) -> Table:
    """A row per method: steps that samples and stability require, steps of the run, time."""
    steps = [(label, "steps", "whole") for label in ("needed", "counted", "rejected")]
    rows: list[tuple[Value, ...]] = []
    for cost in stability.costs:
        counted: tuple[Value, ...] = "none", None, None, None
        if cost.seconds is not None and cost.error is not None:
            counted = cost.steps, cost.rejected, 1e3 * cost.seconds, _small(cost.error)
        rows.append((cost.method, cost.needed, *counted, cost.note))
    return Table.by_rows([("method",), *steps, ("time", "ms", "3 digits"), ("error",), ("note",)], rows)


def _trial(stability: Stability) -> str:
    """Which methods give the loads of this scene."""
    right = [cost.method for cost in stability.costs if not cost.note]
    others = [cost.method for cost in stability.costs if cost.note]
    give = f"{joined(right)} {'give' if len(right) > 1 else 'gives'}" if right else "no method gives"
    but = f"; {joined(others)}: see the note" if others else ""
    return f"Tried on this scene: {give} its loads within {number(WITHIN)} times rtol{but}."


def _difficulties(stability: Stability) -> Iterator[Table | Definitions | str]:
    """A row per feature on which methods fail."""
    if not stability.difficulties:
        yield "Nothing: no contact changes, no jumps, no late pulse, and damping that every method follows."
        return
    yield Table.by_rows([("feature",), ("here",)], [*stability.difficulties.items()])
    yield Definitions(
        "Features on which integration methods fail, as docs/torture.md tries them one by one; whether they fail "
        "here is in the table above."
    )


def _damping(stability: Stability) -> str:
    """Numerical damping of the fastest vibration by implicit with steps from sample to sample."""
    vibrating = stability.eigenvalues[stability.eigenvalues.imag > 0.0]
    if not vibrating.size:
        return "No mode of this machine vibrates: every eigenvalue is real."
    value = vibrating[vibrating.imag.argmax()]
    steps = 2.0 * np.pi / value.imag / stability.sample_interval
    lost, _ = error_per_period("implicit", steps, float(-value.real / np.abs(value)))
    verdict = "its peaks are accurate" if abs(lost) < 0.01 else "use a faster trace to see its peaks"
    return (
        f"The fastest vibration of this machine, {digits(_hertz(value), 4)} Hz, has {digits(steps)} samples per "
        f"period. With steps from sample to sample, implicit changes its amplitude by {_small(abs(lost))} per period: "
        f"{verdict}."
    )


def _periods_table() -> Table:
    """Loss of amplitude and phase lead per period, of rk45 and implicit, for some numbers of steps per period."""
    errors = {
        method: [error_per_period(method, steps) for steps in STEPS_PER_PERIOD] for method in ON_ANY[1:]
    }
    return Table(
        Column("steps per period", [str(steps) for steps in STEPS_PER_PERIOD]),
        *(
            Column(f"{method} {word}", [_small(error[i]) for error in found], unit, "number")
            for i, (word, unit) in enumerate((("lost", ""), ("leads", "rad")))
            for method, found in errors.items()
        ),
    )


def _hertz(eigenvalue: complex) -> float:
    return eigenvalue.imag / (2.0 * np.pi)


def _small(error: float) -> str:
    return scientific(error, 1) if abs(error) >= ROUNDING else "< 1e-13"
