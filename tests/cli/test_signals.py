"""Signals end a command with their exit code, at any time, and leave nothing behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType

import numpy as np
import pytest
from command_line import MACHINE, write_trace
from interrupts import run_process, signalled

from guideload import Machine, Moves, Study
from guideload.cli.inputs import EXAMPLES
from guideload.cli.outputs import MANIFEST
from guideload.cli.signals import ended_in_order

STUDY = EXAMPLES / "study.toml"

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows has no such signals between processes"
)

# The command waits where it would compute, so that the signal comes while the draft is there.
WAITING = """
import sys, time
from pathlib import Path
import guideload.simulation.simulation as simulation
from guideload.cli.main import main
def waits(*_, **__):
    Path(sys.argv[1]).touch()
    time.sleep(60)
simulation.simulate = waits
main(sys.argv[2:])
"""


@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_signal_ends_a_run_in_order(tmp_path: Path, name: str, code: int) -> None:
    reached, home = tmp_path / "reached", tmp_path / "home"
    home.mkdir()
    words = [MACHINE, write_trace(tmp_path / "trace.csv", 1200, 0.5), "-o", str(home / "new" / "out")]
    command = [sys.executable, "-c", WAITING, str(reached), "run", *words]
    process = subprocess.Popen(command, stderr=subprocess.PIPE)
    while not reached.exists():
        assert process.poll() is None
        time.sleep(0.01)
    assert list(home.rglob(".*.draft"))
    process.send_signal(getattr(signal, name))
    _, said = process.communicate(timeout=60)
    assert process.returncode == code and b"Traceback" not in said
    assert not list(home.iterdir())


NUMBERS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
START = np.linspace(0.0, 0.3, 6)  # s: the imports of the command line
# Commands, and the times of signals [s]: the start, and through the whole command.
COMMANDS = {
    "version": (["--version"], START),
    "check": (["check", MACHINE], START),
    "run": (["run", MACHINE, "trace.csv", "-o", "out", "--report", "r.html"], np.linspace(0.2, 3.0, 6)),
    "study": (["study", STUDY, "--samples", "1000", "-o", "out"], np.linspace(0.2, 3.0, 4)),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_signal_at_any_time_ends_a_command_in_order(tmp_path: Path, command: str) -> None:
    words, times = COMMANDS[command]
    for i, after in enumerate(times):
        number, folder = NUMBERS[i % len(NUMBERS)], tmp_path / str(i)
        folder.mkdir()
        write_trace(folder / "trace.csv", 800, 0.1)
        ended = signalled(words, number, after, folder)
        assert ended.returncode in (0, 128 + number), (number, after, ended.stderr)
        assert "Traceback" not in ended.stderr and "ignored" not in ended.stderr, (
            number,
            after,
            ended.stderr,
        )
        assert "Error" not in ended.stderr.replace("Error: interrupted; no", ""), (
            number,
            after,
            ended.stderr,
        )
        hidden = {path.name for path in folder.rglob(".*")} - {MANIFEST, ".lock"}
        assert not hidden, (number, after, hidden)
        if ended.returncode == 0:
            assert "interrupted" not in ended.stderr.lower()


def test_an_exception_that_python_cannot_raise_comes_later() -> None:
    """In a finaliser Python would only print that it ignores the exception."""
    source = """
import os, signal
from guideload.cli.signals import ended_in_order

class Finalised:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        sum(range(1000))

def command():
    Finalised()
    for _ in range(10**9):
        pass

print()
try:
    ended_in_order(command)
except KeyboardInterrupt:
    print("interrupted")
"""
    ended = run_process(source)
    assert ended.stdout.split() == ["interrupted"] and not ended.stderr


@pytest.fixture
def slow(tmp_path: Path) -> Path:
    """A folder with a module whose import gets Ctrl-C."""
    code = "import os, signal\nos.kill(os.getpid(), signal.SIGINT)\nwhole = sum(range(1000))"
    (tmp_path / "slow.py").write_text(code)
    return tmp_path


def test_an_import_is_never_interrupted(slow: Path) -> None:
    """A module that is half imported fails later, and far from here."""
    source = f"""
import sys, time
from guideload.cli.signals import ended_in_order

sys.path.insert(0, {str(slow)!r})

def command():
    import slow
    assert slow.whole
    print("imported", flush=True)
    time.sleep(600)

print()
try:
    ended_in_order(command)
except KeyboardInterrupt:
    print("interrupted")
"""
    ended = run_process(source)
    assert (
        "imported" in ended.stdout and "interrupted" in ended.stdout and not ended.stderr
    )  # print may be cut off


SOBOL = """
import numpy
from scipy.stats import qmc
place, name = numpy, "load"
def work():
    qmc.Sobol(2)
"""
NETCDF = """
import h5netcdf, numpy
from pathlib import Path
from guideload.base.netcdf import write_netcdf
from guideload.base.quantities import Quantities, Quantity
place, name = h5netcdf.File, "create_variable"
def work():
    write_netcdf(Quantities({"a": Quantity(("t",), numpy.zeros(3), {})}, {}), Path("a.nc"))
"""
MATLAB = """
import h5py, numpy
from pathlib import Path
from guideload.traces.format.matlab import read_matlab
with h5py.File("a.mat", "w") as file:
    file.create_dataset("x", data=numpy.zeros((1, 3))).attrs["MATLAB_class"] = b"double"
place, name = h5py.File, "items"
def work():
    read_matlab(Path("a.mat"))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("library", [SOBOL, NETCDF, MATLAB], ids=["sobol", "netcdf", "matlab"])
def test_a_signal_within_library_code_in_c_comes_after_it(tmp_path: Path, library: str, number: int) -> None:
    """That code would print the exception or raise another, and go on with a part missing."""
    source = f"""
import os, time
from guideload.cli.signals import ended_in_order

os.chdir({str(tmp_path)!r})
{library}
function = getattr(place, name)
def interrupted(*arguments, **options):
    os.kill(os.getpid(), {int(number)})
    returned = function(*arguments, **options)
    os.write(1, b"whole ")
    return returned
setattr(place, name, interrupted)

def command():
    work()
    time.sleep(600)

print("", flush=True)
try:
    ended_in_order(command)
except (KeyboardInterrupt, SystemExit):
    print("ended")
"""
    ended = run_process(source)
    assert ended.stdout.split() == ["whole", "ended"] and not ended.stderr


@pytest.mark.parametrize(("error", "found"), [("TypeError", "interrupted"), ("OSError", "OSError")])
def test_what_a_library_raises_in_place_of_a_signal_is_the_signal(error: str, found: str) -> None:
    """An OSError is kept: it may be of files that are put in order."""
    source = f"""
import os, signal
from guideload.cli.signals import ended_in_order

def command():
    try:
        os.kill(os.getpid(), signal.SIGINT)
        sum(range(1000))
    except BaseException:
        raise {error}

print()
try:
    ended_in_order(command)
except KeyboardInterrupt:
    print("interrupted")
except Exception as raised:
    print(type(raised).__name__)
"""
    ended = run_process(source)
    assert (ended.stdout.split(), ended.stderr) == ([found], "")


def test_a_command_that_ends_before_it_can_be_interrupted_has_succeeded(slow: Path) -> None:
    """The timer of the next attempt must not outlive the command: its signal would end the process."""
    source = f"""
import importlib, sys, time
from guideload.cli.signals import ended_in_order

sys.path.insert(0, {str(slow)!r})
print()
ended_in_order(importlib.import_module, "slow")
time.sleep(0.1)
print("over")
"""
    ended = run_process(source)
    assert (ended.returncode, ended.stdout.split(), ended.stderr) == (0, ["over"], "")


def test_a_command_leaves_the_handlers_of_its_caller(tmp_path: Path) -> None:
    from command_line import guideload

    before = [*map(signal.getsignal, [*NUMBERS, signal.SIGALRM]), sys.unraisablehook]
    guideload("check", MACHINE)
    assert [*map(signal.getsignal, [*NUMBERS, signal.SIGALRM]), sys.unraisablehook] == before


@pytest.mark.parametrize(
    "read",
    [
        lambda: Machine.from_toml(MACHINE),
        lambda: Moves.from_toml(EXAMPLES / "moves.toml"),
        lambda: Study.from_toml(EXAMPLES / "study.toml"),
    ],
    ids=["machine", "moves", "study"],
)
def test_a_signal_in_any_function_of_pydantic_is_no_refusal(read: Callable[[], object]) -> None:
    """Pydantic turns an exception that is raised while it serialises a model into the error of a value."""
    functions: dict[CodeType, int] = {}

    def noted(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and "pydantic" in frame.f_code.co_filename:
            functions.setdefault(frame.f_code, len(functions))

    def profiled(profile: Callable[[FrameType, str, object], None]) -> None:
        sys.setprofile(profile)
        try:
            read()
        finally:
            sys.setprofile(None)

    read()
    profiled(noted)
    for place in range(len(functions)):

        def signals(frame: FrameType, event: str, _: object, place: int = place) -> None:
            if event == "call" and functions.get(frame.f_code) == place:
                sys.setprofile(None)
                os.kill(os.getpid(), signal.SIGINT)

        with pytest.raises(KeyboardInterrupt):
            ended_in_order(profiled, signals)
