"""An elastic base under all links, in series with them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from reference import cart, cart_clear, cycle, preloaded

from guideload import (
    ArgumentError,
    ConfigError,
    Machine,
    Motion,
    SceneError,
    Study,
    peak_loads,
    run_study,
    simulate,
)

Array = NDArray[np.float64]


def base(seed: int = 1, size: float = 1.0) -> Array:
    """A random compliance of some micrometres per kilonewton."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(6, 6)) * np.sqrt([1e-9, 1e-9, 1e-9, 1e-8, 1e-8, 1e-8])[:, None]
    return size * root @ root.T


def on_base(machine: Machine, compliance: Any) -> Machine:
    rows = np.asarray(compliance).tolist()
    return machine.model_copy(update={"base": {"compliance": rows}})


def parts(machine: Machine) -> tuple[Array, Array, Array]:
    """Rows (link, 6), stiffness and damping (link,) of the links."""
    table = machine.link_table()
    return (
        np.hstack([table.directions, np.cross(table.points, table.directions)]),
        table.stiffness,
        table.damping,
    )


@pytest.mark.parametrize("axis", [1, 2])
def test_one_direction_is_two_springs_in_series(axis: int) -> None:
    """All carriages in parallel, then the base: 1/k = 1/k_guides + c."""
    machine = cart().with_free(["xyz"[axis]]).model_copy(update={"gravity": (0.0, 3.0, 4.0)})
    compliance = 4e-9
    soft = on_base(machine, np.diag([compliance if i == axis else 0.0 for i in range(6)]))
    series = 1.0 / (1.0 / (4 * 1.2e8) + compliance)
    sag = soft.scene.static_position()[axis]
    assert sag == pytest.approx(1250.0 * machine.gravity[axis] / series, rel=1e-13)
    assert soft.scene.modes()[0][0] == pytest.approx(np.sqrt(series / 1250.0), rel=1e-13)


@pytest.mark.parametrize("free", [("y", "z", "rx", "ry", "rz"), ("rx", "ry", "rz"), ("y", "rx")])
def test_link_loads_follow_the_compliance_of_all_links_together(free: tuple[str, ...]) -> None:
    """f = K (I + D C D' K)^-1 D q, with as many equations as links."""
    machine, compliance = cart().with_free(free), base()
    soft = on_base(machine, compliance)
    (d, k, _), q = parts(machine), soft.scene.static_position()
    loads = np.linalg.solve(np.eye(k.size) + (k[:, None] * d) @ compliance @ d.T, k * (d @ q))
    size = np.abs(loads).max()
    np.testing.assert_allclose(soft.scene.static_link_loads(), loads, atol=1e-9 * size)
    (_, _, stiffness), weight = soft.scene.matrices()
    np.testing.assert_allclose(stiffness, stiffness.T, rtol=0.0, atol=0.0)
    assert np.linalg.eigvalsh(stiffness)[0] > -1e-9 * np.abs(stiffness).max()
    held = [i for i, dof in enumerate(("x", "y", "z", "rx", "ry", "rz")) if dof not in free]
    balance = d.T @ loads - weight
    balance[held] -= soft.scene.static_reaction()[held]
    assert np.abs(balance).max() < 1e-8 * size


def test_a_base_that_hardly_gives_way_changes_nothing() -> None:
    rigid, stiff = (simulate(one, cycle()) for one in (cart(), on_base(cart(), base(size=1e-14))))
    np.testing.assert_allclose(stiff.carriage_loads, rigid.carriage_loads, atol=1e-7)


def test_peaks_are_those_at_any_time() -> None:
    """Between samples too, of single runs and of studies: largest and smallest loads, and the force of the drive."""
    machine, rng = on_base(cart(), base(3)), np.random.default_rng(2)
    time = 4e-3 * np.arange(200)
    motion = Motion.along_x(time, np.append(0.0, rng.normal(0.0, 2.0, 199)))
    dense = np.unique(np.append(time, np.linspace(0.0, time[-1], 20_001)))
    result, found = simulate(machine, motion, times=dense), peak_loads(machine, motion)
    loads = np.abs(result.carriage_loads)
    resultant, drive = (
        result.quantities["resultant"].max(axis=0),
        np.abs(result.quantities["reaction"][:, 0]).max(),
    )
    size = resultant.max()
    np.testing.assert_allclose(found.largest[:, 6], resultant, atol=1e-4 * size)
    assert (found.largest[:, 6] >= resultant * (1.0 - 1e-12)).all()
    peaks = np.maximum(np.abs(found.largest[:, :3]), np.abs(found.smallest[:, :3]))
    np.testing.assert_allclose(peaks, loads[:, :, :3].max(axis=0), atol=1e-4 * size)
    cases = {"body.mass": [machine.body.mass] * 3}
    study = run_study(Study(machine=machine, motion=motion, cases=cases, quantities=("resultant", "drive")))
    columns = [study.column(f"peak_resultant_N[{one.name}]") for one in machine.carriages]
    np.testing.assert_allclose(columns, np.repeat(found.largest[:, 6:7], 3, axis=1), rtol=1e-9)
    np.testing.assert_allclose(study.column("peak_drive_N"), drive, rtol=1e-4)


def exact_eigenvalues(machine: Machine, compliance: Array, start: Array) -> Array:
    """Eigenvalues of the body on links and massless base together, by Newton's iteration on the dynamic stiffness."""
    (d, k, b), (mass, *_) = parts(machine), machine.scene.matrices()[0]
    free = np.ix_([1, 2, 3, 4, 5], [1, 2, 3, 4, 5])

    def singular(s: complex) -> complex:
        links = (d.T * (k + s * b)) @ d
        dynamic = s**2 * mass + links @ np.linalg.inv(np.eye(6) + compliance @ links)
        return complex(np.linalg.det(dynamic[free] / 1e8))

    found = start.copy()
    for _ in range(30):
        values, nearby = (np.array([singular(s) for s in at]) for at in (found, found * (1.0 + 1e-6)))
        found -= values * found * 1e-6 / (nearby - values)
    return found


def test_dampers_on_a_base_are_right_to_first_order() -> None:
    """The error of the eigenvalues falls with the square of the damping."""
    errors = []
    for damping in (2e3, 1e3):
        found = on_base(cart(damping), base()).scene.modes()[3]
        errors.append(np.abs(found - exact_eigenvalues(cart(damping), base(), found)).max())
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize("make", [cart_clear, preloaded])
def test_links_that_are_not_linear_are_refused(make: Any) -> None:
    with pytest.raises(SceneError, match="linear links on an elastic base.*stiffness of each carriage"):
        _ = on_base(make(), base()).scene


def test_impossible_bases_are_refused() -> None:
    skew, indefinite = base(), base()
    skew[0, 1] *= 2.0
    indefinite[2, 2] *= -1.0
    free_of_charge = np.zeros((6, 6))
    free_of_charge[0, 4] = free_of_charge[4, 0] = 1e-9
    for compliance, words in (
        (skew, r"symmetric matrix.*\[0\]\[1\] and \[1\]\[0\]"),
        (indefinite, "semidefinite"),
        (free_of_charge, "semidefinite"),
        (base()[:5], "row ux, row uy"),
        (base()[:, :5], r"\[ux, uy, uz, rx, ry, rz\]"),
    ):
        with pytest.raises(ConfigError, match=words):
            on_base(cart(), compliance)
    wavy = {"rms": (1e-5, 0.0), "wavelengths": (0.5, 2.0), "seed": 1}
    soft = on_base(cart(), base())
    soft = soft.model_copy(
        update={"rails": tuple(rail.model_copy(update={"waviness": wavy}) for rail in soft.rails)}
    )
    with pytest.raises(ArgumentError, match="the base is elastic"):
        simulate(soft, cycle())
