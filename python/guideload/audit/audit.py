"""The audit of a result: figures and warnings on its model, samples, excitation and energy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from guideload.audit import figures
from guideload.audit.energy import Energy, energy
from guideload.audit.figures import ROLLERS, Contact, Rotation, Sampling, SimplerModels
from guideload.audit.force_balance import ForceBalance, force_balance
from guideload.audit.histories import Histories
from guideload.audit.motion_plausibility import plausible_motion, resolution_warnings
from guideload.audit.plausibility import free_at_rest, machine_warnings
from guideload.audit.verification import Solve, Verification, verify
from guideload.audit.warnings import (
    contact_warnings,
    force_doubts,
    rotation_warnings,
    sampling_warnings,
    solution_doubts,
    start_warnings,
)
from guideload.base.number_text import counted, digits, first_names, load_in_sentence, percent
from guideload.base.quantities import Quantities
from guideload.base.warnings import WarningText, verdict
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.resolution import TraceResolution

# Largest errors of the peaks and of the dynamic loads at which a simpler model suffices: catalogues are no better.
SUFFICIENT = 0.03
SUFFICIENT_DYNAMIC = 0.1
NEGLIGIBLE = 1e-3  # relative errors below this are not reported

LABEL = 13  # width of the labels [characters]


@dataclass(frozen=True, eq=False)
class Audit:
    """Figures that judge a result, and a warning for each figure beyond its limit.

    model_level     linear, piecewise linear or smooth nonlinear
    reason          which links need that level
    method          integration method of the run
    rotation        largest rotation, and the second-order terms that the model neglects
    contact         links that lost contact, and the preload that would prevent it
    sampling        sample steps, natural frequencies and bandwidth of the excitation
    resolution      modes that the trace is fine enough to show, and the load that it may hide; None if the reported
                    instants are farther apart than the samples of the motion
    simpler_models  peaks of simpler models, and the dynamic factor
    energy          energy balance; None if the excitation jumps between the reported instants, or riders move
    force_balance   force balance of the reported loads
    verification    comparison with a second solution, and sensitivity to the motion; text if that solution failed, or
                    why there can be none; None if none is needed (linear, exact, energy balances)
    free_at_rest    dofs of L in each motion in which the body is free within its clearance at rest
    doubts          warnings of a result that contradicts itself or cannot be predicted: its loads are not to be used
    warnings        of motion, machine and result, each with its figure and a way out: the doubts, then those beyond the
                    limits of `base.warnings.LIMITS`
    riders_move     whether riders move during the run
    """

    model_level: str
    reason: str
    method: str
    rotation: Rotation
    contact: Contact
    sampling: Sampling
    resolution: TraceResolution | None
    simpler_models: SimplerModels
    energy: Energy | None
    force_balance: ForceBalance
    verification: Verification | str | None
    free_at_rest: tuple[tuple[str, ...], ...]
    doubts: tuple[str, ...]
    warnings: tuple[str, ...]
    riders_move: bool

    @classmethod
    def of(cls, machine: Machine, data: Quantities, modes: Modes, solve: Solve | None = None) -> Audit:
        """The audit of a result, from its machine, its quantities and the modes of the machine.

        solve: solves the run again; default: from the quantities, if they contain the motion.
        """
        histories = Histories(machine, data)
        turns = (figures.rotation(part) for part in histories.stretches)
        rotation, contact = max(turns, key=lambda turn: turn.second_order), figures.contact(histories)
        sampling, balance = figures.sampling(histories, modes), energy(histories)
        solve = solve or (histories.solve_motion if histories.has_motion else None)
        second, forces = verify(histories, balance, solve), force_balance(histories)
        doubts = (*force_doubts(forces), *solution_doubts(histories, second, balance))
        resolution = figures.resolution(histories, modes)
        coarse = resolution_warnings(resolution) or sampling_warnings(histories, sampling)
        not_judged = [WarningText("not judged", f"Not judged: {second}.")] if isinstance(second, str) else []
        return cls(
            model_level=machine.scene.model_level,
            reason=_reason(histories),
            method=str(data.attrs["method"]),
            rotation=rotation,
            contact=contact,
            sampling=sampling,
            resolution=resolution,
            simpler_models=figures.simpler_models(histories),
            energy=balance,
            force_balance=forces,
            verification=second,
            free_at_rest=free_at_rest(machine),
            doubts=doubts,
            warnings=(
                *doubts,
                *not_judged,
                *_motion_warnings(histories),
                *machine_warnings(machine, modes),
                *rotation_warnings(rotation),
                *start_warnings(histories, modes),
                *coarse,
                *contact_warnings(histories, contact),
            ),
            riders_move=histories.rides,
        )

    @property
    def verdict(self) -> str:
        """The number of warnings, in words."""
        return verdict(self.warnings)

    @property
    def lines(self) -> tuple[str, ...]:
        """The figures that are not negligible: a label of width `LABEL` and a sentence for each."""
        return tuple(f"{label:<{LABEL}}{text}" for label, text in (*self._of_model(), *self._of_samples()))

    def __str__(self) -> str:
        return "\n".join([self.verdict, *self.warnings, *self.lines])

    def _of_model(self) -> Iterator[tuple[str, str]]:
        """Labels and sentences on the model, on what it neglects, and on whether a simpler model suffices."""
        yield "model", f"{self.model_level}, solved by method {self.method}: {self.reason}"
        rotation, contact, simpler = self.rotation, self.contact, self.simpler_models
        if rotation.second_order >= NEGLIGIBLE:
            turn = f"the body rotates by up to {digits(rotation.largest, 2)} rad, at {rotation.time:.3f} s"
            neglected = f"neglected terms of second order: {percent(rotation.second_order)} of the load"
            yield "rotation", f"{turn}; {neglected}"
        parted, contacts = contact.share > 0.0, []
        if parted.any():
            words = contact.words(np.arange(parted.size))
            share = f"for up to {percent(contact.share.max())} of the time"
            contacts.append(f"{words} in {int(parted.sum())} of {parted.size} links, {share}")
        if contact.never_touching:
            contacts.append(f"never touching: {first_names(contact.never_touching)}")
        if contacts:
            yield "contact", "; ".join(contacts)
        if contact.preload_needed.size and (contact.changing_sign or parted.any()):
            row, column = divmod(int(contact.preload_needed.argmax()), 2)
            balls = float(contact.preload_needed[row, column])
            needed = f"{load_in_sentence(balls)} (balls) or {load_in_sentence(ROLLERS * balls)} (rollers)"
            sides = f"the load of {counted(len(contact.changing_sign), 'link')} changes its direction; "
            keep = f"a preload of {needed} would keep all rows loaded ({simpler.names[row]} along {'yz'[column]})"
            yield "preload", f"{sides if contact.changing_sign else ''}{keep}"
        if simpler.linear is not None:
            off, name = simpler.deviation(simpler.linear)
            verdict = "enough" if abs(off) <= SUFFICIENT else "not enough"
            yield (
                "linear",
                f"linear springs of the nominal stiffness are {verdict}: peaks are {_error_text(off, name)}",
            )
        off, name = simpler.deviation(simpler.quasi_static)
        dynamic, link = simpler.dynamic_deviation
        enough = abs(off) <= SUFFICIENT and abs(dynamic) <= SUFFICIENT_DYNAMIC
        nominal = "" if self.model_level == "linear" else ", nominal stiffness"
        factor = f"{simpler.dynamic_factor[simpler.names.index(name)]:.2f}"
        peaks = f"peaks are {factor} times its peaks ({name})"
        change = f"its change of load is {_error_text(dynamic, link)}"
        verdict = "enough" if enough else "not enough"
        yield "static", f"a static calculation ({figures.STATICS}{nominal}) is {verdict}: {peaks}, {change}"

    def _of_samples(self) -> Iterator[tuple[str, str]]:
        """Labels and sentences on samples, excitation and trace compared with the modes, and on the energy balance."""
        sampling, energy = self.sampling, self.energy
        if sampling.per_period is None:
            yield "sampling", "only one instant is reported: peaks at other instants are unknown"
        elif sampling.missed > SUFFICIENT:
            per_period, highest = digits(sampling.per_period), digits(sampling.highest)
            count = f"{per_period} samples per period of the highest mode, {highest} Hz"
            missed = f"peaks of its vibration may be missed by up to {percent(sampling.missed)}"
            yield "sampling", f"{count}: {missed}"
        modes = f"the modes are at {digits(sampling.lowest)} to {digits(sampling.highest)} Hz"
        if sampling.band is None:
            yield "excitation", f"none at the reported instants; {modes}"
        else:
            share = percent(figures.POWER_SHARE)
            yield "excitation", f"{share} of its power is below {digits(sampling.band)} Hz; {modes}"
        unknown = "unknown: the reported instants are further apart than the samples of the motion"
        yield "trace", unknown if self.resolution is None else self.resolution.text
        if energy is None:
            why = "riders move" if self.riders_move else "the excitation jumps between the reported instants"
            yield "energy", f"balance unknown: {why}"
        elif not energy.residual < NEGLIGIBLE:
            share = f"{percent(energy.residual)} of the exchanged energy, {digits(energy.exchanged)} J"
            error = "an error of the sum if the second solution agrees"
            yield "energy", f"{share}, does not balance, summed over the reported instants: {error}"
        second = self.verification
        if isinstance(second, str):
            yield "verification", f"no second solution to compare with: {second}"
        elif second is not None and second.agrees:
            agrees = f"{second.words} agrees to {digits(second.newtons, 1)} N in every link load"
            yield "verification", agrees


def _motion_warnings(histories: Histories) -> Iterator[str]:
    """The warnings of the motion by itself: of its figures, and of its reading."""
    data = histories.data
    speed, place, source = data.get("cart_velocity"), data.get("cart_position"), data.attrs["motion_source"]
    yield from plausible_motion(histories.time, histories.cart_acceleration, speed, place, str(source))
    yield from filter(None, str(data.attrs.get("motion_warnings", "")).split("\n"))


def _reason(histories: Histories) -> str:
    """Which links need the model level."""
    if histories.linear:
        return "every link is linear"
    kinds: dict[str, list[str]] = {}
    for name, law in zip(histories.links.names, histories.links.laws, strict=True):
        if law.kind == "sided":
            kinds.setdefault("clearance" if law.edges[-1] > 0 else "unequal sides", []).append(name)
        elif law.kind != "linear":
            kinds.setdefault("preload" if law.kind == "preloaded" else law.kind, []).append(name)
    return "; ".join(f"{kind} in {first_names(names)}" for kind, names in kinds.items())


def _error_text(off: float, name: str) -> str:
    if percent(abs(off)) == "0 %":
        return "the same"
    return f"{percent(abs(off))} too {'low' if off < 0 else 'high'} ({name})"
