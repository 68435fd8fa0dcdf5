"""The command line: what it writes and prints, what it refuses, and with which exit code."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from command_line import MACHINE, contents, guideload, names, refused, write_trace
from unrendered import leave_unrendered

from guideload.base.atomic import DRAFT
from guideload.base.errors import ArgumentError, RunError
from guideload.cli.main import main
from guideload.cli.outputs import FORMATS, MANIFEST, PICTURES
from guideload.cli.terminal import status
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.reports.run import result_report
from guideload.simulation.result import Result


@pytest.fixture
def trace(tmp_path: Path) -> str:
    """Half a second at rest, then a short move, as velocity of the cart."""
    return write_trace(tmp_path / "Spur für Wagen.csv", 1200, 0.5)


def test_run_writes_loads_report_and_pictures(
    tmp_path: Path, trace: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rendered pictures are in test_names.py."""
    leave_unrendered(monkeypatch)
    out = tmp_path / "neue Läufe" / "eins"
    ended = guideload("run", MACHINE, trace, "-o", out)
    assert names(out) == {"loads.nc", "report.txt", *PICTURES}
    assert names(out.parent) == {"eins"}  # no draft is left
    assert (out / "report.txt").read_text(encoding="utf-8").strip() in ended.stdout
    assert Result.load(out / "loads.nc").machine == Machine.from_toml(MACHINE)
    assert ended.stderr == ""


@pytest.mark.parametrize("file_format", FORMATS)
def test_formats_read_back(tmp_path: Path, trace: str, file_format: str) -> None:
    out = tmp_path / "out"
    guideload("run", MACHINE, trace, "-o", out, "--no-pictures", "--format", file_format)
    assert not any(name.endswith(".png") for name in names(out))
    if file_format != "csv":  # which is for other programs
        assert Result.load(out / FORMATS[file_format]).data.sizes["time"] == 1200


def test_options_reach_the_run(tmp_path: Path, trace: str) -> None:
    def attrs(*options: str) -> dict[str, object]:
        guideload("run", MACHINE, trace, "--no-pictures", "-o", tmp_path, "--overwrite", *options)
        return Result.load(tmp_path / "loads.nc").data.attrs

    first = attrs("--free", "rx, ry,rz", "--method", "rk45", "--rtol", "1e-4")
    assert (first["free"], first["method"], first["rtol"]) == ("rx ry rz", "rk45", 1e-4)
    assert attrs("--method", "implicit", "--step", "5e-4")["step_s"] == 5e-4


def test_reading_options_reach_the_trace(tmp_path: Path) -> None:
    bare = tmp_path / "bare.csv"
    bare.write_text(
        "a,b\n" + "".join(f"{i},{1000 * np.sin(i / 50):.3f}\n" for i in range(500)), encoding="utf-8"
    )
    options = ("--column", "b", "--unit", "mm/s", "--kind", "velocity", "--rate")
    for more in (
        ("500", "--smoothing", "savitzky_golay", "--window", "0.05"),
        ("0.5 kHz", "--max-speed", "2 m/s", "--allow-gaps"),
    ):
        assert "500 samples, every 2 ms" in guideload("check", MACHINE, bare, *options, *more).stdout


def test_output_is_not_overwritten_unless_asked(
    tmp_path: Path, trace: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("guideload.plots.saving.save_each", lambda _, folder: (folder / PICTURES[0]).touch())
    out = tmp_path / "out"
    run = ("run", MACHINE, trace, "-o", out)
    guideload(*run, "--format", "csv")
    (out / "notes.txt").write_text("mine")
    before = contents(out)
    assert out / PICTURES[0] in before and "is not empty" in refused(*run)
    assert contents(out) == before
    guideload(*run, "--overwrite", "--no-pictures")
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
    guideload(*run)
    guideload(*run)  # the second time over our own files
    assert all((tmp_path / name).read_text() == "mine" for name in ("loads.csv", "scene.png"))
    assert {"loads.nc", "report.txt"} < names(tmp_path)


def test_overwrite_removes_the_page_of_the_run_before(tmp_path: Path, trace: str) -> None:
    out, run = tmp_path / "out", ("run", MACHINE, trace, "--no-pictures", "-o", tmp_path / "out")
    guideload(*run, "--report", out / "gantry.html")
    (out / "mine.html").write_text("mine")
    guideload(*run, "--overwrite")
    assert names(out) == {"loads.nc", "report.txt", "mine.html"}


@pytest.mark.parametrize("words", [["run", "--report"], ["long-run", "-o"]], ids=" ".join)
def test_a_file_that_cannot_be_written_is_refused_before_the_computation(
    tmp_path: Path, trace: str, no_computation: None, words: list[str]
) -> None:
    command, option = words
    ending, more = (".html", ("-o", tmp_path / "out")) if command == "run" else (".csv", ())
    file = tmp_path / ("r" * (255 - len(ending)) + ending)  # its draft has too long a name
    assert "cannot be written: File name too long" in refused(command, MACHINE, trace, option, file, *more)
    assert names(tmp_path) == {Path(trace).name}


def test_a_list_of_other_files_is_not_believed(tmp_path: Path, trace: str) -> None:
    out = tmp_path / "out"
    run = ("run", MACHINE, trace, "-o", out, "--overwrite", "--no-pictures")
    guideload(*run)
    (out / "notes.txt").write_text("mine")
    (tmp_path / "above.txt").write_text("mine")
    with (out / MANIFEST).open("a") as file:
        file.write("notes.txt\n../above.txt\n")
    guideload(*run)
    assert (out / "notes.txt").exists() and (tmp_path / "above.txt").exists()
    (out / MANIFEST).write_text("a list of somebody else\nloads.nc\n")
    assert f"{out / MANIFEST} was not written" in refused(*run)


def test_overwrite_never_takes_the_input(tmp_path: Path, trace: str) -> None:
    out = tmp_path / "out"
    guideload("run", MACHINE, trace, "-o", out, "--no-pictures", "--format", "csv")
    before = contents(out)
    for file_format in ("csv", "netcdf"):  # replaced, and removed
        run = ("run", MACHINE, out / "loads.csv", "-o", out, "--overwrite", "--format", file_format)
        assert f"{out / 'loads.csv'} is read by this run" in refused(*run)
    assert contents(out) == before


def test_outputs_that_cannot_be_are_refused_before_any_work(
    tmp_path: Path, trace: str, no_computation: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, mkdir = contents(tmp_path), Path.mkdir

    def read_only(
        path: Path, *arguments: Any, **options: Any
    ) -> None:  # root may write anywhere: no mode bits here
        if path.name.endswith(DRAFT):
            raise PermissionError(13, "Permission denied", str(path))
        mkdir(path, *arguments, **options)

    monkeypatch.setattr(Path, "mkdir", read_only)
    for command in (("run", MACHINE, trace, "-o", out := tmp_path / "a" / "b"), ("demo", "-o", out)):
        assert refused(*command) == f"Error: {out}: cannot be written: Permission denied\n"
    picture = tmp_path / "x.png"
    message = refused("modes", MACHINE, "-o", picture)
    assert message == f"Error: {picture}: cannot be written: Permission denied\n"
    assert contents(tmp_path) == before
    assert not (tmp_path / "a").exists()


def test_an_empty_folder_and_the_current_one_may_be_written(
    tmp_path: Path, trace: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    guideload("run", MACHINE, trace, "-o", ".", "--no-pictures")
    assert names(Path.cwd()) == {"loads.nc", "report.txt"}


@pytest.mark.parametrize(
    ("place", "error", "message", "code"),
    [
        ("simulation.simulate", RunError("step 3.1e-14 s is too small"), "step 3.1e-14 s is too small", 1),
        ("simulation.simulate", ArgumentError("rtol: expected > 1e-14"), "rtol: expected > 1e-14", 2),
        ("result.Result.to_netcdf", OSError("no space left"), "{out}: cannot be written: no space left", 1),
    ],
)
def test_a_failure_has_its_exit_code_and_leaves_nothing(
    tmp_path: Path,
    trace: str,
    monkeypatch: pytest.MonkeyPatch,
    place: str,
    error: Exception,
    message: str,
    code: int,
) -> None:
    def fails(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(f"guideload.simulation.{place}", fails)
    before, out = names(tmp_path), tmp_path / "new" / "out"
    found = refused("run", MACHINE, trace, "-o", out, "--no-pictures", code=code)
    assert found == f"Error: {message.format(out=out)}\n"
    assert names(tmp_path) == before


def test_check_shows_the_machine_before_it_refuses_a_trace(tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text(
        "time_s,velocity_m_s\n" + "".join(f"{i * 1e-3:.3f},0.1\n" for i in (*range(30), 7)), encoding="utf-8"
    )
    assert "bad.csv" in guideload("check", MACHINE, bad, code=2).stderr
    assert "no column 'speed'" in guideload("check", MACHINE, bad, "--column", "speed", code=2).stderr


def test_check_shows_machine_and_trace(trace: str) -> None:
    picture = Path(trace).with_suffix(".png")
    text = guideload("check", MACHINE, trace, "-o", picture).stdout
    assert picture.read_bytes().startswith(b"\x89PNG")
    figures = ("mass 1250 kg", "weight 12\u202f258 N", "16 links", "pressed onto", "1200 samples")
    assert all(part in text for part in (*figures, "column velocity_m_s"))


def test_modes_prints_and_draws(tmp_path: Path) -> None:
    picture = tmp_path / "modes.svg"
    ended = guideload("modes", MACHINE, "-o", picture)
    lowest = Modes.of(Machine.from_toml(MACHINE)).frequency[0]
    assert f"{lowest:.4g}" in ended.stdout
    assert b"<svg" in picture.read_bytes()
    assert "exists" in refused("modes", MACHINE, "-o", picture)
    guideload("modes", MACHINE, "-o", picture, "--overwrite")
    assert names(tmp_path) == {"modes.svg"}


def test_demo_shows_that_the_papers_dofs_hide_the_weight(tmp_path: Path, trace: str) -> None:
    """And leaves the files of a run in its folder."""
    out = tmp_path / "demo"
    guideload("run", MACHINE, trace, "-o", out, "--no-pictures")
    before = contents(out)
    assert "not empty" in refused("demo", "-o", out)
    printed = guideload("demo", "-o", out, "--overwrite", "--no-pictures").stdout
    assert before.items() < contents(out).items()
    for run, weight in (("guides", -12258.3), ("paper", 0.0)):
        assert names(out / run) == {"loads.nc", "report.txt"}
        static = Result.load(out / run / "loads.nc").data["static_force"]
        assert static.sel(axis="y").sum() == pytest.approx(weight, abs=0.1)
    assert "free y, z, rx, ry, rz" in printed and "free rx, ry, rz" in printed
    assert "constraint at L carries the weight: 12 258 N" in " ".join(printed.split())
    (out / "paper" / MANIFEST).unlink()
    assert f"{out / 'paper' / 'loads.nc'} was not" in refused("demo", "-o", out, "--overwrite")


MICHIGAN = ("--column", "X1_ActualVelocity", "--unit", "mm/s", "--rate", "10")


@pytest.mark.parametrize(
    ("file", "options"), [("emps_bangbang_1kHz.csv", ()), ("michigan_cnc_experiment_01.csv", MICHIGAN)]
)
def test_real_traces_run(shared_data: Path, tmp_path: Path, file: str, options: tuple[str, ...]) -> None:
    ended = guideload("run", MACHINE, shared_data / file, "-o", tmp_path / "out", "--no-pictures", *options)
    assert file in ended.stdout


def test_a_real_trace_with_bad_rows_is_refused(shared_data: Path) -> None:
    command = ("check", MACHINE, shared_data / "michigan_cnc_experiment_18.csv", *MICHIGAN)
    message = guideload(*command, code=2).stderr
    assert "rows 22, 73, 83" in message
    assert "--no-cross-check" in message  # the way out that the message names is there
    guideload(*command, "--no-cross-check")


@pytest.mark.parametrize(
    ("words", "needed", "heavy"),
    [
        ("-h", "click", "numpy pydantic xarray pandas scipy matplotlib pyarrow rich"),
        ("run {machine} {trace} -o out --no-pictures", "numpy", "matplotlib dask xarray pandas"),
        ("run {machine} {trace} --report out.html", "matplotlib", "dask xarray pandas"),
        ("encoder {trace}", "numpy", "matplotlib"),
    ],
)
def test_a_command_loads_only_what_it_needs(
    tmp_path: Path, trace: str, words: str, needed: str, heavy: str
) -> None:
    arguments = [word.format(machine=MACHINE, trace=trace) for word in words.split()]
    code = f"import sys\nfrom guideload.cli.main import main\nmain({arguments!r}, standalone_mode=False)"
    command = [sys.executable, "-c", f"{code}\nprint(*sys.modules)"]
    ended = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    loaded = set(ended.stdout.splitlines()[-1].split())
    assert needed in loaded and not loaded & set(heavy.split())


def test_help_is_in_the_order_of_use() -> None:
    groups = guideload("--help").stdout.split("Options:")[1].split("\n\n")[1:]
    lines = [line for group in groups for line in group.splitlines()[1:] if line.strip()]
    assert [line.split()[0] for line in lines] == list(main.commands) and list(main.commands)[:3] == [
        "demo",
        "init",
        "check",
    ]
    assert len(groups) == 5 and all(
        len(line) <= 80 and line.endswith(".") and ".." not in line for line in lines
    )


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_a_run_tells_its_report_in_the_encoding_of_the_terminal(
    tmp_path: Path, trace: str, encoding: str
) -> None:
    machine, out = tmp_path / "m.toml", tmp_path / "out"
    text = Path(MACHINE).read_text(encoding="utf-8").replace("Clamping-frames", "Spannrahmen für Ωμέγα")
    machine.write_text(text, encoding="utf-8")
    arguments = ["run", str(machine), trace, "-o", str(out), "--no-pictures"]
    ended = CliRunner(charset=encoding).invoke(main, arguments, catch_exceptions=False)
    report = result_report(Result.load(out / "loads.nc"))
    assert ended.stdout.startswith(report.text(encoding=encoding)) and "Spannrahmen f" in ended.stdout
    assert (out / "report.txt").read_text(encoding="utf-8") == report.text()


def test_progress_stays_off_where_nobody_watches() -> None:
    with status("anything") as shown:
        assert shown is None
