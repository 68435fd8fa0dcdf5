"""Results: labels, units, parts, peaks and files; which modules are imported; the stubs."""

from __future__ import annotations

import ast
import inspect
import json
import pickle
from collections.abc import Callable
from functools import cache
from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import Any

import h5netcdf
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import pytest
import reference as ref
import xarray as xr
from xarray.backends import H5NetCDFStore

import guideload
from guideload import (
    ArgumentError,
    Carriage,
    GuideloadError,
    Link,
    Machine,
    Motion,
    Rail,
    ReadError,
    Result,
    simulate,
)
from guideload import _core as core
from guideload.base.netcdf import LENGTH

WRITERS = {"nc": Result.to_netcdf, "parquet": Result.to_parquet}


@cache
def cart_result() -> Result:
    return simulate(ref.cart(), ref.piece(ref.noisy(), 500, 900))


def rich_machine() -> Machine:
    """Extra links, names that are awkward in files, a rail without carriages."""
    whole = {"length": 0.1, "stiffness_y": 1.2e8, "stiffness_z": 9e7, "damping_y": 1e5, "damping_z": 3e4}
    return Machine(
        name='größe, "A"',
        body=ref.body(),
        rails=[
            Rail(name=name, position=(0.05, z)) for name, z in (("l,1", -0.3), ('r "2"', 0.4), ("spare", 1.0))
        ],
        carriages=[
            Carriage(name="front, left", rail="l,1", x=-0.5, **whole),
            Carriage(name="rear [left]", rail="l,1", x=0.5, **whole),
            Carriage(name="右", rail='r "2"', x=0.1, **whole),
        ],
        links=[Link(name="rack", point=(0, 0.01, 0), direction=(1, 0, 0.2), stiffness=8e7, damping=2e4)],
        free=ref.DOFS,
    )


@cache
def rich_result() -> Result:
    """Everything that a result can hold, and a jump."""
    rng = np.random.default_rng(3)
    time = np.concatenate([np.arange(40) * 1e-3, 0.039 + np.arange(60) * 1.5e-3])  # 0.039 s stands twice
    assert np.count_nonzero(np.diff(time) == 0.0) == 1
    speed = rng.normal(size=100)
    motion = Motion(
        time,
        rng.normal(size=(100, 3)),
        velocity=rng.normal(size=(100, 3)),
        position=rng.normal(size=(100, 3)),
        wrench=100.0 * rng.normal(size=(100, 6)),
        motor_speed=speed,
        source="made up, ümlaut",
        notes=("first note", "second; with\ttab"),
    )
    return simulate(rich_machine(), motion, "rk45", step=5e-4)


# ---- labels, units, parts


LABELS = {
    "carriage": ["front, left", "rear [left]", "右"],
    "rail": ["l,1", 'r "2"', "spare"],
    "link": list(rich_machine().link_table().names),
    "axis": ["x", "y", "z"],
    "dof": list(ref.DOFS),
}
SIX = {unit: ", ".join([unit] * 3 + [unit.replace("m", "rad")] * 3) for unit in ("m", "m/s", "m/s^2")}
WRENCH = "N, N, N, N m, N m, N m"
# Dimensions beside time, and units; static values, parts and rails have the same.
QUANTITIES = {
    "peak_force": (("carriage", "axis"), "N"),
    "peak_moment": (("carriage", "axis"), "N m"),
    "peak_resultant": (("carriage",), "N"),
    "time_of_peak": (("carriage",), "s"),
    "peak_dynamic_resultant": (("carriage",), "N"),
    "peak_dynamic_moment": (("carriage",), "N m"),
    "force": (("carriage", "axis"), "N"),
    "moment": (("carriage", "axis"), "N m"),
    "resultant": (("carriage",), "N"),
    "link_load": (("link",), "N"),
    "cart_acceleration": (("axis",), "m/s^2"),
    "cart_velocity": (("axis",), "m/s"),
    "cart_position": (("axis",), "m"),
    "motor_speed": ((), "rad/s"),
    "time": ((), "s"),
    "displacement": (("dof",), SIX["m"]),
    "velocity": (("dof",), SIX["m/s"]),
    "acceleration": (("dof",), SIX["m/s^2"]),
    "reaction": (("dof",), WRENCH),
    "wrench": (("dof",), WRENCH),
}


def test_every_quantity_has_its_labels_unit_and_a_name_in_words() -> None:
    data = rich_result().data
    assert {name: data[name].values.tolist() for name in LABELS} == LABELS
    assert QUANTITIES.keys() <= set(data.variables)
    for name, quantity in data.variables.items():
        if name in LABELS:
            continue
        text = str(name).removeprefix("static_").removesuffix("_elastic").removesuffix("_damping")
        dims, units = QUANTITIES[text.removeprefix("rail_")]
        if "rail_" in text:
            dims = ("rail", "axis")
        of_a_run = "static_" in str(name) or "peak" in str(name)
        assert quantity.dims == (dims if of_a_run else ("time", *dims)), name
        # One unit, as UDUNITS and pint read it; along the dofs they differ, and `units` would be misread.
        expected = {"units_of_dofs": units} if "dof" in dims else {"units": units}
        assert quantity.attrs == {**expected, "long_name": quantity.attrs["long_name"]}, name
    one = data["force"].sel(carriage="rear [left]", axis="z").values
    assert np.array_equal(one, data["force"].values[:, 1, 2])


def test_attributes_tell_what_was_run() -> None:
    data = rich_result().data
    machine = rich_machine()
    expected = {
        "method": "rk45",
        "free": "x y z rx ry rz",
        "step_s": 5e-4,
        "motion_source": "made up, ümlaut",
    }
    assert expected.items() <= data.attrs.items()
    assert data.attrs["motion_notes"] == "first note\nsecond; with\ttab"
    assert machine.name in data.attrs["title"]
    assert data.attrs["program"].startswith("guideload ")
    assert data.attrs["steps"] > data.sizes["time"]
    assert json.loads(data.attrs["machine"])["name"] == machine.name


@pytest.mark.parametrize("make", [cart_result, rich_result])
def test_a_run_starts_from_its_static_parts(make: Callable[[], Result]) -> None:
    data = make().data
    for name in ("force", "moment", "link_load", "displacement"):
        assert np.array_equal(data[name].values[0], data[f"static_{name}"].values)
    assert not data["velocity"].values[0].any()
    assert not data["force_damping"].values[0].any()


@pytest.mark.parametrize("make", [cart_result, rich_result])
def test_carriages_are_sums_of_their_links_and_rails_of_their_carriages(make: Callable[[], Result]) -> None:
    result = make()
    data, machine = result.data, result.machine
    table, centers = machine.link_table(), machine.carriage_centers
    load = data["link_load"].values[:, :, None]
    for i in range(len(machine.carriages)):
        of = table.carriage == i
        force = load[:, of] * table.directions[of]
        moment = np.cross(table.points[of] - centers[i], force).sum(axis=1)
        assert np.abs(data["force"].values[:, i] - force.sum(axis=1)).max() <= 1e-14 * np.abs(load).max()
        assert np.abs(data["moment"].values[:, i] - moment).max() <= 1e-14 * np.abs(load).max()
    for i, rail in enumerate(machine.rails):
        of = [j for j, carriage in enumerate(machine.carriages) if carriage.rail == rail.name]
        force = data["force"].values[:, of].sum(axis=1)
        assert np.abs(data["rail_force"].values[:, i] - force).max() <= 1e-14 * np.abs(load).max()
        moment = data["moment"].values[:, of].sum(axis=1)
        if of:
            arms = centers[of] - centers[of].mean(axis=0)
            moment = moment + np.cross(arms, data["force"].values[:, of]).sum(axis=1)
        assert np.abs(data["rail_moment"].values[:, i] - moment).max() <= 1e-13 * np.abs(load).max()


def test_plain_arrays_and_resultant() -> None:
    result = cart_result()
    loads, data = result.carriage_loads, result.data
    assert np.array_equal(loads[:, :, :3], data["force"].values)
    assert np.array_equal(loads[:, :, 3:], data["moment"].values)
    assert data["resultant"].values == pytest.approx(np.hypot(loads[:, :, 1], loads[:, :, 2]), rel=1e-15)


def test_the_motion_is_in_the_result_as_it_was_given() -> None:
    data = rich_result().data
    rng = np.random.default_rng(3)
    assert np.array_equal(data["motor_speed"].values, rng.normal(size=100))
    for name in ("cart_acceleration", "cart_velocity", "cart_position"):
        assert np.array_equal(data[name].values, rng.normal(size=(100, 3)))
    assert np.array_equal(data["wrench"].values, 100.0 * rng.normal(size=(100, 6)))


def test_derivatives_fit_together() -> None:
    """Displacement, velocity, acceleration of L are derivatives of each other: trapezoids of short steps."""
    motion = ref.piece(ref.cycle(), 560, 760)
    times = np.linspace(motion.time[0], motion.time[-1], 4001)
    data = simulate(ref.cart(), motion, times=times).data
    h = np.diff(times)[:, None]
    for low, high in (("displacement", "velocity"), ("velocity", "acceleration")):
        rates = data[high].values
        moved = np.cumsum(0.5 * h * (rates[1:] + rates[:-1]), axis=0)
        change = data[low].values[1:] - data[low].values[0]
        assert (
            np.abs(moved - change).max() <= 2e-3 * np.abs(change).max()
        )  # (omega h)^2 / 12 of the fast modes


# ---- files


def whole_seconds_and_zeros() -> Result:
    return simulate(ref.cart(), Motion.along_x([0.0, 1.0, 2.0], [0.0, 0.0, 0.0]))


def without_carriages() -> Result:
    return simulate(ref.random_machine(3, free=ref.DOFS), ref.random_motion(3))


def at_given_times() -> Result:
    return simulate(ref.cart(), Motion.along_x([0.0, 1.0, 2.0], [0.0, 1.0, 0.0]), times=[0.5, 1.5])


@pytest.mark.parametrize("ending", WRITERS)
@pytest.mark.parametrize(
    "make", [cart_result, rich_result, whole_seconds_and_zeros, without_carriages, at_given_times]
)
def test_files_read_back_bit_by_bit(make: Callable[[], Result], ending: str, tmp_path: Path) -> None:
    result = make()
    path = str(tmp_path / f"loads.{ending}")
    WRITERS[ending](result, path)
    again = Result.load(path)
    assert again.data.identical(result.data)
    for name, quantity in result.data.variables.items():
        if quantity.dtype.kind == "f":
            other = again.data.variables[name]
            assert other.dtype == np.float64, name
            assert other.values.tobytes() == np.ascontiguousarray(quantity.values).tobytes(), name
    assert again.machine == result.machine
    assert again.modes.frequency.tolist() == result.modes.frequency.tolist()
    if result.machine.carriages:
        pd.testing.assert_frame_equal(again.peaks(), result.peaks(), check_exact=True)
    if ending == "parquet":  # a file of a file is the same; of netCDF: the next test but one
        again.to_parquet(tmp_path / "second.parquet")
        assert Result.load(tmp_path / "second.parquet").data.identical(result.data)


@pytest.mark.parametrize("make", [cart_result, rich_result, without_carriages])
def test_csv_and_json_hold_every_number(make: Callable[[], Result], tmp_path: Path) -> None:
    result = make()
    result.to_csv(tmp_path / "loads.csv")
    table = pyarrow.csv.read_csv(tmp_path / "loads.csv").to_pandas()
    rest = json.loads((tmp_path / "loads.json").read_text(encoding="utf-8"))
    columns = 1  # the time
    for name, (dims, values, attrs) in result.quantities.variables.items():
        if dims == (name,):
            assert name == "time" or rest["labels"][name] == values.tolist(), name
            continue
        assert rest["quantities"][name]["attributes"] == attrs, name
        if "time" not in dims:
            assert rest["quantities"][name]["values"] == values.tolist(), name
            continue
        there = [column for column in table if column == name or column.startswith(f"{name}[")]
        np.testing.assert_array_equal(table[there], values.reshape(len(values), -1), err_msg=name)
        columns += len(there)
    assert columns == len(table.columns)
    np.testing.assert_array_equal(table["time"], result.quantities["time"])
    assert rest["attributes"] == result.quantities.attrs


def foreign(path: Path) -> None:
    """A sound file of its kind that guideload did not write."""
    if path.suffix == ".parquet":
        pyarrow.parquet.write_table(pa.table({"time": [0.0, 1.0]}), path)
    else:
        xr.Dataset({"load": ("time", [1.0, 2.0])}).to_netcdf(path, engine="h5netcdf")


def halved(path: Path) -> None:
    """A file of guideload's that was cut off."""
    WRITERS[path.suffix[1:]](cart_result(), path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])


def without_columns(path: Path) -> None:
    """A file of guideload's from which someone removed columns, or attributes."""
    WRITERS[path.suffix[1:]](cart_result(), path)
    if path.suffix == ".parquet":
        table = pyarrow.parquet.read_table(path)
        pyarrow.parquet.write_table(table.select(table.column_names[:5]), path)
    else:
        xr.load_dataset(path, engine="h5netcdf").drop_attrs().to_netcdf(path, engine="h5netcdf")


def another_machine(path: Path) -> None:
    """A file whose machine was edited into one that cannot be."""
    result = Result(cart_result().machine, cart_result().data.copy())
    values = json.loads(result.data.attrs["machine"])
    values["body"]["mass"] = -1.0
    result.data.attrs["machine"] = json.dumps(values)
    WRITERS[path.suffix[1:]](result, path)


@pytest.mark.parametrize("instants", [None, []])
def test_a_netcdf_file_is_byte_for_byte_what_xarray_writes(
    tmp_path: Path, instants: list[float] | None
) -> None:
    result = simulate(rich_machine(), ref.piece(ref.noisy(), 500, 900), times=instants)
    result.to_netcdf(tmp_path / "ours.nc")
    theirs = BytesIO()
    with h5netcdf.File(theirs, "w") as file:
        result.data.dump_to_store(H5NetCDFStore(file))
    ours = (tmp_path / "ours.nc").read_bytes()
    assert ours.startswith(theirs.getvalue()) and len(ours) == len(theirs.getvalue()) + LENGTH
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "ours.nc"), result.data)
    again = Result.load(tmp_path / "ours.nc")
    again.to_netcdf(tmp_path / "again.nc")
    xr.testing.assert_identical(Result.load(tmp_path / "again.nc").data, again.data)


NO_RESULTS: dict[str, Callable[[Path], object]] = {
    "foreign": foreign,
    "halved": halved,
    "without columns": without_columns,
    "another machine": another_machine,
    "junk": lambda path: path.write_bytes(b"\x00\xff\xfejunk\n" * 20),
    "empty": Path.touch,
    "nothing": lambda path: None,
    "folder": Path.mkdir,
}


@pytest.mark.parametrize(
    ("name", "ending"), [*((name, ending) for name in NO_RESULTS for ending in WRITERS), ("junk", "csv")]
)
def test_what_is_no_result_is_refused_by_name(name: str, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"loads.{ending}"
    NO_RESULTS[name](path)
    with pytest.raises(ReadError) as caught:
        Result.load(path)
    assert str(path) in str(caught.value)
    assert "expected" in str(caught.value)


# ---- peaks


def test_peaks_are_those_of_plain_numpy() -> None:
    """Of given instants; without these they are a little larger."""
    result = simulate(ref.cart(), ref.cycle(), times=ref.cycle().time[:-1])
    loads, table = result.carriage_loads, result.peaks()
    time = result.data["time"].values
    static = loads[0]
    across = np.sqrt(loads[:, :, 1] ** 2 + loads[:, :, 2] ** 2)
    dynamic = loads - static
    assert table.index.tolist() == result.data["carriage"].values.tolist()
    expected = {
        "peak_resultant_N": across.max(axis=0),
        "time_of_peak_s": time[across.argmax(axis=0)],
        "static_resultant_N": np.sqrt(static[:, 1] ** 2 + static[:, 2] ** 2),
        "dynamic_resultant_N": np.sqrt(dynamic[:, :, 1] ** 2 + dynamic[:, :, 2] ** 2).max(axis=0),
        "dynamic_moment_Nm": np.sqrt((dynamic[:, :, 3:] ** 2).sum(axis=2)).max(axis=0),
    }
    expected |= {f"peak_F{axis}_N": np.abs(loads[:, :, i]).max(axis=0) for i, axis in enumerate("xyz")}
    expected |= {f"peak_M{axis}_Nm": np.abs(loads[:, :, 3 + i]).max(axis=0) for i, axis in enumerate("xyz")}
    assert table.columns.tolist() == list(expected)
    for name, values in expected.items():
        assert table[name].to_numpy() == pytest.approx(values, rel=1e-12, abs=1e-9), name
    at_any_time = simulate(ref.cart(), ref.cycle()).peaks().drop(columns=["time_of_peak_s"])
    at_instants = table[at_any_time.columns]
    assert ((at_any_time >= (1.0 - 1e-12) * at_instants) & (at_any_time <= 1.1 * at_instants)).all(axis=None)
    assert (at_any_time["peak_resultant_N"] > (1.0 + 1e-6) * at_instants["peak_resultant_N"]).all()


# ---- nothing that is passed in is kept


def test_altering_what_was_passed_in_changes_no_result() -> None:
    source = ref.piece(ref.noisy(), 500, 700)
    time, acceleration = source.time.copy(), source.acceleration.copy()
    wrench, times = np.ones((200, 6)), np.linspace(0.5, 0.69, 50)
    motion = Motion(time, acceleration, wrench=wrench)
    result, at_times = simulate(ref.cart(), motion), simulate(ref.cart(), motion, times=times)
    for array in (time, acceleration, wrench, times):
        array[:] = -7.0
    fresh = Motion(source.time, source.acceleration, wrench=np.ones((200, 6)))
    assert result.data.identical(simulate(ref.cart(), fresh).data)
    assert at_times.data.identical(simulate(ref.cart(), fresh, times=np.linspace(0.5, 0.69, 50)).data)


def test_arrays_of_any_layout_give_the_same() -> None:
    motion = ref.piece(ref.noisy(), 500, 700)
    columns = np.asfortranarray(motion.acceleration)
    wide = np.repeat(np.repeat(motion.acceleration, 2, axis=0), 2, axis=1)[::2, ::2]
    expected = simulate(ref.cart(), motion).carriage_loads
    for acceleration in (columns, wide, motion.acceleration.tolist()):
        again = Motion(motion.time.tolist(), acceleration)
        assert np.array_equal(simulate(ref.cart(), again).carriage_loads, expected)
    times = np.repeat(motion.time, 2)[::2]
    assert simulate(ref.cart(), motion, times=times).data.sizes["time"] == 200


def test_the_core_takes_no_array_in_the_wrong_order() -> None:
    motion, scene = ref.piece(ref.noisy(), 500, 700), ref.cart().scene
    columns = np.asfortranarray(motion.acceleration)
    with pytest.raises(ValueError, match="acceleration: expected a C-contiguous array"):
        scene.solve(motion.time, columns, method="exact", rtol=1e-6)


# ---- the package


def test_every_public_name_resolves() -> None:
    assert guideload.__all__ == sorted(guideload.__all__)
    for name in guideload.__all__:
        public = getattr(guideload, name)
        home = public.__name__ if isinstance(public, ModuleType) else public.__module__
        assert home.startswith("guideload.") and public.__doc__, name
    assert set(guideload.__all__) <= set(dir(guideload))
    with pytest.raises(AttributeError, match="Simulate"):
        guideload.Simulate  # noqa: B018


def arguments(function: ast.FunctionDef) -> list[str]:
    names = [argument.arg for argument in function.args.args] + ["*"] * bool(function.args.kwonlyargs)
    return names + [argument.arg for argument in function.args.kwonlyargs]


def arguments_of(function: Any) -> list[str]:
    names: list[str] = []
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY and "*" not in names:
            names.append("*")
        names.append(parameter.name)
    return names


def test_the_stubs_are_the_exports() -> None:
    """Names, arguments and their order; mypy.stubtest would take ten times as long as all of this file."""
    tree = ast.parse((Path(guideload.__file__).parent / "_core.pyi").read_text(encoding="utf-8"))
    stubs = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    public = {name for name in dir(core) if not name.startswith("_")}
    assert public == stubs.keys()
    for name, node in stubs.items():
        export = getattr(core, name)
        if isinstance(node, ast.FunctionDef):
            assert arguments_of(export) == arguments(node), name
            continue
        members = {item.name: item for item in node.body if isinstance(item, ast.FunctionDef)}
        exported = {member for member in vars(export) if not member.startswith("_")}
        assert exported == members.keys() - {"__new__"}, name
        for member, stub in members.items():
            what = vars(export).get(member)
            decorators = [
                decorator.id for decorator in stub.decorator_list if isinstance(decorator, ast.Name)
            ]
            if decorators == ["staticmethod"]:
                assert isinstance(what, staticmethod), member
                assert arguments_of(getattr(export, member)) == arguments(stub), f"{name}.{member}"
            elif decorators == ["property"]:
                assert inspect.isgetsetdescriptor(what), member
            elif member == "__new__":
                assert arguments_of(export) == arguments(stub)[1:], name
            else:
                assert arguments_of(what) == arguments(stub), f"{name}.{member}"


def test_loads_cannot_be_changed_behind_their_labels() -> None:
    result = simulate(ref.cart(), ref.piece(ref.cycle(), 550, 600))
    with pytest.raises(ValueError, match="read-only"):
        result.carriage_loads[:] = 0.0
    for each in (result, pickle.loads(pickle.dumps(result))):
        arrays = [each.carriage_loads, *each.peak_columns.values()]
        arrays += [one.values for one in each.quantities.variables.values()]
        assert not any(array.flags.writeable for array in arrays)
    assert isinstance(result.machine.links_of_carriages, tuple)


def test_a_result_survives_pickling() -> None:
    result = simulate(ref.cart(), ref.piece(ref.cycle(), 550, 600))
    again = pickle.loads(pickle.dumps(result))
    assert again.machine == result.machine and (again.method, again.reason) == (result.method, result.reason)
    assert again.data.identical(result.data)


def test_a_file_name_that_load_would_not_know_is_refused(tmp_path: Path) -> None:
    result = simulate(ref.cart(), ref.piece(ref.cycle(), 550, 560))
    for write, name in ((result.to_csv, "x.json"), (result.to_netcdf, "x.h5"), (result.to_parquet, "x.nc")):
        with pytest.raises(GuideloadError, match="a file name that ends in"):
            write(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_changes_of_the_data_are_written_and_their_order_of_dimensions_does_not_matter(
    tmp_path: Path,
) -> None:
    result = simulate(ref.cart(), ref.piece(ref.cycle(), 550, 600))
    result.data.attrs["title"] = "mine"
    result.data["twice"] = 2.0 * result.data["resultant"]
    result.to_netcdf(tmp_path / "loads.nc")
    data = Result.load(tmp_path / "loads.nc").data
    assert data.attrs["title"] == "mine"
    np.testing.assert_array_equal(data["twice"], 2.0 * data["resultant"])
    turned = Result(result.machine, data.transpose("dof", "axis", "link", "rail", "carriage", "time"))
    pd.testing.assert_frame_equal(turned.peaks(), result.peaks(), check_exact=True)
    assert turned.audit.lines == result.audit.lines
    np.testing.assert_array_equal(turned.carriage_loads, result.carriage_loads)


@pytest.mark.parametrize("times", [[], [0.01]])
def test_a_result_of_few_instants_is_written_and_read(times: list[float], tmp_path: Path) -> None:
    motion = ref.piece(ref.cycle(), 550, 600)
    result = simulate(ref.cart(), motion, times=motion.time[0] + np.array(times))
    for ending, write in WRITERS.items():
        write(result, tmp_path / f"few.{ending}")
        again = Result.load(tmp_path / f"few.{ending}")
        assert again.carriage_loads.shape == result.carriage_loads.shape
    result.to_csv(tmp_path / "few.csv")
    assert len(pd.read_csv(tmp_path / "few.csv")) == len(times)


def test_a_history_by_an_unknown_name_is_refused_whether_computed_or_loaded() -> None:
    result = simulate(ref.cart(), Motion.along_x([0.0, 1.0], [0.0, 1.0]))
    for each in (result, pickle.loads(pickle.dumps(result))):
        assert each.history("cart_velocity") is None and each.history("link_load") is not None
        for name in ("xx", "force"):
            with pytest.raises(ArgumentError, match="name: expected one of time, cart_position, .* got"):
                each.history(name)


@pytest.mark.parametrize("window", ["abc", np.nan, -1.0, "10 N"])
def test_a_window_that_is_none_is_named(window: float | str) -> None:
    with pytest.raises(ArgumentError, match="^window: expected a length"):
        cart_result().settling(window)


@pytest.mark.parametrize("step", [np.inf, np.nan])
def test_a_step_is_finite(step: float) -> None:
    with pytest.raises(ArgumentError, match="^step: expected a finite time > 0 s, got"):
        simulate(ref.cart(), Motion.along_x([0.0, 1.0], [0.0, 1.0]), "rk45", step=step)
