"""The numbers of rails, carriages, extra links and payloads that can vary, and their targets in the core's scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from guideload.machine.components import Carriage, Link
from guideload.machine.laws import Sides
from guideload.machine.links import links_of
from guideload.machine.machine import Machine
from guideload.machine.payloads import Payload

Target = tuple[str, int, int | str]  # a number in the core's scene, see `_core.VariedScene`
Targets = Sequence[tuple[Target, float]]  # with their factors
AXES = ("x", "y", "z")
# Stiffnesses against rotation: the axis of the links that resist it, and the distance that may stand in its place.
STATED = (("pitch", "_y", "length"), ("yaw", "_z", "length"), ("roll", "_y", "width"))


class PartParameter(NamedTuple):
    """A parameter of one part. If the part has none, value is None, and `need` says what it needs.

    sets: targets with the factors on its value. fixed: targets with numbers of the part that cannot vary.
    """

    key: str
    unit: str
    floor: str
    value: float | None
    sets: Targets
    need: str = ""
    fixed: Targets = ()


def arguments_of(machine: Machine) -> dict[str, Any]:
    """The arguments of `_core.VariedScene` that describe the machine, to which the targets refer."""
    body, table = machine.body, machine.link_table()
    return {
        "mass": body.mass,
        "center_of_mass": body.center_of_mass,
        "inertia": body.inertia,
        "inertia_about_reference": body.inertia_about == "L",
        "gravity": machine.gravity,
        "free": machine.free,
        "points": table.points,
        "directions": table.directions,
        "laws": table.laws,
        "damping": table.damping,
        "damping_in_contact": table.damping_in_contact,
        "offsets": machine.offsets,
        "groups": machine.links_of_carriages,
        "centers": machine.carriage_places,
        "base_compliance": None if machine.base is None else machine.base.compliance,
    }


def of_rail(machine: Machine, index: int) -> Iterator[PartParameter]:
    rail, carriages = machine.rails[index], np.flatnonzero(machine.rail_of_carriage == index).tolist()
    for i, axis in enumerate(("y", "z")):
        links = [(("point", k, i + 1), 1.0) for k in machine.links_of_rails[index].tolist()]
        centers = [(("center", j, i + 1), 1.0) for j in carriages]
        yield PartParameter(f"position.{axis}", "m", "", rail.position[i], [*links, *centers])
    need = "a rail turned in the machine file: links of a study keep their directions"
    yield PartParameter("roll", "rad", "", None, [], need)
    directions = machine.link_table().directions
    for i, axis in enumerate(("y", "z")):
        along = [(k, float(directions[k, i + 1])) for k in machine.links_of_rails[index].tolist()]
        feet = [(("offset", k, 0), share) for k, share in along if share != 0.0]
        yield PartParameter(f"mounting_error.{axis}", "m", "", rail.mounting_error[i], feet)


def of_carriage(machine: Machine, i: int) -> Iterator[PartParameter]:
    carriage, first = machine.carriages[i], int(machine.links_of_carriages[i][0])
    links = list(enumerate(links_of(carriage), first))
    along: Targets = [(("point", k, 0), 1.0) for k, _ in links]
    yield PartParameter("x", "m", "", carriage.x, [*along, (("center", i, 0), 1.0)])
    own_z = machine.carriage_axes[i, 2].tolist()
    rows: Targets = [(("point", k, j), link.row * own_z[j]) for k, link in links if link.row for j in (1, 2)]
    pitch, yaw = ([(("point", k, 0), link.end) for k, link in links if link.axis == axis] for axis in (1, 2))
    distances: dict[str, Targets] = {"pitch": pitch, "yaw": yaw, "roll": rows}
    stated = [rotation for rotation in distances if getattr(carriage, f"stiffness_{rotation}") is not None]
    ends = [each for rotation in ("pitch", "yaw") if rotation not in stated for each in distances[rotation]]
    need = "a length, in place of stiffness_pitch and stiffness_yaw"
    yield PartParameter("length", "m", "> 0", carriage.length, ends, need)
    yield PartParameter("width", "m", "> 0", carriage.width, rows, "a width, in place of stiffness_roll")
    for axis in (1, 2):
        of_axis = [k for k, link in links if link.axis == axis]
        damping = carriage.damping_shares[axis - 1] / len(of_axis)
        for row in _of_spring(carriage, f"_{AXES[axis]}", of_axis, 1.0 / len(of_axis), damping):
            yield _if_linear(row, carriage, axis)
    for rotation, suffix, distance in STATED:
        need = f"{distance}, which can vary: stiffness_{rotation} is stiffness{suffix} {distance}^2/4"
        number = getattr(carriage.distances, rotation)
        fixed = [(target, factor * number) for target, factor in distances[rotation] if rotation in stated]
        yield PartParameter(f"stiffness_{rotation}", "N m/rad", "> 0", None, [], need, fixed)
    for axis in (1, 2):
        feet = [(("offset", k, 0), 1.0) for k, link in links if link.axis == axis]
        yield PartParameter(f"mounting_error.{AXES[axis]}", "m", "", carriage.mounting_error[axis - 1], feet)


def _if_linear(row: PartParameter, carriage: Carriage, axis: int) -> PartParameter:
    """The row; without value if links or laws of the carriage do not depend linearly on it."""
    suffix = f"_{AXES[axis]}"
    if row.value is None or not row.key.startswith(("stiffness", "curve")):
        return row
    if getattr(carriage, f"compliance{suffix}"):
        k = carriage.laws[axis - 1].stiffness
        need = f"the law with the structure, {k:.6g} N/m, in place of compliance{suffix}"
        return row._replace(value=None, need=need)
    for rotation, of_suffix, distance in STATED:
        if of_suffix == suffix and getattr(carriage, f"stiffness_{rotation}") is not None:
            number = getattr(carriage.distances, rotation)
            in_place = f"in place of stiffness_{rotation}, which then varies with it"
            return row._replace(value=None, need=f"{distance} = {number:.9g} (m) {in_place}")
    return row


def of_link(index: int, link: Link) -> Iterator[PartParameter]:
    for i, axis in enumerate(AXES):
        yield PartParameter(f"point.{axis}", "m", "", link.point[i], [(("point", index, i), 1.0)])
    yield from _of_spring(link, "", [index], 1.0, 1.0)


def _of_spring(
    part: Carriage | Link, suffix: str, links: Sequence[int], share: float, damping_share: float
) -> Iterator[PartParameter]:
    """The parameters of an elastic law and its damper; shares: parts of them in each of the core's links."""
    stiffness, clearance, preload, curve, damping = (
        getattr(part, f"{key}{suffix}") for key in ("stiffness", "clearance", "preload", "curve", "damping")
    )
    sides = stiffness if isinstance(stiffness, Sides) else None
    # The core has no link that is damped in contact only and always in contact.
    clear = preload is None and curve is None and (clearance > 0.0 or not part.damping_in_contact)

    def of_law(
        key: str, unit: str, floor: str, value: float | None, need: str, name: str, factor: float = share
    ) -> PartParameter:
        return PartParameter(key, unit, floor, value, [(("law", k, name), factor) for k in links], need)

    need, by_side = "one stiffness, in place of a curve or of one per side", "a stiffness by side"
    value = stiffness if isinstance(stiffness, float) else None
    yield of_law(f"stiffness{suffix}", "N/m", "> 0", value, need, "stiffness")
    for side in ("positive", "negative"):
        value = getattr(sides, side, None)
        yield of_law(f"stiffness{suffix}.{side}", "N/m", ">= 0", value, by_side, f"{side}_stiffness")
    need = "a stiffness without preload, and a clearance above 0 if damping_in_contact is true"
    yield of_law(f"clearance{suffix}", "m", ">= 0", clearance if clear else None, need, "clearance", 1.0)
    yield of_law(f"preload{suffix}", "N", "> 0", preload, "a preload, and the rolling element", "preload")
    yield of_law(f"curve{suffix}.scale", "1", "> 0", 1.0 if curve else None, "a curve", "scale", 1.0)
    damper: list[tuple[Target, float]] = [(("damping", k, 0), damping_share) for k in links]
    yield PartParameter(f"damping{suffix}", "N s/m", ">= 0", damping, damper)


def of_payload(index: int, payload: Payload) -> Iterator[PartParameter]:
    yield PartParameter("mass", "kg", "> 0", payload.mass, [(("payload_mass", index, 0), 1.0)])
    for i, axis in enumerate(AXES):
        center = [(("payload_center_of_mass", index, i), 1.0)]
        yield PartParameter(f"center_of_mass.{axis}", "m", "", payload.center_of_mass[i], center)
