"""Carriages that resist rotations by width or stated stiffnesses: closed forms of one rail and one carriage."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from guideload.base.errors import ConfigError, SceneError
from guideload.catalogue.product import Product
from guideload.machine.components import Body, Carriage, Rail
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.motion import Motion
from guideload.simulation.peaks import peak_columns
from guideload.simulation.simulation import peak_loads, simulate
from guideload.study import Study

MASS, INERTIA = 40.0, (0.9, 1.3, 1.1)
STIFFNESS_Y, STIFFNESS_Z, DAMPING_Y, DAMPING_Z = 2.0e8, 1.5e8, 5.0e3, 4.0e3
LAW = {
    "stiffness_y": STIFFNESS_Y,
    "stiffness_z": STIFFNESS_Z,
    "damping_y": DAMPING_Y,
    "damping_z": DAMPING_Z,
}
LENGTH, WIDTH = 0.05, 0.023


def on_one_carriage(center: tuple[float, float, float] = (0.0, 0.0, 0.0), **keys: Any) -> Machine:
    """A body on one carriage of one rail, centred in L."""
    body = Body(mass=MASS, center_of_mass=center, inertia=np.diag(INERTIA))
    carriage = Carriage(**{"name": "a", "rail": "1", "x": 0.0, **LAW, **keys})
    return Machine(body=body, rails=[Rail(name="1", position=(0.0, 0.0))], carriages=[carriage])


@pytest.mark.parametrize(
    ("keys", "roll", "yaw", "pitch"),
    [
        (
            {"length": LENGTH, "width": WIDTH},
            STIFFNESS_Y * WIDTH**2 / 4.0,
            STIFFNESS_Z * LENGTH**2 / 4.0,
            STIFFNESS_Y * LENGTH**2 / 4.0,
        ),
        ({"stiffness_roll": 3e4, "stiffness_yaw": 5e4, "stiffness_pitch": 7e4}, 3e4, 5e4, 7e4),
        (
            {"length": LENGTH, "stiffness_roll": 3e4, "stiffness_yaw": 5e4},
            3e4,
            5e4,
            STIFFNESS_Y * LENGTH**2 / 4.0,
        ),
    ],
)
def test_stiffness_damping_and_modes_of_one_carriage(
    keys: dict[str, float], roll: float, yaw: float, pitch: float
) -> None:
    """K = diag(0, ky, kz, k_roll, k_yaw, k_pitch); damping has the same distances; f = sqrt(k/J)/2 pi."""
    machine = on_one_carriage(**keys)
    (_, damping, stiffness), _ = machine.scene.matrices()
    diagonal = np.array([0.0, STIFFNESS_Y, STIFFNESS_Z, roll, yaw, pitch])
    assert stiffness == pytest.approx(np.diag(diagonal), rel=1e-12, abs=1e-6)
    ratio = np.array([0.0, DAMPING_Y / STIFFNESS_Y, DAMPING_Z / STIFFNESS_Z])[[0, 1, 2, 1, 2, 1]]
    assert damping == pytest.approx(np.diag(ratio * diagonal), rel=1e-12, abs=1e-9)
    inertia = np.array([MASS, MASS, *INERTIA])
    expected = np.sort(np.sqrt(diagonal[1:] / inertia)) / (2.0 * np.pi)
    assert Modes.of(machine).frequency == pytest.approx(expected, rel=1e-12)


def test_the_weight_beside_the_rail_is_carried_as_a_roll_moment() -> None:
    """The body tilts by M/k_roll; Mx is in loads, peaks and peak_loads like the others."""
    offset = 0.08
    machine = on_one_carriage((0.0, 0.0, offset), length=LENGTH, width=WIDTH)
    time = np.linspace(0.0, 0.02, 41)
    motion = Motion.along_x(time, np.zeros(time.size))
    result = simulate(machine, motion)
    moment = MASS * 9.80665 * offset
    assert result.quantities["static_moment"][0] == pytest.approx([moment, 0.0, 0.0], rel=1e-12, abs=1e-9)
    angle = moment / (STIFFNESS_Y * WIDTH**2 / 4.0)
    assert result.quantities["static_displacement"][3] == pytest.approx(angle, rel=1e-12)
    assert peak_columns(result.quantities)["peak_Mx_Nm"] == pytest.approx(moment, rel=1e-9)
    assert peak_loads(machine, motion).largest[0, 3] == pytest.approx(moment, rel=1e-9)


@pytest.mark.parametrize(
    "law",
    [
        {"stiffness_y": 2e8, "preload_y": 2e3, "rolling": "ball"},
        {"stiffness_y": {"positive": 1.5e8, "negative": 2e8}, "clearance_y": 2e-6},
        {"stiffness_y": None, "curve_y": ((0.0, 0.0), (1e-5, 2e3), (4e-5, 4e3))},
    ],
)
def test_nonlinear_laws_have_the_roll_stiffness_at_the_nominal_stiffness(law: dict[str, Any]) -> None:
    machine = on_one_carriage(length=LENGTH, stiffness_roll=3e4, **law)
    (_, _, stiffness), _ = machine.nominal_scene.matrices()
    assert stiffness[3, 3] == pytest.approx(3e4, rel=1e-12)
    table = machine.link_table()
    whole = machine.carriages[0].laws[0].force(np.array([3e-5]))
    along_y = [
        law.force(np.array([3e-5])) for law, axis in zip(table.laws, table.axis, strict=True) if axis == 1
    ]
    assert sum(along_y) == pytest.approx(whole, rel=1e-14)


def test_one_rail_without_width_is_refused_and_width_is_the_way_out() -> None:
    with pytest.raises(SceneError, match=r"nothing resists rotation about x.*key width"):
        _ = on_one_carriage(length=LENGTH).scene


@pytest.mark.parametrize(
    ("keys", "key", "words"),
    [
        ({"length": LENGTH, "width": WIDTH, "stiffness_roll": 3e4}, "carriages[0].width", "stiffness_roll"),
        ({"length": LENGTH, "stiffness_pitch": 3e4, "stiffness_yaw": 3e4}, "carriages[0].length", "replace"),
        ({"stiffness_pitch": 3e4}, "carriages[0].length", "add the key"),
        ({"length": LENGTH, "stiffness_roll": 1e17}, "carriages[0]", "4.47e+04 m apart"),
        ({"length": LENGTH, "stiffness_roll": "30 kN m"}, "carriages[0].stiffness_roll", "N m/rad"),
        ({"length": LENGTH, "width": 0.0}, "carriages[0].width", "> 0"),
    ],
)
def test_contradictions_are_refused_with_their_key(keys: dict[str, Any], key: str, words: str) -> None:
    table = {"name": "a", "rail": "1", "x": 0.0, **LAW, **keys}
    machine = on_one_carriage(length=LENGTH)
    with pytest.raises(ConfigError) as caught:
        machine.model_copy(update={"carriages": [table]})
    assert caught.value.key == key
    assert words in str(caught.value)


def test_a_product_gives_width_by_its_row_spacing_unless_the_carriage_has_its_own() -> None:
    product = Product(
        name="p", maker="m", edition="e", type="ball", row_length=0.06, row_spacing=WIDTH, static=1e4
    )
    machine = on_one_carriage(length=LENGTH, width=WIDTH)

    def carriage(**keys: Any) -> Carriage:
        table = {"name": "a", "rail": "1", "x": 0.0, "product": "p", **LAW, **keys}
        return machine.model_copy(update={"products": [product], "carriages": [table]}).carriages[0]

    assert (carriage().width, carriage().length) == (WIDTH, 0.06 / 3.0**0.5)
    assert carriage(width=0.03).width == 0.03
    assert carriage(stiffness_roll=3e4).width is None
    assert carriage(stiffness_pitch=3e4, stiffness_yaw=3e4).length is None


def study(machine: Machine, **vary: Any) -> Any:
    time = np.linspace(0.0, 0.05, 101)
    motion = Motion.along_x(time, np.where(time < 0.02, 4.0, 0.0))
    entry = {"distribution": "uniform", "plus_minus": "20 %", **vary}
    return Study(machine=machine, motion=motion, samples=16, vary=[entry])


def test_studies_refuse_a_stiffness_on_which_a_stated_rotational_stiffness_rests() -> None:
    machine = on_one_carriage((0.01, 0.1, 0.08), length=LENGTH, stiffness_roll=3e4)
    with pytest.raises(ConfigError, match=r"takes width = 0.0244948974 \(m\) in place of stiffness_roll"):
        study(machine, path="carriages.*.stiffness_y")
    with pytest.raises(ConfigError, match=r"takes width, which can vary: stiffness_roll is"):
        study(machine, path="carriages.*.stiffness_roll")
