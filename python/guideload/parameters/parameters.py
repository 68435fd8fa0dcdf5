"""Parameters: the numbers of a machine that can vary, found by paths such as `carriages.*.stiffness_y`.

`_of_machine` and the functions of `parts` list them, each with the numbers of the core's scene that it sets.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from typing import Literal

from guideload.base.errors import ValueRefused
from guideload.base.ranges import (
    ACCELERATION,
    CLEARANCE,
    DAMPING,
    INERTIA,
    LENGTH,
    MASS,
    POSITION,
    PRELOAD,
    RATIO,
    STIFFNESS,
    Range,
)
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.parameters.parts import (
    AXES,
    PartParameter,
    Target,
    of_carriage,
    of_link,
    of_payload,
    of_rail,
)

Form = Literal["value", "factor", "shift"]  # how a value sets the numbers of a column
# Target, constant, and (column, factor) of each term.
Change = tuple[Target, float, tuple[tuple[int, float], ...]]
RANGES = {one.unit: one for one in (MASS, INERTIA, ACCELERATION, STIFFNESS, DAMPING, PRELOAD, RATIO)}
NEAR = 3  # nearest names that an error lists


@dataclass(frozen=True)
class Parameter:
    """One number of a machine that can vary."""

    path: str  # its full name: "carriages[1a].stiffness_y"
    unit: str
    value: float  # nominal value in SI `unit`
    floor: str  # "> 0", ">= 0" or "" for any number
    # targets to which it adds, with factors: half of a carriage's stiffness at each end
    sets: tuple[tuple[Target, float], ...]
    owners: dict[str, str]  # names of the parts that it belongs to, by kind: {"carriage": "1a", "rail": "1"}
    within: Range  # its range, as in a machine file

    @property
    def root(self) -> str:
        """Its key in the table of its part: "stiffness_y" of "carriages[1a].stiffness_y.positive"."""
        return self.path.rpartition("].")[2].partition(".")[0]

    def require(self, low: float, high: float, form: Form = "value") -> None:
        """Raise ValueRefused if values of this form from `low` to `high` leave the range or go below the floor."""
        low, high = sorted(changed(self.value, form, end) for end in (low, high))
        unit = "" if self.unit == "1" else f" {self.unit}"
        reach = f"values from {low:.4g} to {high:.4g}{unit}"
        if (self.floor == "> 0" and not low > 0.0) or (self.floor == ">= 0" and not low >= 0.0):
            way_out = 'narrow the distribution, cut it with at_least, or take "lognormal"'
            raise ValueRefused(f"{self.path} {self.floor}{unit}", reach, way_out)
        least = self.within.least if self.floor == "> 0" else -self.within.most
        if not (least <= low and high <= self.within.most):
            raise ValueRefused(f"{self.path}: {self.within.words}{unit}", reach, "narrow the distribution")


def changed(value: float, form: Form, number: float) -> float:
    """A value of the machine that a number of this form sets."""
    return {"value": number, "factor": value * number, "shift": value + number}[form]


def part_path(kind: str, name: str) -> str:
    """The path of a part: "carriages[1a]", or with quotes where an index might be meant."""
    return f'{kind}["{name}"]' if name.isdecimal() else f"{kind}[{name}]"


# ---- the numbers that can vary


def _of_machine(machine: Machine, motion: Motion) -> Iterator[PartParameter]:
    body = machine.body
    yield PartParameter("body.mass", "kg", "> 0", body.mass, [(("mass", 0, 0), 1.0)])
    for i, axis in enumerate(AXES):
        center = [(("center_of_mass", i, 0), 1.0)]
        yield PartParameter(f"body.center_of_mass.{axis}", "m", "", body.center_of_mass[i], center)
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
        key, floor = f"body.inertia.{AXES[i]}{AXES[j]}", "> 0" if i == j else ""
        yield PartParameter(key, "kg m^2", floor, body.inertia[i][j], [(("inertia", i, j), 1.0)])
    for i, axis in enumerate(AXES):
        yield PartParameter(f"gravity.{axis}", "m/s^2", "", machine.gravity[i], [(("gravity", i, 0), 1.0)])
    yield PartParameter("motion.scale", "1", "", 1.0, [(("acceleration", 0, 0), 1.0)])
    force, need = None if motion.wrench is None else 1.0, "a motion with a process force"
    yield PartParameter("motion.force_scale", "1", "", force, [(("wrench", 0, 0), 1.0)], need)


def _find_range(row: PartParameter) -> Range:
    """The range of a parameter: by its unit and, for lengths, by its key."""
    if row.unit != "m":
        return RANGES[row.unit]
    if row.key.startswith("clearance"):
        return CLEARANCE
    return LENGTH if row.key in ("length", "width") else POSITION


# ---- the parameters of one machine


class Parameters:
    """All parameters of a machine and its motion.

    of_part  parameters by part, ("carriages", "1a") or ("", "") for the machine, and key
    needs    what a law needs to have a parameter that it does not have, by part and key
    """

    def __init__(self, machine: Machine, motion: Motion) -> None:
        self.machine = machine
        self.of_part: dict[tuple[str, str], dict[str, Parameter]] = {}
        self.needs: dict[tuple[str, str], dict[str, str]] = {}
        self._fixed: dict[Target, float] = {}  # what targets have of numbers that do not vary
        self._add("", "", {}, _of_machine(machine, motion))
        for i, rail in enumerate(machine.rails):
            self._add("rails", rail.name, {"rail": rail.name}, of_rail(machine, i))
        for i, carriage in enumerate(machine.carriages):
            owners = {"carriage": carriage.name, "rail": carriage.rail}
            self._add("carriages", carriage.name, owners, of_carriage(machine, i))
        first = len(machine.link_table().names) - len(machine.links)
        for i, link in enumerate(machine.links):
            self._add("links", link.name, {"link": link.name}, of_link(first + i, link))
        for i, payload in enumerate(machine.payloads):
            self._add("payloads", payload.name, {"payload": payload.name}, of_payload(i, payload))

    def _add(self, kind: str, name: str, owners: dict[str, str], rows: Iterator[PartParameter]) -> None:
        part = f"{part_path(kind, name)}." if kind else ""
        found, needs = self.of_part.setdefault((kind, name), {}), self.needs.setdefault((kind, name), {})
        for row in rows:
            for target, number in row.fixed:
                self._fixed[target] = self._fixed.get(target, 0.0) + number
            if row.value is None:
                needs[row.key] = row.need
            else:
                given = row.unit, row.value, row.floor, tuple(row.sets), owners, _find_range(row)
                found[row.key] = Parameter(part + row.key, *given)

    # ---- finding

    def at(self, path: str) -> tuple[Parameter, ...]:
        """The parameters of a path, in the machine's order.

        `*` or `[*]` means all carriages, rails, links or payloads, [1a] or ["1a"] the one with that name, [0] the
        first; `stiffness` means `stiffness_y` and `stiffness_z`, `position` all its components.
        `carriage_types.front` means all carriages that take this value from their type "front". Raises ValueRefused.
        """
        if path.startswith("carriage_types"):
            return self._of_type(path)
        match = SELECTOR.fullmatch(path)
        if match is None:
            return self._keyed(path, ("", ""), path)
        kind, quoted, bare, key = match["kind"], match["quoted"], match["bare"], match["key"]
        if quoted is None and bare in (None, "*"):
            names = self._names(kind)
        else:
            names = [self._name(path, kind, quoted, bare)]
        if not names:
            raise ValueRefused("a path in this machine", path, f"it has no {kind}")
        return tuple(parameter for name in names for parameter in self._keyed(path, (kind, name), key))

    def _of_type(self, path: str) -> tuple[Parameter, ...]:
        """The parameters of all carriages whose value is that of their type."""
        match, types = TYPE.fullmatch(path), self.machine.carriage_types
        name = "" if match is None else match["quoted"] or match["bare"] or match["name"]
        if match is None or name not in types:
            known = ", ".join(types) or "none"
            raise ValueRefused("a path such as carriage_types.NAME.length", path, f"its types are {known}")
        given = {key: value for key, value in vars(types[name]).items() if value is not None}
        users = [one for one in self.machine.carriages if one.type == name]
        found = [
            parameter
            for one in users
            for parameter in self._keyed(path, ("carriages", one.name), match["key"])
            if given.get(parameter.root, one) == getattr(one, parameter.root)
        ]
        if not found:
            raise ValueRefused(
                "a key that carriages take from their type", path, f"none takes it from {name}"
            )
        return tuple(found)

    def _names(self, kind: str) -> list[str]:
        return [name for of, name in self.of_part if of == kind]

    def _name(self, path: str, kind: str, quoted: str | None, bare: str | None) -> str:
        """The name of the part in brackets: a name with or without quotes, or an index from 0."""
        known = self._names(kind)
        text = quoted if quoted is not None else bare or ""
        index = int(text) if quoted is None and text.isdecimal() else len(known)
        by_index = known[index] if index < len(known) else None
        by_name = text if text in known else None
        if by_name is not None and by_index not in (None, by_name):
            ways = f'{kind}["{by_name}"] or {kind}["{by_index}"]'
            raise ValueRefused("one meaning", path, f"[{text}] is a name and an index: write {ways}")
        name = by_name if by_name is not None else by_index
        if name is None:
            names = ", ".join(f'"{one}"' for one in known)
            hint = f"its {kind} are {names or 'none'}, [0] is the first"
            raise ValueRefused("a path in this machine", path, hint)
        return name

    def _keyed(self, path: str, part: tuple[str, str], key: str) -> tuple[Parameter, ...]:
        """The parameter of a part with this key, or all parameters whose keys begin with it."""
        keys, needs = self.of_part[part], self.needs[part]
        if key in keys:
            return (keys[key],)
        if meant := tuple(one for full, one in keys.items() if key in _beginnings(full)):
            return meant
        need = next((text for full, text in needs.items() if key in (full, *_beginnings(full))), None)
        if need is not None:
            place = f"{part[0]}[{part[1]}] has" if part[0] else "there is"
            raise ValueRefused("a parameter of this machine", path, f"{place} none; it takes {need}")
        near = get_close_matches(path, self._all_paths, n=NEAR, cutoff=0.5)
        hint = f"did you mean {' or '.join(near)}?" if near else f"paths begin with {', '.join(ROOTS)}"
        raise ValueRefused("a known path", path, hint)

    @cached_property
    def _all_paths(self) -> list[str]:
        """All paths of this machine, those with `*` first."""
        paths = dict.fromkeys(
            f"{kind}.*.{written}" if kind else written
            for (kind, _), keys in self.of_part.items()
            for key in keys
            for written in (key, *_beginnings(key))
        )
        return [*paths, *(parameter.path for parameter in self if parameter.owners)]

    def __iter__(self) -> Iterator[Parameter]:
        for keys in self.of_part.values():
            yield from keys.values()

    # ---- changing

    def changes(self, columns: Iterable[tuple[Form, Sequence[str]]]) -> tuple[Change, ...]:
        """Targets that vary, each as a constant plus terms (column, factor).

        columns: form of each column of values, and the full paths that it sets; no path is set twice. A target is the
        sum of all parameters that set it, times their factors; what does not vary has the machine's value.
        """
        column_of: dict[str, tuple[int, Form]] = {
            path: (column, form) for column, (form, paths) in enumerate(columns) for path in paths
        }
        summands: dict[Target, list[tuple[Parameter, float]]] = {}
        for parameter in self:
            for target, factor in parameter.sets:
                summands.setdefault(target, []).append((parameter, factor))
        changes: list[Change] = []
        for target, sums in summands.items():
            constant = self._fixed.get(target, 0.0)
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
    r'(?P<kind>carriages|rails|links|payloads)(?:\.\*|\[(?:"(?P<quoted>[^"]+)"|(?P<bare>[^\]"]+))\])\.(?P<key>[^\[\]]+)'
)
TYPE = re.compile(
    r'carriage_types(?:\.(?P<name>[^.\[\]]+)|\[(?:"(?P<quoted>[^"]+)"|(?P<bare>[^\]"]+))\])\.(?P<key>[^\[\]]+)'
)
ROOTS = ("body.", "gravity.", "motion.", "rails.*.", "carriages.*.", "links.*.", "payloads.*.")


def _beginnings(key: str) -> tuple[str, ...]:
    """Shorter keys that include `key`: "stiffness_y" and "stiffness" include "stiffness_y.positive"."""
    pieces = re.split(r"(?<=[a-z])(?=\.|_[yz](?:\.|$))", key)
    beginnings = ("".join(pieces[:n]) for n in range(len(pieces) - 1, 0, -1))
    # The parameters of the body, and of the motion, have nothing in common.
    return tuple(beginning for beginning in beginnings if beginning not in ("body", "motion"))
