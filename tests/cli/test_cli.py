"""The command line: what it writes and prints, what it refuses, and with which exit code."""

import gc
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from guideload.base.errors import ArgumentError, RunError
from guideload.cli.inputs import EXAMPLES
from guideload.cli.main import main
from guideload.cli.outputs import FORMATS, MANIFEST, PICTURE_ENDINGS, PICTURES
from guideload.cli.terminal import status
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.reports.result import result_report
from guideload.simulation import result as results

MACHINE = str(EXAMPLES / "manipulator.toml")
LOADS = list(FORMATS.values())


@pytest.fixture
def trace(tmp_path: Path) -> str:
    """Half a second at rest, then a short move, as velocity of the cart."""
    time = np.arange(1200) * 1e-3
    velocity = 0.25 * (1 - np.cos(2 * np.pi * np.clip((time - 0.5) / 0.5, 0, 1)))
    path = tmp_path / "Spur für Wagen.csv"
    rows = (f"{t:.3f},{v:.5f}\n" for t, v in zip(time, velocity, strict=True))
    path.write_text("time_s,velocity_m_s\n" + "".join(rows), encoding="utf-8")
    return str(path)


def guideload(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments], catch_exceptions=False)


def refused(*arguments: object, code: int = 2) -> str:
    """The message of a call that must end with this code: on standard error alone, without a traceback."""
    ended = guideload(*arguments)
    assert ended.exit_code == code, ended.output
    assert ended.stdout == ""
    assert "Traceback" not in ended.stderr
    return ended.stderr


def refused_after_output(*arguments: object) -> str:
    """As `refused`, where a first part was fine and printed."""
    ended = guideload(*arguments)
    assert ended.exit_code == 2, ended.output
    return ended.stderr


def names(folder: Path) -> set[str]:
    """What is in a folder, but for the list of our files."""
    return {path.name for path in folder.iterdir()} - {MANIFEST}


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_run_writes_loads_report_and_pictures(tmp_path: Path, trace: str) -> None:
    out = tmp_path / "neue Läufe" / "eins"
    ended = guideload("run", MACHINE, trace, "-o", out)
    assert ended.exit_code == 0, ended.output
    assert names(out) == {"loads.nc", "report.txt", *PICTURES}
    assert names(out.parent) == {"eins"}  # no draft is left
    written = (out / "report.txt").read_text(encoding="utf-8")
    assert written.strip() in ended.stdout
    loaded = results.Result.load(out / "loads.nc")
    assert loaded.machine == Machine.from_toml(MACHINE)
    assert ended.stderr == ""


@pytest.mark.parametrize("file_format", FORMATS)
def test_formats_read_back(tmp_path: Path, trace: str, file_format: str) -> None:
    out = tmp_path / "out"
    assert (
        guideload("run", MACHINE, trace, "-o", out, "--no-pictures", "--format", file_format).exit_code == 0
    )
    assert not any(name.endswith(".png") for name in names(out))
    loaded = results.Result.load(out / FORMATS[file_format])
    assert loaded.data.sizes["time"] == 1200


def test_options_reach_the_run(tmp_path: Path, trace: str) -> None:
    run = ("run", MACHINE, trace, "--no-pictures", "-o")
    assert (
        guideload(*run, tmp_path / "a", "--free", "rx, ry,rz", "--method", "rk45", "--rtol", "1e-4").exit_code
        == 0
    )
    attrs = results.Result.load(tmp_path / "a" / "loads.nc").data.attrs
    assert (attrs["free"], attrs["method"], attrs["rtol"]) == ("rx ry rz", "rk45", 1e-4)
    assert guideload(*run, tmp_path / "b", "--method", "implicit", "--step", "5e-4").exit_code == 0
    assert results.Result.load(tmp_path / "b" / "loads.nc").data.attrs["step_s"] == 5e-4


def test_reading_options_reach_the_trace(tmp_path: Path) -> None:
    bare = tmp_path / "bare.csv"
    bare.write_text(
        "a,b\n" + "".join(f"{i},{1000 * np.sin(i / 50):.3f}\n" for i in range(500)), encoding="utf-8"
    )
    options = ("--column", "b", "--unit", "mm/s", "--kind", "velocity", "--rate", "500")
    ended = guideload("check", MACHINE, bare, *options, "--smoothing", "savitzky_golay", "--window", "0.05")
    assert ended.exit_code == 0, ended.output
    assert "500 samples, every 2 ms" in ended.stdout
    told = guideload("check", MACHINE, bare, *options[:-1], "0.5 kHz", "--max-speed", "2 m/s", "--allow-gaps")
    assert "500 samples, every 2 ms" in told.stdout


def test_output_is_not_overwritten_unless_asked(tmp_path: Path, trace: str) -> None:
    out = tmp_path / "out"
    run = ("run", MACHINE, trace, "-o", out)
    assert guideload(*run, "--format", "csv").exit_code == 0
    (out / "notes.txt").write_text("mine")
    before = {path: path.read_bytes() for path in out.iterdir()}
    assert "is not empty" in refused(*run)
    assert {path: path.read_bytes() for path in out.iterdir()} == before
    assert guideload(*run, "--overwrite", "--no-pictures").exit_code == 0
    assert names(out) == {"loads.nc", "report.txt", "notes.txt"}  # ours are replaced or gone, others stay


@pytest.fixture
def no_computation(monkeypatch: pytest.MonkeyPatch) -> None:
    def computes(*_: object, **__: object) -> None:
        raise AssertionError("computed before the output was refused")

    monkeypatch.setattr("guideload.simulation.simulation.simulate", computes)
    monkeypatch.setattr("guideload.machine.modes.Modes.of", computes)


def test_overwrite_never_takes_files_that_are_not_ours(
    tmp_path: Path, trace: str, no_computation: None
) -> None:
    mine = tmp_path / "loads.csv"
    mine.write_bytes(Path(trace).read_bytes())
    before = contents(tmp_path)
    run = ("run", MACHINE, mine, "-o", tmp_path, "--overwrite", "--no-pictures", "--format", "csv")
    assert f"{mine} was not written by an earlier run" in refused(*run)
    assert contents(tmp_path) == before


def test_overwrite_leaves_files_of_ours_names_that_it_does_not_need(tmp_path: Path, trace: str) -> None:
    for name in ("loads.csv", "scene.png"):
        (tmp_path / name).write_text("mine")
    run = ("run", MACHINE, trace, "-o", tmp_path, "--overwrite", "--no-pictures")
    assert guideload(*run).exit_code == 0
    assert guideload(*run).exit_code == 0  # the second time over our own files
    assert {name: (tmp_path / name).read_text() for name in ("loads.csv", "scene.png")} == {
        "loads.csv": "mine",
        "scene.png": "mine",
    }
    assert {"loads.nc", "report.txt"} < names(tmp_path)


def test_a_list_of_other_files_is_not_believed(tmp_path: Path, trace: str) -> None:
    out = tmp_path / "out"
    run = ("run", MACHINE, trace, "-o", out, "--overwrite", "--no-pictures")
    assert guideload(*run).exit_code == 0
    (out / "notes.txt").write_text("mine")
    (tmp_path / "above.txt").write_text("mine")
    with (out / MANIFEST).open("a") as file:
        file.write("notes.txt\n../above.txt\n")
    assert guideload(*run).exit_code == 0
    assert (out / "notes.txt").exists() and (tmp_path / "above.txt").exists()
    (out / MANIFEST).write_text("a list of somebody else\nloads.nc\n")
    assert f"{out / MANIFEST} was not written" in refused(*run)


def test_overwrite_never_takes_the_input(tmp_path: Path, trace: str) -> None:
    out = tmp_path / "out"
    assert guideload("run", MACHINE, trace, "-o", out, "--no-pictures", "--format", "csv").exit_code == 0
    before = contents(out)
    for file_format in ("csv", "netcdf"):  # replaced, and removed
        run = ("run", MACHINE, out / "loads.csv", "-o", out, "--overwrite", "--format", file_format)
        assert f"{out / 'loads.csv'} is read by this run" in refused(*run)
    assert contents(out) == before


def test_demo_leaves_the_files_of_a_run(tmp_path: Path, trace: str) -> None:
    out = tmp_path / "out"
    assert guideload("run", MACHINE, trace, "-o", out, "--no-pictures").exit_code == 0
    before = contents(out)
    assert guideload("demo", "-o", out, "--overwrite", "--no-pictures").exit_code == 0
    assert before.items() < contents(out).items()
    (out / "paper" / MANIFEST).unlink()
    assert f"{out / 'paper' / 'loads.nc'} was not" in refused("demo", "-o", out, "--overwrite")


def test_outputs_that_cannot_be_are_refused_before_any_work(
    tmp_path: Path, trace: str, no_computation: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("mine")
    before = contents(tmp_path)
    for below in ("sub", "sub/sub"):
        out = tmp_path / "file" / below
        message = refused("run", MACHINE, trace, "-o", out)
        assert message == f"Error: {out}: {tmp_path / 'file'} is a file, not a folder\n"
        assert "is a file, not a folder" in refused("modes", MACHINE, "-o", out.with_suffix(".png"))
        assert "is a file, not a folder" in refused("init", out.with_suffix(".toml"))

    def read_only(*_: object, **__: object) -> None:  # root may write anywhere, so no mode bits here
        raise PermissionError(13, "Permission denied", "/tmp/.draft-x")

    monkeypatch.setattr("tempfile.TemporaryDirectory", read_only)
    monkeypatch.setattr(Path, "touch", read_only)
    for command in (("run", MACHINE, trace, "-o", out := tmp_path / "a" / "b"), ("demo", "-o", out)):
        assert refused(*command) == f"Error: {out}: cannot be written: Permission denied\n"
    picture = tmp_path / "x.png"
    message = refused("modes", MACHINE, "-o", picture)
    assert message == f"Error: {picture}: cannot be written: Permission denied\n"
    assert contents(tmp_path) == before
    assert not (tmp_path / "a").exists()


def test_the_folder_that_one_stands_in_stays(
    tmp_path: Path, trace: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("here").mkdir()
    monkeypatch.chdir("here")
    assert guideload("run", MACHINE, trace, "-o", ".", "--no-pictures").exit_code == 0
    assert names(Path.cwd()) == {"loads.nc", "report.txt"}


def test_an_empty_folder_may_be_written(tmp_path: Path, trace: str) -> None:
    (tmp_path / "out").mkdir()
    assert guideload("run", MACHINE, trace, "-o", tmp_path / "out", "--no-pictures").exit_code == 0


def test_a_failure_on_the_way_leaves_nothing(
    tmp_path: Path, trace: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError("no space left on device")

    before = names(tmp_path)
    monkeypatch.setattr(results.Result, "to_netcdf", full)
    assert "no space left on device" in refused("run", MACHINE, trace, "-o", tmp_path / "out", code=1)
    assert names(tmp_path) == before


def test_a_failed_run_is_exit_code_1(tmp_path: Path, trace: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise RunError("step 3.1e-14 s at t = 0.42 s is below rounding")

    monkeypatch.setattr("guideload.simulation.simulation.simulate", fails)
    message = refused("run", MACHINE, trace, "-o", tmp_path / "out", code=1)
    assert message == "Error: step 3.1e-14 s at t = 0.42 s is below rounding\n"
    assert not (tmp_path / "out").exists()


def test_a_refused_argument_is_exit_code_2(
    tmp_path: Path, trace: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuses(*_: object, **__: object) -> None:
        raise ArgumentError("rtol: expected a number above 1e-14")

    monkeypatch.setattr("guideload.simulation.simulation.simulate", refuses)
    message = refused("run", MACHINE, trace, "-o", tmp_path / "new" / "out")
    assert message == "Error: rtol: expected a number above 1e-14\n"
    assert not (tmp_path / "new").exists()


def test_bad_machines_are_exit_code_2(tmp_path: Path, trace: str) -> None:
    text = Path(MACHINE).read_text(encoding="utf-8")
    bad = tmp_path / "bad.toml"
    bad.write_text(
        text.replace('"1250 kg"', '"-1250 kg"').replace("stiffness_y", "stifness_y", 1), encoding="utf-8"
    )
    for command in (("check", bad), ("modes", bad), ("run", bad, trace, "-o", tmp_path / "out")):
        message = refused(*command)
        assert "body.mass" in message and "-1250 kg" in message  # all that is wrong, not the first alone
        assert "stifness_y" in message
    bad.write_text("name = [", encoding="utf-8")
    assert str(bad) in refused("check", bad)
    assert "missing.toml" in refused("check", tmp_path / "missing.toml")
    assert not (tmp_path / "out").exists()


def test_an_unsupported_body_is_exit_code_2_and_named(tmp_path: Path, trace: str) -> None:
    text = Path(MACHINE).read_text(encoding="utf-8")
    loose = tmp_path / "loose.toml"
    loose.write_text(text.replace('free = ["y"', 'free = ["x", "y"'), encoding="utf-8")
    for command in (("check", loose), ("modes", loose), ("run", loose, trace, "-o", tmp_path / "out")):
        assert f"{loose}: the body is not supported" in refused(*command)
    message = refused("run", MACHINE, trace, "-o", tmp_path / "out", "--free", "x,y")
    assert f"{MACHINE} with --free x,y: the body is not supported" in message


def test_bad_traces_are_exit_code_2(tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text(
        "time_s,velocity_m_s\n" + "".join(f"{i * 1e-3:.3f},0.1\n" for i in (*range(30), 7)), encoding="utf-8"
    )
    out = tmp_path / "out"
    assert "bad.csv" in refused("run", MACHINE, bad, "-o", out)
    assert "bad.csv" in refused_after_output("check", MACHINE, bad)
    assert "missing.csv" in refused("run", MACHINE, tmp_path / "missing.csv", "-o", out)
    assert "is a folder" in refused("run", MACHINE, tmp_path, "-o", out)
    assert "no column 'speed'" in refused_after_output("check", MACHINE, bad, "--column", "speed")
    assert not out.exists()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--method", "euler"), "euler"),
        (("--rtol", "0"), "--rtol"),
        (("--rtol", "small"), "--rtol"),
        (("--step", "-1"), "--step"),
        (("--step", "1e-3"), "--step is for --method rk45 and implicit"),
        (("--rtol", "nan"), "--rtol"),
        (("--step", "inf"), "--step"),
        (("--free", "y,roll"), '--free: expected one or more of x,y,z,rx,ry,rz, each once, got "y,roll"'),
        (("--free", "y,y"), "--free"),
        (("--free", ""), '--free: expected one or more of x,y,z,rx,ry,rz, each once, got ""'),
        (("--max-speed", "-1"), "max_speed: expected > 0 m/s, got -1"),
        (("--max-speed", "nan"), "max_speed"),
        (("--rate", "nan"), "rate"),
        (("--format", "xlsx"), "xlsx"),
        (("--smoothing", "none"), "none"),
        (("--kind", "torque"), "torque"),
    ],
)
def test_bad_options_are_exit_code_2(tmp_path: Path, trace: str, options: tuple[str, str], said: str) -> None:
    assert said in refused("run", MACHINE, trace, "-o", tmp_path / "out", *options)
    assert not (tmp_path / "out").exists()


def test_output_that_is_a_file_is_refused(trace: str) -> None:
    assert "is a file" in refused("run", MACHINE, trace, "-o", trace)


def test_init_writes_a_machine_that_checks(tmp_path: Path) -> None:
    path = tmp_path / "Maschine.toml"
    assert guideload("init", path).exit_code == 0
    ended = guideload("check", path)
    assert ended.exit_code == 0, ended.output
    assert "supported in every free dof" in ended.stdout
    before = path.read_bytes()
    assert "exists" in refused("init", path)
    assert path.read_bytes() == before
    nowhere = tmp_path / "no folder"
    assert f"{nowhere / 'm.toml'}: there is no folder {nowhere}" in refused("init", nowhere / "m.toml")


def test_check_tells_what_was_understood(trace: str) -> None:
    text = guideload("check", MACHINE, trace).stdout
    for said in (
        "mass 1250 kg",
        "16 links",
        "weight 12258 N",
        "supported",
        "1200 samples",
        "column velocity_m_s",
    ):
        assert said in text


def test_modes_prints_and_draws(tmp_path: Path) -> None:
    picture = tmp_path / "modes.svg"
    ended = guideload("modes", MACHINE, "-o", picture)
    assert ended.exit_code == 0, ended.output
    lowest = Modes.of(Machine.from_toml(MACHINE)).frequency[0]
    assert f"{lowest:.4g}" in ended.stdout
    assert b"<svg" in picture.read_bytes()
    assert "exists" in refused("modes", MACHINE, "-o", picture)
    assert guideload("modes", MACHINE, "-o", picture, "--overwrite").exit_code == 0
    for name in ("modes.bmp", "modes"):
        message = refused("modes", MACHINE, "-o", tmp_path / name)
        assert f"{tmp_path / name}: expected a name that ends in .png, .svg, .pdf" in message
    nowhere = tmp_path / "no folder"
    assert f"there is no folder {nowhere}" in refused("modes", MACHINE, "-o", nowhere / "m.png")
    assert names(tmp_path) == {"modes.svg"}
    machine = tmp_path / "machine.svg"
    machine.write_bytes(Path(MACHINE).read_bytes())
    assert "is read by this run" in refused("modes", machine, "-o", machine, "--overwrite")


@pytest.mark.parametrize("ending", PICTURE_ENDINGS)
def test_every_ending_that_is_named_works(tmp_path: Path, ending: str) -> None:
    assert guideload("modes", MACHINE, "-o", tmp_path / f"modes{ending}").exit_code == 0
    assert names(tmp_path) == {f"modes{ending}"}


def test_demo_shows_that_the_papers_dofs_hide_the_weight(tmp_path: Path) -> None:
    ended = guideload("demo", "-o", tmp_path / "demo", "--no-pictures")
    assert ended.exit_code == 0, ended.output
    assert names(tmp_path / "demo") == {"guides", "paper"}
    weights = {}
    for run in ("guides", "paper"):
        assert names(tmp_path / "demo" / run) == {"loads.nc", "report.txt"}
        loaded = results.Result.load(tmp_path / "demo" / run / "loads.nc")
        weights[run] = float(loaded.data["static_force"].sel(axis="y").sum())
    assert weights["guides"] == pytest.approx(-12258.3, abs=0.1)
    assert weights["paper"] == pytest.approx(0, abs=1e-6)
    assert "free y, z, rx, ry, rz" in ended.stdout and "free rx, ry, rz" in ended.stdout
    assert "constraint at L carries the weight: 12258 N" in " ".join(ended.stdout.split())
    assert "not empty" in refused("demo", "-o", tmp_path / "demo")


@pytest.mark.parametrize(
    ("file", "options"),
    [
        ("emps_bangbang_1kHz.csv", ()),
        (
            "michigan_cnc_experiment_01.csv",
            ("--column", "X1_ActualVelocity", "--unit", "mm/s", "--rate", "10"),
        ),
    ],
)
def test_real_traces_run(shared_data: Path, tmp_path: Path, file: str, options: tuple[str, ...]) -> None:
    ended = guideload("run", MACHINE, shared_data / file, "-o", tmp_path / "out", "--no-pictures", *options)
    assert ended.exit_code == 0, ended.output
    assert file in ended.stdout


def test_a_real_trace_with_bad_rows_is_refused(shared_data: Path) -> None:
    file = shared_data / "michigan_cnc_experiment_18.csv"
    command = ("check", MACHINE, file, "--column", "X1_ActualVelocity", "--unit", "mm/s", "--rate", "10")
    message = refused_after_output(*command)
    assert "rows 22, 73, 83" in message
    assert "--no-cross-check" in message  # the way out that the message names is there
    assert guideload(*command, "--no-cross-check").exit_code == 0


def modules_after(code: str) -> set[str]:
    """Names of the modules that a fresh interpreter has loaded after running `code`."""
    script = f"import sys\n{code}\nprint(*sys.modules)"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(ended.stdout.splitlines()[-1].split())


def test_help_loads_no_heavy_module() -> None:
    loaded = modules_after("from guideload.cli.main import main\nmain(['--help'], standalone_mode=False)")
    assert not loaded & {
        "numpy",
        "pydantic",
        "pint",
        "xarray",
        "pandas",
        "scipy",
        "matplotlib",
        "pyarrow",
        "rich",
    }


def test_a_run_without_pictures_loads_neither_matplotlib_nor_the_arrays_of_dask(
    tmp_path: Path, trace: str
) -> None:
    arguments = ["run", MACHINE, trace, "-o", str(tmp_path / "out"), "--no-pictures"]
    loaded = modules_after(f"from guideload.cli.main import main\nmain({arguments!r}, standalone_mode=False)")
    assert "numpy" in loaded and not loaded & {"matplotlib", "dask.array"}


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_any_terminal_encoding_will_do(tmp_path: Path, encoding: str) -> None:
    machine = tmp_path / "m.toml"
    text = Path(MACHINE).read_text(encoding="utf-8").replace("Clamping-frames", "Spannrahmen für Ωμέγα")
    machine.write_text(text, encoding="utf-8")
    ended = CliRunner(charset=encoding).invoke(main, ["check", str(machine)], catch_exceptions=False)
    assert ended.exit_code == 0
    assert "Spannrahmen f" in ended.stdout


@pytest.mark.parametrize("encoding", ["ascii", "utf-8"])
def test_a_run_tells_its_report_in_the_encoding_of_the_terminal(
    tmp_path: Path, trace: str, encoding: str
) -> None:
    arguments = ["run", MACHINE, trace, "-o", str(tmp_path / "out"), "--no-pictures"]
    ended = CliRunner(charset=encoding).invoke(main, arguments, catch_exceptions=False)
    loaded = results.Result.load(tmp_path / "out" / "loads.nc")
    assert ended.stdout.startswith(result_report(loaded, encoding=encoding))
    assert (tmp_path / "out" / "report.txt").read_text(encoding="utf-8") == result_report(loaded)


def test_a_run_leaves_the_search_for_garbage_as_it_was(tmp_path: Path, trace: str) -> None:
    for given, code in ((trace, 0), (tmp_path / "none.csv", 2)):
        ended = guideload("run", MACHINE, given, "-o", tmp_path / "out", "--no-pictures", "--overwrite")
        assert ended.exit_code == code and gc.isenabled()


def test_progress_stays_off_where_nobody_watches() -> None:
    with status("anything") as shown:
        assert shown is None
