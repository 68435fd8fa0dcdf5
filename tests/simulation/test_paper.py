"""The paper's corrections and narrowness (model.md, section 4), and the balance of forces and moments."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import reference as ref
from numpy.typing import NDArray
from reference import DOFS

from guideload import Body, Link, Machine, Motion, Result, simulate

Array = NDArray[np.float64]
GUIDES = ("y", "z", "rx", "ry", "rz")
MASS, GRAVITY = 1250.0, 9.80665
CENTER_OF_MASS = np.array([0.12, -0.65, 0.18])


def rest(machine: Machine) -> Result:
    """One second in which nothing moves."""
    return simulate(machine, Motion.along_x([0.0, 1.0], [0.0, 0.0]))


# ---- 1: gravity points down


@pytest.mark.parametrize("down", [(0.0, -GRAVITY, 0.0), (0.0, GRAVITY, 0.0)])
def test_a_hung_body_sags_by_its_weight_over_the_sum_of_the_stiffnesses(
    down: tuple[float, float, float],
) -> None:
    stiffness = [1e6, 2e6, 5e6]
    links = [
        Link(name=f"{i}", point=(x, 0.4, 0.1), direction=(0, 1, 0), stiffness=k, damping=1e3)
        for i, (x, k) in enumerate(zip([-0.5, 0.0, 0.7], stiffness, strict=True))
    ]
    data = rest(Machine(body=ref.body(), links=links, free=("y",), gravity=down)).data
    sag = MASS * down[1] / sum(stiffness)
    assert data["static_displacement"].sel(dof="y").item() == pytest.approx(sag, rel=1e-14)
    assert data["displacement"].sel(dof="y").values == pytest.approx(sag, rel=1e-14)
    # The load is what the body exerts on its links: along the weight, shared as the stiffnesses.
    shares = MASS * down[1] * np.array(stiffness) / sum(stiffness)
    assert data["static_link_load"].values == pytest.approx(shares, rel=1e-14)


# ---- 2: the static moment balance has stiffness where eq. 24 prints damping


def test_the_static_position_knows_no_damping() -> None:
    soft, stiff = rest(ref.cart()).data, rest(ref.cart_stiff()).data
    for name in ("static_displacement", "static_force", "static_link_load", "static_reaction"):
        assert np.array_equal(soft[name].values, stiff[name].values)


def test_link_moments_balance_the_moment_of_the_weight_about_the_reference_point() -> None:
    """Sum k_i P_i Omega_i P_i phi = -m g R_S g_S in the paper's dofs: eq. 24 corrected."""
    machine = ref.paper()
    data, table = rest(machine).data, machine.link_table()
    phi = data["static_displacement"].values[3:]
    moment = np.zeros(3)
    for p, o, k in zip(table.points, table.directions, table.stiffness, strict=True):
        moment += k * np.cross(p, o) * (o @ np.cross(phi, p))
    weight = np.cross(CENTER_OF_MASS, [0.0, -MASS * GRAVITY, 0.0])
    assert moment == pytest.approx(weight, rel=1e-13, abs=1e-10)


# ---- 4: the paper's dofs hide the weight


@pytest.mark.parametrize("machine", [ref.paper(), ref.example()[0]], ids=["paper", "example"])
def test_the_paper_s_dofs_show_no_weight_on_the_guides_and_all_other_dofs_show_all_of_it(
    machine: Machine,
) -> None:
    """0 N and 12 258 N."""
    hidden, carried = (rest(machine.with_free(free)).data for free in (("rx", "ry", "rz"), GUIDES))
    assert carried.attrs["free"] == " ".join(GUIDES)
    sums = [float(data["static_force"].sel(axis="y").sum()) for data in (hidden, carried)]
    assert abs(sums[0]) < 1e-9
    assert round(sums[1]) == -12258
    assert sums[1] == pytest.approx(-MASS * GRAVITY, rel=1e-14)
    # Held y bears what the guides do not.
    assert hidden["static_reaction"].sel(dof="y").item() == pytest.approx(MASS * GRAVITY, rel=1e-14)
    assert carried["static_reaction"].sel(dof="y").item() == 0.0


# ---- 5: summing the ends of a guide hides the pitch moment


def test_the_pitch_moment_shows_in_links_and_moments_and_not_in_sums() -> None:
    """Each link moves by 1556 N, the carriage sums by 1.8 N (yardstick)."""
    data = simulate(ref.paper(), ref.cycle()).data
    along_y = [i for i, name in enumerate(data["link"].values) if name.endswith("y")]
    links = np.abs(data["link_load"].values - data["static_link_load"].values)[:, along_y].max()
    sums = np.abs(data["force"].values - data["static_force"].values)[:, :, 1:].max()
    assert links == pytest.approx(1556.0, abs=0.5)
    assert sums == pytest.approx(1.8, abs=0.05)


@pytest.mark.parametrize("free", [("rx", "ry", "rz"), GUIDES])
def test_the_moments_of_the_carriages_carry_m_a_h(free: tuple[str, ...]) -> None:
    """Under a steady a the carriages' moments about z change by m a y_S (the inertia -m a acts at y_S)."""
    machine, a = ref.paper(free), 2.2
    data = simulate(machine, Motion.along_x([0.0, 1.0, 3.0], [0.0, a, a])).data
    moment = (data["moment"].values - data["static_moment"].values)[-1, :, 2].sum()
    assert moment == pytest.approx(MASS * a * CENTER_OF_MASS[1], rel=1e-9)
    force = (data["force"].values - data["static_force"].values)[-1, :, 1].sum()
    assert abs(force) < 1e-6 * MASS * a


# ---- the balance


def without_rails() -> tuple[Machine, Motion]:
    machine = ref.random_machine(31, free=DOFS)
    return machine, ref.random_motion(31, wrench=True, times="ticks", jumps=True)


def mixed(free: tuple[str, ...]) -> tuple[Machine, Motion]:
    """Carriages, extra links, three axes, forces, jumps."""
    machine = ref.random_machine(32, free=free, carriages=3)
    return machine, ref.random_motion(32, wrench=True, times="ticks", jumps=True)


def stiff_as_rock() -> tuple[Machine, Motion]:
    machine = Machine(
        body=Body(mass=3.0, center_of_mass=(0.01, 0.2, 0.0), inertia=np.diag([0.1, 0.12, 0.09])),
        links=[
            Link(name=f"{axis}{side}", point=point, direction=direction, stiffness=1e9, damping=1e2)
            for axis, direction, arm in (("x", (1, 0, 0), 1), ("y", (0, 1, 0), 2), ("z", (0, 0, 1), 0))
            for side in (-1, 1)
            for point in [tuple(0.3 * side * float(i == arm) for i in range(3))]
        ],
        free=DOFS,
    )
    return machine, ref.random_motion(33)


BALANCED: dict[str, Callable[[], tuple[Machine, Motion]]] = {
    "cart": lambda: (ref.cart(), ref.noisy()),
    "cart_stiff": lambda: (ref.cart_stiff(), ref.noisy()),
    "paper": lambda: (ref.paper(), ref.cycle()),
    "paper, all that guides carry": lambda: (ref.paper(GUIDES), ref.cycle()),
    "example": ref.example,
    "mixed, all free": lambda: mixed(DOFS),
    "mixed, x and ry held": lambda: mixed(("y", "z", "rx", "rz")),
    "mixed, rotations held": lambda: mixed(("x", "y", "z")),
    "without rails": without_rails,
    "stiff and light": stiff_as_rock,
}


def on_body(result: Result, motion: Motion) -> dict[str, Array]:
    """Every force and moment about L on the body, (time, 6), from public quantities of the result."""
    data, machine = result.data, result.machine
    mass, _, _, weight, rows = ref.matrices(machine)
    force, moment = data["force"].values, data["moment"].values
    about_l = np.concatenate([force, moment + np.cross(machine.carriage_centers, force)], axis=2)
    extra = np.flatnonzero(machine.link_table().carriage < 0)
    total = data["acceleration"].values.copy()
    total[:, :3] += data["cart_acceleration"].values
    nothing = np.zeros_like(total)
    return {
        "guides": -about_l.sum(axis=1),
        "extra links": -data["link_load"].values[:, extra] @ rows[extra],
        "reaction": data["reaction"].values,
        "weight": nothing + weight,
        "wrench": data["wrench"].values if motion.wrench is not None else nothing,
        "inertia": -total @ mass,
    }


@pytest.mark.parametrize("method", ["exact", "rk45", "implicit"])
@pytest.mark.parametrize("name", BALANCED)
def test_loads_and_reactions_balance_inertia_and_weight_at_every_sample(name: str, method: Any) -> None:
    """To 1e-12 of the largest force and of the largest moment, in all six rows."""
    machine, motion = BALANCED[name]()
    if method != "exact":
        motion = ref.piece(motion, 0, 700)
    result = simulate(machine, motion, method, times=motion.time)
    assert np.array_equal(result.data["time"].values, motion.time)
    parts = on_body(result, motion)
    rest_of_it = np.abs(sum(parts.values()))
    errors = [
        rest_of_it[:, rows].max() / max(np.abs(part[:, rows]).max() for part in parts.values())
        for rows in (slice(0, 3), slice(3, 6))
    ]
    print(f"\n{name}, {method}: force {errors[0]:.1e}, moment {errors[1]:.1e}", end="")
    assert max(errors) <= 1e-12
    # Held dofs stand still, free ones have no reaction.
    held = np.array([dof not in machine.free for dof in DOFS])
    assert not result.data["reaction"].values[:, ~held].any()
    for quantity in ("displacement", "velocity", "acceleration"):
        assert not result.data[quantity].values[:, held].any()


def test_the_drive_force_moves_the_mass() -> None:
    """With x held and no load along x, F_x = m a + coupling of the rotations: at rest in rotation, m a."""
    data = simulate(ref.cart(), Motion.along_x([0.0, 1.0, 3.0], [0.0, 2.2, 2.2])).data
    assert data["reaction"].sel(dof="x").values[-1] == pytest.approx(MASS * 2.2, rel=1e-9)
