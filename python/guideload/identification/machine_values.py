"""The machine with other values of its parameters."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from guideload.machine.machine import Machine
from guideload.parameters.parameters import Parameter

AXES = "xyz"
CROSS = ("position", "mounting_error")  # their first component is y
KINDS = {"carriage": "carriages", "link": "links", "rail": "rails"}


def machine_with(machine: Machine, values: Iterable[tuple[Parameter, float]]) -> Machine:
    """The machine with these values of its parameters, in SI. Raises ConfigError for an impossible one."""
    parts: dict[str, Any] = {
        kind: {part.name: part for part in getattr(machine, kind)} for kind in KINDS.values()
    }
    parts |= {"body": machine.body, "gravity": machine.gravity}
    for parameter, value in values:
        key = parameter.path.rpartition("].")[2]
        kind = next((KINDS[owner] for owner in KINDS if owner in parameter.owners), None)
        if kind is not None:
            name = parameter.owners[kind.removesuffix("s")]
            parts[kind][name] = _changed(parts[kind][name], key.split("."), value)
        elif key.startswith("gravity."):
            parts["gravity"] = _replaced(parts["gravity"], AXES.index(key[-1]), value)
        else:
            parts["body"] = _changed(parts["body"], key.split(".")[1:], value)
    update = {key: tuple(part.values()) if isinstance(part, dict) else part for key, part in parts.items()}
    return machine.model_copy(update=update)


def _changed(part: Any, keys: list[str], value: float) -> Any:
    """A part of the machine with another value: of ["stiffness_y"], ["stiffness_y", "positive"], ["position", "z"]."""
    key, *inner = keys
    before = getattr(part, key)
    if not inner:
        after: Any = value
    elif key == "inertia":
        i, j = map(AXES.index, inner[0])
        rows = [list(row) for row in before]
        rows[i][j] = rows[j][i] = value
        after = rows
    elif inner[0] == "scale":
        after = tuple((deflection, value * force) for deflection, force in before)
    elif inner[0] in AXES:
        after = _replaced(before, AXES.index(inner[0]) - (key in CROSS), value)
    else:
        after = before.model_copy(update={inner[0]: value})
    return part.model_copy(update={key: after})


def _replaced(vector: tuple[float, ...], index: int, value: float) -> tuple[float, ...]:
    return (*vector[:index], value, *vector[index + 1 :])
