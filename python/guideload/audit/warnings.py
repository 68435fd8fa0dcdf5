"""The warnings of the audit: each states a figure beyond its limit and a way out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.audit import figures
from guideload.audit.energy import Energy
from guideload.audit.figures import Contact, Rotation, Sampling
from guideload.audit.force_balance import ForceBalance
from guideload.audit.histories import Histories
from guideload.audit.plausibility import open_row_warnings
from guideload.audit.verification import UNBALANCED, Verification, explained_error, fastest_rate
from guideload.base.number_text import digits, load_in_sentence, number, percent, scientific
from guideload.base.warnings import LIMITS, WarningText
from guideload.machine.modes import Modes

# Change of the loads over that of the motion beyond which a doubt says that errors are amplified.
AMPLIFIED = 1e3
# Error of the energy over its estimate from two orders of quadrature up to which the quadrature may be the cause.
ESTIMATE = 10.0
# Step times the largest eigenvalue magnitude up to which the quadrature resolves the fastest motion: 6 per period.
RESOLVED = 1.0


def rotation_warnings(rotation: Rotation) -> Iterator[WarningText]:
    if not LIMITS["rotation"].holds(max(rotation.largest, rotation.second_order)):
        yield WarningText(
            "rotation",
            f"Warning: the body rotates by {digits(rotation.largest, 2)} rad at {rotation.time:.3f} s; the model "
            f"assumes small rotations, which neglects about {percent(rotation.second_order)} of the load. Make the "
            "guides stiffer or wider; check that stiffness is in N/m.",
        )


def start_warnings(histories: Histories, modes: Modes) -> Iterator[WarningText]:
    """Warn of a motion under way whose run starts at rest: it begins with the response to a sudden start.

    3 / (zeta omega) of the slowest mode later 5 % of this response is left.
    """
    size = np.linalg.norm(histories.cart_acceleration, axis=1)
    share = float(size[0] / size.max()) if size[0] else 0.0
    if histories.start != "rest" or LIMITS["sudden start"].holds(share) or not histories.starts_at_rest:
        return
    slowest = float(-np.real(modes.eigenvalues).max())
    until = float(histories.time[0]) + 3.0 / slowest if slowest > 0 else np.inf
    first = histories.time[figures.peak_instants(histories.data)].min(axis=1)
    names = [carriage.name for carriage in histories.machine.carriages]
    early = [name for name, time in zip(names, first, strict=True) if time < until]
    period = f"until {digits(until)} s" if until < histories.time[-1] else "over the whole run"
    whose = "all carriages" if len(early) == len(names) else ", ".join(early)
    fall = f"peaks of {whose} are in this period" if early else "no peak of a carriage is in this period"
    yield WarningText(
        "sudden start",
        f"Warning: the motion begins at {digits(size[0])} m/s2, but the run starts at rest: {period} the loads "
        f"contain the response to a sudden start; {fall}. For the loads of the motion alone, start it in "
        "the quasi-static state (--start).",
    )


def sampling_warnings(histories: Histories, sampling: Sampling) -> Iterator[WarningText]:
    """Warn of vibration whose peaks may lie between given instants, with a way out that fits the motion."""
    if sampling.per_period is None or sampling.between:
        return
    way_out = "Leave times out: the peaks are then those at any time."
    if not LIMITS["samples"].holds(sampling.per_period):
        yield WarningText(
            "samples",
            f"Warning: a sample every {digits(1e3 / (sampling.per_period * sampling.highest))} ms is coarser than half "
            f"a period of the highest mode, {digits(sampling.highest)} Hz: peaks between the samples are missed. "
            f"{way_out}",
        )
        return
    vibration, peak = figures.vibration(histories)
    missed = sampling.missed * vibration / peak if peak else 0.0
    if not LIMITS["missed vibration"].holds(missed):
        yield WarningText(
            "missed vibration",
            f"Warning: {digits(sampling.per_period)} samples per period of the highest mode, "
            f"{digits(sampling.highest)} Hz: a vibration of {load_in_sentence(vibration)}, if it is of this mode, has "
            f"peaks between the samples up to {percent(missed)} above the largest load. {way_out}",
        )


def force_doubts(balance: ForceBalance) -> Iterator[str]:
    """Doubt a result whose loads do not balance the inertia of the body."""
    if not balance.holds:
        yield (
            f"Doubtful: at {balance.place}, {number(balance.time)} s, motion and loads do not belong together: their "
            f"force balance is off by {scientific(balance.residual, 1)} of its terms, and only rounding, about 1e-15, "
            "is explained. The numbers were changed or lost digits: compute them again, and check for extreme "
            "positions and stiffnesses."
        )


def solution_doubts(
    histories: Histories, second: Verification | str | None, energy: Energy | None
) -> Iterator[str]:
    """Doubt a result that a second solution contradicts or, without one, whose energy does not balance."""
    if isinstance(second, Verification):
        if not second.predictable:
            yield (
                f"Doubtful: impacts amplify small differences: a motion times 1 + {scientific(second.perturbation)} "
                f"changes loads by up to {percent(second.sensitivity or np.nan)} of the largest load. No method can "
                "predict such impacts, and peaks may change as much. Damping that always acts (damping_in_contact = "
                "false), more damping or less clearance makes the loads predictable."
            )
        elif not second.agrees:
            yield _contradiction(histories, second)
    elif energy is not None and not energy.residual <= UNBALANCED and not _explained(histories, energy):
        yield (
            f"Doubtful: {percent(energy.residual)} of the exchanged energy, {digits(energy.exchanged)} J, does not "
            "balance: the solution is not accurate. Use a smaller rtol, a smaller step or another method."
        )


def _contradiction(histories: Histories, second: Verification) -> str:
    """The doubt about a result that differs from a second solution."""
    attributes = histories.data.attrs
    if "step_s" in attributes:
        way_out = "Use a shorter step, or rtol instead of a step."
    elif attributes["method"] == "exact":
        way_out = (
            "Method exact has no step error: look for extreme values in the machine, and compare with rk45."
        )
    else:
        way_out = f"Use a smaller rtol or method {second.method}."
        if (second.sensitivity or 0.0) > AMPLIFIED * second.perturbation:
            share = percent(second.sensitivity or 0.0)
            amplified = f"a motion times 1 + {scientific(second.perturbation)} changes loads by {share}"
            way_out = f"Contacts amplify errors: {amplified}. {way_out}"
    explained = second.explained * float(attributes["load_scale_N"])
    return (
        f"Doubtful: another solution, by {second.words}, differs by {digits(second.newtons)} N in the load of "
        f"{second.link} at {number(second.time)} s, {percent(second.difference)} of the load scale; only "
        f"{digits(explained, 1)} N are explained. {way_out}"
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


def contact_warnings(histories: Histories, contact: Contact) -> Iterator[WarningText]:
    """Warn of preloaded links that open a row. Links with clearance lose contact by design: no warning."""
    longest = contact.share[contact.preloaded].max(initial=0.0)
    largest = np.abs(histories.data["link_load_elastic"]).max(axis=0)
    return open_row_warnings(histories.links, largest, f"for up to {percent(longest)} of the time")
