"""A process that may open few files, and a pair of files that is killed between its two moves."""

import os
import sys
from functools import partial
from pathlib import Path

import pytest
from click.testing import CliRunner
from command_line import MACHINE, names, write_trace
from faults import each

from guideload import Machine, Motion, simulate
from guideload.base.atomic import DRAFT
from guideload.cli.main import main


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit on open files")
def test_a_limit_on_open_files_is_an_error_and_leaves_nothing(tmp_path: Path) -> None:
    import resource

    trace, home = write_trace(tmp_path / "trace.csv", 1200, 0.5), tmp_path / "home"
    home.mkdir()
    words = ["run", MACHINE, trace, "--no-pictures", "--overwrite", "-o", str(home / "out")]
    assert CliRunner().invoke(main, words).exit_code == 0  # all modules are imported
    before = (home / "out" / "report.txt").read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    codes = []
    for more in range(60):  # files of other tests may hold some of the numbers
        os.close(lowest := os.dup(0))  # the lowest number that is free
        resource.setrlimit(resource.RLIMIT_NOFILE, (lowest + more, hard))
        try:
            ended = CliRunner().invoke(main, words)
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        codes.append(ended.exit_code)
        assert isinstance(ended.exception, SystemExit | None), repr(ended.exception)
        there = names(home / "out") - {DRAFT}  # to remove a draft takes a file, too: the next run does it
        assert there == {"loads.nc", "report.txt"} and names(home) == {"out"}
        assert (home / "out" / "report.txt").read_bytes() == before
        if ended.exit_code == 0:
            break
        assert "Too many open files" in ended.stderr, ended.stderr
    assert codes[0] in (1, 2) and codes[-1] == 0 and DRAFT not in names(home / "out")


@pytest.mark.parametrize("kind", ["kill", "full disk"])
def test_a_pair_of_files_is_always_of_one_result(tmp_path: Path, kind: str) -> None:
    machine = Machine.from_toml(MACHINE)
    results = [
        simulate(machine, Motion.along_x([0.0, 0.05, 0.1], acceleration=[0.0, a, 0.0])) for a in (1.0, 2.0)
    ]
    path, faults = tmp_path / "pair" / "loads.csv", 0
    path.parent.mkdir()

    def pair() -> tuple[bytes, bytes]:
        return path.read_bytes(), path.with_suffix(".json").read_bytes()

    whole = []
    for result in results:
        result.to_csv(path)
        whole.append(pair())
    for faults in each(path.parent, kind, partial(results[0].to_csv, path), partial(results[1].to_csv, path)):
        assert not path.with_suffix(".json").exists() or pair() in whole, faults
    assert faults > 10
