"""`guideload monitor watch`: its summary, exit codes and refusals, and real signals."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner, Result
from waiting import until
from watched import new_monitor, samples, text_of, write_monitor

from guideload import WatchState
from guideload.cli.exit_codes import INTERRUPTED, LIMIT_PASSED
from guideload.cli.main import main

STAMPS, COUNTS = samples()
TEXT = text_of(STAMPS, COUNTS)


def watch(folder: Path, *options: object, text: bytes = TEXT, code: int = 0) -> Result:
    words = ["monitor", "watch", str(write_monitor(folder)), *map(str, options)]
    ended = CliRunner().invoke(main, words, input=text, catch_exceptions=False)
    assert ended.exit_code == code, ended.output
    return ended


def test_the_summary_has_the_totals(tmp_path: Path) -> None:
    monitor = new_monitor()
    monitor.push(STAMPS, COUNTS)
    totals = monitor.totals()
    text = " ".join(watch(tmp_path).stdout.split())
    largest = max(one[5] for one in totals["largest"]) ** 0.5
    assert f"the largest resultant so far is {largest:.0f} N" in text
    assert f"{sum(totals['limit_exceeded'])} times; each rise" in text
    assert f"{STAMPS.size} samples: all good" in text


def test_a_limit_ends_the_watch_and_runs_the_command(tmp_path: Path) -> None:
    code = "import os, sys; open(sys.argv[1], 'w').write(os.environ['GUIDELOAD_CARRIAGE'])"
    command = f'{sys.executable} -c "{code}" {tmp_path / "passed"}'
    ended = watch(tmp_path, "--stop-at-limit", "--on-limit", command, code=LIMIT_PASSED)
    assert "1 time; each rise" in " ".join(ended.stdout.split()) and "passed its limit" in ended.stderr
    assert (tmp_path / "passed").read_text() == "2b"


def test_malformed_lines_are_named_and_counted(tmp_path: Path) -> None:
    text = b"t,n\n" + TEXT[:100] + b"x" + TEXT[100:2000] + b"zz\n" * 20
    ended = watch(tmp_path, text=text)
    assert 'expected a time stamp and a counter, as in 1200,35210, got "' in ended.stderr
    assert ended.stderr.count("left out") == 10 and "only counted" in ended.stderr
    assert "21 malformed lines" in " ".join(ended.stdout.split())


def test_stamps_in_seconds_need_their_option(tmp_path: Path) -> None:
    assert "stamps in seconds need --seconds" in watch(tmp_path, text=b"0.001,5\n").stderr
    seconds = watch(tmp_path, "--seconds", text=b"0.001,5\n0.002,5.5\n").stderr
    assert 'got "0.002,5.5"; left out' in seconds


def test_strict_ends_before_the_first_malformed_line(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    for line, count in ((1, 0), (3, 2), (5, 4)):
        text = b"".join(b"?\n" if n == line else b"%d,0\n" % n for n in range(1, 6))
        ended = watch(tmp_path, "--strict", "-o", out / str(line), text=text, code=2)
        assert f"line {line}: expected a time stamp" in ended.stderr
        assert f"{count} samples: 1 malformed line," in ended.stdout
        assert count == 0 or pd.read_parquet(out / str(line))["stamp"].tolist() == [*range(1, line)]


def test_stamps_in_seconds(tmp_path: Path) -> None:
    lines = (f"{1e-3 * stamp:.3f},{count}\n" for stamp, count in zip(STAMPS, COUNTS, strict=True))
    assert watch(tmp_path, "--seconds", text="".join(lines).encode()).stdout == watch(tmp_path).stdout


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_killed_started_again_and_ended_by_ctrl_c(tmp_path: Path) -> None:
    """After SIGKILL and a new start every sample is there once; Ctrl-C ends it with a summary and exit code 130."""
    path, out = tmp_path / "samples.csv", tmp_path / "out"
    words = ["monitor", "watch", str(write_monitor(tmp_path)), "--follow", str(path), "-o", str(out)]
    code = f"""if True:
        import signal; signal.signal(signal.SIGINT, signal.default_int_handler)
        from guideload.cli.main import main
        main({words!r})"""

    def start() -> subprocess.Popen[str]:
        return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)

    def has_another(*journals: Path) -> bool:
        found = set(out.glob("_*.journal")) - {*journals}
        return any(one.stat().st_size > 10_000 for one in found)

    half = len(TEXT) // 2
    path.write_bytes(TEXT[:half])
    first = start()
    until(has_another, "a journal", 60.0)
    (journal,) = out.glob("_*.journal")
    first.kill()
    first.communicate()
    with path.open("ab") as file:
        file.write(TEXT[half:])
    second = start()
    until(lambda: has_another(journal), "another journal", 60.0)
    second.send_signal(signal.SIGINT)
    said = " ".join(second.communicate()[0].split())
    assert second.returncode == INTERRUPTED
    assert f"{STAMPS.size} samples: all good, " in said
    assert sorted(pd.read_parquet(out)["sample"]) == list(range(STAMPS.size))


@pytest.mark.skipif(os.name != "posix", reason="a terminal of POSIX")
def test_a_terminal_and_the_state_in_the_folder_show_the_loads_meanwhile(tmp_path: Path) -> None:
    import pty

    out = tmp_path / "out"
    words = ["monitor", "watch", str(write_monitor(tmp_path)), "-o", str(out), "--record-only"]
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "guideload", *words]
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "100"}
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=theirs, stderr=subprocess.PIPE, env=environment
    )
    os.close(theirs)
    assert process.stdin is not None and process.stderr is not None
    half = TEXT.index(b"\n2500,") + 1
    process.stdin.write(TEXT[:half])
    process.stdin.flush()
    monitor = new_monitor()
    monitor.push(STAMPS[:2500], COUNTS[:2500])

    def has_half() -> bool:
        return (out / WatchState.FILE).exists() and WatchState.read(out).status["input"]["samples"] == 2500

    until(has_half, "half of the samples", 60.0)
    found = WatchState.read(out)
    expected = [one[6] for one in monitor.totals()["largest"]]
    assert [one["largest_equivalent_N"] for one in found.status["carriages"]] == expected and not found.ended
    process.stdin.write(TEXT[half:])
    process.stdin.close()
    shown = b""
    while data := read_terminal(ours):
        shown += data
    os.close(ours)
    assert process.wait() == 0
    process.stderr.close()
    live, summary = shown.decode().split("samples/s from standard input")[0], shown.decode()[-1500:]
    assert "life" in live and "carriage" in live
    assert f"{STAMPS.size} samples: all good" in summary and WatchState.read(out).ended


def read_terminal(handle: int) -> bytes:
    """What a terminal shows next; nothing at its end, which Linux tells by an error."""
    try:
        return os.read(handle, 65536)
    except OSError:
        return b""
