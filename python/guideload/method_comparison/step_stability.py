"""Step stability: the longest stable step of rk45 on a machine, and cost and error of every method there.

The modes of a scene decay or vibrate with its eigenvalues λ, and a fixed step h of rk45 is stable while |R(h λ)| <= 1
for all of them; R is its stability function. The other methods are stable at any step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter

import numpy as np

from guideload._core import Solution
from guideload.base.arguments import checked
from guideload.base.arrays import Array, Complex, Indices, median_step
from guideload.base.errors import ArgumentError, RunError
from guideload.base.methods import METHODS
from guideload.machine.machine import DOFS, Machine
from guideload.machine.modes import moving_dofs
from guideload.method_comparison.diagram import Setting
from guideload.method_comparison.difficulties import difficulties, excitation
from guideload.method_comparison.runner import difference, has_exponential, reference_run, solve
from guideload.motion.motion import Motion
from guideload.simulation.stability_function import UNDAMPED, longest_stable_steps

# On any machine, and where contacts are preloaded without edges beside them.
ON_ANY = tuple(name for name, of in METHODS.items() if of.with_edges is not False)
WITHOUT_EDGES = tuple(name for name, of in METHODS.items() if of.with_edges is False)

MOST_STEPS = 3_000_000  # of rk45 for its cost to be measured, about a second
# Of the largest excitation: a sample this close to the line through its neighbours lies on it.
STRAIGHT = 1e-12
WITHIN = 10.0  # times the tolerance: errors of steps add up
NEAR = 1.3  # counted steps are put down to stability up to this many times the steps that it needs


@dataclass(frozen=True)
class Cost:
    """Steps, time and error of a method for a motion.

    needed    steps that end at all samples in `step_ends`, none longer than stable
    steps, rejected, seconds: as counted and timed; None where the method gave no loads
    error     largest difference from the reference, over its largest load
    note      why it gave no loads, or that they are beyond `WITHIN` times the tolerance; else empty
    """

    method: str
    needed: int
    steps: int | None = None
    rejected: int | None = None
    seconds: float | None = None
    error: float | None = None
    note: str = ""


@dataclass(frozen=True, eq=False)
class Stability:
    """Eigenvalues of a machine, the longest stable step of rk45, and the cost of each method for a motion.

    machine       the machine; links that are not linear count with their nominal stiffness, all in contact
    eigenvalues   (m,) 1/s, complex, by ascending size
    longest_steps (m,) s, longest stable step of rk45 for each
    motion        that the costs are for
    rtol          tolerance of those runs
    costs         of exact, rk45 and implicit; also of exponential if links are preloaded and none has clearance, sides
                  or a curve
    difficulties  features of the scene on which methods fail, and their size here
    """

    machine: Machine
    eigenvalues: Complex
    longest_steps: Array
    motion: Motion
    rtol: float
    costs: tuple[Cost, ...]
    difficulties: dict[str, str]

    @property
    def predicted_step(self) -> float:
        """The longest stable step of rk45 [s]."""
        return float(self.longest_steps.min())

    @property
    def limiting(self) -> int:
        """Index of the eigenvalue that limits the step; of a pair the one with positive imaginary part."""
        return int(np.lexsort((-self.eigenvalues.imag, self.longest_steps))[0])

    @property
    def limited_by(self) -> str:
        """What sets the number of steps of rk45: samples, stability or tolerance."""
        rk45 = self.costs[ON_ANY.index("rk45")]
        if rk45.steps is None:
            return "stability"
        if rk45.steps <= NEAR * step_ends(self.machine, self.motion, "rk45").size:
            return "samples"
        return "stability" if rk45.steps <= NEAR * rk45.needed else "tolerance"

    @cached_property
    def sample_interval(self) -> float:
        """Median interval between samples of the motion [s]."""
        return median_step(self.motion.time)

    def moving(self, index: int) -> list[str]:
        """The dofs that move most in the mode of an eigenvalue, largest first; none if only L turns."""
        scene = self.machine.nominal_scene
        (mass, damping, stiffness), _ = scene.matrices()
        free = [DOFS.index(dof) for dof in self.machine.free]
        _, _, shapes, _ = scene.modes()
        basis = shapes[:, free].T  # in which the mass is one, so that metres and radians compare
        value = self.eigenvalues[index]
        pencil = value**2 * mass + value * damping + stiffness
        pencil = basis.T @ pencil[np.ix_(free, free)] @ basis
        if not np.isfinite(pencil).all():  # the square of an eigenvalue beyond 1e154 overflows
            return []
        null_vector = np.linalg.svd(pencil)[2][-1].conj()
        shape = null_vector @ shapes
        largest = shape[np.abs(shape).argmax()]
        return moving_dofs(self.machine, np.real(shape * np.conj(largest)))


@checked
def stability(machine: Machine, motion: Motion | None = None, *, rtol: float = 1e-6) -> Stability:
    """The longest stable step of rk45 on a machine, and cost and error of every method.

    Parameters
    ----------
    motion
        That the costs are for; if left out, a jerk-limited move by 1.6 m at 1 kHz, up to 1 m/s and 2 m/s2.
    rtol
        Tolerance of exponential, rk45 and implicit there.

    Raises
    ------
    SceneError
        For an unsupported body.
    ArgumentError
        For a tolerance or a motion that cannot be used.
    RunError
        If no method gives a reference.
    """
    machine.require_no_payloads("the stability of steps")
    machine.require_standing_riders("the stability of steps")
    if motion is None:
        motion = standard_move()
    if not np.ptp(motion.time):
        raise ArgumentError(f"motion: expected samples over some time, got all at {motion.time[0]:g} s")
    eigenvalues = machine.nominal_scene.modes()[3]
    undamped = eigenvalues.real >= -UNDAMPED * np.abs(eigenvalues)
    eigenvalues = np.where(undamped, 0.0, eigenvalues.real) + 1j * eigenvalues.imag
    eigenvalues = eigenvalues[np.argsort(np.abs(eigenvalues), kind="stable")]
    longest = longest_stable_steps(eigenvalues)
    methods = (*ON_ANY, *WITHOUT_EDGES) if has_exponential(machine) else ON_ANY
    reference, solution, expected, metric = reference_run(machine, motion)

    def error(solution: Solution) -> float:
        return difference(metric.loads(solution), expected) / (reference.largest_load or 1.0)

    return Stability(
        machine=machine,
        eigenvalues=eigenvalues,
        longest_steps=longest,
        motion=motion,
        rtol=rtol,
        costs=tuple(_cost(machine, motion, method, rtol, float(longest.min()), error) for method in methods),
        difficulties=difficulties(machine, motion, solution, reference, eigenvalues),
    )


def standard_move() -> Motion:
    """A jerk-limited move along x: 1 m/s, 2 m/s2, 25 m/s3, 1 s of cruise; at rest before and after; 1 kHz."""
    speed, acceleration, jerk = 1.0, 2.0, 25.0
    ramp = acceleration / jerk
    up = [(ramp, 1.0), (speed / acceleration - ramp, 1.0), (ramp, 0.0)]
    down = [(length, -sign) for length, sign in up]
    lengths, signs = np.array([(0.0, 0.0), (0.1, 0.0), *up, (1.0, 0.0), *down, (0.5, 0.0)]).T
    corners = np.cumsum(lengths)
    stamps = np.arange(round(corners[-1] * 1000.0) + 1) / 1000.0
    return Motion.along_x(stamps, np.interp(stamps, corners, acceleration * signs), source="standard move")


def _cost(
    machine: Machine,
    motion: Motion,
    method: str,
    rtol: float,
    longest: float,
    error: Callable[[Solution], float],
) -> Cost:
    """Run a method, and time it. longest: stable step of rk45 [s]. error: of a solution, over the largest load."""
    needed = _needed(motion, step_ends(machine, motion, method), longest if method == "rk45" else np.inf)
    if needed > MOST_STEPS:
        return Cost(method, needed, note=f"{needed:.2g} steps are not worth the wait")
    began = perf_counter()
    try:
        solution = solve(machine, motion, Setting(method, "rtol", rtol))
    except ArgumentError:
        raise
    except RunError as refused:
        return Cost(method, needed, note=str(refused))
    seconds, found = perf_counter() - began, error(solution)
    note = "" if found <= WITHIN * rtol else f"beyond {WITHIN:g} times rtol"
    return Cost(method, needed, solution.steps, solution.rejected, seconds, found, note)


def step_ends(machine: Machine, motion: Motion, method: str) -> Indices:
    """Indices of the samples at which every step of a method must end: all, or those where the excitation bends.

    rk45 and implicit step over samples that lie on a straight line, unless contact changes are to be located.
    """
    piecewise = machine.model_level == "piecewise linear"
    if METHODS[method].numerator is None or piecewise or motion.time.size < 3:
        return np.arange(motion.time.size)
    columns = excitation(motion)
    steps = np.diff(motion.time)
    before, after = steps[:-1], steps[1:]
    no_jump = (before > 0.0) & (after > 0.0)
    weight = (before / np.where(no_jump, before + after, 1.0))[:, None]
    off = np.abs((1.0 - weight) * columns[:-2] + weight * columns[2:] - columns[1:-1])
    straight = no_jump & (off <= STRAIGHT * np.abs(columns).max(axis=0)).all(axis=1)
    return np.flatnonzero(np.concatenate([[True], ~straight, [True]]))


def _needed(motion: Motion, ends: Indices, longest: float) -> int:
    """Steps from each of the samples `ends` to the next, none longer than `longest` [s].

    Before the first excitation one step per interval suffices.
    """
    excited = excitation(motion).any(axis=1)
    moving = ends[1:] >= (excited.argmax() if excited.any() else excited.size)
    steps = np.diff(motion.time[ends])
    counts = np.where(moving, np.ceil(steps / longest * (1.0 - 1e-12)), 1.0)
    return int(np.maximum(counts, 1.0)[steps > 0.0].sum())
