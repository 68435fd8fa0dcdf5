"""Derivatives at rest: static loads, modes and responses against differences in 50 digits, on every law."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from machines import one_mass
from mpmath import mpf
from numpy.typing import NDArray
from precise_derivatives import SIZE_OF_ZERO, STEP, at_rest, differences, matrices_of, with_value
from reference import DIGITS, body, cart, example, paper, random_machine, translating

from guideload import Machine, Modes
from guideload.base.errors import ArgumentError, SceneError
from guideload.machine.response import frequency_response
from guideload.sensitivity import VariedMachine

Array = NDArray[Any]
PATHS = [
    "body.mass",
    "body.center_of_mass.y",
    "body.inertia.xy",
    "gravity.y",
    'rails["1"].position.z',
    "carriages[1a].x",
    "carriages[1a].length",
    "carriages[2a].stiffness_y",
    "carriages[2a].damping_y",
]


def close(mine: Array, exact: Array, rtol: float = 1e-12) -> None:
    """Whether two arrays agree to rtol of the largest entry; the error in the formulas is some roundings."""
    assert np.abs(mine - exact).max() <= rtol * max(np.abs(exact).max(), 1e-200)


@pytest.mark.parametrize("about", ["center_of_mass", "L"])
def test_static_loads_in_50_digits(about: str) -> None:
    inertia = ((1200.0, 15.0, -8.0), (15.0, 900.0, 22.0), (-8.0, 22.0, 1100.0))
    few = {"center_of_mass": paper(("y", "rx", "rz")), "L": cart()}[about]
    machine = Machine(**few.model_dump() | {"body": body(inertia_about=about, inertia=inertia).model_dump()})
    varied = VariedMachine(machine, PATHS[:-1] if about == "center_of_mass" else PATHS[:5:2] + PATHS[7:8])
    one = varied.at()
    for k, column in enumerate(varied.columns):
        exact = differences(machine, at_rest(), column.name, column.value)
        close(one.d_static_position[k], exact["static_displacement"])
        close(one.d_static_link_loads[k], exact["static_link_load"])
        close(one.d_static_carriage_loads[k].ravel(), exact["static_carriage"].ravel())


def precise_modes(machine: Machine) -> dict[str, list[Any]]:
    """omega, damping ratios, shapes of unit modal mass, eigenvalues in mpmath."""
    mass, damping, stiffness = matrices_of(machine)
    lower = mpmath.cholesky(mass) ** -1
    squares, turned = mpmath.eigsy(lower * stiffness * lower.T)
    shapes = (lower.T * turned).T
    n = len(squares)
    omega = [mpmath.sqrt(square) for square in squares]
    signs = [mpmath.sign(max(shapes[k, :], key=abs)) for k in range(n)]
    inverse = mass**-1
    first = mpmath.zeros(2 * n)
    first[:n, n:] = mpmath.eye(n)
    first[n:, :n], first[n:, n:] = -inverse * stiffness, -inverse * damping
    values = sorted((z for z in mpmath.eig(first, left=False, right=False) if z.imag >= 0), key=abs)
    return {
        "frequency": [w / (2 * mpmath.pi) for w in omega],
        "damping_ratio": [-z.real / abs(z) for z in values],
        "shape": [signs[k] * x for k in range(n) for x in shapes[k, :]],
        "eigenvalue": values,
    }


@pytest.mark.parametrize("path", PATHS)
def test_modes_in_50_digits(path: str) -> None:
    machine = paper()
    path = path.replace("carriages[2a].d", "carriages[1a].d")
    varied = VariedMachine(machine, [path])
    modes, free = varied.at().modes(), [3, 4, 5]
    signs = np.array([np.sign(shape[np.abs(shape).argmax()]) for shape in modes.shape])[:, None]
    mine = {
        "frequency": modes.d_frequency[0],
        "damping_ratio": modes.d_damping_ratio[0],
        "shape": (signs * modes.d_shape[0])[:, free].ravel(),
        "eigenvalue": modes.d_eigenvalue[0],
    }
    with mpmath.workdps(DIGITS):
        value = mpf(varied.columns[0].value)
        step = STEP * (abs(value) or SIZE_OF_ZERO)
        high, low = (precise_modes(with_value(machine, path, value + side * step)) for side in (1, -1))
        for name, found in mine.items():
            exact = [(a - b) / (2 * step) for a, b in zip(high[name], low[name], strict=True)]
            kind = complex if name == "eigenvalue" else float
            scale = {"frequency": modes.frequency.max(), "damping_ratio": 1.0, "eigenvalue": 1e3}.get(
                name, 1.0
            )
            error = np.abs(found - np.array([kind(x) for x in exact])).max()
            assert error <= 1e-11 * max(
                np.abs(found).max(), 1e-3 * scale / (abs(float(value)) or SIZE_OF_ZERO)
            ), name


def test_damped_shapes_solve_the_equation_with_derivatives() -> None:
    """d[(lambda^2 M + lambda C + K) x] = 0 and d[x^T (2 lambda M + C) x] = 0, by dual numbers on random machines."""
    for seed in range(6):
        machine = random_machine(seed, carriages=2)
        to = ["links.*.damping", "links.*.point", "body.inertia", "body.mass", "links.*.stiffness"]
        one = VariedMachine(machine, to).at()
        modes, f = one.modes(), one.free
        m, c, k = (getattr(one, name)[np.ix_(f, f)] for name in ("mass", "damping", "stiffness"))
        for j, (s, x) in enumerate(zip(modes.eigenvalue, modes.damped_shape[:, f], strict=True)):
            size = np.abs(k @ x).max()
            assert np.abs((s**2 * m + s * c + k) @ x).max() <= 1e-9 * size
            assert abs(x @ (2.0 * s * m + c) @ x - 1.0) <= 1e-9
            for p in range(len(one.columns)):
                ds, dx = modes.d_eigenvalue[p, j], modes.d_damped_shape[p, j, f]
                dm, dc, dk = (
                    getattr(one, name)[p][np.ix_(f, f)] for name in ("d_mass", "d_damping", "d_stiffness")
                )
                terms = [
                    (s**2 * m + s * c + k) @ dx,
                    (s**2 * dm + s * dc + dk) @ x,
                    ds * (2.0 * s * m + c) @ x,
                ]
                scale = max(np.abs(term).max() for term in terms)
                assert np.abs(sum(terms)).max() <= 1e-8 * max(scale, np.abs(k @ dx).max())
                change = 2.0 * dx @ (2.0 * s * m + c) @ x + x @ (2.0 * ds * m + 2.0 * s * dm + dc) @ x
                assert abs(change) <= 1e-8 * max(1.0, np.abs(dx @ (2.0 * s * m + c) @ x))


def test_equal_frequencies_split_along_each_column() -> None:
    """m = 100 kg on k = 1e6 N/m along y and along z: along k_y alone one frequency rises, the other stays."""
    links = [("y", (0.0, 1.0, 0.0), 1e6, 100.0), ("z", (0.0, 0.0, 1.0), 1e6, 100.0)]
    modes = VariedMachine(translating(100.0, links), ["links[y].stiffness", "body.mass"]).at().modes()
    f = np.sqrt(1e4) / (2.0 * np.pi)
    assert modes.repeated == ((0, 1),)
    assert np.allclose(modes.d_frequency, [[0.0, f / 2e6], [-f / 200.0] * 2], rtol=1e-12, atol=1e-20)
    assert np.isnan(modes.d_shape).all() and np.isnan(modes.d_damping_ratio).all()
    assert "modes 1, 2 have one frequency, 15.9155 Hz" in modes.reasons[0]
    # Damped: lambda^2 + lambda c/m + k/m = 0 for both.
    s = modes.eigenvalue[0]
    slopes = np.array([-1.0, s**2 * 0.0]) / (2.0 * s * 100.0 + 100.0)
    assert np.allclose(sorted(np.abs(modes.d_eigenvalue[0])), sorted(np.abs(slopes)), rtol=1e-9, atol=1e-18)


def test_critical_damping_has_no_derivative() -> None:
    links = [("y", (0.0, 1.0, 0.0), 1e6, 2e4)]  # b = 2 sqrt(k m)
    modes = VariedMachine(translating(100.0, links), ["body.mass"]).at().modes()
    assert np.isnan(modes.d_eigenvalue).all()
    assert modes.reasons
    assert np.isfinite(modes.d_frequency).all()


def test_response_is_that_of_the_program_and_its_derivative_that_of_50_digits() -> None:
    machine = paper().model_copy(update={"points": ()})
    varied, hertz = (
        VariedMachine(machine, ["carriages[1a].stiffness_y", "body.center_of_mass.x"]),
        [7.0, 23.0],
    )
    one, at = varied.at(), (0.3, -0.2, 0.1)
    for point in (None, at):
        q, d_q = one.response(hertz, point, (0.0, 1.0, 0.0) if point else (1.0, 0.0, 0.0))
        for k, column in enumerate(varied.columns):
            with mpmath.workdps(DIGITS):
                step = STEP * mpf(column.value)
                ends = [with_value(machine, column.name, mpf(column.value) + side * step) for side in (1, -1)]
                for i, f in enumerate(hertz):
                    high, low = (precise_response(end, f, point) for end in ends)
                    exact = np.array([complex(x) for x in (high - low) / (2 * step)])
                    close(d_q[i, k, 3:], exact, 1e-12)
                    close(q[i, 3:], np.array([complex(x) for x in low]), 1e-12)
    with_point = Machine(**machine.model_dump() | {"points": [{"name": "tip", "at": at}]})
    q = one.response(hertz)[0]
    theirs = frequency_response(with_point, hertz).displacement[:, 0]
    assert np.allclose(q[:, :3] + np.cross(q[:, 3:], at), theirs, rtol=1e-11)


def precise_response(machine: Machine, hertz: float, point: Any) -> Any:
    mass, damping, stiffness = matrices_of(machine, all_dofs=True)
    force = -mass[:, 0]
    if point is not None:
        force = mpmath.matrix([0, 1, 0, -mpf(point[2]), 0, mpf(point[0])])
    w = 2 * mpmath.pi * mpf(hertz)
    return mpmath.lu_solve((stiffness + 1j * w * damping - w**2 * mass)[3:, 3:], force[3:])


# ---- one body on one link of every law, hung along y

Force = Callable[[Any, dict[str, Any]], Any]


def preloaded(d: Any, keys: dict[str, Any]) -> Any:
    n = {"ball": mpf(3) / 2, "roller": mpf(10) / 9}[keys["rolling"]]
    d0 = 2 * n * keys["preload"] / keys["stiffness"]
    return keys["preload"] / d0**n * (max(d0 + d, 0) ** n - max(d0 - d, 0) ** n)


LAWS: dict[str, tuple[dict[str, Any], Force]] = {
    "linear": ({"stiffness": 2e7}, lambda d, k: k["stiffness"] * d),
    "clear": (
        {"stiffness": 2e7, "clearance": 4e-6},
        lambda d, k: k["stiffness"] * (d + k["clearance"]),  # it hangs at d < 0
    ),
    "sides": (
        {"stiffness": {"positive": 1e7, "negative": 3e7}, "clearance": 2e-6},
        lambda d, k: k["stiffness.negative"] * (d + k["clearance"]),
    ),
    "balls": ({"stiffness": 2e7, "preload": 900.0, "rolling": "ball"}, preloaded),
    "open": ({"stiffness": 2e7, "preload": 200.0, "rolling": "ball"}, preloaded),
    "rollers": ({"stiffness": 2e7, "preload": 900.0, "rolling": "roller"}, preloaded),
    "curve": (
        {"curve": ((0.0, 0.0), (1e-5, 100.0), (5e-5, 2e3))},
        lambda d, k: k["curve.scale"] * (-100 - mpf(1900) / mpf("4e-5") * (-d - mpf("1e-5"))),
    ),
}


@pytest.mark.parametrize("law", LAWS)
def test_every_law_in_50_digits(law: str) -> None:
    """Static position, load and frequency of a hanging mass by every parameter of its law."""
    keys, force = LAWS[law]
    machine = one_mass(100.0, damping=100.0, **keys)
    values = {key: value for key, value in keys.items() if isinstance(value, float)}
    if isinstance(keys.get("stiffness"), dict):
        values |= {f"stiffness.{side}": value for side, value in keys["stiffness"].items()}
    if law == "curve":
        values["curve.scale"] = 1.0
    varied = VariedMachine(machine, ["body.mass", "gravity.y", *(f"links[spring].{key}" for key in values)])
    one = varied.at()
    modes = one.modes()
    names = {key: mpf(value) for key, value in values.items()}
    with mpmath.workdps(50):

        def solve(mass: Any, gravity: Any, numbers: dict[str, Any]) -> list[Any]:
            given = {**keys, **numbers}
            start = [mpf(one.static_position[1]), mpf(one.static_position[1]) * (1 + mpf(10) ** -6)]
            d = mpmath.findroot(lambda d: force(d, given) - mass * gravity, start, tol=1e-80)
            slope = mpmath.diff(lambda d: force(d, given), d, h=mpf(10) ** -25, direction=0)
            return [d, mass * gravity, mpmath.sqrt(slope / mass) / (2 * mpmath.pi)]

        mass, gravity = mpf(100), mpf(machine.gravity[1])
        for k, column in enumerate(varied.columns):
            step = mpf(10) ** -12 * abs(mpf(column.value))
            ends = []
            for side in (1, -1):
                moved = mpf(column.value) + side * step
                key = column.name.rpartition("].")[2]
                numbers = names | ({key: moved} if key in names else {})
                ends.append(
                    solve(
                        moved if key == "body.mass" else mass,
                        moved if key == "gravity.y" else gravity,
                        numbers,
                    )
                )
            exact = np.array([float((a - b) / (2 * step)) for a, b in zip(*ends, strict=True)])
            mine = np.array(
                [one.d_static_position[k, 1], one.d_static_link_loads[k, 0], modes.d_frequency[k, 0]]
            )
            size = np.array([one.static_position[1], one.static_link_loads[0], modes.frequency[0]])
            assert (np.abs(mine - exact) <= 1e-11 * np.maximum(np.abs(exact), abs(size / column.value))).all()


# ---- values, groups, refusals


def test_values_are_those_of_a_machine_built_with_them() -> None:
    varied = VariedMachine(cart(), {"k": "carriages.*.stiffness_y", "m": "body.mass"})
    assert [column.name for column in varied.columns] == ["k", "m"]
    one = varied.at([9e7, 1100.0])
    mass = body(mass=1100.0)
    built = Machine(**cart(stiffness_y=9e7).model_dump() | {"body": mass.model_dump()})
    assert np.array_equal(one.stiffness, built.scene.matrices()[0][2])
    assert np.allclose(one.static_link_loads, built.scene.static_link_loads(), rtol=1e-12)


def test_numbers_that_vary_together_have_the_sum_of_their_derivatives() -> None:
    alone = VariedMachine(cart(), "carriages.*.stiffness_y").at()
    together = VariedMachine(cart(), {"k": "carriages.*.stiffness_y"}).at()
    factor = VariedMachine(cart(), {"k": ["carriages.*.stiffness", "carriages[1a].damping_y"]}).at()
    assert (together.columns[0].form, factor.columns[0].form) == ("value", "factor")
    close(together.d_stiffness[0], alone.d_stiffness.sum(axis=0), 1e-14)
    close(factor.d_stiffness[0], cart().scene.matrices()[0][2], 1e-14)


def test_what_has_no_derivative_is_refused_with_the_reason() -> None:
    with pytest.raises(ArgumentError, match="another derivative to either side"):
        VariedMachine(one_mass(100.0, stiffness=1e7), "links[spring].clearance").at()
    weightless = one_mass(100.0, gravity=0.0, stiffness=1e7, clearance=1e-6)
    with pytest.raises(ArgumentError, match="loose within its clearance"):
        VariedMachine(weightless, "body.mass").at()
    sides = one_mass(100.0, gravity=0.0, stiffness={"positive": 1e7, "negative": 2e7})
    with pytest.raises(ArgumentError, match="has a kink"):
        VariedMachine(sides, "body.mass").at()
    with pytest.raises(SceneError, match="mass"):
        VariedMachine(cart(), "body.mass").at([-1.0])
    with pytest.raises(ArgumentError, match="expected 1 finite numbers"):
        VariedMachine(cart(), "body.mass").at([1.0, 2.0])
    with pytest.raises(ArgumentError, match="to: expected a known path"):
        VariedMachine(cart(), "body.weight")
    with pytest.raises(ArgumentError, match="to: k: expected paths, got none"):
        VariedMachine(cart(), {"m": "body.mass", "k": []})
    for wrong in (
        [[np.nan]],
        [[1.0], (0.0, 1.0)],
        [[1.0], None, (1.0, 0.0)],
        [[1.0], None, (np.inf, 0.0, 0.0)],
    ):
        with pytest.raises(ArgumentError, match="response: expected finite numbers"):
            VariedMachine(cart(), "body.mass").at().response(*wrong)
    with pytest.raises(ArgumentError, match="expected each number once"):
        VariedMachine(cart(), {"a": "body.mass", "b": "body.mass"})


@pytest.mark.parametrize("machine", [cart(), paper(), example()[0]])
def test_damping_ratios_are_those_of_the_modes(machine: Machine) -> None:
    modes = VariedMachine(machine, ["body.mass"]).at().modes()
    assert modes.damping_ratio == pytest.approx(Modes.of(machine).damping_ratio, rel=1e-9)
