"""Pictures in space: the machine with its loads, and its natural modes. y is up; all axes have one scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import TYPE_CHECKING, cast

import numpy as np
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from guideload.base.numbers import joined, load_with_unit
from guideload.machine.modes import displacement, moving_dofs
from guideload.plots.style import GREY, INK, PALE, carriage_look, look, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import NDArray

    from guideload.machine.machine import Machine
    from guideload.machine.modes import Modes
    from guideload.simulation.result import Result

    Points = NDArray[np.float64]

BODY_COLOR = "#5b6f8a"
LOAD_ARROW = 0.36  # longest load arrow and
WEIGHT_ARROW = 0.16  # arrow of the weight, and
MODE_SWING = 0.10  # largest displacement of a mode, each as a part of the machine's diagonal

CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
EDGES = [(a, b) for a, b in combinations(range(8), 2) if np.abs(CORNERS[a] - CORNERS[b]).sum() == 1]
FACES = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]


def equivalent_box(machine: Machine) -> Points:
    """Corners of the homogeneous box with the body's mass, centre of mass and inertia.

    Returns
    -------
    ndarray, shape (8, 3) [m], from L. Its sides are those of J = m/12 (b² + c²) in each principal direction.
    """
    mass = machine.body.mass
    center = np.asarray(machine.body.center_of_mass, dtype=np.float64)
    principal, directions = np.linalg.eigh(machine.body.central_inertia())
    squares = 6 / mass * (principal.sum() - 2 * principal)
    # A plate or a rod has sides of zero, which rounding may turn negative: drawn a little thick instead.
    sides = np.sqrt(np.maximum(squares, 4e-4 * squares.max()))
    return cast("Points", center + (CORNERS * sides) @ directions.T)


def scene(machine: Machine, result: Result | None = None, ax: Axes3D | None = None) -> Axes3D:
    """The machine in space: box of the body's inertia, rails, carriages, L, centre of mass and weight.

    With a result also the load of every carriage, the force of the body on it, at the instant of the largest
    resultant; the legend names the arrows' scale and the instant.
    """
    box = equivalent_box(machine)
    size = _diagonal(machine, box)
    with look():
        if ax is None:
            # Constrained layout does not see what a picture in space fills: places are given by hand.
            figure = new_figure(10.0, 6.4)
            figure.set_layout_engine("none")
            ax = cast("Axes3D", figure.add_axes((0.0, 0.03, 0.66, 0.92), projection="3d"))
        _draw_rails(ax, machine, box)
        ax.add_collection3d(_faces(box, BODY_COLOR, 0.10))
        ax.add_collection3d(_edges(box, BODY_COLOR, 0.9))
        ax.plot(
            [],
            [],
            "s",
            color=BODY_COLOR,
            alpha=0.4,
            markersize=9,
            label="body: homogeneous box of its mass and inertia",
        )
        _draw_weight(ax, machine, size)
        ax.plot(
            [0], [0], [0], marker="D", linestyle="", color=INK, markersize=6, label="L, the reference point"
        )
        for index in range(len(machine.carriages)):
            color = carriage_look(index).color
            block = _carriage_block(machine, index, size)
            ax.add_collection3d(_faces(block, color, 0.45))
            ax.add_collection3d(_edges(block, color, 0.9))
        upward = np.zeros(len(machine.carriages))
        if result is not None and machine.carriages:
            upward = _draw_loads(ax, result, machine.carriage_centers, size)
        for index, carriage in enumerate(machine.carriages):
            away = -1 if upward[index] > 0 else 1  # the name stands where the arrow does not
            place = machine.carriage_centers[index] + (0, 0.045 * size * away, 0)
            side = "top" if away < 0 else "bottom"
            ax.text(
                *place,
                carriage.name,
                color=carriage_look(index).color,
                weight="bold",
                ha="center",
                va=side,
                zorder=20,
            )
        ax.set_title(machine.name)
        _frame(ax, zoom=0.98)
        ax.legend(loc="upper left", bbox_to_anchor=(1.02, 0.95), alignment="left", labelspacing=0.9)
    return ax


def modes(machine: Machine, modes: Modes, axes: Sequence[Axes3D] | None = None) -> list[Axes3D]:
    """Every natural mode as exaggerated motion of the machine, its frequency and damping ratio above it.

    The grey outline is the machine at rest. The swing has one size in all modes: it shows a direction, no
    amplitude.
    """
    count = len(modes.frequency)
    if axes is not None and len(axes) < count:
        raise ValueError(f"{count} modes need {count} axes, got {len(axes)}")
    box = equivalent_box(machine)
    size = _diagonal(machine, box)
    with look():
        if axes is None:
            columns = min(3, count)
            rows = -(-count // columns)
            figure = new_figure(4.0 * columns, 0.5 + 3.6 * rows)
            axes = [_add_axes(figure, rows, columns, index + 1) for index in range(count)]
            what = (
                "" if machine.model_level == "linear" else ", all links in contact at their nominal stiffness"
            )
            figure.suptitle(f"{machine.name}: natural modes{what}\n")
            marks = [Patch(color=carriage_look(i).color, alpha=0.6) for i in range(len(machine.carriages))]
            names = [carriage.name for carriage in machine.carriages]
            figure.legend(
                marks, names, title="carriages", loc="outside lower center", ncols=min(8, len(names))
            )
        for index in range(count):
            _draw_mode(axes[index], machine, np.real(modes.shape[index]), box, size)
            moving = moving_dofs(machine, np.real(modes.shape[index]))
            ratio = 100 * float(modes.damping_ratio[index])
            axes[index].set_title(
                f"{modes.frequency[index]:.4g} Hz, ζ {ratio:.3g} %, mostly {joined(moving)}"
            )
    return list(axes[:count])


def _add_axes(figure: Figure, rows: int, columns: int, index: int) -> Axes3D:
    return cast("Axes3D", figure.add_subplot(rows, columns, index, projection="3d"))


def _diagonal(machine: Machine, box: Points) -> float:
    points = np.vstack([box, machine.carriage_centers, np.zeros(3)])
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _carriage_block(machine: Machine, index: int, size: float) -> Points:
    """Corners of the block that stands for a carriage; its length is true, its section only a symbol."""
    sides = np.array([machine.carriages[index].length, 0.045 * size, 0.055 * size])
    return cast("Points", machine.carriage_centers[index] + CORNERS * sides)


def _rail_ends(machine: Machine, box: Points) -> Iterator[Points]:
    """Start and end of each rail, a little beyond the body and the carriages."""
    ends = [box[:, 0]]
    for center, carriage in zip(machine.carriage_centers, machine.carriages, strict=True):
        ends.append(center[0] + carriage.length * np.array([-0.5, 0.5]))
    low, high = np.min(np.concatenate(ends)), np.max(np.concatenate(ends))
    margin = 0.08 * (high - low)
    for rail in machine.rails:
        y, z = rail.position
        yield np.array([[low - margin, y, z], [high + margin, y, z]])


def _draw_rails(ax: Axes3D, machine: Machine, box: Points) -> None:
    for ends, rail in zip(_rail_ends(machine, box), machine.rails, strict=True):
        ax.plot(*ends.T, color=GREY, linewidth=3.5, alpha=0.8, solid_capstyle="butt")
        ax.text(*ends[1], f" rail {rail.name}", color=GREY, fontsize=8.5, va="center")


def _draw_weight(ax: Axes3D, machine: Machine, size: float) -> None:
    center = np.asarray(machine.body.center_of_mass, dtype=np.float64)
    gravity = np.asarray(machine.gravity, dtype=np.float64)
    pull = float(np.linalg.norm(gravity))
    weight = load_with_unit(machine.body.mass * pull)
    ax.plot(
        *center[:, None],
        marker="o",
        linestyle="",
        color=BODY_COLOR,
        markersize=7,
        label=f"centre of mass and weight, {weight}",
    )
    if pull > 0:
        arrow = WEIGHT_ARROW * size * gravity / pull
        ax.quiver(*center, *arrow, color=BODY_COLOR, linewidth=2.2, arrow_length_ratio=0.25)


def _draw_loads(ax: Axes3D, result: Result, centers: Points, size: float) -> NDArray[np.float64]:
    """Arrows of the carriages' loads at the instant of the peak; returns their y parts (carriage,) [N]."""
    data = result.data
    instant = int(np.argmax(data["resultant"].max("carriage").values))
    force = data["force"].isel(time=instant).transpose("carriage", "axis").values
    sizes = np.linalg.norm(force, axis=1)
    if sizes.max() == 0:
        return force[:, 1]
    newtons_per_metre = _round_up(sizes.max() / (LOAD_ARROW * size))
    ax.plot(
        [],
        [],
        " ",
        label=f"\nloads: the body on the carriages, {data['time'].values[instant]:.3f} s",
    )
    for index, (center, load) in enumerate(zip(centers, force, strict=True)):
        label = f"carriage {data['carriage'].values[index]}: {load_with_unit(sizes[index])}"
        color = carriage_look(index).color
        ax.quiver(
            *center,
            *(load / newtons_per_metre),
            color=color,
            linewidth=2.4,
            arrow_length_ratio=0.18,
            label=label,
        )
    ax.auto_scale_xyz(*(centers + force / newtons_per_metre).T, True)  # quiver counts the arrows' tails only
    ax.plot([], [], " ", label=f"scale of their arrows: {load_with_unit(newtons_per_metre / 10)} per 100 mm")
    return force[:, 1]


def _round_up(value: float) -> float:
    """The next 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-12)) * power)


def _draw_mode(ax: Axes3D, machine: Machine, shape: NDArray[np.float64], box: Points, size: float) -> None:
    centers = machine.carriage_centers
    swing = np.linalg.norm(displacement(np.vstack([box, centers]), shape), axis=1).max()
    q = shape * (MODE_SWING * size / swing) if swing > 0 else shape
    for ends in _rail_ends(machine, box):
        ax.plot(*ends.T, color=PALE, linewidth=2.5, solid_capstyle="butt")
    ax.add_collection3d(_edges(box, GREY, 0.55, width=0.7))
    moved = box + displacement(box, q)
    ax.add_collection3d(_faces(moved, BODY_COLOR, 0.12))
    ax.add_collection3d(_edges(moved, BODY_COLOR, 0.95))
    for index in range(len(machine.carriages)):
        block = _carriage_block(machine, index, size)
        color = carriage_look(index).color
        ax.add_collection3d(_edges(block, GREY, 0.55, width=0.7))
        moved_block = block + displacement(block, q)
        ax.add_collection3d(_faces(moved_block, color, 0.5))
        ax.add_collection3d(_edges(moved_block, color, 0.95))
    ax.plot([0], [0], [0], marker="D", linestyle="", color=INK, markersize=4)
    _frame(ax, zoom=1.3, bare=True)


def _faces(corners: Points, color: str, alpha: float) -> Poly3DCollection:
    return Poly3DCollection(
        [corners[face] for face in FACES], facecolors=color, alpha=alpha, edgecolors="none"
    )


def _edges(corners: Points, color: str, alpha: float, width: float = 1.1) -> Line3DCollection:
    return Line3DCollection(
        [corners[list(edge)] for edge in EDGES], colors=color, alpha=alpha, linewidths=width
    )


def _frame(ax: Axes3D, zoom: float, bare: bool = False) -> None:
    """One scale on all axes, y up, seen from the front right."""
    ax.view_init(elev=20, azim=-50, vertical_axis="y")
    ax.set_box_aspect(
        [float(np.ptp(limits)) for limits in (ax.get_xlim(), ax.get_ylim(), ax.get_zlim())], zoom=zoom
    )
    for artist in (*ax.lines, *ax.collections):
        # The corners of a wide machine may stand out of the axes' rectangle, without moving other axes.
        artist.set_clip_on(False)
        artist.set_in_layout(False)
    if bare:
        ax.set_axis_off()
        return
    ax.set(xlabel="x, travel [m]", ylabel="y, up [m]", zlabel="z [m]")
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(5))
        axis.pane.set_facecolor("white")
        axis.pane.set_edgecolor(PALE)
