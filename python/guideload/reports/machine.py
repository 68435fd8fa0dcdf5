"""Reports of a machine: state at rest, elastic laws, static loads, natural modes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from guideload.audit.warnings import free_at_rest, open_row_notes, rest_notes
from guideload.base.number_text import counted, joined, load_in_table
from guideload.machine.modes import Modes, moving_dofs
from guideload.reports.elements import dofs_line, new_table, remark, section, to_text

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from guideload._core import Law
    from guideload.machine.components import Carriage, Link, Rail
    from guideload.machine.machine import Machine

# Machines on guides have modes at tens to hundreds of Hz, damping of some percent and clearances of micrometres. Beyond
# these limits a unit is probably wrong: N/mm read as N/m divides the frequencies by 32.
SLOWEST_MODE = 1.0  # Hz
LARGEST_DAMPING = 2.0  # of critical
LARGEST_CLEARANCE = 1e-3  # m

STATIC_DEFINITIONS = (
    "Forces of the body on the carriage, in its rail's axes; moments about the carriage's centre."
)
NOMINAL = "* Not linear. The table has the nominal stiffness, which determines modes and longest stable step. The law:"


def machine_report(machine: Machine, encoding: str = "utf-8") -> str:
    """The report of a machine: state at rest, warnings, body, carriages and links, static loads."""
    modes = Modes.of(machine)
    loose = free_at_rest(machine)
    state = "free within its clearance" if loose else "supported in every free dof"
    at_rest = np.abs(machine.scene.static_link_loads())
    rows = open_row_notes(machine.link_table(), at_rest, "at rest")
    notes = [*rest_notes(loose), *rows, *unit_notes(machine, modes)]
    parts: list[RenderableType] = [
        *remark(f"{machine.name}: {machine.model_level}. At rest: {state}. {modes_range(modes)}", *notes),
        dofs_line(machine),
        *section("Body and drive"),
        *body_lines(machine),
    ]
    count = f"{len(machine.link_table().names)} links"
    if machine.links:
        count += f", {len(machine.links)} of them extra: {', '.join(link.name for link in machine.links)}"
    parts += [*section(f"Carriages and links ({count})"), *carriage_tables(machine)]
    if machine.links:
        parts.append(links_table(machine))
    parts += [*mounting_lines(machine), *product_lines(machine), *payload_lines(machine)]
    if machine.carriages:
        parts += [*section("Static loads"), static_table(machine), *remark(STATIC_DEFINITIONS)]
    return to_text([*parts, *weight_lines(machine)], encoding=encoding)


def body_lines(machine: Machine) -> list[str]:
    """Mass, centre of mass and inertia of the body, the travel per turn of the motor, and the points."""
    body = machine.whole_body
    weight = body.mass * float(np.linalg.norm(machine.gravity))
    principal = np.linalg.eigvalsh(body.central_inertia())
    lines = [
        f"mass {body.mass:g} kg, weight {load_in_table(weight)} N",
        f"centre of mass {_millimetres(body.center_of_mass)} from L",
        f"principal moments of inertia about it {', '.join(f'{j:.4g}' for j in principal)} kg m2",
    ]
    for rider in machine.riders:
        along = f"({', '.join(f'{x:g}' for x in rider.direction)})"
        stands = f"here at a travel of {1e3 * rider.position:.4g} mm"
        lines.append(f"with the rider {rider.name}: {rider.mass:g} kg that moves along {along}, {stands}")
    if machine.drive is not None and not machine.drive.linear_motor:
        per_turn = 2e3 * np.pi * machine.drive.speed_per_motor_speed
        lines.append(f"drive: the cart moves {per_turn:.4g} mm per turn of the motor")
    for point in machine.points:
        lines.append(f"point {point.name} {_millimetres(point.at)} from L")
    return lines


def modes_report(machine: Machine, modes: Modes, encoding: str = "utf-8") -> str:
    """The report of the natural modes: range of frequencies and damping, warnings, a row per mode."""
    first = f"{machine.name}: {modes_range(modes)}"
    notes = remark(first, *unit_notes(machine, modes), *nominal_lines(machine, "frequencies"))
    return to_text([*notes, dofs_line(machine), modes_table(machine, modes)], encoding=encoding)


def modes_range(modes: Modes) -> str:
    """The range of natural frequencies and damping ratios, as a sentence."""
    if not modes.frequency.size:
        return "No natural modes."
    ends = ((values.min(), values.max()) for values in (modes.frequency, 100.0 * modes.damping_ratio))
    frequencies, ratios = (f"{low:.3g} to {high:.3g}" for low, high in ends)
    return f"{counted(modes.frequency.size, 'natural mode')} at {frequencies} Hz, damped by {ratios} %."


def carriage_tables(machine: Machine) -> list[RenderableType]:
    """A row per carriage: position, stiffness, damping, rail; and a second table of nonlinear laws."""
    rolling = [carriage.distances.roll > 0.0 for carriage in machine.carriages]
    width = ("width\nmm",) if any(rolling) else ()
    headings = ("ky\nN/um", "kz\nN/um", "by\nkN s/m", "bz\nkN s/m")
    table = new_table("carriage", "x\nmm", "y\nmm", "z\nmm", "length\nmm", *width, *headings, texts=("rail",))
    rails = {rail.name: rail for rail in machine.rails}
    carriages_of: dict[tuple[str, str], list[str]] = {}  # by axes and text of a nonlinear law
    for carriage, center in zip(machine.carriages, machine.carriage_centers, strict=True):
        table.add_row(
            Text(carriage.name),
            *(f"{1e3 * place:g}" for place in center),
            *_distances(carriage)[: 1 + len(width)],
            *(
                f"{1e-6 * law.stiffness:g}" if law.kind == "linear" else f"{1e-6 * law.stiffness:.4g}*"
                for law in carriage.laws
            ),
            *(f"{1e-3 * b:g}" for b in _dampings(carriage)),
            Text(_rail_text(rails[carriage.rail])),
        )
        laws = [
            (axis, law_text(carriage, law, axis) + _series_text(getattr(carriage, f"compliance_{axis}")))
            for axis, law in zip("yz", carriage.laws, strict=True)
            if law.kind != "linear"
        ]
        for text in dict.fromkeys(text for _, text in laws):
            axes = ", ".join(axis for axis, same in laws if same == text)
            carriages_of.setdefault((axes, text), []).append(carriage.name)
    compliant = [one.name for one in machine.carriages if one.compliance_y or one.compliance_z]
    notes = (
        [f"Stiffness and damping of {joined(compliant)} are those with the compliance in series."]
        if compliant
        else []
    )
    if not carriages_of:
        return [table, *remark(*notes)]
    laws_table = new_table("carriage", texts=("along", "law of the whole carriage"))
    for (axes, text), names in carriages_of.items():
        laws_table.add_row(Text(", ".join(names)), axes, text)
    return [table, NOMINAL, laws_table, *remark(*notes)]


def _distances(carriage: Carriage) -> tuple[str, str]:
    """Length and width of a carriage in mm, or the distances of its links that stated stiffnesses give."""
    pitch, yaw, roll = (f"{1e3 * distance:.4g}" for distance in carriage.distances)
    return (pitch if pitch == yaw else f"{pitch} (y), {yaw} (z)"), roll


def _dampings(carriage: Carriage) -> tuple[float, float]:
    share_y, share_z = carriage.damping_shares
    return share_y * carriage.damping_y, share_z * carriage.damping_z


def _rail_text(rail: Rail) -> str:
    return f"{rail.name}, rolled {np.degrees(rail.roll):.4g} deg" if rail.roll else rail.name


def _series_text(compliance: float) -> str:
    return f"; in series with {1e9 * compliance:g} um/kN" if compliance else ""


def mounting_lines(machine: Machine) -> list[str]:
    """Lines on mounting errors, an elastic base, and rails that are not straight."""
    parts = [("rail", one.name, one.mounting_error) for one in machine.rails]
    parts += [("carriage", one.name, one.mounting_error) for one in machine.carriages]
    errors = [f"{kind} {name} ({1e6 * y:g}, {1e6 * z:g}) um" for kind, name, (y, z) in parts if y or z]
    lines = [f"mounting errors (y, z): {', '.join(errors)}"] if errors else []
    if machine.base is not None:
        across = ", ".join(f"{1e9 * machine.base.compliance[i][i]:.3g}" for i in range(3))
        lines.append(f"elastic base under all links: at L it gives way by {across} um/kN along x, y, z")
    for rail in machine.rails:
        for profile in rail.profiles:
            first, last = profile.reach
            known = f"known from {first:g} to {last:g} m" if np.isfinite(last) else "random"
            lines.append(
                f"rail {rail.name} is not straight: {known}, shortest wavelength {profile.shortest:g} m"
            )
    at_rest = f"static loads are those with the cart at {machine.rest_at:g} m (rest_at)"
    return lines if machine.has_straight_rails else [*lines, at_rest]


def payload_lines(machine: Machine) -> list[str]:
    """The payloads with mass, place and when they are on the machine."""
    lines = []
    for one in machine.payloads:
        if one.times is not None:
            when = joined(f"{start:g} to {end:g} s" for start, end in one.times)
        else:
            places = ("gripped", one.picked_at), ("released", one.released_at)
            when = ", ".join(
                f"{word} at x = {at.x:g} m going {at.travel}" for word, at in places if at is not None
            )
        lines.append(
            f"payload {one.name}: {one.mass:g} kg at {_millimetres(one.center_of_mass)} from L, {when}"
        )
    return lines


def product_lines(machine: Machine) -> list[str]:
    """The products of the carriages with their ratings, and what was not compared with the maker's page."""
    lines = []
    for product in machine.products:
        users = [one.name for one in machine.carriages if one.product == product.name]
        rating, static = product.dynamic, product.static
        ratings = [] if rating is None else [f"C {1e-3 * rating.value:g} kN for {1e-3 * rating.base:g} km"]
        ratings += [] if static is None else [f"C0 {1e-3 * static:g} kN"]
        unverified = (
            f"; not compared with its page: {joined(product.unverified)}" if product.unverified else ""
        )
        lines.append(
            f"product {product.name} ({product.maker}; {', '.join(ratings) or 'no ratings'}): "
            f"carriage {joined(users) if users else 'none'}{unverified}"
        )
    return lines


def links_table(machine: Machine) -> Table:
    """A row per extra link: point, direction, damping and law."""
    table = new_table("extra link", "at\nmm", "along", "b\nkN s/m", texts=("law",))
    for link in machine.links:
        along = f"({', '.join(f'{part:.3g}' for part in link.direction)})"
        at = _millimetres(link.point).removesuffix(" mm")
        table.add_row(Text(link.name), at, along, f"{1e-3 * link.damping:g}", law_text(link, link.law))
    return table


def law_text(part: Carriage | Link, law: Law, axis: str = "") -> str:
    """Description of the law of a carriage along an axis, or of an extra link; units N/um, um, N."""
    suffix = f"_{axis}" if axis else ""
    if law.kind == "linear":
        return f"{1e-6 * law.stiffness:g} N/um"
    if law.kind == "preloaded":
        opens = float(law.force(law.edges[-1:])[0])
        return (
            f"{1e-6 * law.stiffness:g} N/um at no load, preload {getattr(part, 'preload' + suffix):g} N, "
            f"{part.rolling}s; one row opens at {load_in_table(opens)} N, {1e6 * law.edges[-1]:.3g} um"
        )
    curve = getattr(part, "curve" + suffix)
    if curve is not None:
        points = ", ".join(f"{1e6 * deflection:.4g} um {force:.6g} N" for deflection, force in curve)
        return f"curve through {points}{'; mirrored below 0 um' if curve[0] == (0.0, 0.0) else ''}"
    clearance, stiffness = getattr(part, "clearance" + suffix), getattr(part, "stiffness" + suffix)
    gap = f"{1e6 * clearance:g} um of clearance to either side, then " if clearance else ""
    pause = ", damping only in contact" if part.damping_in_contact and clearance else ""
    if isinstance(stiffness, float):
        return f"{gap}{1e-6 * stiffness:g} N/um{pause}"
    forwards, backwards = (f"towards +{axis}", f"towards -{axis}") if axis else ("along it", "against it")
    positive, negative = 1e-6 * stiffness.positive, 1e-6 * stiffness.negative
    return f"{gap}{positive:g} N/um {forwards}, {negative:g} N/um {backwards}{pause}"


def nominal_lines(machine: Machine, what: str) -> list[str]:
    """Which stiffness of nonlinear links determines eigenvalues or frequencies; empty for a linear machine."""
    if machine.model_level == "linear":
        return []
    return [
        f"This machine is {machine.model_level}. The {what} are those with all links in contact and nominal stiffness: "
        "the larger of two sides, the stiffness of a preloaded contact at no load, the steepest slope of a curve. "
        "Open or softer links lower them."
    ]


def unit_notes(machine: Machine, modes: Modes) -> list[str]:
    """Warnings of modes or clearances that suggest a wrong unit."""
    odd, notes = [], []
    if modes.frequency.size and modes.frequency.min() < SLOWEST_MODE:
        odd.append(f"the lowest mode is at {modes.frequency.min():.3g} Hz")
    if modes.damping_ratio.size and modes.damping_ratio.max() > LARGEST_DAMPING:
        odd.append(f"a damping ratio is {100 * modes.damping_ratio.max():.3g} %")
    if odd:
        notes.append(
            f"Note: {' and '.join(odd)}: are stiffness and damping in N/m and N s/m? Numbers without unit are SI; "
            'other values need a unit, as in "350 N/um".'
        )
    sided = (float(law.edges[-1]) for law in machine.link_table().laws if law.kind == "sided")
    clearance = max(sided, default=0.0)
    if clearance > LARGEST_CLEARANCE:
        notes.append(
            f"Note: a clearance is {1e3 * clearance:.4g} mm to either side: is it in m? Numbers without unit are SI; "
            'other values need a unit, as in "5 um".'
        )
    return notes


def static_table(machine: Machine) -> Table:
    """A row per carriage: static force and moment, with sign."""
    table = new_table("carriage", "Fy\nN", "Fz\nN", "Mx\nN m", "My\nN m", "Mz\nN m")
    for carriage, load in zip(machine.carriages, _static_loads(machine), strict=True):
        table.add_row(Text(carriage.name), *(load_in_table(float(part)) for part in load[1:]))
    return table


def modes_table(machine: Machine, modes: Modes) -> Table:
    """A row per natural mode: frequencies, damping ratio and the dofs that move most."""
    table = new_table("mode", "natural\nHz", "damping\nratio %", "damped\nHz", texts=("moves mostly in",))
    for index, frequency in enumerate(modes.frequency):
        ratio = float(modes.damping_ratio[index])
        damped = "none" if ratio >= 1 else f"{float(modes.damped_frequency[index]):.4g}"
        dofs = ", ".join(moving_dofs(machine, np.real(modes.shape[index])))
        table.add_row(str(index + 1), f"{float(frequency):.4g}", f"{100 * ratio:.3g}", damped, dofs)
    return table


def weight_lines(machine: Machine) -> list[RenderableType]:
    """A note for each of y and z that is held, so that the constraint at L and not the guides carry the weight."""
    reaction, loads = machine.scene.static_reaction(), _static_loads(machine)
    lines = []
    for index, axis in enumerate("xyz"):
        weight = machine.whole_body.mass * machine.gravity[index]
        if axis in machine.free or axis == "x" or weight == 0:
            continue
        held, carried = load_in_table(float(reaction[index])), load_in_table(float(loads[:, index].sum()))
        lines.append(
            f"Note: {axis} of L is held, so the constraint at L carries the weight: {held} N at rest. "
            f"The static loads of the carriages along {axis} add up to {carried} N: they carry only its moment. "
            f"If {axis} is free, the guides carry the weight."
        )
    return remark(*lines)


def _millimetres(point: Sequence[float]) -> str:
    return f"({', '.join(f'{1e3 * part:g}' for part in point)}) mm"


def _static_loads(machine: Machine) -> NDArray[np.float64]:
    """Static loads (carriage, 6): Fx Fy Fz [N], Mx My Mz [N m]."""
    return machine.scene.static_group_loads(machine.links_of_carriages, machine.carriage_places)
