"""Histories that show the vibration between the samples of a motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from guideload._core import limited_parts
from guideload.base.arrays import Array, Indices
from guideload.motion.motion import divided
from guideload.simulation.instants import (
    fastest_vibration,
    slowest_vibration,
    with_more_instants,
    with_parts,
)
from guideload.simulation.run import Run

# Distance of a load from the line between two instants, over the largest dynamic load: accepted, aimed at if it is
# larger, and accepted where no vibration has four instants per period, so that the mean load is that of the vibration.
MOST_BOW, AIMED_BOW, BLIND_BOW = 0.01, 0.0025, 0.0003
ROUNDING = 1e-9  # of the load scale: a smaller dynamic load has no bow
# Instants per period of the fastest mode: the most, and those from which on halving lessens each bow but that of a
# jump, as by a damper that gains contact.
MOST_PER_PERIOD, RESOLVED = 320, 6
PAUSE = 2.0  # times in which vibrations die away: a longer interval is a pause
MOST_INSTANTS = 200_000  # beyond them, some intervals have fewer than they need
PASSES = 6  # where an interval lasts for many periods, one pass does not show the whole vibration
# Where in an interval a load is compared with the line: not in its middle, where a vibration with whole periods from
# the end to there has no bow. The bow there is this share of that in the middle.
PLACE = 0.382
SHARE = 4.0 * PLACE * (1.0 - PLACE)
SOME = 200  # instants, whose largest dynamic load is a lower bound of that of all
AT_A_TIME = 1000  # instants: larger arrays take longer to get than to fill
SUSPECT = 0.8  # of the bow: with four instants per period, second differences say 0.85 of it
# Intervals on both sides whose bow counts too: a vibration may cross the line just where it is compared.
NEIGHBOURS = 2


def with_visible_vibration(run: Run) -> Run:
    """The run with more instants between the samples where its histories would hide a vibration; else the same run.

    Where the load of a link differs from the line between two instants by more than `MOST_BOW` of the largest dynamic
    load, the interval is halved until the distance is about `AIMED_BOW`. A linear machine whose modes have more than 22
    samples per period never needs it. Where even the slowest vibration has fewer than four instants per period,
    `BLIND_BOW` is too much.

    Without instants in between: runs that report given instants, have a fixed step (which would end at each of them) or
    go over rails that are not straight.
    """
    other = (run.times, run.step, run.straightness_loads)
    if any(each is not None for each in other) or run.motion.time.size >= MOST_INSTANTS or _bows_little(run):
        return run
    run = _with_ends_of_vibrations(run)
    intervals, fastest, slowest = np.diff(run.motion.time), _fastest(run), slowest_vibration(run.machine)
    periods = intervals * fastest / (2.0 * np.pi)
    most = 2.0 ** np.clip(np.ceil(np.log2(np.maximum(MOST_PER_PERIOD * periods, 1.0))), 0, 40)
    finer, parts, before = run, np.ones(intervals.size, np.int64), np.full(intervals.size, np.inf)
    is_linear = run.machine.model_level == "linear"
    for _ in range(PASSES):
        places = _suspects(finer, fastest)
        if not places.size:
            break
        bow, largest, accuracy = _bows(finer, places)
        if largest <= accuracy:
            break
        bow = np.maximum.reduceat(bow, np.cumsum(parts) - parts) / largest
        wide = np.pad(bow, NEIGHBOURS, mode="edge")
        bow = np.lib.stride_tricks.sliding_window_view(wide, 2 * NEIGHBOURS + 1).max(axis=1)
        bow[bow * largest <= accuracy] = 0.0
        accepted = np.where(intervals / parts * slowest > 0.5 * np.pi, BLIND_BOW, MOST_BOW)
        if np.all(bow <= accepted):
            break
        halvings = np.ceil(0.5 * np.log2(np.maximum(bow / AIMED_BOW, 2.0))).astype(np.int64)
        is_jump = (bow > 0.5 * before) & (parts >= RESOLVED * periods)
        wanted, before = np.where((bow > accepted) & ~is_jump, parts << halvings, parts), bow
        wanted = limited_parts(np.minimum(wanted, most).astype(np.int64), MOST_INSTANTS)
        if np.array_equal(wanted, parts):
            break
        # A bow of at most half a period is measured, and each halving leaves a quarter of it: no need to look again.
        is_measured = is_linear and np.all((wanted == parts) | (intervals * fastest <= np.pi * parts))
        parts = wanted
        finer = run.at_stamps(*with_parts(run.motion, run.stretches, parts))
        if is_measured:
            break
    return finer


def with_instants_for_peaks(run: Run) -> Run:
    """The run with six instants or more per period of the fastest vibration, among them its own; else the same run.

    From them on, a search between the instants finds each peak. Velocity and position of the cart are left out.
    """
    motion, stretches = run.excitation_for_peaks
    if motion is run.motion:
        return run
    if run.method != "exact":  # its steps would end at the new stamps
        return replace(run, times=motion.time)
    return run.at_stamps(motion, stretches)


def _with_ends_of_vibrations(run: Run) -> Run:
    """The run with an instant in each pause at which vibrations have died away: from there on no load bows."""
    decay = -run.machine.scene.modes()[3].real.max(initial=-np.inf)
    lasts = -np.log(ROUNDING) / decay if decay > 0.0 else np.inf
    stamps = run.motion.time
    pauses = np.flatnonzero(np.diff(stamps) > PAUSE * lasts)
    return run.at_stamps(*with_more_instants(run.motion, run.stretches, stamps[pauses] + lasts))


def _bows_little(run: Run) -> bool:
    """Whether the changes of velocity say already that no elastic load bows by more than `MOST_BOW`.

    Of linear machines: over an interval h a load F bows by h^2 |F''| / 8 or less, for the F'' of its middle; the mean
    of F'' is the change of F' over h, and for a vibration w that of the middle times sin(w h / 2) / (w h / 2). The
    loads of dampers are not looked at: under noise they may bow a little more. True where nothing vibrates.
    """
    machine, longest = run.machine, float(np.diff(run.motion.time).max())
    if machine.model_level != "linear":
        return False
    fastest = fastest_vibration(machine)
    if longest * fastest <= np.sqrt(8.0 * MOST_BOW):
        return True
    if longest * fastest > np.pi:  # the samples may show a vibration where it has no curvature
        return False
    table = machine.link_table()
    rows = table.rows * table.stiffness[:, None]
    # From the largest of each dof and from some instants: much quicker than all links at all samples.
    some = run.solution.some_positions(1 + run.motion.time.size // SOME)
    largest = np.abs((some - run.machine_at_start.scene.static_position()) @ rows.T).max()
    change = (np.abs(rows) @ run.solution.largest_velocity_change()).max()
    half = 0.5 * longest * fastest
    bow = longest / 8.0 * change * half / np.sin(half)
    return bool(bow <= max(MOST_BOW * largest, _accuracy(run)))


def _accuracy(run: Run) -> float:
    """Size of a load [N] that the run does not know."""
    exact = run.method == "exact" or run.machine.model_level == "linear"
    return max(ROUNDING, 0.0 if exact else 10.0 * run.rtol) * float(run.solution.load_scale)


def _fastest(run: Run) -> float:
    """Angular frequency of the fastest vibration [rad/s], also of that with all contacts closed."""
    closed = float(np.abs(run.machine.nominal_scene.modes()[3].imag).max(initial=0.0))
    return max(closed, fastest_vibration(run.machine))


def _suspects(run: Run, fastest: float) -> Indices:
    """Intervals in which a load may bow by more than `MOST_BOW`, by its second differences at the ends.

    They contain the changes of slope at samples, so most of these intervals are innocent. Where an interval is longer
    than a quarter of a period, or where no second difference is known, it is one of them.
    """
    steps = np.diff(run.motion.time)
    lasts = steps > 0.0
    each = run.carriage_loads()[:, :, :3] if len(run.machine.carriages) > 1 else run.link_loads()[:, None]
    per_step = np.divide(1.0, steps, out=np.zeros_like(steps), where=lasts)
    changes, low, high = np.zeros(steps.size - 1), np.inf, -np.inf
    for first in range(0, steps.size, AT_A_TIME):
        part = slice(first, first + AT_A_TIME + 2)
        loads = np.ascontiguousarray(each[part].reshape(-1, each.shape[1] * each.shape[2]).T)
        low, high = np.minimum(low, loads.min(axis=1)), np.maximum(high, loads.max(axis=1))
        slopes = np.diff(loads)
        slopes *= per_step[part][: slopes.shape[1]]
        found = np.abs(np.diff(slopes)).max(axis=0)
        changes[first : first + found.size] = found
    known = np.pad(lasts[1:] & lasts[:-1], 1)
    curvature = np.zeros(steps.size + 1)
    curvature[1:-1] = 2.0 * changes / np.where(known[1:-1], steps[1:] + steps[:-1], np.inf)
    bow = steps**2 / 8.0 * np.maximum(curvature[:-1], curvature[1:])
    swing = 0.5 * float(np.max(high - low))
    may = (bow > SUSPECT * MOST_BOW * swing) | ~(known[:-1] | known[1:]) | (steps * fastest > 0.5 * np.pi)
    return np.flatnonzero(lasts & may)


def _bows(run: Run, at: Indices) -> tuple[Array, float, float]:
    """The largest bow of a link load in each interval, the largest dynamic load, and the accuracy of both [N].

    at: the intervals that are looked at; for the others the bow is 0.
    """
    stretches = run.stretches
    if stretches is not None:
        first = np.array(stretches.first)
        stretches = replace(stretches, first=tuple((first + np.searchsorted(at, first)).tolist()))
    loads = run.link_loads(solution=run.solved(divided(run.motion.excitation, at, PLACE), stretches))
    inside = at + 1 + np.arange(at.size)
    line = (1.0 - PLACE) * loads[inside - 1] + PLACE * loads[inside + 1]
    bow = np.zeros(run.motion.time.size - 1)
    bow[at] = np.abs(loads[inside] - line).max(axis=1) / SHARE
    loads -= run.machine_at_start.scene.static_link_loads()
    return bow, float(np.abs(loads).max()), _accuracy(run)
