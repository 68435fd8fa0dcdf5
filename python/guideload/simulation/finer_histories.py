"""Histories that show the vibration between the samples of a motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from guideload.simulation.instants import enough_step, fastest_vibration, parts_of, with_parts
from guideload.simulation.run import Run

BOW = 0.01  # distance of a load from the chord between two instants, over the largest dynamic load
ROUNDING = 1e-9  # of the load scale: a smaller dynamic load has no bow
MOST_INSTANTS = 200_000  # beyond them, some intervals have fewer than they need


def with_visible_vibration(run: Run) -> Run:
    """The run with more instants between the samples if its histories would hide a vibration there; else the same run.

    A load F bows away from the chord between two instants by about h^2 |F''| / 8. Where that is more than `BOW` of the
    largest dynamic load for some link, the instants are as close as this needs, and at least as those with which
    extremes are found. Modes with more than 22 samples per period never need it.

    Without instants in between: runs that report given instants, have a fixed step (which would end at each of them),
    go over rails that are not straight, or have moving riders.
    """
    motion, machine, fastest = run.motion, run.machine, fastest_vibration(run.machine)
    other = (run.times, run.step, run.feet, run.travel)
    if any(each is not None for each in other) or not fastest:
        return run
    longest_needed = np.sqrt(8.0 * BOW) / fastest
    if parts_of(motion, longest_needed, MOST_INSTANTS).max() == 1:
        return run
    table, solution = machine.link_table(), run.solution
    rows = np.hstack([table.directions, np.cross(table.points, table.directions)]) * table.stiffness[:, None]
    curvature = float(np.abs(solution.acceleration() @ rows.T).max(initial=0.0))
    dynamic = run.link_loads() - run.machine_at_start.scene.static_link_loads()
    largest = float(np.abs(dynamic).max(initial=0.0))
    if not curvature or largest <= ROUNDING * solution.load_scale:
        return run
    step = float(np.sqrt(8.0 * BOW * largest / curvature))
    if parts_of(motion, step, MOST_INSTANTS).max() == 1:
        return run
    parts = parts_of(motion, min(step, enough_step(machine)), MOST_INSTANTS)
    finer, stretches = with_parts(motion, run.stretches, parts)
    return replace(run, motion=finer, stretches=stretches, samples=motion.time)
