"""Made measurements of a machine whose parameters are known, and their derivatives by differences."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from guideload import Machine, PointOfInterest
from guideload.base.arrays import Array
from guideload.identification.measured import Measured
from guideload.identification.modal_test import MeasuredMode, ModalTest
from guideload.identification.model import Model, parse_place
from guideload.identification.responses import Deflection, Deflections, ResponseCurve
from guideload.identification.unknowns import Unknown, UnknownTable, resolve_unknowns

CORNERS = ((-0.5, 0.1, -0.35), (0.5, 0.1, -0.35), (-0.5, 0.1, 0.35), (0.5, 0.1, 0.35), (0.1, -1.2, 0.2))
LEVELS = (0.01, 0.1, 0.05)
ROUNDING = 1e-9  # of the largest derivative


def with_corners(machine: Machine) -> Machine:
    """The machine with five points, p0 to p4."""
    points = [PointOfInterest(name=f"p{i}", at=at) for i, at in enumerate(CORNERS)]
    return machine.model_copy(update={"points": points})


def unknown(machine: Machine, *tables: UnknownTable) -> tuple[Unknown, ...]:
    return resolve_unknowns(tables, machine)


def derivative_errors(
    data: Measured, model: Model, z: Array, nuisance: Array, step: float = 1e-5, own_steps: ArrayLike = ()
) -> tuple[Array, Array]:
    """Differences of the derivatives of residuals from central differences, over the largest of each.

    By the unknowns (p,), with this step, and by the nuisance parameters (q,), with `own_steps`.
    """
    found = data.residuals(model.at(z), nuisance)
    by_unknowns = _differences(
        lambda at: data.residuals(model.at(at), nuisance).values, z, np.full(z.size, step)
    )
    errors = _over_largest(found.by_unknowns.T - by_unknowns, by_unknowns)
    if not np.size(own_steps):
        return errors, np.zeros(0)
    own = _differences(lambda at: data.residuals(model.at(z), at).values, nuisance, np.asarray(own_steps))
    return errors, _over_largest(found.by_nuisance.T - own, own)


def _over_largest(errors: Array, values: Array) -> Array:
    """(k,) largest error of each row over its largest value; over that of all rows where it is rounding alone."""
    largest = abs(values).max(axis=1)
    return np.asarray(
        abs(errors).max(axis=1) / np.where(largest > ROUNDING * largest.max(), largest, largest.max())
    )


def _differences(function: Callable[[Array], Array], at: Array, steps: Array) -> Array:
    """(k, m) derivatives of a function (m,) by its k arguments."""
    ends = ((function(at + change), function(at - change)) for change in np.diag(steps))
    return np.array([(up - down) / (2.0 * step) for (up, down), step in zip(ends, steps, strict=True)])


def response_curves(
    model: Model, truth: Array, hertz: Array, level: float, rng: np.random.Generator, gain: float = 1.0
) -> tuple[ResponseCurve, ...]:
    """Accelerations at three places by forces at two, of the machine at `truth`, with noise of this level."""
    curves, empty = [], np.zeros(hertz.size, dtype=np.complex128)
    for force in ("p0 y", "p4 z"):
        for place in ("p1 y", "p3 y", "p2 z"):
            places = [parse_place(name, model.machine) for name in (force, place)]
            value = gain * ResponseCurve(*places, 2, hertz, empty).computed(model.at(truth))[0]
            noise = rng.standard_normal((hertz.size, 2)) @ [1.0, 1.0j]
            curves.append(ResponseCurve(*places, 2, hertz, value * (1.0 + level * noise)))
    return tuple(curves)


def deflections(
    model: Model,
    truth: Array,
    pairs: Sequence[tuple[str, str]],
    noise: float = 0.01,
    rng: np.random.Generator | None = None,
) -> Deflections:
    """Displacements under 1 kN of the machine at `truth`, at (place of the force, place of the sensor).

    noise: level over the largest displacement; drawn and added if there is a generator.
    """
    places = [[parse_place(text, model.machine) for text in pair] for pair in pairs]
    still = Deflections("static", tuple(Deflection(a, 1e3, b, 0.0) for a, b in places), 1e-7, True)
    moved = still.computed(model.at(np.asarray(truth)))[0]
    level = noise * float(abs(moved).max())
    drawn = 0.0 if rng is None else rng.standard_normal(moved.size)
    made = zip(still.values, (moved + level * drawn).tolist(), strict=True)
    return replace(still, values=tuple(replace(one, moved=value) for one, value in made), level=level)


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
