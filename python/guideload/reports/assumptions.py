"""What reports of a machine say of the limits of its model: what is rigid, in place, linear or left out."""

from __future__ import annotations

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import shown
from guideload.base.number_text import joined, load_in_sentence, number
from guideload.machine.machine import Machine
from guideload.reports.report import Value

MISPLACED = 10e-6  # m: rails are aligned to some hundredths of a millimetre


def structure_lines(machine: Machine) -> list[str]:
    """How far the stiffness of the structure around the guides is in the model."""
    compliant = compliant_carriages(machine)
    given = [] if machine.base is None else ["the base ([base])"]
    given += [f"the structure at carriage {joined(compliant)} (compliance)"] if compliant else []
    if given:
        return [
            f"Elastic are the guides and {joined(given)}; all else, as table and body, is rigid in this model."
        ]
    return [
        "The structure, table and base, is rigid in this model: only the guides give way. On an elastic structure "
        "natural frequencies are lower and displacements larger: enter it as [base], or as compliance_y and "
        "compliance_z of the carriages."
    ]


def placement_lines(machine: Machine) -> list[str]:
    """That rails and carriages without mounting errors are exactly in place, and what one of 10 um would change."""
    if machine.mounting_errors.any() or not machine.has_straight_rails or len(machine.carriages) < 2:
        return []
    nominal, changes = machine.static_carriage_loads, {}
    for i, one in enumerate(machine.carriages):
        for axis, error in (("y", (MISPLACED, 0.0)), ("z", (0.0, MISPLACED))):
            moved = [*machine.carriages]
            moved[i] = one.model_copy(update={"mounting_error": error})
            loads = machine.model_copy(update={"carriages": tuple(moved)}).static_carriage_loads
            changes[one.name, axis] = float(np.linalg.norm((loads - nominal)[i, 1:3]))
    name, axis = max(changes, key=changes.__getitem__)
    return [
        f"Rails and carriages are exactly in place in this model. A mounting error of {number(1e6 * MISPLACED)} um of "
        f"carriage {name} along {axis} would change its load by {load_in_sentence(changes[name, axis])}; state errors "
        "as mounting_error of rails and carriages, or let them scatter in a study."
    ]


def nominal_lines(machine: Machine, what: str) -> list[str]:
    """Which stiffness of nonlinear links determines eigenvalues or frequencies; empty for a linear machine."""
    if machine.model_level == "linear":
        return []
    return [
        f"This machine is {machine.model_level}. The {what} are those with all links in contact and nominal stiffness: "
        "the larger of two sides, the stiffness of a preloaded contact at no load, the steepest slope of a curve. "
        "Open or softer links lower them."
    ]


def without_payloads(machine: Machine) -> list[str]:
    """The payloads that modes and static loads leave out, and the way to have them; no line without any."""
    if not machine.payloads:
        return []
    names = joined(f"{one.name} ({number(one.mass)} kg)" for one in machine.payloads)
    way = (
        f"machine.with_payloads([{shown(machine.payloads[0].name)}]) in Python is the machine that carries it"
    )
    return [f"Without payload {names}; {way}."]


def no_roll(machine: Machine) -> str:
    """Why a table has no Mx for some carriages; empty if it has all."""
    if all(one.distances.roll for one in machine.carriages):
        return ""
    return "Mx is not modelled (-) for carriages without width: in the model they do not resist roll."


def moments_x(machine: Machine, moments: Array) -> list[Value]:
    """Moments Mx of the carriages for a table; a dash for those that do not resist roll in the model."""
    return [
        float(moment) if one.distances.roll else "-"
        for one, moment in zip(machine.carriages, moments, strict=True)
    ]


def compliant_carriages(machine: Machine) -> list[str]:
    """Names of the carriages whose structure gives way."""
    return [one.name for one in machine.carriages if one.compliance_y or one.compliance_z]
