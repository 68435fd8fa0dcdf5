"""Stamps of a planned motion: at every corner of its acceleration, and a grid between them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from guideload.base.arrays import Array
from guideload.motion.motion import Motion
from guideload.motion.phase_forces import PhaseForce
from guideload.motion.profiles import Pieces

CLOSE = 0.01  # of the grid's step: a grid stamp so close to a corner is left out


@dataclass(frozen=True, eq=False)
class Leg:
    """A move of a motion and the pause after it.

    pieces      of the move in positive direction
    start, end  m, positions of the cart before and after it
    dwell       s, the pause
    forces      process forces
    """

    pieces: Pieces
    start: float
    end: float
    dwell: float
    forces: tuple[PhaseForce, ...] = ()


def grid_step(rate: float) -> float:
    """Step [s] of the grid: a power of two, at most 1 / rate. Its multiples are exact, so all steps are equal."""
    return 2.0 ** -math.ceil(math.log2(rate))


def sampled(legs: Sequence[Leg], rate: float, source: str, notes: tuple[str, ...]) -> Motion:
    """The motion of legs, one after the other, with at least `rate` [1/s] stamps per second.

    Velocity and position at the stamps are the integrals of the acceleration, which is linear between the stamps. Each
    leg ends with velocity 0 at its end, without rounding.
    """
    parts = [_states(leg) for leg in legs]
    states = np.hstack(parts)
    corner = np.append(0.0, np.cumsum(states[0]))
    acting = [*_acting(legs, [part.shape[1] for part in parts], corner)]
    lasting = np.diff(corner) > 0.0  # a piece below the resolution of the stamps becomes a jump
    length, start, end, speed, place = states[:, lasting]
    corner = np.append(0.0, corner[1:][lasting])
    before, after = np.append(0.0, end), np.append(start, 0.0)
    speed, place = np.append(speed, 0.0), np.append(place, legs[-1].end)

    index = np.repeat(np.arange(corner.size), 1 + (before != after))  # a jump has two stamps
    late = np.append(False, index[1:] == index[:-1])
    step = grid_step(rate)
    grid = step * np.arange(1, math.ceil(corner[-1] / step))
    piece = np.searchsorted(corner, grid, side="right") - 1
    free = np.minimum(grid - corner[piece], corner[piece + 1] - grid) > CLOSE * step
    grid, piece = grid[free], piece[free]
    since = grid - corner[piece]
    slope = (end - start)[piece] / length[piece]
    bent = start[piece] + slope * since
    gained = since * (start[piece] + slope * since / 2.0)
    moved = since * (speed[piece] + since * (start[piece] / 2.0 + slope * since / 6.0))

    time = np.concatenate([corner[index], grid])
    order = np.argsort(time, kind="stable")
    motion = Motion.along_x(
        time[order],
        np.concatenate([np.where(late, after[index], before[index]), bent])[order],
        velocity=np.concatenate([speed[index], speed[piece] + gained])[order],
        position=np.concatenate([place[index], place[piece] + moved])[order],
        source=source,
        notes=notes,
        exact=True,
    )
    return _with_forces(motion, acting) if acting else motion


def _acting(
    legs: Sequence[Leg], counts: Sequence[int], corner: Array
) -> Iterator[tuple[float, float, Array]]:
    """Start and end [s] of each process force, and its wrench. counts: pieces of each leg, with its pause."""
    for leg, count, end in zip(legs, counts, np.cumsum(counts), strict=True):
        for force in leg.forces:
            pieces = force.pieces(leg.pieces, leg.dwell)
            start, stop = corner[end - count + np.array([pieces.start, pieces.stop])]
            yield float(start), float(stop), force.wrench


def _with_forces(motion: Motion, acting: Sequence[tuple[float, float, Array]]) -> Motion:
    """The motion with wrenches (6,) about L that act from a start to an end [s]; exact, with jumps at both."""
    edges = np.unique([time for start, end, _ in acting for time in (start, end)])
    load = np.zeros((edges.size - 1, 6))
    for start, end, wrench in acting:
        load[slice(*np.searchsorted(edges, (start, end)))] += wrench
    load = load.repeat(2, axis=0)
    forced = motion.with_force(np.zeros(3), load[:, :3], load[:, 3:], time=edges.repeat(2)[1:-1])
    return replace(forced, notes=motion.notes)


def _states(leg: Leg) -> Array:
    """Of the pieces of a leg (5, k): length [s], acceleration at start and end [m/s2], speed [m/s] and place [m]."""
    pieces, sign = leg.pieces, math.copysign(1.0, leg.end - leg.start)
    speed, place = sign * pieces.speeds()[:-1], leg.start + sign * pieces.distances()[:-1]
    states = np.stack([pieces.length, sign * pieces.start, sign * pieces.end, speed, place])
    pause = [leg.dwell, 0.0, 0.0, 0.0, leg.end]
    return states if leg.dwell == 0.0 else np.column_stack([states, pause])
