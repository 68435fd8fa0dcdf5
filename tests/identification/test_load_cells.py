"""Load cells and strain gauges: the loads of a run, exact derivatives, known values and an unknown gain found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hammer_tests import derivative_errors, unknown
from motor_records import SOFT_TABLES, axis, moves, shown_by, soft_axis

from guideload import Link, Machine, Motion, simulate
from guideload.base.errors import ArgumentError, ConfigError, ValueRefused
from guideload.identification import UnknownTable, identify
from guideload.identification.model import COMPONENTS, Model, parse_load_place, parse_place
from guideload.identification.sensor_log import Channel, SensorLog
from guideload.identification.tables import SensorLogTable

GEOMETRY = (
    UnknownTable(path="carriages.*.length", spread=0.1),
    UnknownTable(path="rails[1].position.y", spread=0.01),
    UnknownTable(path="links[strut].stiffness"),
    UnknownTable(path="links[strut].point.x", spread=0.01),
)
DELAY, GAIN, OFFSET = 3.25, -2.5e-6, 0.4


def machine_with(stiffness: float = 1.0, damping: float = 1.0) -> Machine:
    """The soft axis on a rail that is turned, with a strut across."""
    strut = Link(
        name="strut", point=(0.05, 0.1, 0.2), direction=(0.0, 0.6, 0.8), stiffness=5e6, damping=300.0
    )
    rail = {"name": "1", "position": [0.0, 0.0], "roll": 0.3}
    return soft_axis(stiffness, damping, links=[strut], rails=[rail])


def cells(machine: Machine, *places: str) -> list[Channel]:
    return [Channel(parse_load_place(place, machine), "load") for place in places]


@pytest.fixture(scope="module")
def motion() -> Motion:
    return moves(2.0)


def test_cells_show_the_loads_of_a_run(motion: Motion) -> None:
    """Force and moment of a carriage in its own axes, and the load of a link, from their values at rest."""
    machine = machine_with()
    result = simulate(machine, motion)
    loads = np.hstack([result.carriage_loads[:, 1, 1:], result.quantities["link_load"][:, -1:]])
    channels = cells(machine, *(f"b {one}" for one in COMPONENTS[1:]), "strut")
    for shown, load in zip(shown_by(machine, motion, channels, motion.time).T, loads.T, strict=True):
        assert shown == pytest.approx(load - load[0], abs=1e-9 * abs(loads).max())


def test_derivatives_are_exact(motion: Motion) -> None:
    """Against central differences, by laws and places of carriages and links, gain and delay."""
    machine = machine_with()
    channels = [
        *cells(machine, "a Fy", "b Mz"),
        Channel(parse_load_place("strut", machine), "load", None, np.inf),
    ]
    time, model = np.arange(0.1, 1.9, 2e-3), Model(machine, unknown(machine, *SOFT_TABLES, *GEOMETRY))
    values = np.random.default_rng(0).standard_normal((time.size, 3))
    data = SensorLog.of(machine, motion, channels, time, values, one_clock=True)
    z, nuisance = np.array([0.1, -0.2, 0.05, 0.01, 0.3, 0.02]), np.array([0.1, 0.2, 0.3, 2.0])
    errors, own = derivative_errors(data, model, z, nuisance, 1e-6, np.ones(4))
    assert errors.max() < 2e-6 and own.max() < 1e-9


def test_a_strain_gauge_without_calibration_tells_stiffness_and_damping(motion: Motion) -> None:
    """Its gain, with its sign, and the delay are found as well. Alone in another clock it is refused."""
    true, machine = machine_with(1.2, 0.6), machine_with()
    time = np.arange(0.1, 1.9, 1.0 / 870.0)
    channels = [replace(*cells(machine, "a Fy"), gain_spread=np.inf), Channel(parse_place("tool x", machine))]
    shown = [GAIN, 1.0] * shown_by(true, motion, channels, time) + [OFFSET, 0.0]
    data = SensorLog.of(machine, motion, channels, time + DELAY, shown)
    found = identify(machine, SOFT_TABLES, [data], starts=1)
    assert [one.value for one in found.estimates] == pytest.approx([1.2e7, 0.6e3], rel=1e-4)
    assert found.nuisance_values(found.data[0])[[0, 2, 3]] == pytest.approx([OFFSET, GAIN, DELAY], rel=1e-4)
    with pytest.raises(ArgumentError, match="unknown gain alone do not tell the delay"):
        SensorLog.of(machine, motion, channels[:1], time + DELAY, shown[:, :1])


def test_tables_of_load_cells(motion: Motion) -> None:
    """A gauge's column has any unit; places that do not exist, and loads that are always 0, are refused."""
    machine = machine_with()
    with pytest.raises(ValueRefused, match='a carriage and a component of its load, or a link.*"a Fx"'):
        parse_load_place("a Fx", machine)
    plain = {"trace": "none.csv", "channels": [{"column": "e", "place": "a Fy", "kind": "load"}]}
    (cell,) = SensorLogTable(**plain).channels
    assert cell.channel(machine).unit == "N"
    (gauge,) = SensorLogTable(**{**plain, "channels": [{**plain["channels"][0], "gain": "unknown"}]}).channels
    assert (gauge.channel(machine).unit, gauge.channel(machine).gain_spread) == ("1", np.inf)
    both = {**plain["channels"][0], "gain": "unknown", "gain_spread": 0.1}
    with pytest.raises(ConfigError, match='no gain_spread beside gain = "unknown"'):
        SensorLogTable(**{**plain, "channels": [both]})
    narrow = axis()
    parts = tuple(one.model_copy(update={"width": None}) for one in narrow.carriages)
    wide = axis(carriages=[*parts, parts[0].model_copy(update={"name": "c", "width": 0.06, "x": 0.0})])
    time, values = np.arange(0.1, 1.9, 2e-3), np.random.default_rng(0).standard_normal((900, 1))
    with pytest.raises(ArgumentError, match="load of a Mx is 0 in this machine whatever it does"):
        SensorLog.of(wide, motion, cells(wide, "a Mx"), time, values)
