"""The warnings of the audit: each states a figure beyond its limit and a way out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.audit import figures
from guideload.audit.energy import Energy
from guideload.audit.figures import FEWEST_PER_PERIOD, Contact, Rotation, Sampling
from guideload.audit.force_balance import ForceBalance
from guideload.audit.histories import Histories
from guideload.audit.second_look import UNBALANCED, SecondLook, explained_error, fastest_rate
from guideload.base.arrays import Array
from guideload.base.number_text import first_names, percent, scientific
from guideload.machine.links import LinkTable
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes, moving_dofs

# Limits above which there is a warning.
LARGE_ROTATION = 1e-2  # rad; the relative error of the loads is about as large
LARGE_SECOND_ORDER = 0.01  # of the largest link load
# Change of the loads over that of the motion beyond which a doubt says that errors are amplified.
AMPLIFIED = 1e3
# Error of the energy over its estimate from two orders of quadrature up to which the quadrature may be the cause.
ESTIMATE = 10.0
# Step times the largest eigenvalue magnitude up to which the quadrature resolves the fastest motion: 6 per period.
RESOLVED = 1.0
# First acceleration over the largest, above which a motion does not start at rest; smoothed standstill is below it.
MOVING_START = 0.2


def free_at_rest(machine: Machine) -> tuple[tuple[str, ...], ...]:
    """Dofs of L in each motion in which the body is free within its clearance at rest."""
    return tuple(tuple(moving_dofs(machine, shape)) for shape in machine.scene.free_at_rest)


def rest_notes(motions: tuple[tuple[str, ...], ...]) -> list[str]:
    """A note on the starting position of a body that is free at rest in these `motions` of `free_at_rest`."""
    if not motions:
        return []
    dofs = ", and in ".join(" with ".join(motion) for motion in motions)
    return [
        f"Note: at rest the body is free within its clearance in {dofs}: it starts where very weak springs would "
        "centre it. Preload or a process force defines the start."
    ]


def rotation_warnings(rotation: Rotation) -> Iterator[str]:
    if rotation.largest > LARGE_ROTATION or rotation.second_order > LARGE_SECOND_ORDER:
        yield (
            f"Note: the body rotates by {rotation.largest:.2g} rad at {rotation.time:.3f} s; the model assumes small "
            f"rotations, which neglects about {percent(rotation.second_order)} of the load. Make the guides stiffer or "
            "wider; check that stiffness is in N/m."
        )


def start_warnings(histories: Histories, modes: Modes) -> Iterator[str]:
    """Warn of a motion under way whose run starts at rest: it begins with the response to a sudden start.

    3 / (zeta omega) of the slowest mode later 5 % of this response is left.
    """
    size = np.linalg.norm(histories.cart_acceleration, axis=1)
    if histories.start != "rest" or size[0] <= MOVING_START * size.max() or not histories.starts_at_rest:
        return
    slowest = float(-np.real(modes.eigenvalues).max())
    until = float(histories.time[0]) + 3.0 / slowest if slowest > 0 else np.inf
    first = histories.time[figures.peak_instants(histories.data)].min(axis=1)
    names = [carriage.name for carriage in histories.machine.carriages]
    early = [name for name, time in zip(names, first, strict=True) if time < until]
    if until < histories.time[-1]:
        period = f"until {until:.3g} s"
    else:
        period = "over the whole run"
    whose = "all carriages" if len(early) == len(names) else ", ".join(early)
    fall = f"peaks of {whose} are in this period" if early else "no peak of a carriage is in this period"
    yield (
        f"Note: the motion begins at {size[0]:.3g} m/s2, but the run starts at rest: {period} the loads "
        f"contain the response to a sudden start; {fall}. For the loads of the motion alone, start it in "
        "the quasi-static state (--start)."
    )


def sampling_warnings(sampling: Sampling) -> Iterator[str]:
    if sampling.per_period is not None and sampling.per_period < FEWEST_PER_PERIOD:
        yield (
            f"Note: a sample every {1e3 / (sampling.per_period * sampling.highest):.3g} ms is coarser than half a "
            f"period of the highest mode, {sampling.highest:.3g} Hz: peaks between the samples are missed. Use "
            "a faster trace, or in Python report finer instants: simulate(machine, motion, times=...)."
        )


def force_doubts(balance: ForceBalance) -> Iterator[str]:
    """Doubt a result whose loads do not balance the inertia of the body."""
    if not balance.holds:
        yield (
            f"Doubtful: at {balance.place}, {balance.time:.6g} s, motion and loads do not belong together: their force "
            f"balance is off by {scientific(balance.residual, 1)} of its terms, and only rounding, about 1e-15, is "
            "explained. The numbers were changed or lost digits: compute them again, and check for extreme positions "
            "and stiffnesses."
        )


def solution_doubts(
    histories: Histories, look: SecondLook | str | None, energy: Energy | None
) -> Iterator[str]:
    """Doubt a result that a second solution contradicts or, without one, whose energy does not balance."""
    if isinstance(look, SecondLook):
        if not look.predictable:
            yield (
                f"Doubtful: impacts amplify small differences: a motion times 1 + {scientific(look.perturbation)} "
                f"changes loads by up to {percent(look.sensitivity or np.nan)} of the largest load. No method can "
                "predict such impacts, and peaks may change as much. Damping that always acts (damping_in_contact = "
                "false), more damping or less clearance makes the loads predictable."
            )
        elif not look.agrees:
            yield _contradiction(histories, look)
    elif energy is not None and not energy.residual <= UNBALANCED and not _explained(histories, energy):
        yield (
            f"Doubtful: {percent(energy.residual)} of the exchanged energy, {energy.exchanged:.3g} J, does not "
            "balance: the solution is not accurate. Use a smaller rtol, a smaller step or another method."
        )


def _contradiction(histories: Histories, look: SecondLook) -> str:
    """The doubt about a result that differs from a second solution."""
    attributes = histories.data.attrs
    if "step_s" in attributes:
        way_out = "Use a shorter step, or rtol instead of a step."
    elif attributes["method"] == "exact":
        way_out = (
            "Method exact has no step error: look for extreme values in the machine, and compare with rk45."
        )
    else:
        way_out = f"Use a smaller rtol or method {look.method}."
        if (look.sensitivity or 0.0) > AMPLIFIED * look.perturbation:
            share = percent(look.sensitivity or 0.0)
            amplified = f"a motion times 1 + {scientific(look.perturbation)} changes loads by {share}"
            way_out = f"Contacts amplify errors: {amplified}. {way_out}"
    explained = look.explained * float(attributes["load_scale_N"])
    return (
        f"Doubtful: another solution, by {look.words}, differs by {look.newtons:.3g} N in the load of {look.link} at "
        f"{look.time:.6g} s, {percent(look.difference)} of the load scale; only {explained:.1g} N are explained. "
        f"{way_out}"
    )


def _explained(histories: Histories, energy: Energy) -> bool:
    """Whether quadrature or tolerance explain the error of the energy balance.

    An error of a link load does work along the path of the link.
    """
    steps, rate = np.diff(histories.time), np.abs(histories.velocity @ histories.rows.T)
    path = float(steps @ (rate[1:] + rate[:-1]).sum(axis=1)) / 2.0
    error = explained_error(histories.data.attrs) * float(histories.data.attrs["load_scale_N"])
    return (
        energy.residual <= ESTIMATE * energy.resolution + energy.crossed
        or energy.residual * energy.exchanged <= error * path
        or float(steps.max(initial=0.0)) * fastest_rate(histories) > RESOLVED
    )


def contact_warnings(histories: Histories, contact: Contact) -> list[str]:
    """Warn of preloaded links that open a row. Links with clearance lose contact by design: no warning."""
    longest = contact.share[contact.preloaded].max(initial=0.0)
    largest = np.abs(histories.data["link_load_elastic"]).max(axis=0)
    return open_row_notes(histories.links, largest, f"for up to {percent(longest)} of the time")


def open_row_notes(links: LinkTable, loads: Array, when: str) -> list[str]:
    """A note on the preloaded links that elastic loads (link,) [N] open, and on the preload that they need."""
    ratios = {
        name: float(load / law.force(law.edges[-1:])[0])
        for name, law, load in zip(links.names, links.laws, loads, strict=True)
        if law.kind == "preloaded"
    }
    opened = [name for name, ratio in ratios.items() if ratio >= 1.0]
    if not opened:
        return []
    return [
        f"Note: {first_names(opened)} {'has' if len(opened) == 1 else 'have'} a row open {when}: half of the balls or "
        f"rollers then carry no load. {max(ratios.values()):.3g} times the preload would keep all rows loaded."
    ]
