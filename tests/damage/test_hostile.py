"""Commands with hostile files and options; that faults in outputs are found; `hostile_runs.py` runs for longer."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest
from click.testing import CliRunner
from finite_outputs import faults, faults_of_text
from small_project import COMMANDS, words_of, write_project
from unrendered import leave_unrendered

from guideload.cli.main import main

CASES = 60  # of seed 0; as many commands end with numbers that a shorter share would leave out most commands
RUNS = Path(__file__).with_name("hostile_runs.py")


@pytest.mark.skipif(sys.platform != "linux", reason="needs fork, and limits of a process")
def test_hostile_files_and_options_end_in_finite_numbers_or_a_typed_error() -> None:
    command = [sys.executable, str(RUNS), "--count", str(CASES), "--seed", "0"]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stdout + ended.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="the commands name files as there")
def test_every_command_succeeds_with_undamaged_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the cases would damage files that no command reads to the end."""
    leave_unrendered(monkeypatch)
    monkeypatch.chdir(tmp_path)
    write_project(tmp_path)
    for line in COMMANDS:
        (tmp_path / "out").mkdir()
        words, given = words_of(line)
        ended = CliRunner().invoke(main, words, input=None if given is None else Path(given).read_bytes())
        assert ended.exit_code == 0, (line, ended.output)
        shutil.rmtree("out")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_found_in_every_kind_of_file(tmp_path: Path, value: float) -> None:
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file["force"] = [1.0, value]
    with h5py.File(tmp_path / "b.nc", "w") as file:
        file.attrs["band"] = value
    parquet.write_table(pa.table({"x": [1.0, value]}), tmp_path / "c.parquet")
    word = {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}[str(value)]
    table = pa.table({"x": [1.0]}).replace_schema_metadata({"guideload": f'{{"a": {word}}}'})
    parquet.write_table(table, tmp_path / "d.parquet")
    (tmp_path / "e.json").write_text(f'{{"a": [{word}]}}', encoding="utf-8")
    (tmp_path / "f.csv").write_text(f"x\n{value}\n", encoding="utf-8")
    (tmp_path / "g.html").write_text(f"<td>{value} N</td>", encoding="utf-8")
    assert {one.split(":")[0][0] for one in faults(tmp_path)} == set("abcdefg")


def test_words_and_finite_numbers_are_no_faults(tmp_path: Path) -> None:
    assert faults_of_text("infeed Nancy inf.toml nan/x 1.5 N, inform", "printed") == []
    parquet.write_table(pa.table({"x": [1.0, None]}), tmp_path / "a.parquet")
    assert faults(tmp_path) == []
