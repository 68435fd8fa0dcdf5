"""Every command that writes, on disks of many sizes: `python tests/helpers/full_disk.py [--sizes 100] [COMMAND ...]`.

Each command runs on a tmpfs, first large enough, then with less room, down to none. It must succeed, or fail with an
ordinary error: no signal, no exception that is no message, no draft, nothing half written. A tmpfs needs a mount
namespace of Linux; elsewhere the size of each file is limited instead. Prints counts for the table in
docs/robustness.md.
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
from click.testing import CliRunner
from interrupts import HELPERS
from watched import samples, text_of, write_monitor

from guideload.cli.inputs import EXAMPLES
from guideload.cli.main import main
from guideload.cli.outputs import MANIFEST

MACHINE, TRACE, GANTRY = EXAMPLES / "manipulator.toml", EXAMPLES / "manipulator.csv", EXAMPLES / "gantry.toml"
RUN = ["run", MACHINE, "{in}/short.csv", "--no-pictures", "-o", "{disk}/o"]
MOVES = EXAMPLES / "moves.toml"
BUILD = [
    "monitor",
    "build",
    MACHINE,
    TRACE,
    "--period",
    "1 ms",
    "--travel-per-count",
    "20 um",
    "--lag",
    "20",
    "-o",
]
STUDY = ["study", "{in}/study.toml", "--samples", "200", "-o", "{disk}/o"]
COMMANDS: dict[str, list[object]] = {
    "run, netcdf": RUN,
    "run, parquet": [*RUN, "--format", "parquet"],
    "run, csv": [*RUN, "--format", "csv"],
    "run, pictures and report": [
        "run",
        MACHINE,
        "{in}/short.csv",
        "-o",
        "{disk}/o",
        "--report",
        "{disk}/r.html",
    ],
    "demo": ["demo", "--no-pictures", "-o", "{disk}/o"],
    "init": ["init", "{disk}/m.toml"],
    "chart": ["chart", MACHINE, "{in}/short.csv", "--budget", "0.05", "-o", "{disk}/o"],
    "encoder": ["encoder", "{in}/short.csv", "-o", "{disk}/e.png"],
    "modes": ["modes", MACHINE, "-o", "{disk}/m.svg"],
    "response": ["response", GANTRY, "-o", "{disk}/r.png", "--csv", "{disk}/r.csv"],
    "sensitivities": ["sensitivities", MACHINE, "{in}/short.csv", "-o", "{disk}/s.png"],
    "compare": ["compare", MACHINE, GANTRY, MOVES, "-o", "{disk}/c.png", "--report", "{disk}/r.html"],
    "stability": ["stability", MACHINE, "-o", "{disk}/s.png"],
    "long-run": ["long-run", MACHINE, "{in}/log.parquet", "--rows", "8192", "-o", "{disk}/b.csv"],
    "long-run, parquet": [
        "long-run",
        MACHINE,
        "{in}/log.parquet",
        "--rows",
        "8192",
        "-o",
        "{disk}/b.parquet",
    ],
    "monitor build": [*BUILD, "{disk}/m.toml", "-o", "{disk}/m.h", "-o", "{disk}/m.rs"],
    "monitor watch": ["monitor", "watch", "{in}/monitor.toml", "-o", "{disk}/w"],
    "identify": ["identify", EXAMPLES / "identify.toml", "-o", "{disk}/o"],
    "study": [*STUDY, "--no-pictures"],
    "study, pictures and report": [*STUDY, "--report", "{disk}/r.html"],
    "study, cases": ["study", "{in}/cases.toml", "--no-pictures", "-o", "{disk}/o"],
}
# After a failure the next start goes on with what was written.
RESUMED = ("study", "study, pictures and report", "study, cases", "monitor watch")
# Of these one disk is filled by a process of its own, whose end must not fail either.
FRESH = ("run, netcdf", "long-run", "study")
PEAK = {"monitor watch": 6}  # times the room of what is left: the journal becomes a Parquet file
PAGE = 4096


def prepare(folder: Path) -> None:
    """Write the inputs of the commands."""
    folder.mkdir()
    stamps, counts = samples()
    rows = [f"{1e-3 * stamp:.3f},{2e-5 * count:.6f}\n" for stamp, count in zip(stamps, counts, strict=True)]
    (folder / "short.csv").write_text("time_s,position_m\n" + "".join(rows[1400:2400]), encoding="utf-8")
    import pandas as pd

    pd.read_csv(folder / "short.csv").to_parquet(folder / "log.parquet")
    write_monitor(folder)
    vary = '[[vary]]\npath = "body.mass"\ndistribution = "uniform"\nplus_minus = "10 %"\n'
    inputs = f'machine = "{MACHINE}"\ntrace = "short.csv"\n'
    (folder / "study.toml").write_text(
        f"{inputs}samples = 200\nseed = 1\nhistories = 4\n{vary}", encoding="utf-8"
    )
    (folder / "cases.csv").write_text(
        "body.mass [kg]\n" + "".join(f"{mass}\n" for mass in range(80, 120)), encoding="utf-8"
    )
    (folder / "cases.toml").write_text(f'{inputs}cases = "cases.csv"\n', encoding="utf-8")


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


def sweep(name: str, place: Path, sizes: int, limit: Callable[[int | None], None]) -> Counter[str]:
    """Run a command with each amount of room; counts of what became of it.

    limit: sets the size of the disk [bytes], or that of each file; None: large enough.
    """
    disk = place / "disk"
    words = [str(word).format(**{"in": place / "in", "disk": disk}) for word in COMMANDS[name]]
    text = text_of(*samples()) if name == "monitor watch" else b""
    counts = Counter[str]()
    limit(None)
    clear(disk)
    code, said = called(words, text)
    assert code == 0, (name, code, said)
    whole = seen(disk)
    room = sum(-(-size // PAGE) * PAGE + PAGE for size in whole.values())
    most = PEAK.get(name, 1.5) * room + 8 * PAGE
    # Not the largest: there a command does what it has done on the large disk.
    rooms = np.unique(np.linspace(PAGE, most, sizes, endpoint=False).astype(int) // PAGE * PAGE).tolist()
    for size in rooms:
        limit(None)
        clear(disk)
        limit(size)
        fresh = name in FRESH and size == rooms[len(rooms) // 2]
        code, said = (started if fresh else called)(words, text)
        limit(None)
        where, left = (name, size, code, said), seen(disk)
        assert code in (0, 1, 2, 3) and "Traceback" not in said and "ignored" not in said, where
        if code == 0:
            assert left.keys() == whole.keys(), (*where, left)
        else:
            reasons = ("No space left", "File too large", "Error: ", "Warning: ")
            assert any(reason in said for reason in reasons), where
            drafts = [file for file in left if ".draft" in file]
            assert not drafts, (*where, drafts)
        counts["survived" if code == 0 else "refused"] += 1
        if code in (1, 2) and name not in RESUMED:
            assert all(left[file] == whole[file] for file in left.keys() - {MANIFEST}), (*where, left)
        elif code in (1, 2):
            again = [*words, "--resume"] if (disk / "o" / "study.json").exists() else words
            code, said = called(again, b"")
            assert code == 0, (*where, "again", code, said)
    return counts


def main_in_place(arguments: argparse.Namespace) -> None:
    """Run the sweeps; in a mount namespace of its own if there is one."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        prepare(place / "in")
        disk = place / "disk"
        disk.mkdir()
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
            for name in arguments.commands or COMMANDS:
                counts = sweep(name, place, arguments.sizes, limit)
                total += counts
                print(f"{sum(counts.values()):5d}  {name}: {dict(counts)}", flush=True)
        finally:
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
    parser.add_argument("commands", nargs="*", metavar="COMMAND", help=", ".join(COMMANDS))
    parser.add_argument("--sizes", type=int, default=100)
    parser.add_argument("--mounted", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.mounted or not namespace():
        main_in_place(given)
    else:
        sys.exit(subprocess.run(command(*sys.argv[1:]), check=False).returncode)
