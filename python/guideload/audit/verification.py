"""Verification of a result: the run is solved again by another method or more tightly, and the loads are compared.

Link loads of the result are compared with those of a second solution, under the motion times 1 + `perturbation` if
links are not linear. Where both agree within what the tolerance explains, the result is accurate and predictable at the
cost of one run. Where they do not, a third run under the motion itself separates the error of the result from its
sensitivity to the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from guideload.audit.energy import Energy
from guideload.audit.histories import Histories
from guideload.base.arrays import Array
from guideload.base.errors import GuideloadError
from guideload.base.methods import METHODS
from guideload.base.number_text import scientific

# Solves the run again: takes method, rtol and a factor on the excitation, returns link loads (time, link) [N].
Solve = Callable[[str, float, float], Array]

# Of the largest link load: beyond this a change of the motion by `perturbation` is amplified.
SENSITIVE = 1e-3
UNBALANCED = 0.01  # of the exchanged energy: beyond this a run by exact is solved again by another method
# Second solution: tighter than the result by this factor, but at least as tight as 1e-8, so that a perturbation which
# stands above its step error is still far below the error of any trace; and not tighter than rounding allows.
TIGHTER, LOOSEST, TIGHTEST = 0.01, 1e-8, 1e-12
PERTURBATION = 1e-9  # relative change of the excitation, if the step error of the second solution is smaller
# Error over rtol that is explained: 1 to 3 are usual, 10 is the bound that tests/fuzz/scenes.py holds.
EXPLAINED = 10.0
MOST_EXPLAINED = 0.01  # of the load scale, for any tolerance: catalogues of guides are good to some percent
# Of the load scale, for a fixed step: no tolerance was asked for; about the error of the model.
UNCONTROLLED = 1e-3
ROUNDING = 1e-7  # of the load scale: differences below it are rounding, which stiff scenes amplify

NO_MOTION = (
    "the samples of its motion are not stored with it; compute it again, or keep the result of `simulate`"
)


@dataclass(frozen=True)
class Verification:
    """The difference of a result from a second solution, and its sensitivity to the motion.

    method, rtol  of the second solution
    difference    largest difference of a link load, over the load scale
    newtons       N, the same difference
    link, time    where it occurs
    explained     difference that the tolerances explain, over the load scale
    perturbation  relative change of the excitation for `sensitivity`
    sensitivity   largest change of a link load by the perturbation, over the largest link load; None if all links are
                  linear. At most that if below `explained`, as it may then contain step errors.
    """

    method: str
    rtol: float
    difference: float
    newtons: float
    link: str
    time: float
    explained: float
    perturbation: float
    sensitivity: float | None

    @property
    def agrees(self) -> bool:
        """Whether the tolerances explain the difference; False for numbers that are not finite."""
        return self.difference <= self.explained

    @property
    def words(self) -> str:
        """The second solution, in words."""
        return self.method if self.method == "exact" else f"{self.method} at rtol {scientific(self.rtol)}"

    @property
    def predictable(self) -> bool:
        """Whether small changes of the motion stay small."""
        return self.sensitivity is None or self.sensitivity <= SENSITIVE


def verify(histories: Histories, energy: Energy | None, solve: Solve | None) -> Verification | str | None:
    """Verify a result by a second solution; text if that failed, or if the run cannot be solved again.

    None if none is needed: a linear run by exact has no step error, and its energy balances.
    """
    balanced = energy is not None and energy.residual <= UNBALANCED
    exact = histories.data.attrs["method"] == "exact"
    if balanced and histories.linear and exact:
        return None
    if solve is None:
        return NO_MOTION
    compare = partial(_compare, histories, solve)
    try:
        if histories.linear and exact:
            return compare("implicit", perturbed=False)
        found = compare("exact" if exact else _other_method(histories), perturbed=not histories.linear)
        if exact and found.agrees and found.predictable and not balanced:
            return compare("implicit", perturbed=False, known=found.sensitivity)
    except GuideloadError as error:
        return str(error)
    return found


def _compare(
    histories: Histories, solve: Solve, method: str, *, perturbed: bool, known: float | None = None
) -> Verification:
    """Verification by a method. known: the sensitivity, if the motion is not perturbed."""
    attributes, load = histories.data.attrs, histories.load
    scale = float(attributes["load_scale_N"]) or 1.0
    without_rtol = attributes["method"] == "exact" or "step_s" in attributes
    rtol = LOOSEST if without_rtol else tighter(float(attributes["rtol"]))
    step_error = 0.0 if method == "exact" else rtol
    perturbation, explained = max(PERTURBATION, step_error), explained_error(attributes)
    if known is not None:  # sensitivity to the motion amplifies the step error as well
        explained = max(explained, EXPLAINED * step_error * max(1.0, known / PERTURBATION))
    second = solve(method, rtol, 1.0 + perturbation if perturbed else 1.0)
    change, sensitivity = np.abs(second - load), known
    if perturbed:
        largest = float(np.abs(load).max()) or 1.0
        changed = change
        if not float(change.max()) <= min(explained * scale, SENSITIVE * largest):
            third = solve(method, rtol, 1.0)
            change, changed = np.abs(third - load), np.abs(second - third)
        sensitivity = float(changed.max()) / largest
    at, link = divmod(int(change.argmax()), change.shape[1])  # of nan the first
    newtons = float(change[at, link])
    return Verification(
        method=method,
        rtol=rtol,
        difference=newtons / scale,
        newtons=newtons,
        link=histories.links.names[link],
        time=float(histories.time[at]),
        explained=explained,
        perturbation=perturbation,
        sensitivity=sensitivity,
    )


def explained_error(attributes: Mapping[str, str | float | int]) -> float:
    """Error of the link loads, over the load scale, that the tolerance of a result explains; from its attributes."""
    if "step_s" in attributes:
        return UNCONTROLLED
    if attributes["method"] == "exact":
        return ROUNDING
    return max(min(EXPLAINED * float(attributes["rtol"]), MOST_EXPLAINED), ROUNDING)


def tighter(rtol: float) -> float:
    """The tolerance of the second solution of a run with this tolerance."""
    return float(np.clip(TIGHTER * rtol, TIGHTEST, LOOSEST))


def _other_method(histories: Histories) -> str:
    """Another method than that of the result: exact where it can be, else one that does not share its errors."""
    if histories.machine.scene.model_level != "smooth nonlinear" and not histories.rides:
        return "exact"
    method = str(histories.data.attrs["method"])
    if method == "rk45":
        return "implicit"
    steps = fastest_rate(histories) * float(np.ptp(histories.time)) / 3.0  # of rk45 at its limit of stability
    most = METHODS[method].rk45_steps_to_check * float(histories.data.attrs["steps"])
    return "rk45" if steps <= most else "implicit"


def fastest_rate(histories: Histories) -> float:
    """Largest eigenvalue magnitude [1/s] of the equations of motion, with every link in contact."""
    return float(np.abs(histories.machine.nominal_scene.modes()[3]).max())
