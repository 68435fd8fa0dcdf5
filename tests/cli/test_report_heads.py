"""Law of every command that shows a report of a machine: head of the table [report], warnings of machine and motion."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import EXAMPLES, guideload

HEAD = "Project: Gantry 12"
OF_MACHINE = "points[0].at is 90 m, beyond 20 m: is it in mm?"
OF_MOTION = "the cart reaches 12 m/s, beyond 10 m/s: is a length or a speed in mm?"
MOVE = "--move", "distance=9 m, speed=12 m/s, acceleration=30 m/s^2, jerk=5000 m/s^3"
OF_BOTH = {
    "check": (),
    "run": ("-o", "run", "--no-pictures"),
    "life": ("--no-bands",),
    "limit": ("--of", "payload"),
    "size": ("--product", "HGH25CA"),
    "sensitivities": ("--to", "body.mass"),
    "stability": (),
}
STUDY = """
machine = "machine.toml"
trace = "moves.toml"
samples = 8
seed = 1
limits = { peak_resultant = "1 kN" }
[[vary]]
path = "body.mass"
sigma = "5 %"
distribution = "normal"
"""
PRODUCT = 'product = "HGH25CA"\npreload_class = "ZA"\n'
OF_MACHINES = ("modes", "response")


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The packaged example with products, a head and a point that is 90 m away."""
    monkeypatch.chdir(tmp_path)
    text = (EXAMPLES / "kinds" / "vertical.toml").read_text(encoding="utf-8")
    text = text.replace("[carriage_types.wagon]", f"[carriage_types.wagon]\n{PRODUCT}")
    text = text.replace('["0 mm", "250 mm", "0 mm"]', '["0 mm", 90, "0 mm"]')
    assert PRODUCT in text and "90," in text
    text += '[report]\nproject = "Gantry 12"\n'
    Path("machine.toml").write_text(text, encoding="utf-8")
    return "machine.toml"


@pytest.mark.parametrize("command", [*OF_BOTH, *OF_MACHINES])
def test_a_report_has_the_head_and_the_warnings_of_machine_and_motion(command: str, machine: str) -> None:
    motion = () if command in OF_MACHINES else (*MOVE, *OF_BOTH[command])
    said = guideload(command, machine, *motion).stdout
    words = " ".join(said.split())
    assert HEAD in said and OF_MACHINE in words and (not motion or OF_MOTION in words)


@pytest.mark.parametrize(
    "command",
    [("study", "-o", "study", "--no-pictures"), ("probability", "--error", 50, "--most-runs", 20_000)],
)
def test_a_report_on_a_study_has_the_head_and_the_warnings_of_both(
    command: tuple[object, ...], machine: str
) -> None:
    limits = dict(one.split("=") for one in MOVE[1].split(", "))
    moves = "\n".join(f'{key} = "{value}"' for key, value in limits.items())
    Path("moves.toml").write_text(f"[[moves]]\n{moves}\n", encoding="utf-8")
    Path("study.toml").write_text(STUDY, encoding="utf-8")
    plain = Path(machine).read_text(encoding="utf-8").replace(PRODUCT, "")  # linear, so that it is quick
    Path(machine).write_text(plain, encoding="utf-8")
    name, *options = command
    said = guideload(name, "study.toml", *options).stdout
    words = " ".join(said.split())
    assert HEAD in said and OF_MACHINE in words and OF_MOTION in words
