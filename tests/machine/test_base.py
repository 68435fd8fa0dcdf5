"""An elastic base under all links, in series with them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from machines import having
from numpy.typing import NDArray
from reference import cart, cart_clear, cycle, on_base, preloaded, random_base

from guideload import ArgumentError, ConfigError, Machine, SceneError, simulate

Array = NDArray[np.float64]


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
    machine, compliance = cart().with_free(free), random_base()
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
    rigid, stiff = (simulate(one, cycle()) for one in (cart(), on_base(cart(), random_base(size=1e-14))))
    np.testing.assert_allclose(stiff.carriage_loads, rigid.carriage_loads, atol=1e-7)


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
        found = on_base(cart(damping), random_base()).scene.modes()[3]
        errors.append(np.abs(found - exact_eigenvalues(cart(damping), random_base(), found)).max())
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize("make", [cart_clear, preloaded])
def test_links_that_are_not_linear_are_refused(make: Any) -> None:
    with pytest.raises(SceneError, match="linear links on an elastic base.*stiffness of each carriage"):
        _ = on_base(make(), random_base()).scene


def test_impossible_bases_are_refused() -> None:
    skew, indefinite = random_base(), random_base()
    skew[0, 1] *= 2.0
    indefinite[2, 2] *= -1.0
    free_of_charge = np.zeros((6, 6))
    free_of_charge[0, 4] = free_of_charge[4, 0] = 1e-9
    for compliance, words in (
        (skew, r"symmetric matrix.*\[0\]\[1\] and \[1\]\[0\]"),
        (indefinite, "semidefinite"),
        (free_of_charge, "semidefinite"),
        (random_base()[:5], "row ux, row uy"),
        (random_base()[:, :5], r"\[ux, uy, uz, rx, ry, rz\]"),
    ):
        with pytest.raises(ConfigError, match=words):
            on_base(cart(), compliance)
    wavy = {"rms": (1e-5, 0.0), "wavelengths": (0.5, 2.0), "seed": 1}
    soft = on_base(cart(), random_base())
    soft = having(soft, rails=[having(rail, waviness=wavy) for rail in soft.rails])
    with pytest.raises(ArgumentError, match="the base is elastic"):
        simulate(soft, cycle())
