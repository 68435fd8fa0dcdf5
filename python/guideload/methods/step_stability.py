"""How long a step may be and what that costs: a scene's eigenvalues against the methods, by theory and by trial.

The modes of a scene decay or ring with its eigenvalues λ, and a fixed step h of rk45 is stable while |R(h λ)| <= 1
for all of them (guideload.amplification). exact and implicit are stable at any step.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from guideload._core import Scene
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, RunError
from guideload.machine.laws import NO_EXACT
from guideload.machine.machine import DOFS, Machine
from guideload.machine.modes import moving_dofs
from guideload.motion.motion import Motion
from guideload.simulation.stability_function import UNDAMPED, MethodName, amplification, longest_stable_steps

METHODS: tuple[MethodName, ...] = ("exact", "rk45", "implicit")

# The bracket around the step that blows up ends at this ratio, a quarter of what theory and trial may differ by.
BRACKET = 1.005
# A step this part beyond the limit has to show in a trial, by growing this much: beyond the hundredfold that the
# core takes for divergence, with room for modes that the kick moves less than others.
BEYOND = 0.01
GROWTH = 1e5
# Steps of one trial at most, some seconds: an undamped mode grows by 4e-6 a step there.
MOST_TRIED = 20_000_000
# Steps that rk45 may take to be run for its cost, about a second.
MOST_RUN = 3_000_000
# Of the largest excitation: how far a sample may be off the line through its neighbours to lie on it.
STRAIGHT = 1e-12
# Counted steps that are put down to stability: within this factor of what it asks for.
NEAR = 1.3


@dataclass(frozen=True)
class Cost:
    """What a method took for the motion: counted, timed, and beside it what its bends and stability ask for.

    needed    steps that end wherever they must, see `step_ends`, and are no longer than stable
    steps, rejected, seconds: as counted and timed; None where the method was not run
    note      why it was not run, else empty
    """

    method: MethodName
    needed: int
    steps: int | None
    rejected: int | None
    seconds: float | None
    note: str = ""


@dataclass(frozen=True, eq=False)
class Stability:
    """Eigenvalues of a machine, the longest stable step of rk45, and what each method takes for a motion.

    machine       the machine; links that are not linear count with their nominal stiffness, all in contact
    eigenvalues   (m,) 1/s, complex, by ascending size
    longest_steps (m,) s, up to which rk45 is stable for each, in theory
    measured_step s, at which runs with a fixed step really begin to grow without bound
    motion        that the costs are for
    rtol          tolerance of those runs
    costs         of exact, rk45 and implicit
    """

    machine: Machine
    eigenvalues: NDArray[np.complex128]
    longest_steps: Array
    measured_step: float
    motion: Motion
    rtol: float
    costs: tuple[Cost, ...]

    @property
    def predicted_step(self) -> float:
        """s, the longest step at which rk45 is stable, in theory."""
        return float(self.longest_steps.min())

    @property
    def limiting(self) -> int:
        """Index of the eigenvalue that sets it; of a pair the one with positive imaginary part."""
        return int(np.lexsort((-self.eigenvalues.imag, self.longest_steps))[0])

    @property
    def limited_by(self) -> str:
        """What sets the number of steps of rk45: samples, stability or tolerance."""
        rk45 = self.costs[METHODS.index("rk45")]
        if rk45.steps is None:
            return "stability"
        counted = rk45.steps
        if counted <= NEAR * step_ends(self.machine, self.motion, "rk45").size:
            return "samples"
        return "stability" if counted <= NEAR * rk45.needed else "tolerance"

    @cached_property
    def sample_interval(self) -> float:
        """s, the median between samples of the motion."""
        steps = np.diff(self.motion.time)
        return float(np.median(steps[steps > 0.0]))

    def moving(self, index: int) -> list[str]:
        """The dofs that make up the mode of an eigenvalue, largest first; none if nothing but L turns."""
        scene = self.machine.nominal_scene
        (mass, damping, stiffness), _ = scene.matrices()
        free = [DOFS.index(dof) for dof in self.machine.free]
        _, _, shapes, _ = scene.modes()
        basis = shapes[:, free].T  # in which the mass is one, so that metres and radians compare
        value = self.eigenvalues[index]
        pencil = value**2 * mass + value * damping + stiffness
        pencil = basis.T @ pencil[np.ix_(free, free)] @ basis
        nearest = np.linalg.svd(pencil)[2][-1].conj()  # of the smallest singular value: pencil @ nearest = 0
        shape = nearest @ shapes
        largest = shape[np.abs(shape).argmax()]
        return moving_dofs(self.machine, np.real(shape * np.conj(largest)))


def stability(machine: Machine, motion: Motion | None = None, *, rtol: float = 1e-6) -> Stability:
    """The longest stable step of rk45 on a machine, predicted and measured, and the cost of every method.

    motion  that the costs are for; left out, a jerk-limited move by 1.6 m at 1 kHz, up to 1 m/s and 2 m/s2
    rtol    tolerance of rk45 and implicit there

    Raises SceneError (unsupported body), ArgumentError (rtol, motion), RunError.
    """
    if motion is None:
        motion = standard_move()
    if not np.ptp(motion.time):
        raise ArgumentError(f"motion: expected samples over some time, got all at {motion.time[0]:g} s")
    scene = machine.nominal_scene
    eigenvalues = scene.modes()[3]
    undamped = eigenvalues.real >= -UNDAMPED * np.abs(eigenvalues)
    eigenvalues = np.where(undamped, 0.0, eigenvalues.real) + 1j * eigenvalues.imag
    eigenvalues = eigenvalues[np.argsort(np.abs(eigenvalues), kind="stable")]
    longest = longest_stable_steps(eigenvalues)
    step = float(longest.min())
    return Stability(
        machine=machine,
        eigenvalues=eigenvalues,
        longest_steps=longest,
        measured_step=_measured_step(scene, complex(eigenvalues[longest.argmin()]), step),
        motion=motion,
        rtol=rtol,
        costs=tuple(_cost(machine, motion, method, rtol, step) for method in METHODS),
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


def _measured_step(scene: Scene, limiting: complex, start: float) -> float:
    """The fixed step of rk45 from which on free vibration grows without bound, s, by bisection about `start`.

    limiting: the eigenvalue, 1/s, that by theory grows there; it says how many steps a trial needs to show it.
    """
    excess = np.log(np.abs(amplification("rk45", (1.0 + BEYOND) * start * limiting)))
    steps = MOST_TRIED
    if excess > 0.0:
        steps = int(min(steps, np.ceil(np.log(GROWTH) / excess)))
    kick = _kick(scene)

    def blows_up(step: float) -> bool:
        # One step of force, then free vibration without a sample, so that all steps are as long as asked.
        stamps = np.array([0.0, step, step, step * (1 + steps)])
        try:
            scene.solve(stamps, np.zeros((4, 3)), kick, method="rk45", rtol=1e-6, step=step)
        except RunError as error:
            if "stability region" not in str(error):
                raise
            return True
        return False

    stable, unstable = start, start
    while blows_up(stable):
        unstable, stable = stable, 0.8 * stable
    while not blows_up(unstable):
        stable, unstable = unstable, 1.25 * unstable
    while unstable > BRACKET * stable:
        middle = float(np.sqrt(stable * unstable))
        stable, unstable = (stable, middle) if blows_up(middle) else (middle, unstable)
    return float(np.sqrt(stable * unstable))


def _kick(scene: Scene) -> Array:
    """Wrench (4, 6) at four samples: the same at the first two, then zero; it moves every mode, none like another."""
    shapes = scene.modes()[2]
    (mass, _, _), _ = scene.matrices()
    wrench = np.zeros((4, 6))
    wrench[:2] = mass @ (np.sqrt(2.0 + np.arange(len(shapes))) @ shapes)
    return wrench


def _cost(machine: Machine, motion: Motion, method: MethodName, rtol: float, longest: float) -> Cost:
    """Run a method, and time it."""
    ends = step_ends(machine, motion, method)
    needed = _needed(motion, ends, longest if method == "rk45" else np.inf)
    if method == "exact" and machine.model_level == "smooth nonlinear":
        return Cost(method, needed, None, None, None, NO_EXACT)
    if needed > MOST_RUN:
        return Cost(method, needed, None, None, None, f"{needed:.2g} steps are not worth the wait")
    scene = machine.scene
    began = time.perf_counter()
    solution = scene.solve(
        motion.time, motion.acceleration, motion.wrench, method=method, rtol=rtol, step=None
    )
    seconds = time.perf_counter() - began
    return Cost(method, needed, solution.steps, solution.rejected, seconds)


def step_ends(machine: Machine, motion: Motion, method: MethodName) -> NDArray[np.intp]:
    """Indices of the samples that no step of a method passes: all, or those at which the excitation bends.

    rk45 and implicit step over samples that lie on a straight line, unless contact changes are to be found.
    """
    if method == "exact" or machine.model_level == "piecewise linear" or motion.time.size < 3:
        return np.arange(motion.time.size)
    columns = _inputs(motion)
    steps = np.diff(motion.time)
    first, second = steps[:-1], steps[1:]
    smooth = (first > 0.0) & (second > 0.0)  # at a jump there is no line
    part = (first / np.where(smooth, first + second, 1.0))[:, None]
    off = np.abs((1.0 - part) * columns[:-2] + part * columns[2:] - columns[1:-1])
    straight = smooth & (off <= STRAIGHT * np.abs(columns).max(axis=0)).all(axis=1)
    return np.flatnonzero(np.concatenate([[True], ~straight, [True]]))


def _needed(motion: Motion, ends: NDArray[np.intp], longest: float) -> int:
    """Steps from each of the samples `ends` to the next, none longer than `longest` s.

    Until anything moves one each is enough.
    """
    excited = _inputs(motion).any(axis=1)
    moving = ends[1:] >= (excited.argmax() if excited.any() else excited.size)
    steps = np.diff(motion.time[ends])
    counts = np.where(moving, np.ceil(steps / longest * (1.0 - 1e-12)), 1.0)
    return int(np.maximum(counts, 1.0)[steps > 0.0].sum())


def _inputs(motion: Motion) -> Array:
    """(time, 3 or 9) acceleration [m/s2], and force and moment [N, N m] where there are any."""
    return motion.acceleration if motion.wrench is None else np.hstack([motion.acceleration, motion.wrench])
