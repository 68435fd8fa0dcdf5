"""Motion of the machine's points: displacement, velocity and acceleration in time, peaks, settling after moves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from guideload.audit.histories import Histories
from guideload.base.arrays import Array, read_only
from guideload.base.errors import ArgumentError
from guideload.base.maxima import maxima_between
from guideload.base.quantities import Quantities, QuantityRow
from guideload.machine.machine import DOFS, Machine
from guideload.machine.modes import Modes, displacement
from guideload.motion.standstill import MoveSpan, move_spans
from guideload.simulation.finer_histories import with_instants_for_peaks
from guideload.simulation.run import Run

DIMS = {
    "point_displacement": ("time", "point", "axis"),
    "point_velocity": ("time", "point", "axis"),
    "point_acceleration": ("time", "point", "axis"),
    "point_absolute_acceleration": ("time", "point", "axis"),
    "static_point_displacement": ("point", "axis"),
}
# Histories of the points, and the columns of their largest values.
RATES = ("displacement", "velocity", "acceleration", "absolute_acceleration")
SIZES: tuple[str, ...] = ("peak_m", "peak_x_m", "peak_y_m", "peak_z_m")
SIZES += ("peak_velocity_m_s", "peak_acceleration_m_s2", "peak_absolute_acceleration_m_s2")
WATCHED = 0.5  # periods of the lowest mode: shorter observation does not show that a vibration has settled


def moved(machine: Machine, motion: Array) -> Array:
    """Displacements (..., point, 3) of the machine's points, or their rates, for those (..., 6) of L."""
    return displacement(np.array([point.at for point in machine.points]), motion)


def point_rows(machine: Machine, known: Mapping[str, Array]) -> Iterator[QuantityRow]:
    """The quantities of the points of a run, from those of L and of the cart by name; none without points."""
    if not machine.points:
        return
    dims, frame = DIMS["point_displacement"], "in the travelling frame"
    acceleration = moved(machine, known["acceleration"])
    absolute = acceleration + known["cart_acceleration"][:, None]
    place, static = moved(machine, known["displacement"]), moved(machine, known["static_displacement"])
    yield "point_displacement", dims, place, "m", f"displacement {frame}, sag included"
    yield "point_velocity", dims, moved(machine, known["velocity"]), "m/s", f"velocity {frame}"
    yield "point_acceleration", dims, acceleration, "m/s^2", f"acceleration {frame}"
    yield "point_absolute_acceleration", dims, absolute, "m/s^2", "acceleration with that of the cart"
    yield "static_point_displacement", DIMS["static_point_displacement"], static, "m", "displacement at rest"


def from_rest(machine: Machine, data: Quantities, spans: Sequence[MoveSpan]) -> Array:
    """Displacement (time, point, 3) [m] from the place at rest with the payloads, riders and forces of the instant.

    spans: the moves; riders count where they are at the end of the standstill after a move. By process forces, and by
    riders on their way there, the place is shifted as far as the nominal stiffness of the links balances them.
    """
    stretches = Histories(machine, data).stretches
    sizes = [part.time.size for part in stretches]
    rest = np.repeat([part.machine.scene.static_position() for part in stretches], sizes, axis=0)
    forces = data["wrench"].copy() if "wrench" in data else np.zeros_like(rest)
    if "rider_position" in data:
        places = data["rider_position"]
        away = places - [rider.position for rider in machine.riders]
        for span in spans:
            first, last = np.searchsorted(data["time"], [span.end, span.until])
            there = places[min(last, len(places) - 1)]
            riders = [
                rider.model_copy(update={"position": float(at)})
                for rider, at in zip(machine.riders, there, strict=True)
            ]
            rest[first:] = machine.model_copy(update={"riders": riders}).scene.static_position()
            away[first:] = places[first:] - there
        for rider, travel in zip(machine.riders, away.T, strict=True):
            weight = rider.mass * np.array(machine.gravity)
            forces[:, 3:] += travel[:, None] * np.cross(rider.direction, weight)
    free = [DOFS.index(dof) for dof in machine.free]
    stiffness = machine.nominal_scene.matrices()[0][2][np.ix_(free, free)]
    rest[:, free] += np.linalg.solve(stiffness, forces[:, free].T).T
    return np.asarray(data["point_displacement"] - moved(machine, rest))


def point_columns(data: Quantities, run: Run | None) -> dict[str, Array]:
    """The columns of `Result.points`, each (point,).

    run: has the motion of the points at other instants too; None: the columns are of the instants of the data.
    """
    static, time = data["static_point_displacement"], data["time"]
    magnitudes = _magnitudes(static, {name: data[f"point_{name}"] for name in RATES})
    if run is not None:

        def magnitudes_of(there: Run) -> Array:
            return _magnitudes(static, _rates(there))

        def magnitudes_at(times: Array) -> Array:
            return magnitudes_of(replace(run, times=times))

        finer = with_instants_for_peaks(run)
        if finer is not run:
            time, magnitudes = finer.time, magnitudes_of(finer)
        at = maxima_between(time, magnitudes, magnitudes.max(axis=0), magnitudes_at)
        if at.size:
            order = np.argsort(np.append(time, at), kind="stable")
            magnitudes = np.concatenate([magnitudes, magnitudes_at(at)])[order]
            time = np.append(time, at)[order]
    peak, *others = magnitudes.max(axis=0).reshape(len(SIZES), -1)
    at = magnitudes[:, : len(static)].argmax(axis=0)
    columns = {"sag_m": np.linalg.norm(static, axis=1), SIZES[0]: peak, "time_of_peak_s": time[at]}
    columns |= dict(zip(SIZES[1:], others, strict=True))
    return {name: read_only(column) for name, column in columns.items()}


def _rates(run: Run) -> dict[str, Array]:
    """The histories of the points of a run, (time, point, 3)."""
    solution = run.solution
    of_point = solution.position(), solution.velocity(), solution.acceleration()
    rates = dict(zip(RATES, (moved(run.machine, each) for each in of_point), strict=False))
    return rates | {RATES[3]: rates["acceleration"] + solution.inputs()[:, None, :3]}


def _magnitudes(static: Array, rates: Mapping[str, Array]) -> Array:
    """Histories (time, magnitude and point) whose largest values are the columns `SIZES`."""
    change = rates["displacement"] - static
    distances = [np.linalg.norm(each, axis=2) for each in (change, *(rates[name] for name in RATES[1:]))]
    return np.concatenate([distances[0], *np.moveaxis(np.abs(change), 2, 0), *distances[1:]], axis=1)


@dataclass(frozen=True, eq=False)
class Settling:
    """Settling of a point after each move."""

    point: str  # its name
    window: float  # m
    spans: tuple[MoveSpan, ...]  # the moves, and the standstills after them
    # (move,) s from the end of the move until the point stays inside the window; nan if the standstill ends before that
    # is seen
    time: Array


def settling_of(machine: Machine, data: Quantities, window: float | None = None) -> tuple[Settling, ...]:
    """The settling of every point with a window.

    window: m, for all points; by default each point's own settle_window. Raises ArgumentError for a
    window that is not above 0.
    """
    if window is not None and not 0.0 < window < np.inf:
        raise ArgumentError(f"window: expected a length above 0 m, got {window!r}")
    windows = [one.settle_window if window is None else window for one in machine.points]
    if not any(windows):
        return ()
    velocity = data["cart_velocity"] if "cart_velocity" in data else None
    spans = tuple(move_spans(data["time"], data["cart_acceleration"], velocity))
    distance = np.linalg.norm(from_rest(machine, data, spans), axis=2)
    machines = [part.machine for part in Histories(machine, data).stretches]
    lowest_mode = min(float(Modes.of(one).frequency.min(initial=np.inf)) for one in machines)
    watched = WATCHED / lowest_mode if lowest_mode else 0.0
    found = []
    for i, (point, limit) in enumerate(zip(machine.points, windows, strict=True)):
        if limit is not None:
            times = [_settled(data["time"], distance[:, i] > limit, span, watched) for span in spans]
            found.append(Settling(point.name, limit, spans, np.array(times)))
    return tuple(found)


def _settled(time: Array, outside: Array, span: MoveSpan, watched: float) -> float:
    """Time [s] from the end of a move until the point stays inside; nan if the standstill ends before that is seen."""
    first, after = np.searchsorted(time, [span.end, span.until], side="left")
    out = np.flatnonzero(outside[first : after + 1])
    inside = first + (out[-1] + 1 if out.size else 0)
    if inside > after or span.until - time[min(inside, time.size - 1)] < watched:
        return float("nan")
    return float(time[inside] - span.end)
