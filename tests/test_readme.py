"""The README runs: its Python as it stands here, its Rust as a documentation test of the crate."""

import re
from pathlib import Path

import pytest

from guideload.base.toml import tomllib
from guideload.cli.inputs import EXAMPLES
from guideload.cli.run import PAPER_DOFS
from guideload.machine.machine import Machine
from guideload.simulation.simulation import simulate
from guideload.traces.reading import motion_from_trace, read_trace

README = Path(__file__).resolve().parents[1] / "README.md"
TEXT = README.read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
LAWS = [row for block in re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL) for row in block.splitlines()]


def test_there_is_python_to_run() -> None:
    assert BLOCKS


@pytest.mark.parametrize("block", BLOCKS)
def test_python_block_runs(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # what it writes goes there
    exec(compile(block, str(README), "exec"), {"__name__": "readme"})


def test_the_table_of_peaks_is_the_one_of_the_demo() -> None:
    """Peak and static load of every carriage, with all dofs and with the paper's."""
    machine = Machine.from_toml(EXAMPLES / "manipulator.toml")
    motion = motion_from_trace(read_trace(EXAMPLES / "manipulator.csv"), machine.drive)
    results = [simulate(each, motion) for each in (machine, machine.with_free(PAPER_DOFS))]
    loads = [result.peaks()[["peak_resultant_N", "static_resultant_N"]] for result in results]
    for carriage in machine.carriages:
        figures = [f"{load:,.0f} N".replace(",", " ") for part in loads for load in part.loc[carriage.name]]
        assert f"| {carriage.name} | {' | '.join(figures)} |" in TEXT


def test_every_law_of_the_machine_file_is_one() -> None:
    """The rows of the block, each a law; and what the text below adds to the first."""
    given = Machine.from_toml(EXAMPLES / "machine.toml").carriages[0]
    stiffness = LAWS[0]
    added = [f"{stiffness}\n{key}" for key in re.findall(r"`(clearance_y = .*?)`", TEXT)]
    preload, rolling = (re.search(rf"`({key} = .*?)`", TEXT) for key in ("preload_y", "rolling"))
    assert preload is not None and rolling is not None
    added.append("\n".join([stiffness, preload[1], rolling[1]]))
    changes = [tomllib.loads(text) for text in (*LAWS, *added)]
    laws = [given.model_copy(update={"stiffness_y": None, **keys}).laws[0] for keys in changes]
    assert [law.kind for law in laws] == ["linear", "sided", "curve", "sided", "preloaded"]
