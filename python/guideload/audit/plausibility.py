"""Plausibility of a machine: figures that no machine on guides has suggest a mistaken unit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np

from guideload.base.arrays import Array
from guideload.base.number_text import (
    counted,
    digits,
    first_names,
    joined,
    load_in_sentence,
    load_in_table,
    number,
    percent,
)
from guideload.base.warnings import LIMITS, WarningText
from guideload.machine.links import LinkTable
from guideload.machine.machine import DOFS, Machine
from guideload.machine.modes import Modes, displacement, moving_dofs
from guideload.machine.products import stiffness_estimates

ALONG = 0.95  # cosine of an angle between directions that count as one
SI = "Numbers without unit are SI; other values need a unit, as in"


def machine_warnings(machine: Machine, modes: Modes | None = None) -> list[WarningText]:
    """The warnings of a machine at rest; `modes`: those of the machine, computed if None."""
    modes = Modes.of(machine) if modes is None else modes
    found = (
        _free_at_rest(machine),
        _distances(machine),
        _inertia(machine),
        _overlaps(machine),
        _stacked_rails(machine),
        _rest(machine),
        _ratings(machine),
        _rated_moments(machine),
        _unused(machine),
        _modes(machine, modes),
        _weight(machine),
        _estimates(machine),
        _own_stiffness(machine),
    )
    return [warning for each in found for warning in each]


def free_at_rest(machine: Machine) -> tuple[tuple[str, ...], ...]:
    """Dofs of L in each motion in which the body is free within its clearance at rest."""
    return tuple(tuple(moving_dofs(machine, shape)) for shape in machine.scene.free_at_rest)


def _free_at_rest(machine: Machine) -> Iterator[WarningText]:
    """On the starting position of a body that is free at rest."""
    if motions := free_at_rest(machine):
        dofs = ", and in ".join(
            " with ".join(motion) if count == 1 else f"{count} motions of {joined(motion)}"
            for motion, count in Counter(motions).items()
        )
        yield WarningText(
            "free at rest",
            f"Warning: at rest the body is free within its clearance in {dofs}: it starts where very weak springs "
            "would centre it. Preload or a process force defines the start.",
        )


def open_row_warnings(links: LinkTable, loads: Array, when: str) -> Iterator[WarningText]:
    """On the preloaded links that elastic loads (link,) [N] open, and on the preload that they need."""
    ratios = {
        name: float(load / law.force(law.edges[-1:])[0])
        for name, law, load in zip(links.names, links.laws, loads, strict=True)
        if law.kind == "preloaded"
    }
    if opened := [name for name, ratio in ratios.items() if ratio >= 1.0]:
        has = "has" if len(opened) == 1 else "have"
        yield WarningText(
            "open row",
            f"Warning: {first_names(opened)} {has} a row open {when}: half of the balls or rollers then carry no load. "
            f"{digits(max(ratios.values()))} times the preload would keep all rows loaded.",
        )


def _distances(machine: Machine) -> Iterator[WarningText]:
    """On lengths and distances from L, with the key that has the largest."""
    sizes = {"body.center_of_mass": float(np.abs(machine.body.center_of_mass).max())}
    parts: tuple[tuple[str, list[Any]], ...] = (
        ("carriages[{}].x", [one.x for one in machine.carriages]),
        ("carriages[{}].length", [one.length or 0.0 for one in machine.carriages]),
        ("rails[{}].position", [one.position for one in machine.rails]),
        ("links[{}].point", [one.point for one in machine.links]),
        ("points[{}].at", [one.at for one in machine.points]),
        ("riders[{}].center_of_mass", [one.center_of_mass for one in machine.riders]),
        ("payloads[{}].center_of_mass", [one.center_of_mass for one in machine.payloads]),
    )
    for key, places in parts:
        sizes |= {key.format(i): float(np.abs(place).max()) for i, place in enumerate(places)}
    key = max(sizes, key=sizes.__getitem__)
    lengths = {one.name: max(one.distances.pitch, one.distances.yaw) for one in machine.carriages}
    shortest = min(lengths, key=lengths.__getitem__, default="")
    for limit, ratio, beyond in (
        ("distance", sizes[key], f"{number(LIMITS['distance'].most)} m"),
        (
            "distance in lengths",
            sizes[key] / lengths.get(shortest, np.inf),
            f"{number(LIMITS['distance in lengths'].most)} times the length of carriage {shortest}, "
            f"{number(1e3 * lengths.get(shortest, 0.0))} mm",
        ),
    ):
        if not LIMITS[limit].holds(ratio):
            yield WarningText(
                limit,
                f'Warning: {key} is {number(sizes[key])} m, beyond {beyond}: is it in mm? {SI} "90 mm".',
            )
            return


def _inertia(machine: Machine) -> Iterator[WarningText]:
    """On the radius of gyration of the moving mass, against the places of carriages and links."""
    body = machine.whole_body
    places = np.array([*machine.carriage_centers, *(one.point for one in machine.links)]).reshape(-1, 3)
    reach = float(np.linalg.norm(places - body.center_of_mass, axis=1).max(initial=0.0))
    radius = float(np.sqrt(np.linalg.eigvalsh(body.central_inertia()).max() / body.mass))
    if reach and not LIMITS["inertia"].holds(radius / reach):
        yield WarningText(
            "inertia",
            f"Warning: the moving mass of {number(body.mass)} kg has a radius of gyration of {digits(1e3 * radius)} "
            f"mm; the farthest carriage or link is {digits(1e3 * reach)} mm from its centre: are mass in kg and "
            f'inertia in kg m2? {SI} "5e6 kg mm^2".',
        )


def _overlaps(machine: Machine) -> Iterator[WarningText]:
    """On carriages of one rail that are nearer than their lengths allow; with the nearest pair."""
    lengths = [
        (None if product is None else product.carriage_length) or one.length or 0.0
        for one, product in zip(machine.carriages, machine.product_of_carriage, strict=True)
    ]
    pairs = []
    for i, j in combinations(range(len(lengths)), 2):
        needed = 0.5 * (lengths[i] + lengths[j])
        apart = abs(machine.carriages[i].x - machine.carriages[j].x)
        if machine.carriages[i].rail == machine.carriages[j].rail and apart < needed * (1.0 - 1e-9):
            pairs.append((apart - needed, apart, needed, i, j))
    if pairs:
        _, apart, needed, i, j = min(pairs)
        one, other = machine.carriages[i], machine.carriages[j]
        others = f", and {counted(len(pairs) - 1, 'other pair')} too" if len(pairs) > 1 else ""
        yield WarningText(
            "overlap",
            f"Warning: carriages {one.name} and {other.name} overlap on rail {one.rail}{others}: their centres are "
            f"{digits(1e3 * apart, 4)} mm apart, their length is {digits(1e3 * needed, 4)} mm: is x that of the centre "
            "of each carriage, and the rail the right one?",
        )


def _stacked_rails(machine: Machine) -> Iterator[WarningText]:
    """On rails whose carriages look to one side, with the distance between them along that side."""
    normals = {one.rail: axes[1] for one, axes in zip(machine.carriages, machine.carriage_axes, strict=True)}
    for one, other in combinations([rail for rail in machine.rails if rail.name in normals], 2):
        apart = np.array([0.0, *np.subtract(other.position, one.position)])
        distance = float(np.linalg.norm(apart))
        along = [abs(float(normals[rail.name] @ apart)) for rail in (one, other)]
        if normals[one.name] @ normals[other.name] > ALONG and min(along) > ALONG * distance:
            yield WarningText(
                "stacked rails",
                f"Warning: rails {one.name} and {other.name} are {digits(1e3 * distance)} mm apart along y of their "
                "carriages, so one stands above the other instead of beside it: are y and z of `position` swapped, or "
                "is `roll` of the rails missing?",
            )
            return


def _rest(machine: Machine) -> Iterator[WarningText]:
    """On sag and on loads of the carriages at rest."""
    mass = f"body.mass = {number(machine.whole_body.mass)} kg"
    names = [*(f"carriage {one.name}" for one in machine.carriages), "the centre of mass"]
    places = np.array([*machine.carriage_centers, machine.whole_body.center_of_mass])
    sags = np.linalg.norm(displacement(places, machine.scene.static_position()), axis=1)
    at = int(sags.argmax())
    if not LIMITS["sag"].holds(sags[at]):
        yield WarningText(
            "sag",
            f"Warning: at rest {names[at]} sags by {digits(1e3 * sags[at])} mm: are stiffness in N/m and mass in kg "
            f'({mass})? {SI} "350 N/um".',
        )
    loads = np.linalg.norm(machine.static_carriage_loads[:, 1:3], axis=1)
    ratings = [(one and one.static) or np.inf for one in machine.product_of_carriage]
    use = loads / np.array(ratings)
    if use.size and not LIMITS["load at rest"].holds(float(use.max())):
        at = int(use.argmax())
        yield WarningText(
            "load at rest",
            f"Warning: carriage {machine.carriages[at].name} carries {load_in_sentence(loads[at])} at rest, more than "
            f"its static load rating C0 of {load_in_sentence(ratings[at])}: is the mass in kg ({mass}), and is the "
            "product large enough?",
        )


def _ratings(machine: Machine) -> Iterator[WarningText]:
    """On products whose load ratings do not belong together."""
    for product in dict.fromkeys(machine.product_of_carriage):
        if product is None or product.dynamic is None or product.static is None:
            continue
        ratio = product.static / product.rating_for_100_km
        if not LIMITS["load ratings"].holds(ratio):
            yield WarningText(
                "load ratings",
                f"Warning: the static load rating C0 of {product.name} is {load_in_sentence(product.static)}, "
                f"{digits(ratio)} times its dynamic one for 100 km, {load_in_sentence(product.rating_for_100_km)}; "
                "catalogues have 1.1 to 2.6 times: is one in the wrong unit?",
            )


def _rated_moments(machine: Machine) -> Iterator[WarningText]:
    """On products with a rated static moment that does not belong to their C0; of each product the first one."""
    limit = LIMITS["rated moments"]
    for product in dict.fromkeys(machine.product_of_carriage):
        if product is None or product.static is None:
            continue
        for axis in ("roll", "yaw", "pitch"):
            moment = getattr(product.static_moments, axis)
            if moment is not None and not limit.holds(moment / product.static):
                yield WarningText(
                    "rated moments",
                    f"Warning: the rated static {axis} moment of {product.name}, {digits(moment)} N m, is its C0 at an "
                    f"arm of {digits(1e3 * moment / product.static)} mm; catalogues have 2 to 54 mm: is one in the "
                    "wrong unit?",
                )
                break


def _unused(machine: Machine) -> Iterator[WarningText]:
    """On rails that bear nothing, and on types that no carriage has."""
    used = {one.rail for one in machine.carriages}
    if empty := [rail.name for rail in machine.rails if rail.name not in used]:
        rail = "rail" if len(empty) == 1 else "rails"
        yield WarningText(
            "empty rail",
            f"Warning: no carriage runs on {rail} {joined(empty)}: is one forgotten, or on another rail? Else leave "
            f"the {rail} out.",
        )
    named = {one.type for one in machine.carriages}
    if unused := [name for name in machine.carriage_types if name not in named]:
        types = "the carriage type" if len(unused) == 1 else "the carriage types"
        yield WarningText(
            "unused type",
            f"Warning: no carriage names {types} {joined(unused)}: does a carriage lack its key type? Else leave "
            "the table out.",
        )


def _modes(machine: Machine, modes: Modes) -> Iterator[WarningText]:
    """On natural frequencies, damping ratios and clearances."""
    units = 'is stiffness in N/m, as in "350 N/um", and mass in kg?', 'is damping in N s/m, as in "8 kN s/m"?'
    for key, values, scale, unit, what, question in (
        ("frequency", modes.frequency, 1.0, "Hz", "is at", units[0]),
        ("damping", modes.damping_ratio, 100.0, "%", "is damped by", units[1]),
    ):
        limit = LIMITS[key]
        odd = [i for i, value in enumerate(values) if not limit.holds(float(value))]
        if odd:
            middle = np.sqrt(limit.least * limit.most)
            worst = odd[int(np.abs(np.log(np.maximum(values[odd], 1e-300) / middle)).argmax())]
            others = f", and {counted(len(odd) - 1, 'other mode')} too" if len(odd) > 1 else ""
            if key == "damping" and values[worst] < limit.least:
                rolls = machine.in_one_line and moving_dofs(machine, modes.shape[worst])[:1] == ["rx"]
                question = (
                    "it is roll on one rail, which the rows at width/2 damp with damping_y, and viscous damping gives "
                    "low modes less than high ones. It rings longer here than with the 2 % usual of guides; raise "
                    "damping_y only if a measurement says so."
                    if rolls and len(odd) == 1
                    else 'is damping in N s/m, as in "8 kN s/m", and given for every carriage?'
                )
            yield WarningText(
                key,
                f"Warning: mode {worst + 1} {what} {digits(scale * values[worst])} {unit}, outside "
                f"{number(scale * limit.least)} to {number(scale * limit.most)} {unit}{others}: {question}",
            )
    sided = [float(law.edges[-1]) for law in machine.link_table().laws if law.kind == "sided"]
    if not LIMITS["clearance"].holds(clearance := max(sided, default=0.0)):
        yield WarningText(
            "clearance",
            f'Warning: a clearance is {digits(1e3 * clearance, 4)} mm to either side: is it in m? {SI} "5 um".',
        )


def _weight(machine: Machine) -> Iterator[WarningText]:
    """On gravity along held dofs of L, and across the carriages."""
    gravity = np.array(machine.gravity)
    reaction, loads = machine.scene.static_reaction(), machine.static_carriage_loads
    for index, axis in enumerate(DOFS[:3]):
        if axis in machine.free or axis == "x" or not gravity[index]:
            continue
        held, carried = load_in_table(float(reaction[index])), load_in_table(float(loads[:, index].sum()))
        yield WarningText(
            "weight on the constraint",
            f"Warning: {axis} of L is held, so the constraint at L carries the weight: {held} N at rest. "
            f"The static loads of the carriages along {axis} add up to {carried} N: they carry only its moment. "
            f"If {axis} is free, the guides carry the weight.",
        )
    size = float(np.linalg.norm(gravity))
    if not LIMITS["gravity"].holds(size):
        yield WarningText(
            "gravity",
            f"Warning: gravity is {number(size)} m/s2, not 9.81 m/s2: is it in m/s2, as in [0, -9.80665, 0]? Static "
            "loads are proportional to it.",
        )
    if not size or not machine.carriages:
        return
    across = np.abs(machine.carriage_axes[:, 2] @ gravity) / size
    if not LIMITS["weight on the side"].holds(float(across.min())):
        yield WarningText(
            "weight on the side",
            f"Warning: {percent(float(across.min()))} of gravity acts on the sides of all carriages (z), across their "
            "rails instead of onto them (y): right for rails on a wall; else y and z are swapped, in gravity or in the "
            "positions, or `roll` of the rails is missing.",
        )


def _estimates(machine: Machine) -> Iterator[WarningText]:
    """On carriages whose stiffness is estimated, and how good the estimate is."""
    carriages: dict[tuple[str, str], list[str]] = {}  # by product with class, and words of the estimate
    estimates = stiffness_estimates(machine.carriages, machine.product_of_carriage)
    for carriage, estimate in zip(machine.carriages, estimates, strict=True):
        if estimate is not None:
            product = " ".join(filter(None, (carriage.product, carriage.preload_class)))
            carriages.setdefault((product, estimate.words), []).append(carriage.name)
    of_products = [
        f"of {_carriages(machine, names)} ({product}) {words}"
        for (product, words), names in carriages.items()
    ]
    if of_products:
        text = f"Warning: stiffness {'; '.join(of_products)}; the catalogue prints none."
        yield WarningText("estimated stiffness", text)


def _own_stiffness(machine: Machine) -> Iterator[WarningText]:
    """On stiffness in the machine file that is far from that of the product which the carriage names."""
    found: dict[str, list[str]] = {}  # carriages by what is said of them
    for carriage, product in zip(machine.carriages, machine.product_of_carriage, strict=True):
        laws = {} if product is None else product.law_keys(carriage.preload_class)
        parts = []
        for axis, keys in laws.items():
            key = f"stiffness_{axis}"
            own, of_product = getattr(carriage, key), keys.get(key)
            if not (isinstance(own, float) and isinstance(of_product, float)):
                continue
            if not LIMITS["own stiffness"].holds(own / of_product):
                parts.append(
                    f"{key} is {digits(1e-6 * own)} N/um instead of {digits(1e-6 * of_product)} N/um"
                )
        if parts:
            kinds = " ".join(filter(None, (carriage.product, carriage.preload_class)))
            found.setdefault(f"{joined(parts)} of {kinds}", []).append(carriage.name)
    for text, names in found.items():
        way_out = "the machine file counts; delete the key there for the value of the product"
        yield WarningText("own stiffness", f"Warning: {_carriages(machine, names)}: {text}; {way_out}.")


def _carriages(machine: Machine, names: list[str]) -> str:
    return "all carriages" if len(names) == len(machine.carriages) else f"carriage {joined(names)}"
