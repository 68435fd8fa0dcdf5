"""The machine in space, up is up: what can be dragged, and the loads at the chosen instant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from nicegui import ui
from nicegui.elements.scene.objects import AxesHelper, Box, Cylinder, Group, Sphere, Text
from nicegui.elements.scene.scene_object3d import Object3D
from nicegui.events import GenericEventArguments
from numpy.typing import NDArray

import guideload
from guideload.app import widgets
from guideload.app.answer import Answer

Array = NDArray[np.float64]
BODY, RAIL, LABEL = "#5b6f8a", "#6b7280", "color: #1d2129; font-size: 12px"
ARROW = 0.3  # longest arrow of a load over the size of the machine
CAMERA = ui.scene.perspective_camera(fov=32, near=0.01)
EVERY = 0.03  # s between two steps of a drag that are sent
# The wheel scrolls the page, and zooms the picture with Ctrl only.
# A carriage stays on its rail while it is dragged; other parts move in the plane of the screen.
MOUSE = """
const scene = getElement(%d), controls = scene.drag_controls;
scene.$el.addEventListener("wheel", (event) => { if (!event.ctrlKey) event.stopPropagation(); }, true);
controls.addEventListener("dragstart", ({object}) => { object.userData.rail = object.position.clone(); });
controls.addEventListener("drag", ({object}) => {
  if (object.name.startsWith("carriage")) object.position.setY(object.userData.rail.y).setZ(object.userData.rail.z);
});
"""
# A ghost of the body moves as in a mode: slowly, and far enough to be seen.
VIBRATE = """
const scene = getElement(%d), ghost = scene.objects.get("%s").mesh, [x, y, z, rx, ry, rz] = %s;
clearInterval(scene.vibration);
scene.vibration = setInterval(() => {
  const s = Math.sin(performance.now() / 1000 * %g);
  ghost.position.set(s * x, s * y, s * z);
  ghost.quaternion.set(s * rx / 2, s * ry / 2, s * rz / 2, 1).normalize();
}, 33);
"""
SWING = 0.08  # of a mode, over the size of the machine
TURN = 3.0  # its circular frequency on the page [rad/s]


class Arrow:
    """An arrow that can be moved, turned and stretched."""

    def __init__(self, color: str, thick: float) -> None:
        self.group = Group()
        with self.group:
            Cylinder(thick, thick, 0.8, 12).material(color).move(y=0.4)
            Cylinder(0.0, 2.6 * thick, 0.2, 12).material(color).move(y=0.9)

    def show(self, start: Array, vector: Array) -> None:
        """From a point along a vector; an arrow without length is not seen."""
        length = float(np.linalg.norm(vector))
        self.group.visible(length > 1e-9)
        if length > 1e-9:
            self.group.move(*map(float, start)).scale(1.0, length, 1.0).rotate_R(_turned(vector / length))


class MachineScene:
    """The parts of a machine in space.

    dragged: called with the name of a part and its place [m] while it is dragged, and whether the drag has ended.
    Names: "carriage 0", ..., "center of mass".
    """

    def __init__(self, dragged: Callable[[str, tuple[float, float, float], bool], None]) -> None:
        self.dragged = dragged
        self.structure: Any = None
        self.held = ""  # the part that the user drags: the browser moves it
        self.scene = ui.scene(background_color="#fbfbfc", grid=False, fps=30, camera=CAMERA).classes("scene")
        self.scene.props('role=img aria-label="The machine in space"')
        keys = ["type", "object_name", "x", "y", "z"]
        self.scene.on("drag", self._dragged, keys, throttle=EVERY)
        for name in ("dragstart", "dragend"):
            self.scene.on(name, self._dragged, keys)
        self.scene.on("init", lambda: ui.run_javascript(MOUSE % self.scene.id))

    def show(self, answer: Answer, instant: int) -> None:
        """The machine of an answer, with its loads at an instant."""
        machine = answer.machine
        box = _box(machine)
        seen = np.vstack([box["corners"], machine.carriage_centers, np.zeros(3)])
        size = self.size = float(np.linalg.norm(np.ptp(seen, axis=0)))
        names = [[one.name for one in parts] for parts in (machine.carriages, machine.rails, machine.points)]
        structure = (names, machine.gravity)
        if structure != self.structure:
            self.structure = structure
            self._build(machine, size)
            self.look(_up(machine), (seen.min(axis=0) + seen.max(axis=0)) / 2.0, size)
        self._place(answer, instant, box, size)

    def vibrate(self, shape: Array | None) -> None:
        """Show a mode shape, displacement and rotation (6,) [m, rad], or none; after `show`."""
        self.ghost.visible(shape is not None)
        if shape is not None:
            motion = (SWING * self.size * shape).tolist()
            ui.run_javascript(VIBRATE % (self.scene.id, self.ghost.id, motion, TURN))

    def _build(self, machine: guideload.Machine, size: float) -> None:
        self.scene.clear()
        unit = size / 60.0
        with self.scene:
            self.rails = [Box().material(RAIL) for _ in machine.rails]
            self.carriages = [
                Box().material(widgets.carriage_color(i)).with_name(f"carriage {i}").draggable()
                for i in range(len(machine.carriages))
            ]
            self.names = [Text(one.name, LABEL) for one in machine.carriages]
            self.body = Box(wireframe=True).material(BODY)
            with Group().with_name("ghost") as self.ghost:
                self.ghost_body = Box(wireframe=True).material("#d55e00")
            self.ghost.visible(False)
            AxesHelper(size / 6.0)
            for i, name in enumerate("xyz"):  # from L; red, green and blue
                Text(name, LABEL).move(*(size / 5.5 * np.eye(3)[i]).tolist())
            self.center = Sphere(1.6 * unit).material(BODY).with_name("center of mass").draggable()
            self.points = [Sphere(unit).material("#b3261e") for _ in machine.points]
            self.labels = [Text(one.name, LABEL) for one in machine.points]
            self.weight = Arrow(BODY, 0.35 * unit)
            self.loads = [
                Arrow(widgets.carriage_color(i), 0.45 * unit) for i in range(len(machine.carriages))
            ]

    def _place(self, answer: Answer, instant: int, box: dict[str, Array], size: float) -> None:
        machine, result = answer.machine, answer.result
        ends = np.concatenate([box["corners"][:, 0], machine.carriage_centers[:, 0]])
        low, high = float(ends.min()) - 0.1 * size, float(ends.max()) + 0.1 * size
        for rail, part in zip(machine.rails, self.rails, strict=True):
            part.move((low + high) / 2, *rail.position).scale(high - low, 0.03 * size, 0.03 * size)
        for i, part in enumerate(self.carriages):
            lengths = machine.carriages[i].distances
            length = max(lengths.pitch, lengths.yaw)
            self._move(part, machine.carriage_centers[i])
            part.scale(length, 0.05 * size, 0.06 * size)
            part.rotate_R(machine.carriage_axes[i].T.tolist())
            self.names[i].move(*(machine.carriage_centers[i] + 0.05 * size * _up(machine)).tolist())
        for body in (self.body, self.ghost_body):
            body.move(*box["center"].tolist()).scale(*box["sides"].tolist()).rotate_R(box["axes"].tolist())
        self._move(self.center, np.array(machine.body.center_of_mass))
        for point, ball, label in zip(machine.points, self.points, self.labels, strict=True):
            ball.move(*point.at)
            label.move(*(np.array(point.at) + 0.03 * size * _up(machine)).tolist())
        gravity = np.array(machine.gravity)
        pull = float(np.linalg.norm(gravity))
        center = np.array(machine.whole_body.center_of_mass)  # with the riders
        self.weight.show(center, 0.16 * size * gravity / pull if pull else gravity)
        if machine.carriages:
            force = result.carriage_loads[instant, :, :3]  # each in the axes of its carriage
            longest = float(answer.loads.max()) or 1.0
            for i, arrow in enumerate(self.loads):
                turned = machine.carriage_axes[i].T @ force[i]
                arrow.show(machine.carriage_centers[i], ARROW * size * turned / longest)

    def _move(self, part: Object3D, place: Array) -> None:
        if part.name == self.held:
            part.x, part.y, part.z = place.tolist()
        else:
            part.move(*place.tolist())

    def look(self, up: Array, center: Array, size: float) -> None:
        """Look at the machine from the front right, from above."""
        along = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
        side = np.cross(along, up)
        eye = center + size * (0.75 * along + 1.35 * side + 0.6 * up)
        self.scene.move_camera(*map(float, [*eye, *center, *up, 0.0]))  # at once

    def _dragged(self, event: GenericEventArguments) -> None:
        place = tuple(float(event.args[axis]) for axis in "xyz")
        name, kind = str(event.args["object_name"]), event.args["type"]
        if kind == "dragstart":
            self.held = name
        elif self.held:  # a last step may come after the end
            self.held = "" if kind == "dragend" else name
            self.dragged(name, (place[0], place[1], place[2]), kind == "dragend")


def _box(machine: guideload.Machine) -> dict[str, Array]:
    """Corners, centre, sides and axes (as columns) of the homogeneous box of the body's inertia."""
    corners = np.array(guideload.plots.equivalent_box(machine))
    edges = corners[[4, 2, 1]] - corners[0]  # along its own x, y and z
    sides = np.linalg.norm(edges, axis=1)
    axes = (edges / sides[:, None]).T
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return {"corners": corners, "center": corners.mean(axis=0), "sides": sides, "axes": axes}


def _up(machine: guideload.Machine) -> Array:
    """Against gravity; y without gravity."""
    gravity = np.array(machine.gravity)
    return np.asarray(-gravity / np.linalg.norm(gravity)) if gravity.any() else np.array([0.0, 1.0, 0.0])


def _turned(direction: Array) -> list[list[float]]:
    """The rotation that turns y into a direction."""
    other = np.eye(3)[int(np.abs(direction).argmin())]
    x = np.cross(direction, other)
    x /= np.linalg.norm(x)
    turned: list[list[float]] = np.column_stack([x, direction, np.cross(x, direction)]).tolist()
    return turned
