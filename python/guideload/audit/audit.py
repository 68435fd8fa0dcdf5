"""The audit of a result: whether the model was no more than the scene needs, and no less."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from guideload.audit import checks
from guideload.audit.checks import ROLLERS, Below, Contact, Histories, Rotation, Sampling
from guideload.audit.energy import Energy, energy
from guideload.base.numbers import first_names, load_in_sentence, percent
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes, moving_dofs
from guideload.motion.resolution import TraceResolution

if TYPE_CHECKING:
    import xarray as xr

# Limits from which on something is warned of.
LARGE_ROTATION = 1e-2  # rad: the loads are then wrong by about as much
LARGE_SECOND_ORDER = 0.01  # of the largest link load
SENSITIVE = 1e-3  # of the largest link load, for a change of the motion by `checks.NUDGE`
UNBALANCED = 0.01  # of the energy turned over
# First acceleration, of the largest, from which on a motion has begun under way; smoothed standstill stays below.
UNDER_WAY = 0.2
# Peaks by a simpler model that differ less than this make it enough: catalogues' own figures are no better.
ENOUGH = 0.03
ENOUGH_DYNAMIC = 0.1  # and whose dynamic part differs by less than this

LABEL = 12  # signs before the text of a line


@dataclass(frozen=True, eq=False)
class Audit:
    """What a result is worth: figures, and warnings where one of them asks for a change.

    rung          of the model: linear, piecewise linear or smooth nonlinear
    reason        which links made it so
    method        that solved it
    rotation      largest rotation, and what small rotations neglect
    contact       where contact was lost, and the preload that would keep it
    sampling      samples against modes and the excitation's band
    information   the band of the trace against the modes, and what it hides; None where the instants do not hold the
                  whole motion
    below         peaks by the simpler models: would the rung below have done?
    sensitivity   change of the loads by a change of the motion by 1e-9; see `checks.sensitivity`
    energy        balance of the energy; None where the instants hide jumps of the excitation
    free_at_rest  for each motion that the body is free to make within its clearance at rest, the dofs of L in it
    warnings      each with its figure and what to change; what spoils more of the result comes first
    """

    model_level: str
    reason: str
    method: str
    rotation: Rotation
    contact: Contact
    sampling: Sampling
    resolution: TraceResolution | None
    below: Below
    sensitivity: float | None
    energy: Energy | None
    free_at_rest: tuple[tuple[str, ...], ...]
    warnings: tuple[str, ...]

    @classmethod
    def of(cls, machine: Machine, data: xr.Dataset, modes: Modes) -> Audit:
        """The audit of a result's machine, labelled arrays and modes."""
        histories = Histories(machine, data)
        rotation, contact = checks.rotation(histories), checks.contact(histories)
        sampling, balance = checks.sampling(histories, modes), energy(histories)
        sensitivity = checks.sensitivity(histories)
        information = checks.resolution(histories, modes)
        hidden = () if information is None else tuple(information.warnings())
        coarse = hidden or tuple(_sampling_warnings(sampling))
        motions = free_at_rest(machine)
        return cls(
            model_level=machine.scene.model_level,
            reason=_reason(histories),
            method=str(data.attrs["method"]),
            rotation=rotation,
            contact=contact,
            sampling=sampling,
            resolution=information,
            below=checks.below(histories),
            sensitivity=sensitivity,
            energy=balance,
            free_at_rest=motions,
            warnings=(
                *_rotation_warnings(rotation),
                *_start_warnings(histories, modes),
                *coarse,
                *_energy_warnings(balance, coarse=bool(coarse)),
                *_sensitivity_warnings(sensitivity),
                *rest_notes(motions),
                *_contact_warnings(histories, contact),
            ),
        )

    @property
    def lines(self) -> tuple[str, ...]:
        """The audit in words, a line per figure, each with a label of `LABEL` signs in front."""
        told = (
            ("model", f"{self.model_level}, by {self.method}: {self.reason}"),
            ("rotation", self._of_rotation()),
            ("contact", self._of_contact()),
            ("sampling", self._of_sampling()),
            ("excitation", self._of_excitation()),
            ("band", self._of_information()),
            *(("linear", text) for text in self._of_linear()),
            ("static", self._of_static()),
            ("energy", self._of_energy()),
            ("warnings", f"{len(self.warnings)}, under the peaks" if self.warnings else "none"),
        )
        return tuple(f"{label:<{LABEL}}{text}" for label, text in told)

    def __str__(self) -> str:
        return "\n".join([*self.lines, *self.warnings])

    def _of_rotation(self) -> str:
        found = self.rotation
        neglected = f"second order left out: {found.second_order:.1g} of the load"
        return f"{found.largest:.2g} rad at {found.time:.3f} s; {neglected}"

    def _of_contact(self) -> str:
        found = self.contact
        if self.model_level == "linear":
            sides = len(found.changing_sign)
            text = f"linear links never part; {sides} {'changes' if sides == 1 else 'change'} sides"
        else:
            text = self._of_parting()
            if found.never:
                text += f"; never touching: {first_names(found.never)}"
        if not found.preload_needed.size:
            return text
        row, column = np.unravel_index(int(found.preload_needed.argmax()), found.preload_needed.shape)
        balls = float(found.preload_needed[row, column])
        place = f"{self.below.names[row]} in {'yz'[column]}"
        preloads = f"{load_in_sentence(balls)}, rollers {load_in_sentence(ROLLERS * balls)} ({place})"
        return f"{text}; preload to keep all rows loaded: {preloads}"

    def _of_parting(self) -> str:
        """Links that lose contact and preloaded ones that open a row, and for how long at most."""
        found = self.contact
        parted = found.share > 0
        text = f"{found.changes} changes; " if self.model_level == "piecewise linear" else ""
        kinds = ((~found.preloaded, "lose contact"), (found.preloaded, "open a row"))
        told = [
            f"{int(parted[kind].sum())} of {int(kind.sum())} links {what}"
            for kind, what in kinds
            if kind.any()
        ]
        longest = f", for up to {percent(found.share.max())} of the time" if parted.any() else ""
        return f"{text}{', '.join(told)}{longest}"

    def _of_sampling(self) -> str:
        found = self.sampling
        if found.per_period is None:
            return "a single instant"
        return f"{found.per_period:.3g} samples per period of the highest mode, {found.highest:.3g} Hz"

    def _of_excitation(self) -> str:
        found = self.sampling
        modes = f"modes {found.lowest:.3g} to {found.highest:.3g} Hz"
        if found.band is None:
            return f"none to be seen at the reported instants; {modes}"
        return f"{percent(checks.POWER_SHARE)} of its power below {found.band:.3g} Hz; {modes}"

    def _of_information(self) -> str:
        if self.resolution is None:
            return "not to be told: the reported instants do not hold the whole motion"
        return self.resolution.text

    def _of_linear(self) -> Iterator[str]:
        if self.below.linear is not None:
            off, name = self.below.deviation(self.below.linear)
            verdict = "do" if abs(off) <= ENOUGH else "not do"
            yield f"nominal linear links would {verdict}: peaks {_off(off, name)}"

    def _of_static(self) -> str:
        off, name = self.below.deviation(self.below.quasi_static)
        dynamic, whose = self.below.dynamic_deviation
        verdict = "do" if abs(off) <= ENOUGH and abs(dynamic) <= ENOUGH_DYNAMIC else "not do"
        nominal = "" if self.model_level == "linear" else ", nominal stiffness,"
        peaks = f"peaks {_off(off, name)}, dynamic part {_off(dynamic, whose)}"
        return f"a static calculation with m a{nominal} would {verdict}: {peaks}"

    def _of_energy(self) -> str:
        found = self.energy
        if found is None:
            return "not to be told: the excitation jumps, which the reported instants do not show"
        if not found.turned_over:
            return "none is turned over"
        return f"balances to {found.residual:.1g} of the {found.turned_over:.3g} J turned over"


def free_at_rest(machine: Machine) -> tuple[tuple[str, ...], ...]:
    """For each motion that the body is free to make within its clearance at rest, the dofs of L in it."""
    return tuple(tuple(moving_dofs(machine, shape)) for shape in machine.scene.free_at_rest)


def rest_notes(motions: tuple[tuple[str, ...], ...]) -> list[str]:
    """What a body that is free at rest in these motions, as of `free_at_rest`, starts from."""
    if not motions:
        return []
    told = ", and in ".join(" with ".join(dofs) for dofs in motions)
    return [
        f"Note: at rest the body is free within its clearance in {told}: it starts where very weak springs would "
        "centre it. Preload, or a process force in the motion, makes the start definite."
    ]


def _reason(of: Histories) -> str:
    """Which links made the model what it is."""
    if of.linear:
        return "every link is linear"
    kinds: dict[str, list[str]] = {}
    for name, law in zip(of.links.names, of.links.laws, strict=True):
        if law.kind == "sided":
            kinds.setdefault("clearance" if law.edges[-1] > 0 else "unequal sides", []).append(name)
        elif law.kind != "linear":
            kinds.setdefault("preload" if law.kind == "preloaded" else law.kind, []).append(name)
    return "; ".join(f"{kind} in {first_names(names)}" for kind, names in kinds.items())


def _rotation_warnings(found: Rotation) -> Iterator[str]:
    if found.largest > LARGE_ROTATION or found.second_order > LARGE_SECOND_ORDER:
        yield (
            f"Note: the body turns by {found.largest:.2g} rad at {found.time:.3f} s; the model takes rotations as "
            f"small, which leaves out about {percent(found.second_order)} of the load. Stiffer or wider guides "
            "turn less; is stiffness in N/m?"
        )


def _start_warnings(of: Histories, modes: Modes) -> Iterator[str]:
    """What a motion that begins under way does to the peaks: the run starts at rest, as by a sudden start.

    The time until that has died away is 3 / (zeta omega) of the slowest mode: 5 % of it is left then.
    """
    size = np.linalg.norm(of.cart_acceleration, axis=1)
    if size[0] <= UNDER_WAY * size.max() or not of.rests_at_first:
        return
    slowest = float(-np.real(modes.eigenvalues).max())
    until = float(of.time[0]) + 3.0 / slowest if slowest > 0 else np.inf
    first = of.time[checks.peak_instants(of)].min(axis=1)
    names = [carriage.name for carriage in of.machine.carriages]
    early = [name for name, time in zip(names, first, strict=True) if time < until]
    if until < of.time[-1]:
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


def _sampling_warnings(found: Sampling) -> Iterator[str]:
    if found.step is not None and found.step * found.highest > 0.5:
        yield (
            f"Note: a sample every {1e3 * found.step:.3g} ms is coarser than half a period of the highest mode, "
            f"{found.highest:.3g} Hz: peaks between the samples are missed. Take a faster trace, or in Python report "
            "at finer instants: simulate(machine, motion, times=...)."
        )


def _energy_warnings(found: Energy | None, coarse: bool) -> Iterator[str]:
    """Where the energy does not balance. Coarse samples are blamed once, the solver only where they are not to blame.

    Where samples are too coarse the two quadratures are about as far apart as the residual is large, at the least.
    """
    if found is None or found.residual <= UNBALANCED:
        return
    told = f"Note: {percent(found.residual)} of the energy turned over, {found.turned_over:.3g} J, does not balance"
    if found.resolution < 0.1 * found.residual:
        yield f"{told}: the solution is not accurate. Lower rtol, or take a smaller step or another method."
    elif not coarse:
        yield f"{told}: the samples are too coarse to tell. Report at finer instants: simulate(..., times=...)."


def _sensitivity_warnings(found: float | None) -> Iterator[str]:
    if found is not None and found > SENSITIVE:
        yield (
            f"Note: impacts multiply small differences here: a motion larger by {checks.NUDGE:.0e} of it changes loads "
            f"by up to {percent(found)} of the largest. No method tells their course, and peaks may change as "
            "much. Damping that always acts (no damping_in_contact), more damping or less play settle it."
        )


def _contact_warnings(of: Histories, found: Contact) -> Iterator[str]:
    """Preloaded contacts of which a row opens. Clearance is expected to."""
    more: dict[str, float] = {}  # preload that would keep the rows loaded, over the one that is there
    elastic = of.of("link_load_elastic", "link")
    for i, (name, law) in enumerate(zip(of.links.names, of.links.laws, strict=True)):
        if law.kind == "preloaded" and found.lost[:, i].any():
            more[name] = float(np.abs(elastic[:, i]).max() / law.force(law.edges[-1:])[0])
    if more:
        longest = max(found.share[of.links.names.index(name)] for name in more)
        yield (
            f"Note: {first_names(list(more))} {_open(len(more))} for up to {percent(longest)} of the time: half of "
            f"its balls or rollers carry nothing then. {max(more.values()):.3g} times the preload would keep all rows "
            "loaded."
        )


def _open(links: int) -> str:
    return "has a row open" if links == 1 else "have a row open"


def _off(off: float, name: str) -> str:
    if percent(abs(off)) == "0 %":
        return "unchanged"
    return f"{percent(abs(off))} {'low' if off < 0 else 'high'} ({name})"
