"""Histories that show the vibration between the samples of a motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from guideload.simulation.instants import fastest_vibration, parts_of, with_parts
from guideload.simulation.run import Run

# Distance of a load from the chord between two instants, over the largest dynamic load: what is accepted, and how close
# the instants are put if it is more.
MOST_BOW, BOW = 0.01, 0.0025
ROUNDING = 1e-9  # of the load scale: a smaller dynamic load has no bow
MOST_INSTANTS = 200_000  # beyond them, some intervals have fewer than they need
# Of runs with so many instants, only some are looked at, up to each thirteenth: a vibration has all its phases there.
MANY, EVERY = 1000, 12
PASSES = 3  # the instants of one pass show more of the vibration than those before


def with_visible_vibration(run: Run) -> Run:
    """The run with more instants between the samples if its histories would hide a vibration there; else the same run.

    A load F bows away from the chord between two instants by about h^2 |F''| / 8. If that is more than `MOST_BOW` of
    the largest dynamic load for some link, the instants are so close that it is `BOW`. Modes with more than 22 samples
    per period never need it.

    Without instants in between: runs that report given instants, have a fixed step (which would end at each of them),
    go over rails that are not straight, or have moving riders.
    """
    fastest = fastest_vibration(run.machine)
    other = (run.times, run.step, run.feet, run.travel)
    if any(each is not None for each in other) or not fastest:
        return run
    if _fine_enough(run, np.sqrt(8.0 * MOST_BOW) / fastest):
        return run
    finer = run
    for _ in range(PASSES):
        step = _step_per_root_of_bow(finer)
        if _fine_enough(finer, step * np.sqrt(MOST_BOW)):
            break
        parts = parts_of(run.motion, step * np.sqrt(BOW), MOST_INSTANTS)
        motion, stretches = with_parts(run.motion, run.stretches, parts)
        finer = replace(run, motion=motion, stretches=stretches, samples=run.motion.time)
    return finer


def _fine_enough(run: Run, step: float) -> bool:
    """Whether no instants are, or can be, put into a motion so that they are not further apart than a step [s]."""
    return bool(parts_of(run.motion, step, MOST_INSTANTS).max() == 1)


def _step_per_root_of_bow(run: Run) -> float:
    """The distance of instants [s] between which the largest bow would be the largest dynamic load."""
    table, solution = run.machine.link_table(), run.solution.every(1 + min(EVERY, run.time.size // MANY))
    rows = np.hstack([table.directions, np.cross(table.points, table.directions)]) * table.stiffness[:, None]
    moved = solution.position() - run.machine_at_start.scene.static_position()
    curvature = float(np.abs(solution.acceleration() @ rows.T).max(initial=0.0))
    largest = float(np.abs(moved @ rows.T).max(initial=0.0))
    if not curvature or largest <= ROUNDING * solution.load_scale:
        return np.inf
    return float(np.sqrt(8.0 * largest / curvature))
