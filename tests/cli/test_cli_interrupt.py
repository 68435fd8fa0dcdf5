"""Ctrl-C ends every command with exit code 130 and leaves nothing half written."""

from pathlib import Path

import numpy as np
import pytest
from command_line import MACHINE, guideload
from interrupts import run_process

COMMANDS = {
    "run": ["run", "{machine}", "{trace}", "-o", "{folder}/out"],
    "chart": ["chart", "{machine}", "{trace}", "--budget", "100", "-o", "{folder}/out"],
    "encoder": ["encoder", "{trace}"],
}


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trace of 800 s at 1 kHz, of which a command needs more than ten seconds."""
    path = tmp_path_factory.mktemp("long") / "trace.csv"
    time = np.arange(800_000) * 1e-3
    position = 0.3 * np.sin(0.7 * time) + np.random.default_rng(0).normal(0.0, 1e-6, time.size)
    lines = (f"{t:.3f},{x:.7f}\n" for t, x in zip(time, position, strict=True))
    path.write_text("time_s,position_m\n" + "".join(lines), encoding="utf-8")
    # Into the cache of the disk: a first import may take longer than the time to Ctrl-C, which then ends the import.
    modules = "traces.reading", "simulation.simulation", "method_comparison", "plots", "reports.run"
    run_process("\n".join(["print()", *(f"import guideload.{module}" for module in modules)]))
    return path


@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
@pytest.mark.parametrize("later", [0.0, 1.0], ids=["at once", "later"])
def test_ctrl_c_ends_a_command(command: list[str], later: float, trace: Path, tmp_path: Path) -> None:
    words = [word.format(machine=MACHINE, trace=trace, folder=tmp_path) for word in command]
    code = (
        "import threading, time\nfrom guideload.cli.main import main\n"
        f"threading.Thread(target=lambda: (time.sleep({later}), print('begun', flush=True)), daemon=True).start()\n"
        f"main({words!r})"
    )
    ended = run_process(code, interrupt=True)
    assert ended.returncode == 130, ended.stdout[-300:] + ended.stderr[-2000:]
    assert "interrupted" in ended.stderr and "Traceback" not in ended.stderr
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_ends_the_reading_of_a_text(trace: Path) -> None:
    """pyarrow reads on a thread: on the main thread it would take over Ctrl-C, and lose one as the reading ends."""
    source = f"""
import os, signal, threading, time
from pyarrow import csv
from guideload.traces.reading import read_trace

def read_csv(content, **_):
    assert threading.current_thread() is not threading.main_thread()
    time.sleep(0.3)  # until the main thread waits
    os.kill(os.getpid(), signal.SIGINT)
    start = time.monotonic()
    while time.monotonic() < start + 60.0:
        try:
            content.seek(0)
            content.read(1)
        except InterruptedError:
            print("ended")
            raise

csv.read_csv = read_csv
try:
    read_trace({str(trace)!r})
except KeyboardInterrupt:
    print("interrupted")
"""
    done = run_process(source)
    assert done.stdout.split() == ["ended", "interrupted"], done.stderr


def test_too_little_memory_is_an_error_of_the_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A MemoryError becomes a message and exit code 1."""

    def fails(*_: object, **__: object) -> None:
        raise MemoryError("3 GB are needed")

    monkeypatch.setattr("guideload.cli.machine.read_machine", fails)
    ended = guideload("check", MACHINE, code=1)
    assert "not enough memory: 3 GB are needed" in ended.stderr
