"""Names are shown as they are, in reports and pictures, are never paths, and cannot cost the numbers."""

import json
from pathlib import Path

import pytest
from command_line import MACHINE, guideload, names, write_trace
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from unrendered import leave_unrendered

from guideload import plots
from guideload.cli.exit_codes import PICTURE_MISSING
from guideload.cli.outputs import PICTURES
from guideload.machine.machine import Machine
from guideload.plots.style import plain
from guideload.simulation.result import Result

HOSTILE = [
    "a$b_$",
    r"\$\frac$",
    "_nolegend_",
    "[red]x[/red]",
    "[/]",
    "../../up",
    "/tmp/x",
    "轨道 😀",
    "$$",
    "_",
]


def machine_file(folder: Path, renamed: dict[str, str]) -> Path:
    """The packaged machine with other names of machine and carriages."""
    text = Path(MACHINE).read_text(encoding="utf-8")
    for old, new in renamed.items():
        assert f"name = {json.dumps(old)}" in text
        text = text.replace(f"name = {json.dumps(old)}", f"name = {json.dumps(new, ensure_ascii=False)}")
    file = folder / "machine.toml"
    file.write_text(text, encoding="utf-8")
    return file


def hostile_machine(folder: Path) -> Path:
    machine = Machine.from_toml(MACHINE)
    old = [machine.name, *(carriage.name for carriage in machine.carriages)]
    return machine_file(folder, dict(zip(old, HOSTILE, strict=False)))


def test_a_run_and_a_study_of_hostile_names_write_all_and_nothing_elsewhere(tmp_path: Path) -> None:
    work = tmp_path / "a" / "b"
    work.mkdir(parents=True)
    file, trace = hostile_machine(work), write_trace(work / "trace.csv", 1200, 0.5)
    shown = guideload("run", file, trace, "-o", work / "out").stdout
    assert names(work / "out") == {"loads.nc", "report.txt", *PICTURES}
    for name in HOSTILE[:5]:
        assert name in shown
    assert Result.load(work / "out" / "loads.nc").quantities["carriage"].tolist() == HOSTILE[1:5]
    vary = 'path = "carriages.*.stiffness_y"\neach = "carriage"\ndistribution = "uniform"\nplus_minus = "5 %"'
    head = 'machine = "machine.toml"\ntrace = "trace.csv"\nsamples = 16\nseed = 1\nhistories = 4\n'
    entries = f'{head}[[vary]]\n{vary}\n[[vary]]\nname = "$m_$"\npath = "body.mass"\n'
    (work / "study.toml").write_text(
        f'{entries}distribution = "uniform"\nplus_minus = "5 %"\n', encoding="utf-8"
    )
    for more in ("--no-pictures", "--resume"):
        guideload("study", work / "study.toml", "-o", work / "study", more)
    assert {"exceedance.png", "tornado.png", "histories.png"} <= names(work / "study")
    assert {path.name for path in work.iterdir()} == {
        "machine.toml",
        "trace.csv",
        "out",
        "study.toml",
        "study",
    }
    assert {path.name for path in tmp_path.iterdir()} == {"a"} and names(tmp_path / "a") == {"b"}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_legend_shows_a_name_as_it_is(tmp_path: Path, name: str) -> None:
    ax: Axes = Figure().add_subplot()
    ax.plot([0, 1], label=f"{plain(name)}: F$_y$")
    ax.plot([0, 1], label=plain(name))
    texts = ax.legend().get_texts()
    plots.save(ax, tmp_path / "legend.svg")  # parses the mathematics
    assert len(texts) == 2
    shown, is_math = texts[1]._preprocess_math(texts[1].get_text())
    assert not is_math and shown.removeprefix("\u200b") == name


def test_a_picture_that_fails_costs_neither_numbers_nor_the_other_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> Axes:
        raise ValueError("no \x1b[31mfont")

    leave_unrendered(monkeypatch)
    trace = write_trace(tmp_path / "trace.csv", 1200, 0.5)
    monkeypatch.setattr("guideload.plots.run.moments", fail)
    ended = guideload("run", MACHINE, trace, "-o", tmp_path / "out", code=PICTURE_MISSING)
    assert names(tmp_path / "out") == {"loads.nc", "report.txt", *PICTURES} - {"moments.png"}
    assert ended.stderr == (
        "Warning: not drawn: moments.png (ValueError: no \\x1b[31mfont). The numbers are not affected.\n"
    )
    assert "Wrote" in ended.stdout
