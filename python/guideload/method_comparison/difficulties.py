"""What makes a scene hard for integration methods: the features of docs/torture.md that a machine and a motion have."""

from __future__ import annotations

import numpy as np

from guideload._core import Solution
from guideload.base.arrays import Array, Complex, find_runs, median_step
from guideload.base.number_text import counted, digits, scientific
from guideload.machine.machine import Machine
from guideload.method_comparison.diagram import Reference
from guideload.motion.motion import Motion

HARDLY_DAMPED = 1e-3  # damping ratio: the damping of a method itself may be larger
QUICK_DECAY = 10.0  # time constants between two samples, which an explicit method must follow
SENSITIVE = 100.0  # times the tolerance: growth of an error over the motion
LONG_REST = 10.0  # times the excitation after it: a step that grows during the rest passes over it


def difficulties(
    machine: Machine,
    motion: Motion,
    solution: Solution,
    reference: Reference,
    eigenvalues: Complex,
) -> dict[str, str]:
    """The features of a scene on which methods fail, and their size here; none if it is easy.

    solution: of the reference, at the samples of the motion. eigenvalues: (m,) 1/s, of the machine.
    """
    found = {
        "contact changes": _contacts(machine, solution),
        "growth of errors": _growth(reference),
        "damping": _damping(motion, eigenvalues),
        "jumps of the excitation": _jumps(motion),
        "a pulse after a rest": _late_pulse(motion),
    }
    return {feature: here for feature, here in found.items() if here}


def _contacts(machine: Machine, solution: Solution) -> str:
    """How many contact changes there are, and how many of them the samples do not show."""
    if not solution.contact_changes:
        return ""
    loads, shown = solution.link_loads("elastic"), 0
    for load, law in zip(loads.T, machine.link_table().laws, strict=True):
        # Two per edge that the load has passed, one per edge that it is at, as within a clearance.
        edges = law.force(law.edges)
        passed = sum(np.searchsorted(edges, load, side) for side in ("left", "right"))
        shown += int(np.abs(np.diff(passed)).sum()) // 2
    hidden = max(solution.contact_changes - shown, 0)
    between = f", {hidden} of them between two samples that do not show it" if hidden else ""
    return f"{solution.contact_changes}{between}"


def _growth(reference: Reference) -> str:
    """How far two runs at the tightest tolerances are apart, as after many impacts."""
    if reference.limit is None or reference.check is None or reference.check.kind != "rtol":
        return ""
    tolerance = (reference.check.value or 0.0) * reference.largest_load
    if reference.limit <= SENSITIVE * tolerance:
        return ""
    return (
        f"{reference.setting.text} and {reference.check.text} are {scientific(reference.limit / tolerance)} times that "
        "tolerance apart: small differences grow, so only statistics of such loads can be predicted"
    )


def _damping(motion: Motion, eigenvalues: Complex) -> str:
    """Vibrations that hardly decay, and decays that are over within a part of the interval between samples."""
    interval = median_step(motion.time)
    sizes = np.abs(eigenvalues)
    hardly = eigenvalues[(eigenvalues.imag > 0.0) & (-eigenvalues.real < HARDLY_DAMPED * sizes)]
    quick = -eigenvalues.real[(eigenvalues.imag == 0.0) & (-eigenvalues.real * interval > QUICK_DECAY)]
    texts = []
    if hardly.size:
        modes = counted(hardly.size, "vibration")
        texts.append(f"{modes} damped by less than {digits(100.0 * HARDLY_DAMPED)} %")
    if quick.size:
        texts.append(
            f"a decay at {digits(float(quick.max()))} 1/s between samples {digits(1e3 * interval)} ms apart"
        )
    return "; ".join(texts)


def _jumps(motion: Motion) -> str:
    """How often the excitation changes without a time between."""
    jumps = (np.diff(motion.time) == 0.0) & np.diff(excitation(motion), axis=0).any(axis=1)
    return str(int(jumps.sum())) if jumps.any() else ""


def _late_pulse(motion: Motion) -> str:
    """The longest rest whose excitation after it is far shorter."""
    first, end = find_runs(np.asarray(excitation(motion).any(axis=1)))
    pulses = motion.time[np.minimum(end, motion.time.size - 1)] - motion.time[first]
    rests = motion.time[first] - motion.time[np.append(0, end)[:-1]]
    late = np.flatnonzero(rests > LONG_REST * pulses)
    if not late.size:
        return ""
    longest = int(late[rests[late].argmax()])
    return f"{digits(rests[longest])} s of rest, then {digits(pulses[longest])} s of excitation"


def excitation(motion: Motion) -> Array:
    """(time, 3 or 9) acceleration [m/s2], and force and moment [N, N m] if the motion has any."""
    return motion.acceleration if motion.wrench is None else np.hstack([motion.acceleration, motion.wrench])
