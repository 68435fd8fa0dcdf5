"""The machine file with identified values, wherever the old file has the number or takes it from."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from hammer_tests import deflections, unknown

from guideload import Machine
from guideload.identification import UnknownTable, identify
from guideload.identification.model import Model
from guideload.identification.written_files import machine_text

TEXT = """rails = [{ name = "1", position = ["50 mm", "-350 mm"] }, { name = "2", position = ["50 mm", "350 mm"] }]
[body]
mass = "1250 kg"   # weighed
center_of_mass = ["120 mm", "-650 mm", "180 mm"]
inertia = [[420, 15, -8], [15, 310, 22], [-8, 22, 380]]
[carriage_types.t]
length = "120 mm"
stiffness_y = "120 N/um"
stiffness_z = 120e6
damping_y = "100 kN s/m"
damping_z = "100 kN s/m"
[[carriages]]
name = "1a"
type = "t"
rail = "1"
x = "-500 mm"
[[carriages]]
name = "1b"
type = "t"
rail = "1"
x = "500 mm"
stiffness_y = "150 N/um"
[[carriages]]
name = "2a"
type = "t"
rail = "2"
x = "-500 mm"
[[riders]]
name = "slide"
mass = "20 kg"
center_of_mass = [0, 0, 0]
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
direction = [0, 0, 1]
motion = "slide.toml"
[[points]]
name = "p"
at = [0.3, 0.2, 0.4]
"""
TABLES = (
    UnknownTable(path="carriages.*.stiffness_y"),
    UnknownTable(path="carriages.*.stiffness_z"),
    UnknownTable(path="body.inertia.xy", spread="20 kg m^2"),
    UnknownTable(path="body.center_of_mass.y", spread="20 mm"),
)


def test_the_file_gives_the_identified_machine(tmp_path: Path) -> None:
    """Values of a type, of inline tables, inside vectors and matrices, with units and without; comments are kept."""
    source = tmp_path / "machine.toml"
    source.write_text(TEXT.replace("\n", "\r\n"), encoding="utf-8", newline="")
    machine = Machine.from_toml(source)
    tables = [*TABLES, UnknownTable(path='rails["2"].position.z', spread="5 mm")]
    tables.append(UnknownTable(path='carriages["2a"].x', spread="5 mm"))
    model, truth = Model(machine, unknown(machine, *tables)), np.array([-0.2, 0.3, 0.0, 0.0, 0.0, 0.0])
    data = deflections(model, truth, [("p y", "p y"), ("p z", "p z")], noise=1e-3)
    found = identify(machine, tables, [data], starts=1)
    assert pickle.loads(pickle.dumps(found)).table().equals(found.table())
    text = machine_text(found, source, tmp_path / "new")
    after = Machine.from_text(text, tmp_path / "new" / "after.toml")
    assert after.riders[0].motion == "../slide.toml"
    assert "# weighed\r\n" in text and text.count("\r\n") == text.count("\n")
    assert text.count("from static") == 6 and text.count("NOT identified by static") == 4
    for one, other in zip(after.carriages, found.machine.carriages, strict=True):
        assert one.stiffness_y == pytest.approx(other.stiffness_y, rel=1e-5)
        assert one.stiffness_z == pytest.approx(other.stiffness_z, rel=1e-5)
    assert after.carriages[1].stiffness_y == pytest.approx(1.25 * after.carriages[0].stiffness_y, rel=1e-5)
    assert after.carriages[2].x == pytest.approx(found.machine.carriages[2].x, rel=1e-5)
    assert after.rails[1].position == pytest.approx(found.machine.rails[1].position, rel=1e-5)
    assert np.array(after.body.inertia) == pytest.approx(np.array(found.machine.body.inertia), rel=1e-5)
    assert after.body.center_of_mass == pytest.approx(found.machine.body.center_of_mass, rel=1e-5)
