"""The warnings of the audit: each names a figure beyond its limit and a way out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.audit import figures
from guideload.audit.energy import Energy
from guideload.audit.figures import FEWEST_PER_PERIOD, Contact, Rotation, Sampling
from guideload.audit.histories import Histories
from guideload.base.arrays import Array
from guideload.base.number_text import first_names, percent
from guideload.machine.links import LinkTable
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes, moving_dofs

# Limits above which there is a warning; of samples, below which.
LARGE_ROTATION = 1e-2  # rad: the loads are then wrong by about as much
LARGE_SECOND_ORDER = 0.01  # of the largest link load
SENSITIVE = 1e-3  # of the largest link load, for a change of the motion by `figures.NUDGE`
UNBALANCED = 0.01  # of the energy turned over
# First acceleration, of the largest, above which a motion does not start at rest; smoothed standstill stays below.
UNDER_WAY = 0.2


def free_at_rest(machine: Machine) -> tuple[tuple[str, ...], ...]:
    """For each motion that the body is free to make within its clearance at rest, the dofs of L in it."""
    return tuple(tuple(moving_dofs(machine, shape)) for shape in machine.scene.free_at_rest)


def rest_notes(motions: tuple[tuple[str, ...], ...]) -> list[str]:
    """A note on where a body starts that is free at rest in these motions, as from `free_at_rest`."""
    if not motions:
        return []
    dofs = ", and in ".join(" with ".join(motion) for motion in motions)
    return [
        f"Note: at rest the body is free within its clearance in {dofs}: it starts where very weak springs would "
        "centre it. Preload, or a process force in the motion, makes the start definite."
    ]


def rotation_warnings(rotation: Rotation) -> Iterator[str]:
    if rotation.largest > LARGE_ROTATION or rotation.second_order > LARGE_SECOND_ORDER:
        yield (
            f"Note: the body turns by {rotation.largest:.2g} rad at {rotation.time:.3f} s; the model takes rotations "
            f"as small, which leaves out about {percent(rotation.second_order)} of the load. Stiffer or wider guides "
            "turn less; is stiffness in N/m?"
        )


def start_warnings(histories: Histories, modes: Modes) -> Iterator[str]:
    """The effect of a motion that does not start at rest: the run does, so the loads are those of a sudden start.

    After 3 / (zeta omega) of the slowest mode 5 % of that is left.
    """
    size = np.linalg.norm(histories.cart_acceleration, axis=1)
    if size[0] <= UNDER_WAY * size.max() or not histories.starts_at_rest:
        return
    slowest = float(-np.real(modes.eigenvalues).max())
    until = float(histories.time[0]) + 3.0 / slowest if slowest > 0 else np.inf
    first = histories.time[figures.peak_instants(histories.data)].min(axis=1)
    names = [carriage.name for carriage in histories.machine.carriages]
    early = [name for name, time in zip(names, first, strict=True) if time < until]
    if until < histories.time[-1]:
        period = f"until {until:.3g} s"
        way_out = "record from standstill, or read the peaks after that"
    else:
        period, way_out = "over the whole run", "record from standstill"
    whose = "all carriages" if len(early) == len(names) else ", ".join(early)
    fall = f"peaks of {whose} fall into it" if early else "no carriage's peak falls into it"
    yield (
        f"Note: the motion begins at {size[0]:.3g} m/s2, but a run starts at rest: {period} the loads are those "
        f"of a sudden start; {fall}. To see those of the motion, {way_out}."
    )


def sampling_warnings(sampling: Sampling) -> Iterator[str]:
    if sampling.per_period is not None and sampling.per_period < FEWEST_PER_PERIOD:
        yield (
            f"Note: a sample every {1e3 / (sampling.per_period * sampling.highest):.3g} ms is coarser than half a "
            f"period of the highest mode, {sampling.highest:.3g} Hz: peaks between the samples are missed. Take a "
            "faster trace, or in Python report at finer instants: simulate(machine, motion, times=...)."
        )


def energy_warnings(energy: Energy | None, coarse: bool) -> Iterator[str]:
    """Where the energy does not balance: the solver, unless the samples are too coarse, which is said only once.

    Samples are too coarse where the two quadratures differ by a tenth of the residual or more.
    """
    if energy is None or energy.residual <= UNBALANCED:
        return
    share = (
        f"{percent(energy.residual)} of the energy turned over, {energy.turned_over:.3g} J, does not balance"
    )
    if energy.resolution < 0.1 * energy.residual:
        way_out = "Lower rtol, or take a smaller step or another method."
        yield f"Note: {share}: the solution is not accurate. {way_out}"
    elif not coarse:
        way_out = "Report at finer instants: simulate(..., times=...)."
        yield f"Note: {share}: the samples are too coarse to judge the solution. {way_out}"


def sensitivity_warnings(sensitivity: float | None) -> Iterator[str]:
    if sensitivity is not None and sensitivity > SENSITIVE:
        yield (
            f"Note: impacts multiply small differences here: a motion larger by {figures.NUDGE:.0e} of it changes "
            f"loads by up to {percent(sensitivity)} of the largest. No method predicts the course of such impacts, and "
            "peaks may change as much. Damping that always acts (no damping_in_contact), more damping or less "
            "clearance makes them definite."
        )


def contact_warnings(histories: Histories, contact: Contact) -> list[str]:
    """Preloaded contacts of which a row opens. Contacts with clearance are expected to part."""
    longest = contact.share[contact.preloaded].max(initial=0.0)
    largest = np.abs(histories.data["link_load_elastic"]).max(axis=0)
    return open_row_notes(histories.links, largest, f"for up to {percent(longest)} of the time")


def open_row_notes(links: LinkTable, loads: Array, when: str) -> list[str]:
    """A note on preloaded links of which these elastic loads (link,) N open a row, and on the preload needed."""
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
        f"rollers carry nothing then. {max(ratios.values()):.3g} times the preload would keep all rows loaded."
    ]
