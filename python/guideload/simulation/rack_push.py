"""The push of a rack on its pinion, |F| tan(alpha) / cos(beta), for the force F of the drive.

The push moves the body, which changes F: both are iterated until they agree. The push is linear between the stamps of
the motion, as all that acts on the body; where |F| is not, stamps are added.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import RunError
from guideload.machine.drive import Drive
from guideload.motion.motion import HISTORIES, Motion
from guideload.motion.stamps import is_late, sampled
from guideload.simulation.drive_force import friction_force, require_held_x, rolling_speed
from guideload.simulation.finer_histories import (
    AIMED_BOW,
    MOST_INSTANTS,
    PASSES,
    PLACE,
    SHARE,
    with_visible_vibration,
)
from guideload.simulation.instants import with_more_instants
from guideload.simulation.run import Run
from guideload.simulation.start import StartState

# Relative change of the largest push, far below the tolerance of any run. Where no vibration amplifies a change, an
# iteration divides it by some hundred.
SETTLED = 1e-10
ITERATIONS = 20  # of a whole record
WINDOW = 100  # stamps
MOST_ITERATIONS = 500  # of a window; of a whole record where a run cannot begin in its middle
MOST_PUSH = 10.0  # times the largest push of the first iteration: what has not settled may grow without limit


def with_rack_push(run: Run) -> Run:
    """The run with the force with which a rack pushes the pinion away, acting at L, as a part of its process forces.

    The direction of F does not matter. Where the push differs from the line between two stamps by more than `AIMED_BOW`
    of the largest push, the interval is halved; if F changes its sign there, that instant gets a stamp too. The same
    run without a pressure angle. Raises ArgumentError if x is free, RunError if the iteration does not settle.
    """
    drive = run.machine.drive
    if drive is None or drive.push_direction is None:
        return run
    require_held_x(run.machine)
    at_samples = replace(run, times=None)
    seen = with_visible_vibration(replace(at_samples, step=None))
    bare = at_samples.at_stamps(seen.motion, seen.stretches)
    push = _settled(bare, drive, np.zeros(bare.motion.time.size))
    for _ in range(PASSES):
        instants = _bends(bare, drive, push)
        if not instants.size or bare.motion.time.size + instants.size > MOST_INSTANTS:
            break
        before, bare = bare, _with_instants(bare, instants)
        push = _settled(bare, drive, _at_stamps_of(bare, before, push))
    return replace(_pushed(bare, drive, push), times=run.times, motion_without_push=bare.motion)


def with_rack_push_at_stamps(run: Run) -> Run:
    """The same without more stamps: where F changes its sign between two of them, the push is their line."""
    drive = run.machine.drive
    if drive is None or drive.push_direction is None:
        return run
    return _pushed(run, drive, _settled(replace(run, times=None), drive, np.zeros(run.motion.time.size)))


def _settled(bare: Run, drive: Drive, push: Array) -> Array:
    """The push (n,) [N] at the stamps that agrees with the force of the drive, from a first guess."""
    speed = _rolling_speed(bare.motion)
    # A run with payloads, riders or rails that are not straight cannot begin in the middle of its motion.
    in_windows = all(each is None for each in (bare.stretches, bare.travel, bare.straightness_loads))
    iterations = ITERATIONS if in_windows else MOST_ITERATIONS
    push, settled, most = _iterated(bare, drive, speed, push, np.inf, iterations)
    if in_windows:
        settled = _settle_in_windows(bare, drive, speed, push, settled, most)
    if settled < push.size:
        raise RunError(
            f"drive: the push of the rack at {bare.motion.time[settled]:g} s did not settle in {MOST_ITERATIONS} "
            "iterations: it and the force of the drive amplify each other; check pressure_angle, push_direction, "
            "center_of_mass and the damping of the carriages"
        )
    return push


def _settle_in_windows(
    bare: Run, drive: Drive, speed: Array | None, push: Array, settled: int, most: float
) -> int:
    """Settle the push of all stamps, of which the first `settled` have; returns how many have in the end.

    Where a vibration amplifies changes of the push, they grow over the record from iteration to iteration. In short
    windows, each from the state at the end of the one before, they have no time to grow.
    """
    first, start = 0, bare.start
    while settled < push.size:
        if settled > first + 1:
            before = slice(first, settled)
            start = _pushed(_part(bare, before, start), drive, push[before]).solution.end()
            first = settled - 1
        window = slice(first, min(first + WINDOW, push.size))
        own = None if speed is None else speed[window]
        part = _part(bare, window, start)
        push[window], inside, _ = _iterated(part, drive, own, push[window], most, MOST_ITERATIONS)
        settled = first + inside
        if settled < window.stop:
            break
    return settled


def _iterated(
    bare: Run, drive: Drive, speed: Array | None, push: Array, most: float, iterations: int
) -> tuple[Array, int, float]:
    """The push (n,) [N] after some iterations, the number of stamps from the first on at which it has settled.

    And the largest push that is allowed [N]: `most`, or if that is infinite, so many times that of the first iteration.
    """
    settled = 0
    for _ in range(iterations):
        found = drive.push_per_force * np.abs(_drive_force(_pushed(bare, drive, push), speed))
        most = min(most, MOST_PUSH * (float(found.max()) or np.inf))
        change = np.abs(found - push)[settled:] > SETTLED * most / MOST_PUSH
        push = np.append(push[:settled], np.minimum(found[settled:], most))
        if not change.any():
            return push, push.size, most
        settled += int(change.argmax())
    return push, settled, most


def _part(run: Run, stamps: slice, start: StartState | Array) -> Run:
    """The run over some stamps of its motion, from a state."""
    motion = run.motion
    histories = {name: values[stamps] for name in HISTORIES if (values := getattr(motion, name)) is not None}
    part = Motion(motion.time[stamps], **histories)
    return replace(run, motion=part, start=start, original_times=None)


def _rolling_speed(motion: Motion) -> Array | None:
    """Speed of the cart along x (n,) [m/s] by which friction is known, 0 at standstill; None if it is unknown."""
    if motion.velocity is None:
        return None
    return rolling_speed(motion.time, motion.acceleration, motion.velocity)


def _drive_force(run: Run, speed: Array | None) -> Array:
    """Force of the drive with friction (n,) [N] at the stamps."""
    force = run.solution.reaction()[:, 0] + friction_force(run.machine, run.carriage_loads(), speed)
    return np.asarray(force)


def _bends(bare: Run, drive: Drive, push: Array) -> Array:
    """Instants [s] in intervals where the push is not linear: their middles, and where the force changes its sign."""
    time = bare.motion.time
    starts = np.flatnonzero(np.diff(time) > 0.0)
    steps = time[starts + 1] - time[starts]
    inside = time[starts] + PLACE * steps
    finer = _with_instants(bare, inside)
    line = _at_stamps_of(finer, bare, push)
    force = _drive_force(_pushed(finer, drive, line), _rolling_speed(finer.motion))
    there = np.searchsorted(finer.motion.time, inside)
    bow = np.abs(drive.push_per_force * np.abs(force[there]) - line[there]) / SHARE
    bent = bow > AIMED_BOW * push.max()
    at, steps = there[bent], steps[bent]
    turns = [_crossings(finer.motion.time, force, first) for first in (at - 1, at)]
    return np.concatenate([time[starts[bent]] + 0.5 * steps, *turns])


def _crossings(time: Array, force: Array, first: Array) -> Array:
    """The times [s] of the zeros of a force in the intervals that begin with the stamps `first`; it is linear there."""
    start, end = force[first], force[first + 1]
    turns = start * end < 0.0
    first, share = first[turns], (start / np.where(turns, start - end, 1.0))[turns]
    return np.asarray(time[first] + share * (time[first + 1] - time[first]))


def _with_instants(run: Run, times: Array) -> Run:
    return run.at_stamps(*with_more_instants(run.motion, run.stretches, times))


def _at_stamps_of(run: Run, before: Run, push: Array) -> Array:
    """A push at the stamps of the run before, at those of a run."""
    return sampled(before.motion.time, push, run.motion.time, is_late(run.motion.time))


def _pushed(bare: Run, drive: Drive, push: Array) -> Run:
    """A run with the push (time,) [N] at L added to the process forces."""
    motion = bare.motion
    wrench = np.zeros((push.size, 6)) if motion.wrench is None else motion.wrench.copy()
    wrench[:, :3] += push[:, None] * np.array(drive.push_direction)
    notes = (*motion.notes, "with the push of the rack at L")
    return replace(bare, motion=replace(motion, wrench=wrench, notes=notes))
