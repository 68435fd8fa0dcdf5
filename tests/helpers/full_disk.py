"""Every command that writes, on disks of many sizes: `python tests/helpers/full_disk.py [--sizes 100] [COMMAND ...]`.

Each command runs on a tmpfs, first large enough, then with less room, down to none. It must succeed, or fail with an
ordinary error: no signal, no exception that is no message, no draft, nothing half written. A tmpfs needs a mount
namespace of Linux; elsewhere the size of each file is limited instead. Prints counts for the table in
docs/robustness.md. --quick leaves out what takes long and has nothing to do with disks: pictures are written as ever,
but nothing is drawn on them, and a trace is smoothed once.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
from click.testing import CliRunner
from interrupts import HELPERS
from smoothed_once import smooth_once
from unrendered import leave_blank

from guideload.cli.main import main
from guideload.cli.outputs import MANIFEST

sys.path.insert(0, str(HELPERS.parent / "damage"))
from small_project import words_of, write_project

# In the folder of the project, with DISK for the disk.
COMMANDS = """\
run manipulator.toml trace.csv --no-pictures -o DISK/o
run manipulator.toml trace.csv --no-pictures -o DISK/o --format parquet
run manipulator.toml trace.csv --no-pictures -o DISK/o --format csv
run manipulator.toml trace.csv -o DISK/o --report DISK/r.html
demo --no-pictures -o DISK/o
init DISK/m.toml
chart manipulator.toml trace.csv --budget 0.05 -o DISK/o
encoder trace.csv -o DISK/e.png
modes manipulator.toml -o DISK/m.svg
response gantry.toml -o DISK/r.png --csv DISK/r.csv
sensitivities manipulator.toml trace.csv -o DISK/s.png
compare manipulator.toml gantry.toml moves.toml -o DISK/c.png --report DISK/r.html
stability manipulator.toml -o DISK/s.png
long-run manipulator.toml log.parquet --rows 8192 -o DISK/b.csv
long-run manipulator.toml log.parquet --rows 8192 -o DISK/b.parquet
monitor build manipulator.toml trace.csv --period 1_ms --travel-per-count 20_um --lag 20 \
-o DISK/m.toml -o DISK/m.h -o DISK/m.rs
monitor watch monitor.toml -o DISK/w < samples.txt
identify identify.toml -o DISK/o
study small_study.toml --samples 200 --no-pictures -o DISK/o
study small_study.toml --samples 200 -o DISK/o --report DISK/r.html
study cases.toml --no-pictures -o DISK/o
""".splitlines()
# After a failure the next start goes on with what was written.
RESUMED = ("study", "monitor watch")
# Of these three times as many disks are filled, one of them by a process of its own, whose end must not fail either.
FRESH = (COMMANDS[0], COMMANDS[13], COMMANDS[18])
PEAK = 6  # times the room of what `monitor watch` leaves: the journal becomes a Parquet file
PAGE = 4096


def called(words: list[str], text: bytes) -> tuple[int, str]:
    """Exit code and standard error of a command in this process."""
    ended = CliRunner().invoke(main, words, input=text)
    assert isinstance(ended.exception, SystemExit | None), repr(ended.exception)
    return ended.exit_code, ended.stderr


def started(words: list[str], text: bytes) -> tuple[int, str]:
    """Exit code and standard error of a command in a process of its own."""
    command = [sys.executable, "-m", "guideload", *words]
    ended = subprocess.run(command, input=text, capture_output=True, check=False)
    return ended.returncode, ended.stderr.decode()


def seen(disk: Path) -> dict[str, int]:
    """Size of the files by name, hidden ones too."""
    return {str(path.relative_to(disk)): path.stat().st_size for path in disk.rglob("*") if path.is_file()}


def clear(disk: Path) -> None:
    for path in disk.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def sweep(line: str, disk: Path, sizes: int, limit: Callable[[int | None], None]) -> Counter[str]:
    """Run a command with each amount of room; counts of what became of it.

    limit: sets the size of the disk [bytes], or that of each file; None: large enough.
    """
    words, file = words_of(line.replace("DISK", str(disk)))
    text = Path(file).read_bytes() if file else b""
    counts = Counter[str]()
    limit(None)
    clear(disk)
    code, said = called(words, text)
    assert code == 0, (line, code, said)
    whole = seen(disk)
    room = sum(-(-size // PAGE) * PAGE + PAGE for size in whole.values())
    most = (PEAK if file else 1.5) * room + 8 * PAGE
    # Not the largest: there a command does what it has done on the large disk.
    rooms = np.unique(np.linspace(PAGE, most, sizes, endpoint=False).astype(int) // PAGE * PAGE).tolist()
    for size in rooms:
        limit(None)
        clear(disk)
        limit(size)
        fresh = line in FRESH and size == rooms[len(rooms) // 2]
        code, said = (started if fresh else called)(words, text)
        limit(None)
        where, left = (line, size, code, said), seen(disk)
        assert code in (0, 1, 2, 3) and "Traceback" not in said and "ignored" not in said, where
        if code == 0:
            assert left.keys() == whole.keys(), (*where, left)
        else:
            reasons = ("No space left", "File too large", "Error: ", "Warning: ")
            assert any(reason in said for reason in reasons), where
            drafts = [file for file in left if ".draft" in file]
            assert not drafts, (*where, drafts)
        counts["survived" if code == 0 else "refused"] += 1
        if code in (1, 2) and not line.startswith(RESUMED):
            assert all(left[file] == whole[file] for file in left.keys() - {MANIFEST}), (*where, left)
        elif code in (1, 2):
            again = [*words, "--resume"] if (disk / "o" / "study.json").exists() else words
            code, said = called(again, b"")
            assert code == 0, (*where, "again", code, said)
    return counts


def main_in_place(arguments: argparse.Namespace) -> None:
    """Run the sweeps; in a mount namespace of its own if there is one."""
    if arguments.quick:
        whole_process = pytest.MonkeyPatch()
        leave_blank(whole_process)
        smooth_once(whole_process)
    with tempfile.TemporaryDirectory() as folder:
        project, disk = Path(folder) / "project", Path(folder) / "disk"
        project.mkdir()
        disk.mkdir()
        write_project(project)
        os.chdir(project)
        pyarrow.parquet.write_table(pyarrow.csv.read_csv("trace.csv"), "log.parquet")
        if arguments.mounted:
            subprocess.run(["mount", "-t", "tmpfs", "tmpfs", disk], check=True)

        def limit(size: int | None) -> None:
            if arguments.mounted:
                option = f"remount,size={2**28 if size is None else size}"
                subprocess.run(["mount", "-o", option, disk], check=True)
            else:
                hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
                resource.setrlimit(resource.RLIMIT_FSIZE, (hard if size is None else size, hard))

        total = Counter[str]()
        try:
            for line in arguments.commands or COMMANDS:
                sizes = arguments.sizes * (3 if line in FRESH else 1)
                counts = sweep(line, disk, sizes, limit)
                total += counts
                print(f"{sum(counts.values()):5d}  {line}: {dict(counts)}", flush=True)
        finally:
            os.chdir(HELPERS)
            if arguments.mounted:
                subprocess.run(["umount", "--lazy", disk], check=True)
        print(f"{sum(total.values())} disks, none failed: {dict(total)}")


def namespace() -> list[str]:
    """Words before a command that give it mounts of its own; none if that is not permitted."""
    words = ["unshare", "--mount", *([] if os.geteuid() == 0 else ["--map-root-user"])]
    try:
        probe = [*words, "mount", "-t", "tmpfs", "tmpfs", str(HELPERS)]
        return words if subprocess.run(probe, capture_output=True, check=False).returncode == 0 else []
    except OSError:
        return []


def command(*arguments: str) -> list[str]:
    """The command that runs this script where it has small disks."""
    words = namespace()
    return [*words, sys.executable, str(Path(__file__)), *arguments, *(["--mounted"] if words else [])]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("commands", nargs="*", metavar="COMMAND", help="lines of COMMANDS")
    parser.add_argument("--sizes", type=int, default=100)
    parser.add_argument("--quick", action="store_true", help="blank pictures, one smoothing of each trace")
    parser.add_argument("--mounted", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.mounted or not namespace():
        main_in_place(given)
    else:
        sys.exit(subprocess.run(command(*sys.argv[1:]), check=False).returncode)
