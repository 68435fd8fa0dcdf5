"""Pictures in space, up against gravity, axes of one scale: the machine with its loads, and its natural modes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import Literal, cast

import numpy as np
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.base.number_text import digits, joined, load_with_unit
from guideload.machine.components import Carriage
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes, displacement, moving_dofs
from guideload.plots.style import GREY, INK, PALE, carriage_look, look, new_figure, plain
from guideload.simulation.result import Result

BODY_COLOR = "#5b6f8a"
# Over the diagonal of the machine: longest arrow of a load, arrow of the weight, largest displacement of a mode.
LOAD_ARROW, WEIGHT_ARROW, MODE_DISPLACEMENT = 0.36, 0.16, 0.10

AXES = "x, travel", "y", "z"
CHARACTER_WIDTH, MARK_WIDTH = (
    0.085,
    0.65,
)  # inches, of a character of a name and of the mark beside it in a legend
CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
EDGES = [(a, b) for a, b in combinations(range(8), 2) if np.abs(CORNERS[a] - CORNERS[b]).sum() == 1]
FACES = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]


@checked
def equivalent_box(machine: Machine) -> Array:
    """Corners of the homogeneous box with the body's mass, centre of mass and inertia.

    Returns
    -------
    ndarray, shape (8, 3) [m], from L. The sides a, b, c follow from J_a = m/12 (b² + c²) in the principal axes.
    """
    mass = machine.whole_body.mass
    center = np.asarray(machine.whole_body.center_of_mass, dtype=np.float64)
    principal, directions = np.linalg.eigh(machine.whole_body.central_inertia())
    squares = 6 / mass * (principal.sum() - 2 * principal)
    # Sides of a plate or a rod are zero, or by rounding imaginary: drawn with 2 % of the longest side.
    sides = np.sqrt(np.maximum(squares, 4e-4 * squares.max()))
    return cast(Array, center + (CORNERS * sides) @ directions.T)


@checked
def scene(machine: Machine, result: Result | None = None, ax: Axes3D | None = None) -> Axes3D:
    """The machine in space: box of the body's inertia, rails, carriages, L, points, centre of mass and weight.

    With a result, arrows show the force of the body on each carriage at the instant of the largest resultant; the
    legend gives their scale and the instant.
    """
    if result is not None:
        result.require_instants()
    box = equivalent_box(machine)
    size = _diagonal(machine, box)
    with look():
        if ax is None:
            # Constrained layout ignores the extent of 3D axes: the position is given by hand.
            figure = new_figure(10.0, 6.4)
            figure.set_layout_engine("none")
            ax = cast(Axes3D, figure.add_axes((0.0, 0.03, 0.66, 0.92), projection="3d"))
        _draw_rails(ax, machine, box)
        _draw_box(ax, box, BODY_COLOR, 0.10)
        label = "body: homogeneous box of its mass and inertia"
        ax.plot([], [], "s", color=BODY_COLOR, alpha=0.4, markersize=9, label=label)
        _draw_weight(ax, machine, size)
        ax.plot([0], [0], [0], "D", color=INK, markersize=6, label="L, the reference point")
        for point in machine.points:
            ax.plot(*np.array(point.at)[:, None], "^", color=INK, markersize=6, zorder=20)
            ax.text(*point.at, f"  {plain(point.name)}", color=INK, fontsize=8.5, va="center", zorder=20)
        for index in range(len(machine.carriages)):
            _draw_box(ax, _carriage_block(machine, index, size), carriage_look(index).color, 0.45)
        up = _up(machine)
        upward = np.zeros(len(machine.carriages))
        if result is not None and machine.carriages:
            upward = _draw_loads(ax, result, machine.carriage_centers, size) @ up
        for index, carriage in enumerate(machine.carriages):
            side = -1 if upward[index] > 0 else 1  # the name is on the side without the arrow
            place = machine.carriage_centers[index] + 0.045 * size * side * up
            style = {"color": carriage_look(index).color, "weight": "bold", "ha": "center", "zorder": 20}
            ax.text(*place, plain(carriage.name), va="top" if side < 0 else "bottom", **style)
        ax.set_title(machine.name, parse_math=False)
        _set_view(ax, machine, zoom=0.98)
        ax.legend(loc="upper left", bbox_to_anchor=(1.02, 0.95), alignment="left", labelspacing=0.9)
    return ax


@checked
def modes(machine: Machine, modes: Modes, axes: Sequence[Axes3D] | None = None) -> list[Axes3D]:
    """Mode shapes as exaggerated motion of the machine, with frequencies and damping ratios.

    The grey outline is the machine at rest. All modes have the same largest displacement, as a mode shape has no
    amplitude. Raises ArgumentError if `axes` are fewer than the modes.
    """
    count = len(modes.frequency)
    if axes is not None and len(axes) < count:
        raise ArgumentError(f"{count} modes need {count} axes, got {len(axes)}")
    box = equivalent_box(machine)
    size = _diagonal(machine, box)
    with look():
        if axes is None:
            columns = min(3, count)
            rows = -(-count // columns)
            figure = new_figure(4.0 * columns, 0.5 + 3.6 * rows)
            axes = [figure.add_subplot(rows, columns, 1 + i, projection="3d") for i in range(count)]
            linear = machine.model_level == "linear"
            nominal = "" if linear else ", all links in contact at their nominal stiffness"
            figure.suptitle(f"{machine.name}: natural modes{nominal}\n", parse_math=False)
            marks = [Patch(color=carriage_look(i).color, alpha=0.6) for i in range(len(machine.carriages))]
            names = [plain(carriage.name) for carriage in machine.carriages]
            entry = MARK_WIDTH + CHARACTER_WIDTH * max(map(len, names), default=0)
            columns = max(1, min(8, len(names), int(figure.get_figwidth() / entry)))
            figure.legend(marks, names, title="carriages", loc="outside lower center", ncols=columns)
        for index, ax in enumerate(axes[:count]):
            shape = np.real(modes.shape[index])
            _draw_mode(ax, machine, shape, box, size)
            ratio = 100 * float(modes.damping_ratio[index])
            dofs = joined(moving_dofs(machine, shape))
            ax.set_title(f"{digits(modes.frequency[index], 4)} Hz, ζ {digits(ratio)} %, mostly {dofs}")
    return list(axes[:count])


def _diagonal(machine: Machine, box: Array) -> float:
    points = np.vstack([box, machine.carriage_centers, np.zeros(3)])
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _carriage_block(machine: Machine, index: int, size: float) -> Array:
    """Corners of the block of a carriage; its length is true, its section is symbolic."""
    sides = np.array([_length(machine.carriages[index]), 0.045 * size, 0.055 * size])
    return cast(Array, machine.carriage_centers[index] + (CORNERS * sides) @ machine.carriage_axes[index])


def _length(carriage: Carriage) -> float:
    """Distance [m] of the ends of a carriage at which its links act."""
    return max(carriage.distances.pitch, carriage.distances.yaw)


def _rail_ends(machine: Machine, box: Array) -> Iterator[Array]:
    """Start and end of each rail, a little beyond the body and the carriages."""
    ends = [box[:, 0]]
    for center, carriage in zip(machine.carriage_centers, machine.carriages, strict=True):
        ends.append(center[0] + _length(carriage) * np.array([-0.5, 0.5]))
    low, high = np.min(np.concatenate(ends)), np.max(np.concatenate(ends))
    margin = 0.08 * (high - low)
    for rail in machine.rails:
        y, z = rail.position
        yield np.array([[low - margin, y, z], [high + margin, y, z]])


def _draw_rails(ax: Axes3D, machine: Machine, box: Array) -> None:
    for ends, rail in zip(_rail_ends(machine, box), machine.rails, strict=True):
        ax.plot(*ends.T, color=GREY, linewidth=3.5, alpha=0.8, solid_capstyle="butt")
        ax.text(*ends[1], f" rail {plain(rail.name)}", color=GREY, fontsize=8.5, va="center")


def _draw_weight(ax: Axes3D, machine: Machine, size: float) -> None:
    center = np.asarray(machine.whole_body.center_of_mass, dtype=np.float64)
    gravity = np.asarray(machine.gravity, dtype=np.float64)
    pull = float(np.linalg.norm(gravity))
    label = f"centre of mass and weight, {load_with_unit(machine.whole_body.mass * pull)}"
    ax.plot(*center[:, None], "o", color=BODY_COLOR, markersize=7, label=label)
    if pull > 0:
        arrow = WEIGHT_ARROW * size * gravity / pull
        ax.quiver(*center, *arrow, color=BODY_COLOR, linewidth=2.2, arrow_length_ratio=0.25)


def _draw_loads(ax: Axes3D, result: Result, centers: Array, size: float) -> Array:
    """Arrows of the carriages' loads at the instant of the peak; returns these loads (carriage, 3) [N]."""
    data = result.quantities  # not `data`, which takes the time to import xarray
    time, peaks, largest = data["time"], result.peak_columns, result.largest_load()
    force = cast(Array, data["force_global" if "force_global" in data else "force"][largest.instant])
    sizes = np.linalg.norm(force, axis=1)
    # Of a carriage that peaks beside the instant, the peak of the report.
    low, high = time[max(largest.instant - 1, 0)], time[min(largest.instant + 1, time.size - 1)]
    beside = (peaks["time_of_peak_s"] >= low) & (peaks["time_of_peak_s"] <= high)
    sizes = np.where(beside, peaks["peak_resultant_N"], sizes)
    if sizes.max() == 0:
        return force
    newtons_per_metre = _round_up(sizes.max() / (LOAD_ARROW * size))
    ax.plot([], [], " ", label=f"\nloads: the body on the carriages, {largest.time:.3f} s")
    for index, (center, load) in enumerate(zip(centers, force, strict=True)):
        style = {"color": carriage_look(index).color, "linewidth": 2.4, "arrow_length_ratio": 0.18}
        name = plain(str(data["carriage"][index]))
        label = f"carriage {name}: {load_with_unit(sizes[index])}"
        ax.quiver(*center, *(load / newtons_per_metre), label=label, **style)
    # quiver scales to the tails of the arrows only
    ax.auto_scale_xyz(*(centers + force / newtons_per_metre).T, True)
    scale = load_with_unit(newtons_per_metre / 10)
    ax.plot([], [], " ", label=f"scale of their arrows: {scale} per 100 mm")
    return force


def _round_up(value: float) -> float:
    """The next 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-12)) * power)


def _draw_mode(ax: Axes3D, machine: Machine, shape: Array, box: Array, size: float) -> None:
    centers = machine.carriage_centers
    largest = np.linalg.norm(displacement(np.vstack([box, centers]), shape), axis=1).max()
    q = shape * (MODE_DISPLACEMENT * size / largest) if largest > 0 else shape
    for ends in _rail_ends(machine, box):
        ax.plot(*ends.T, color=PALE, linewidth=2.5, solid_capstyle="butt")
    blocks = [_carriage_block(machine, index, size) for index in range(len(machine.carriages))]
    colors = [carriage_look(index).color for index in range(len(blocks))]
    for corners, color, alpha in [
        (box, BODY_COLOR, 0.12),
        *((b, c, 0.5) for b, c in zip(blocks, colors, strict=True)),
    ]:
        ax.add_collection3d(_edges(corners, GREY, 0.55, width=0.7))
        _draw_box(ax, corners + displacement(corners, q), color, alpha)
    ax.plot([0], [0], [0], "D", color=INK, markersize=4)
    _set_view(ax, machine, zoom=1.3, bare=True)


def _draw_box(ax: Axes3D, corners: Array, color: str, alpha: float) -> None:
    """Faces and edges of a box; alpha: opacity of the faces."""
    faces = [corners[face] for face in FACES]
    ax.add_collection3d(Poly3DCollection(faces, facecolors=color, alpha=alpha, edgecolors="none"))
    ax.add_collection3d(_edges(corners, color, 0.9))


def _edges(corners: Array, color: str, alpha: float, width: float = 1.1) -> Line3DCollection:
    lines = [corners[list(edge)] for edge in EDGES]
    return Line3DCollection(lines, colors=color, alpha=alpha, linewidths=width)


def _up(machine: Machine) -> Array:
    """The axis that is drawn upright, (3,) of 0 and 1 or -1: that along which gravity is largest, y without gravity."""
    gravity = np.array(machine.gravity if any(machine.gravity) else (0.0, -1.0, 0.0))
    at = int(np.abs(gravity).argmax())
    return cast(Array, -np.sign(gravity[at]) * np.eye(3)[at])


def _set_view(ax: Axes3D, machine: Machine, zoom: float, bare: bool = False) -> None:
    """The same scale on all axes, seen from the front right."""
    up = _up(machine)
    upright = int(np.abs(up).argmax())
    vertical = cast("Literal['x', 'y', 'z']", "xyz"[upright])
    # Turned upside down rather than mirrored, which would swap left and right.
    roll = 180 if up[upright] < 0.0 else 0
    ax.view_init(elev=-20 if roll else 20, azim=-50, roll=roll, vertical_axis=vertical)
    lengths = [float(np.ptp(limits)) for limits in (ax.get_xlim(), ax.get_ylim(), ax.get_zlim())]
    ax.set_box_aspect(lengths, zoom=zoom)
    for artist in (*ax.lines, *ax.collections):
        # Corners of a wide machine outside the axes' rectangle must be drawn, and must not move other axes.
        artist.set_clip_on(False)
        artist.set_in_layout(False)
    if bare:
        ax.set_axis_off()
        return
    names = [name + (", down" if up[i] < 0.0 else ", up") * (i == upright) for i, name in enumerate(AXES)]
    ax.set(**{f"{axis}label": f"{name} [m]" for axis, name in zip("xyz", names, strict=True)})
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(5))
        axis.pane.set_facecolor("white")
        axis.pane.set_edgecolor(PALE)
