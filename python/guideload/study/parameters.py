"""From a path such as `carriages.*.stiffness_y` to places in a machine, and to what the core changes there.

All that can vary stands in the tables `OF_MACHINE`, `OF_RAIL`, `OF_CARRIAGE`, `OF_LINK` and `OF_SPRING`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from typing import Any

from guideload.base.errors import ValueRefused
from guideload.machine.components import Carriage, Link
from guideload.machine.laws import Sides
from guideload.machine.links import ENDS
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.study.distributions import Form

Target = tuple[str, int, int | str]  # what the core sets, see `_core.Batch`
Change = tuple[
    Target, float, tuple[tuple[int, float], ...]
]  # target, constant, (column, factor) of each term
AXES = ("x", "y", "z")
NEAR = 3  # names told where one is unknown


@dataclass(frozen=True)
class Parameter:
    """One number of a machine that can vary.

    path    its full name: "carriages[1a].stiffness_y"
    value   the machine's own, in SI `unit`
    floor   "> 0", ">= 0" or "" for any number
    sets    what of the core it is part of, and by which factor: half of a carriage's stiffness is at each end
    owners  the parts it belongs to, from their kind to their name: {"carriage": "1a", "rail": "1"}
    """

    path: str
    unit: str
    value: float
    floor: str
    sets: tuple[tuple[Target, float], ...]
    owners: dict[str, str]

    def require(self, low: float, high: float) -> None:
        """Refuses values from `low` to `high` if the parameter cannot have all of them. Raises ValueRefused."""
        if (self.floor == "> 0" and not low > 0.0) or (self.floor == ">= 0" and not low >= 0.0):
            unit = "" if self.unit == "1" else f" {self.unit}"
            reach = f"values from {low:.4g} to {high:.4g}{unit}"
            way_out = 'narrow the distribution, cut it with at_least, or take "lognormal"'
            raise ValueRefused(f"{self.path} {self.floor}{unit}", reach, way_out)


# ---- what can vary: key, unit, floor, value in the machine's part, what it sets


def _axes(key: str, unit: str, target: str) -> list[tuple[Any, ...]]:
    """The rows of the three components of a vector of the machine."""
    *parts, last = key.split(".")

    def component(machine: Machine, axis: int) -> float:
        part = machine.body if parts else machine
        return float(getattr(part, last)[axis])

    return [
        (f"{key}.{name}", unit, "", lambda machine, i=i: component(machine, i), (target, i, 0))
        for i, name in enumerate(AXES)
    ]


OF_MACHINE: list[tuple[Any, ...]] = [
    ("body.mass", "kg", "> 0", lambda machine: machine.body.mass, ("mass", 0, 0)),
    *_axes("body.center_of_mass", "m", "center_of_mass"),
    *[
        (
            f"body.inertia.{AXES[i]}{AXES[j]}",
            "kg m^2",
            "> 0" if i == j else "",
            lambda machine, i=i, j=j: machine.body.inertia[i][j],
            ("inertia", i, j),
        )
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    ],
    *_axes("gravity", "m/s^2", "gravity"),
]
# Of the point of each link of its carriages, and of their centres: axis.
OF_RAIL = (("position.y", "m", "", 0, 1), ("position.z", "m", "", 1, 2))
# Of the points of its links along x: factor at the end "-", at the end "+", and of the centre.
OF_CARRIAGE = (("x", "m", "", 1.0, 1.0, 1.0), ("length", "m", "> 0", -0.5, 0.5, 0.0))
OF_LINK = tuple((f"point.{name}", "m", "", i) for i, name in enumerate(AXES))


@dataclass(frozen=True)
class Spring:
    """The keys of an elastic law and its damper along one direction."""

    stiffness: float | Sides | None
    clearance: float
    preload: float | None
    curve: tuple[tuple[float, float], ...] | None
    damping: float
    damping_in_contact: bool


def _clearance(spring: Spring) -> float | None:
    # The core knows no link that is damped in contact only and always in contact.
    open_to_it = spring.clearance > 0.0 or not spring.damping_in_contact
    return spring.clearance if spring.preload is None and spring.curve is None and open_to_it else None


def _side(name: str) -> Callable[[Spring], float | None]:
    return lambda spring: getattr(spring.stiffness, name) if isinstance(spring.stiffness, Sides) else None


def _stiffness(spring: Spring) -> float | None:
    return spring.stiffness if isinstance(spring.stiffness, float) else None


ONE_STIFFNESS, BY_SIDE = "one stiffness, in place of a curve or of its sides", "a stiffness by side"
CLEAR = "a stiffness without preload, and a clearance to begin with where damping_in_contact is true"
# Key, unit, floor, value or None where the law has no place for it, what the law would need, what of the core's law
# (of damping: nothing), whether an end of a carriage has half of it.
OF_SPRING: tuple[tuple[str, str, str, Callable[[Spring], float | None], str, str | None, bool], ...] = (
    ("stiffness", "N/m", "> 0", _stiffness, ONE_STIFFNESS, "stiffness", True),
    ("stiffness.positive", "N/m", ">= 0", _side("positive"), BY_SIDE, "positive_stiffness", True),
    ("stiffness.negative", "N/m", ">= 0", _side("negative"), BY_SIDE, "negative_stiffness", True),
    ("clearance", "m", ">= 0", _clearance, CLEAR, "clearance", False),
    ("preload", "N", "> 0", lambda spring: spring.preload, "a preload, and what is rolling", "preload", True),
    ("curve.scale", "1", "> 0", lambda spring: 1.0 if spring.curve else None, "a curve", "scale", False),
    ("damping", "N s/m", ">= 0", lambda spring: spring.damping, "", None, True),
)


# ---- the parameters of one machine


class Parameters:
    """All that can vary in a machine and its motion.

    of      by part ("carriages", "1a", or twice "" for the machine) and key: the parameter, or what it would take
    """

    def __init__(self, machine: Machine, motion: Motion) -> None:
        self.of: dict[tuple[str, str], dict[str, Parameter | str]] = {("", ""): {}}
        self.names = {
            "rails": [rail.name for rail in machine.rails],
            "carriages": [carriage.name for carriage in machine.carriages],
            "links": [link.name for link in machine.links],
        }
        whole = self.of["", ""]
        for key, unit, floor, value, target in OF_MACHINE:
            whole[key] = Parameter(key, unit, value(machine), floor, ((target, 1.0),), {})
        whole["motion.scale"] = Parameter("motion.scale", "1", 1.0, "", ((("acceleration", 0, 0), 1.0),), {})
        whole["motion.force_scale"] = (
            "a motion with a process force"
            if motion.wrench is None
            else Parameter("motion.force_scale", "1", 1.0, "", ((("wrench", 0, 0), 1.0),), {})
        )
        rail_of = machine.rail_of_carriage.tolist()
        for i, rail in enumerate(machine.rails):
            on_it = [j for j, index in enumerate(rail_of) if index == i]
            for key, unit, floor, entry, axis in OF_RAIL:
                sets = [((("point", 4 * j + end, axis)), 1.0) for j in on_it for end in range(len(ENDS))]
                sets += [(("center", j, axis), 1.0) for j in on_it]
                self._add(
                    "rails", rail.name, key, unit, floor, rail.position[entry], sets, {"rail": rail.name}
                )
        for i, carriage in enumerate(machine.carriages):
            self._add_carriage(i, carriage)
        for i, link in enumerate(machine.links):
            index, owners = 4 * len(machine.carriages) + i, {"link": link.name}
            for key, unit, floor, axis in OF_LINK:
                point: list[tuple[Target, float]] = [(("point", index, axis), 1.0)]
                self._add("links", link.name, key, unit, floor, link.point[axis], point, owners)
            keys = ("stiffness", "clearance", "preload", "curve", "damping", "damping_in_contact")
            spring = Spring(**{key: getattr(link, key) for key in keys})
            self._add_spring("links", link, "", spring, (index,), 1.0, owners)

    def _add_carriage(self, i: int, carriage: Carriage) -> None:
        owners = {"carriage": carriage.name, "rail": carriage.rail}
        for key, unit, floor, minus, plus, center in OF_CARRIAGE:
            sets: list[tuple[Target, float]] = [
                (("point", 4 * i + k, 0), plus if end.startswith("+") else minus)
                for k, end in enumerate(ENDS)
            ]
            sets += [(("center", i, 0), center)] if center else []
            self._add("carriages", carriage.name, key, unit, floor, getattr(carriage, key), sets, owners)
        for axis in ("y", "z"):
            of_axis = {
                key: getattr(carriage, f"{key}_{axis}")
                for key in ("stiffness", "clearance", "preload", "curve", "damping")
            }
            spring = Spring(**of_axis, damping_in_contact=carriage.damping_in_contact)
            links = tuple(4 * i + k for k, end in enumerate(ENDS) if end.endswith(axis))
            self._add_spring("carriages", carriage, f"_{axis}", spring, links, 0.5, owners)

    def _add_spring(
        self,
        kind: str,
        part: Carriage | Link,
        suffix: str,
        spring: Spring,
        links: tuple[int, ...],
        share: float,
        owners: dict[str, str],
    ) -> None:
        for key, unit, floor, value_of, need, of_law, shared in OF_SPRING:
            first, dot, rest = key.partition(".")
            value = value_of(spring)
            factor = share if shared else 1.0
            sets = [(("law", k, of_law) if of_law else ("damping", k, 0), factor) for k in links]
            self._add(kind, part.name, f"{first}{suffix}{dot}{rest}", unit, floor, value, sets, owners, need)

    def _add(
        self,
        kind: str,
        name: str,
        key: str,
        unit: str,
        floor: str,
        value: float | None,
        sets: Sequence[tuple[Target, float]],
        owners: dict[str, str],
        need: str = "",
    ) -> None:
        path = f'{kind}["{name}"].{key}' if name.isdecimal() else f"{kind}[{name}].{key}"
        found = need if value is None else Parameter(path, unit, value, floor, tuple(sets), owners)
        self.of.setdefault((kind, name), {})[key] = found

    # ---- finding

    def at(self, path: str) -> tuple[Parameter, ...]:
        """The parameters that a path means, in the machine's order.

        `*` or `[*]` stands for all carriages, rails or links, [1a] or ["1a"] for the one of that name, [0] for the
        first; `stiffness` for `stiffness_y` and `stiffness_z`, `position` for all its components. Raises ValueRefused.
        """
        match = SELECTOR.fullmatch(path)
        if match is None:
            return self._keyed(path, ("", ""), path)
        kind, quoted, bare, key = match["kind"], match["quoted"], match["bare"], match["key"]
        if quoted is None and bare in (None, "*"):
            names = self.names[kind]
        else:
            names = [self._name(path, kind, quoted, bare)]
        if not names:
            raise ValueRefused("a path in this machine", path, f"it has no {kind}")
        return tuple(found for name in names for found in self._keyed(path, (kind, name), key))

    def _name(self, path: str, kind: str, quoted: str | None, bare: str | None) -> str:
        """The name in brackets, with quotes or without, or that of an index from 0."""
        known = self.names[kind]
        text = quoted if quoted is not None else bare or ""
        index = int(text) if quoted is None and text.isdecimal() else None
        by_index = known[index] if index is not None and index < len(known) else None
        by_name = text if text in known else None
        if by_name is not None and by_index not in (None, by_name):
            ways = f'{kind}["{by_name}"] or {kind}["{by_index}"]'
            raise ValueRefused("one meaning", path, f"[{text}] is a name and an index: write {ways}")
        found = by_name if by_name is not None else by_index
        if found is None:
            listed = ", ".join(f'"{name}"' for name in known)
            raise ValueRefused(
                "a path in this machine", path, f"its {kind} are {listed or 'none'}, [0] is the first"
            )
        return found

    def _keyed(self, path: str, part: tuple[str, str], key: str) -> tuple[Parameter, ...]:
        """What `key` means in a part: itself, or all that it is the beginning of."""
        keys = self.of[part]
        meant = [keys[key]] if isinstance(keys.get(key), Parameter) else []
        meant = meant or [keys[full] for full in keys if key in _wholes(full)]
        there = tuple(found for found in meant if isinstance(found, Parameter))
        if there:
            return there
        if key in keys or meant:
            need = keys[key] if key in keys else meant[0]
            place = f"{part[0]}[{part[1]}] has" if part[0] else "there is"
            raise ValueRefused("a path that has a place here", path, f"{place} none; it takes {need}")
        near = get_close_matches(path, self._all, n=NEAR, cutoff=0.5)
        hint = f"did you mean {' or '.join(near)}?" if near else f"paths begin with {', '.join(ROOTS)}"
        raise ValueRefused("a known path", path, hint)

    @cached_property
    def _all(self) -> list[str]:
        """All paths that can be written here, those of all parts of a kind first."""
        every: dict[str, None] = {}
        for (kind, _), keys in self.of.items():
            for key, found in keys.items():
                if isinstance(found, Parameter):
                    for written in (key, *_wholes(key)):
                        every[f"{kind}.*.{written}" if kind else written] = None
        return [*every, *(parameter.path for parameter in self if parameter.owners)]

    def __iter__(self) -> Iterator[Parameter]:
        for keys in self.of.values():
            yield from (found for found in keys.values() if isinstance(found, Parameter))

    # ---- changing

    def changes(self, columns: Sequence[tuple[Form, Sequence[Parameter]]]) -> tuple[Change, ...]:
        """What the core is told: each target, its constant and its terms, from what the columns of values are.

        A target is the sum of all parameters that set it, each with its factor: those that no column is for keep the
        machine's value. No two columns are for one parameter.
        """
        column_of: dict[str, tuple[int, Form]] = {
            parameter.path: (column, form)
            for column, (form, parameters) in enumerate(columns)
            for parameter in parameters
        }
        parts: dict[Target, list[tuple[Parameter, float]]] = {}
        for parameter in self:
            for target, factor in parameter.sets:
                parts.setdefault(target, []).append((parameter, factor))
        changes: list[Change] = []
        for target, sums in parts.items():
            constant = 0.0
            terms: dict[int, float] = {}
            for parameter, factor in sums:
                column, form = column_of.get(parameter.path, (-1, "value"))
                if column < 0 or form == "shift":
                    constant += factor * parameter.value
                if column >= 0:
                    slope = factor * parameter.value if form == "factor" else factor
                    terms[column] = terms.get(column, 0.0) + slope
            if terms:
                changes.append((target, constant, tuple(terms.items())))
        return tuple(changes)


SELECTOR = re.compile(
    r'(?P<kind>carriages|rails|links)(?:\.\*|\[(?:"(?P<quoted>[^"]+)"|(?P<bare>[^\]"]+))\])\.(?P<key>[^\[\]]+)'
)
ROOTS = ("body.", "gravity.", "motion.", "rails.*.", "carriages.*.", "links.*.")
NO_WHOLE = ("body", "motion")  # their parts have nothing in common


def _wholes(key: str) -> tuple[str, ...]:
    """What `key` is a part of: "stiffness_y" and "stiffness" of "stiffness_y.positive"."""
    parts = re.split(r"(?<=[a-z])(?=\.|_[yz](?:\.|$))", key)
    wholes = ("".join(parts[:n]) for n in range(len(parts) - 1, 0, -1))
    return tuple(whole for whole in wholes if whole not in NO_WHOLE)
