"""Made measurements of a machine whose parameters are known."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from guideload import Machine, PointOfInterest
from guideload.identification.modal_test import MeasuredMode, ModalTest
from guideload.identification.model import Model, parse_place
from guideload.identification.unknowns import Unknown, UnknownTable, resolve_unknowns

CORNERS = ((-0.5, 0.1, -0.35), (0.5, 0.1, -0.35), (-0.5, 0.1, 0.35), (0.5, 0.1, 0.35), (0.1, -1.2, 0.2))
LEVELS = (0.01, 0.1, 0.05)


def with_corners(machine: Machine) -> Machine:
    """The machine with five points, p0 to p4."""
    points = [PointOfInterest(name=f"p{i}", at=at) for i, at in enumerate(CORNERS)]
    return machine.model_copy(update={"points": points})


def unknown(machine: Machine, *tables: UnknownTable) -> tuple[Unknown, ...]:
    return resolve_unknowns(tables, machine)


def hammer_test(
    model: Model,
    truth: Sequence[float],
    rng: np.random.Generator,
    *,
    shapes: bool = True,
    noise: Sequence[float] = LEVELS,
    levels: tuple[float, float, float] = LEVELS,
    known: bool = True,
) -> ModalTest:
    """A modal test of the machine at `truth` (coordinates z), with this noise; levels: what is stated of it."""
    modes = model.at(np.array(truth)).modes
    places = [parse_place(f"p{i} {axis}", model.machine) for i in range(len(CORNERS)) for axis in "yz"]
    rows = np.array([place.row for place in places])
    measured = []
    for value, shape in zip(modes.eigenvalue, modes.damped_shape, strict=True):
        seen = rows @ shape
        seen = (seen * np.exp(-0.5j * np.angle(seen @ seen))).real
        measured.append(
            MeasuredMode(
                abs(value) / (2.0 * np.pi) * np.exp(noise[0] * rng.standard_normal()),
                -value.real / abs(value) * np.exp(noise[1] * rng.standard_normal()),
                seen + noise[2] * abs(seen).max() * rng.standard_normal(seen.size) if shapes else None,
            )
        )
    used = tuple(places) if shapes else ()
    return ModalTest("hammer test", tuple(measured), used, levels, (known,) * 3)


def in_toml(test: ModalTest) -> str:
    """The test as a table of an identify file."""
    rows = ["[[modal_tests]]", f"places = {json.dumps([place.name for place in test.places])}"]
    keys = ("frequency_noise", "damping_noise", "shape_noise")
    rows += [f'{key} = "{100 * level} %"' for key, level in zip(keys, test.levels, strict=True)]
    for mode in test.modes:
        rows += ["[[modal_tests.modes]]", f'frequency = "{mode.frequency} Hz"', f"damping = {mode.damping}"]
        rows += [] if mode.shape is None else [f"shape = {mode.shape.tolist()}"]
    return "\n".join(rows) + "\n"
