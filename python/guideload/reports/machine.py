"""Reports of a machine: state at rest, elastic laws, static loads, natural modes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from guideload._core import Law
from guideload.audit.motion_plausibility import input_warnings
from guideload.audit.plausibility import free_at_rest, machine_warnings, open_row_warnings
from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.number_text import between, counted, digits, joined, load_in_table, number, vector
from guideload.machine.components import Carriage, Link
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes, moving_dofs
from guideload.motion.motion import Motion
from guideload.reports.assumptions import (
    compliant_carriages,
    moments_x,
    no_roll,
    nominal_lines,
    placement_lines,
    structure_lines,
    without_payloads,
)
from guideload.reports.report import Column, Definitions, Part, Report, Section, Table

STATIC_DEFINITIONS = (
    "Forces of the body on the carriage, in its rail's axes; moments about the carriage's centre."
)
NOMINAL = "* Not linear. The table has the nominal stiffness, which determines modes and longest stable step. The law:"


@checked
def machine_report(machine: Machine, motion: Motion | None = None) -> Report:
    """The report of a machine: state at rest, warnings, body, carriages and links, static loads.

    motion: whose warnings it has too.
    """
    modes, level = Modes.of(machine), machine.model_level
    springs = "all springs are linear" if level == "linear" else f"its springs are {level}"
    state = "the carriages hold the body in every free direction"
    if free_at_rest(machine):
        state = "the body is free within its clearance"
    at_rest = np.abs(machine.scene.static_link_loads())
    rows = open_row_warnings(machine.link_table(), at_rest, "at rest")
    return Report.of(
        machine,
        "machine",
        answer=[
            f"{machine.name}: {springs}. At rest {state}. {_modes_range(modes)}",
            *without_payloads(machine),
        ],
        warnings=[*input_warnings(machine, motion), *rows],
        sections=[
            *machine_sections(machine),
            _static_section(machine),
            Section("Structure", *structure_lines(machine), *placement_lines(machine)),
        ],
    )


def machine_sections(machine: Machine) -> list[Section]:
    """Body and drive; carriages, extra links, mounting errors, products and payloads."""
    links = int(np.sum(machine.link_table().carriage >= 0))
    count = f"{links} links: springs along y and z at both ends of each carriage" if links else ""
    if machine.links:
        count += f"{'; ' if links else ''}extra links: {', '.join(link.name for link in machine.links)}"
    lines = [*_mounting_lines(machine), *_product_lines(machine), *_payload_lines(machine)]
    return [
        Section("Body and drive", _body_lines(machine)),
        Section("Carriages and links", count, *_carriage_parts(machine), _links_table(machine), lines),
    ]


def _body_lines(machine: Machine) -> list[str]:
    """Mass, centre of mass and inertia of the body, the travel per turn of the motor, and the points."""
    body = machine.whole_body
    weight = body.mass * float(np.linalg.norm(machine.gravity))
    principal = np.linalg.eigvalsh(body.central_inertia())
    lines = [
        f"mass {number(body.mass)} kg, weight {load_in_table(weight)} N",
        f"centre of mass {_millimetres(body.center_of_mass)} from L",
        f"principal moments of inertia about it {', '.join(digits(each, 4) for each in principal)} kg m2",
    ]
    for rider in machine.riders:
        along = vector(rider.direction)
        stands = f"here at a travel of {digits(1e3 * rider.position, 4)} mm"
        lines.append(
            f"with the rider {rider.name}: {number(rider.mass)} kg that moves along {along}, {stands}"
        )
    if machine.drive is not None and not machine.drive.linear_motor:
        per_turn = 2e3 * np.pi * machine.drive.speed_per_motor_speed
        lines.append(f"drive: the cart moves {digits(per_turn, 4)} mm per turn of the motor")
    for point in machine.points:
        lines.append(f"point {point.name} {_millimetres(point.at)} from L")
    return lines


@checked
def modes_report(machine: Machine, modes: Modes) -> Report:
    """The report of the natural modes: range of frequencies and damping, warnings, a row per mode."""
    return Report.of(
        machine,
        "natural modes",
        answer=[f"{machine.name}: {_modes_range(modes)}", *without_payloads(machine)],
        warnings=[*machine_warnings(machine, modes)],
        sections=[modes_section(machine, modes)],
    )


def modes_section(machine: Machine, modes: Modes) -> Section:
    """A row per natural mode: frequencies, damping ratio and the dofs that move most."""
    damped = [
        "none" if ratio >= 1.0 else float(frequency)
        for ratio, frequency in zip(modes.damping_ratio, modes.damped_frequency, strict=True)
    ]
    dofs = [", ".join(moving_dofs(machine, np.real(shape))) for shape in modes.shape]
    table = Table(
        Column("mode", [str(i + 1) for i in range(len(dofs))]),
        Column("natural", modes.frequency, "Hz", "4 digits"),
        Column("damping ratio", 100.0 * modes.damping_ratio, "%", "3 digits"),
        Column("damped", damped, "Hz", "4 digits"),
        Column("moves mostly in", dofs),
    )
    return Section(
        "Natural modes",
        table,
        "Damping ratio and damped frequency: of the damped machine. Dampers couple modes of close frequencies.",
        *nominal_lines(machine, "frequencies"),
        *structure_lines(machine),
    )


def _modes_range(modes: Modes) -> str:
    """The range of natural frequencies and damping ratios, as a sentence."""
    if not modes.frequency.size:
        return "No natural modes."
    ends = ((values.min(), values.max()) for values in (modes.frequency, 100.0 * modes.damping_ratio))
    frequencies, ratios = (between(low, high) for low, high in ends)
    return f"{counted(modes.frequency.size, 'natural mode')} at {frequencies} Hz, damped by {ratios} %."


def _carriage_parts(machine: Machine) -> list[Part]:
    """A row per carriage: position, stiffness, damping, rail; and a second table of nonlinear laws."""
    carriages, centers = machine.carriages, np.reshape(machine.carriage_centers, (-1, 3))
    rolling = any(carriage.distances.roll > 0.0 for carriage in carriages)
    rolled = {
        rail.name: f"{rail.name}, rolled {digits(np.degrees(rail.roll), 4)} deg"
        for rail in machine.rails
        if rail.roll
    }
    shares = np.reshape([one.damping_shares for one in carriages], (-1, 2))
    dampings = shares * np.reshape([(one.damping_y, one.damping_z) for one in carriages], (-1, 2))
    lengths, widths = zip(*map(_distances, carriages), strict=True) if carriages else ((), ())
    table = Table(
        Column("carriage", [one.name for one in carriages]),
        *(Column(axis, 1e3 * centers[:, i], "mm", "number") for i, axis in enumerate("xyz")),
        Column("length", lengths, "mm", "4 digits"),
        *([Column("width", widths, "mm", "4 digits")] if rolling else []),
        *(
            Column(f"k{axis}", [_stiffness(one.laws[i]) for one in carriages], "N/um", "4 digits")
            for i, axis in enumerate("yz")
        ),
        *(Column(f"b{axis}", 1e-3 * dampings[:, i], "kN s/m", "number") for i, axis in enumerate("yz")),
        Column("rail", [rolled.get(one.rail, one.rail) for one in carriages]),
    )
    laws, series = _laws_table(machine), ""
    if compliant := compliant_carriages(machine):
        series = f"Stiffness and damping of {joined(compliant)} are those with the compliance in series."
    return [table, NOMINAL if laws else "", laws, series]


def _stiffness(law: Law) -> float | str:
    """In N/um; with a mark if the law is not linear."""
    return 1e-6 * law.stiffness if law.kind == "linear" else f"{digits(1e-6 * law.stiffness, 4)}*"


def _laws_table(machine: Machine) -> Table:
    """A row for each law that is not linear, with the carriages that have it."""
    carriages: dict[tuple[str, str], list[str]] = {}  # by axes and text of a law
    for carriage in machine.carriages:
        axes: dict[str, list[str]] = {}
        for axis, law in zip("yz", carriage.laws, strict=True):
            if law.kind != "linear":
                text, compliance = _law_text(carriage, law, axis), getattr(carriage, f"compliance_{axis}")
                text += f"; in series with {number(1e9 * compliance)} um/kN" if compliance else ""
                axes.setdefault(text, []).append(axis)
        for text, found in axes.items():
            carriages.setdefault((", ".join(found), text), []).append(carriage.name)
    return Table(
        Column("carriage", [", ".join(names) for names in carriages.values()]),
        Column("along", [along for along, _ in carriages]),
        Column("law of the whole carriage", [text for _, text in carriages]),
    )


def _distances(carriage: Carriage) -> tuple[str, str]:
    """Length and width of a carriage in mm, or the distances of its links that stated stiffnesses give."""
    pitch, yaw, roll = (digits(1e3 * distance, 4) for distance in carriage.distances)
    return (pitch if pitch == yaw else f"{pitch} (y), {yaw} (z)"), roll


def _mounting_lines(machine: Machine) -> list[str]:
    """Lines on mounting errors, an elastic base, and rails that are not straight."""
    parts = [("rail", one.name, one.mounting_error) for one in machine.rails]
    parts += [("carriage", one.name, one.mounting_error) for one in machine.carriages]
    errors = [
        f"{kind} {name} ({number(1e6 * y)}, {number(1e6 * z)}) um" for kind, name, (y, z) in parts if y or z
    ]
    lines = [f"mounting errors (y, z): {', '.join(errors)}"] if errors else []
    if machine.base is not None:
        across = ", ".join(f"{digits(1e9 * machine.base.compliance[i][i])}" for i in range(3))
        lines.append(f"elastic base under all links: at L it gives way by {across} um/kN along x, y, z")
    for rail in machine.rails:
        for profile in rail.profiles:
            first, last = profile.reach
            known = f"known from {number(first)} to {number(last)} m" if np.isfinite(last) else "random"
            lines.append(
                f"rail {rail.name} is not straight: {known}, shortest wavelength {number(profile.shortest)} m"
            )
    at_rest = f"static loads are those with the cart at {number(machine.rest_at)} m (rest_at)"
    return lines if machine.has_straight_rails else [*lines, at_rest]


def _payload_lines(machine: Machine) -> list[str]:
    """The payloads with mass, place and when they are on the machine."""
    lines = []
    for one in machine.payloads:
        if one.times is not None:
            when = joined(f"{number(start)} to {number(end)} s" for start, end in one.times)
        else:
            places = ("gripped", one.picked_at), ("released", one.released_at)
            when = ", ".join(
                f"{word} at x = {number(at.x)} m going {at.travel}" for word, at in places if at is not None
            )
        lines.append(
            f"payload {one.name}: {number(one.mass)} kg at {_millimetres(one.center_of_mass)} from L, {when}"
        )
    return lines


def _product_lines(machine: Machine) -> list[str]:
    """The products of the carriages with their ratings, and what was not compared with the maker's page."""
    lines = []
    for product in machine.products:
        users = [one.name for one in machine.carriages if one.product == product.name]
        rating, static = product.dynamic, product.static
        dynamic = rating and f"C {number(1e-3 * rating.value)} kN for {number(1e-3 * rating.base)} km"
        ratings = [text for text in (dynamic, static and f"C0 {number(1e-3 * static)} kN") if text]
        unverified = "; values not compared with its page" if product.unverified else ""
        lines.append(
            f"product {product.name} ({product.maker}; {', '.join(ratings) or 'no ratings'}): "
            f"carriage {joined(users) if users else 'none'}{unverified}"
        )
    return lines


def _links_table(machine: Machine) -> Table:
    """A row per extra link: point, direction, damping and law."""
    links = machine.links
    return Table(
        Column("extra link", [link.name for link in links]),
        Column("at", [vector(1e3 * part for part in link.point) for link in links], "mm", "whole"),
        Column("along", [f"({', '.join(map(digits, link.direction))})" for link in links], kind="whole"),
        Column("b", [1e-3 * link.damping for link in links], "kN s/m", "number"),
        Column("law", [_law_text(link, link.law) for link in links]),
    )


def _law_text(part: Carriage | Link, law: Law, axis: str = "") -> str:
    """Description of the law of a carriage along an axis, or of an extra link; units N/um, um, N."""
    suffix = f"_{axis}" if axis else ""
    if law.kind == "linear":
        return f"{number(1e-6 * law.stiffness)} N/um"
    if law.kind == "preloaded":
        opens = float(law.force(law.edges[-1:])[0])
        return (
            f"{number(1e-6 * law.stiffness)} N/um at no load, preload {number(getattr(part, 'preload' + suffix))} N, "
            f"{part.rolling}s; one row opens at {load_in_table(opens)} N, {digits(1e6 * law.edges[-1])} um"
        )
    curve = getattr(part, "curve" + suffix)
    if curve is not None:
        points = ", ".join(
            f"{digits(1e6 * deflection, 4)} um {number(force)} N" for deflection, force in curve
        )
        return f"curve through {points}{'; mirrored below 0 um' if curve[0] == (0.0, 0.0) else ''}"
    clearance, stiffness = getattr(part, "clearance" + suffix), getattr(part, "stiffness" + suffix)
    gap = f"{number(1e6 * clearance)} um of clearance to either side, then " if clearance else ""
    pause = ", damping only in contact" if part.damping_in_contact and clearance else ""
    if isinstance(stiffness, float):
        return f"{gap}{number(1e-6 * stiffness)} N/um{pause}"
    forwards, backwards = (f"towards +{axis}", f"towards -{axis}") if axis else ("along it", "against it")
    positive, negative = 1e-6 * stiffness.positive, 1e-6 * stiffness.negative
    return f"{gap}{number(positive)} N/um {forwards}, {number(negative)} N/um {backwards}{pause}"


def _static_section(machine: Machine) -> Section:
    """A row per carriage: static force and moment, with sign."""
    loads = machine.static_carriage_loads
    axes = {"Fy": "N", "Fz": "N", "Mx": "N m", "My": "N m", "Mz": "N m"}
    table = Table(
        Column("carriage", [one.name for one in machine.carriages]),
        *(
            Column(axis, moments_x(machine, loads[:, 3]) if axis == "Mx" else loads[:, i + 1], unit, "load")
            for i, (axis, unit) in enumerate(axes.items())
        ),
    )
    terms = Definitions(STATIC_DEFINITIONS if table else "", no_roll(machine))
    return Section("Static loads", table, _sum_lines(machine, loads), terms)


def _sum_lines(machine: Machine, loads: Array) -> list[str]:
    """The sum of the carriages' loads against the weight; which of them are pressed, and which lifted."""
    if not machine.carriages:
        return []
    table, of = machine.link_table(), machine.link_table().carriage >= 0
    total = machine.scene.static_link_loads()[of] @ table.directions[of]
    weight = machine.whole_body.mass * np.array(machine.gravity)
    carried, needed = (
        f"{load_in_table(y)} N along y, {load_in_table(z)} N along z" for _, y, z in (total, weight)
    )
    others = ", of which extra links carry a part" if machine.links else ""
    lines = [f"all carriages together: {carried}; weight: {needed}{others}"]
    least, lift = 1e-6 * float(np.abs(loads[:, :3]).max(initial=0.0)), loads[:, 1]
    names = np.array([one.name for one in machine.carriages])
    for which, words in ((lift < -least, "pressed onto the rail"), (lift > least, "lifted from the rail")):
        if which.any():
            lines.append(
                f"{words} at rest: {'all carriages' if which.all() else joined(names[which].tolist())}"
            )
    return lines


def _millimetres(point: Sequence[float]) -> str:
    return f"{vector(1e3 * part for part in point)} mm"
