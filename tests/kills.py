"""Commands killed at random moments, with real signals: `python tests/kills.py [--kills 60]`.

Each round starts `guideload run` into a new folder, into one with an earlier run, or a study, and kills it with SIGKILL
or SIGTERM at a random moment. Whatever is there afterwards must be a whole set of one run or none, and the next run
must leave nothing hidden but the list of its files. Prints a row for the table in docs/robustness.md.
"""

from __future__ import annotations

import argparse
import json
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from guideload.cli.inputs import EXAMPLES
from guideload.cli.outputs import MANIFEST

MACHINE, TRACE = EXAMPLES / "manipulator.toml", EXAMPLES / "manipulator.csv"
RUN = ("run", MACHINE, TRACE, "--no-pictures")
STUDY = ("study", EXAMPLES / "study.toml", "--samples", "20000", "--seed", "1", "--no-pictures")
SIGNALS = (signal.SIGKILL, signal.SIGTERM)


def start(*words: object) -> subprocess.Popen[bytes]:
    """A command of guideload, without its output."""
    command = [sys.executable, "-m", "guideload", *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def succeeds(*words: object) -> None:
    """A command that must succeed."""
    process = start(*words)
    said = process.communicate()[1].decode()
    assert process.returncode == 0, (words, said)


def visible(folder: Path) -> dict[str, bytes]:
    """The files of a run in a folder that a user sees."""
    there = folder.iterdir() if folder.is_dir() else ()
    return {
        path.name: path.read_bytes() for path in there if not path.name.startswith(".") and path.is_file()
    }


def hidden(folder: Path) -> set[str]:
    """Names of drafts and locks below a folder; the lock of a study's samples stays, as it is no draft."""
    return {path.name for path in folder.rglob(".*")} - {MANIFEST, ".lock"}


def killed(number: int, rng: random.Random, longest: float, *words: object) -> bool:
    """Kill a command after a random time; whether it was still running."""
    process = start(*words)
    time.sleep(rng.uniform(0.3, 1.1) * longest)
    process.send_signal(number)
    said, code = process.communicate()[1].decode(), process.returncode
    assert code in (0, -number, 128 + number) and "Traceback" not in said, (code, said)
    return code != 0


def round_of_run(home: Path, rng: random.Random, longest: float, number: int, is_new: bool) -> str:
    """Kill a run; returns what became of it."""
    out = home / "out"
    old = ("--format", "csv", "--rtol", "1e-5")
    if not is_new:
        succeeds(*RUN, *old, "-o", out)
    before = visible(out)
    was_running = killed(number, rng, longest, *RUN, "-o", out, "--overwrite")
    after = visible(out)
    left = hidden(home)
    assert number == signal.SIGKILL or not left, left
    is_old, is_whole = after == before, set(after) == {"loads.nc", "report.txt"}
    assert (
        is_old
        or is_whole
        or (not is_new and after.items() <= before.items())
        or (not is_new and set(after) < {"loads.nc", "report.txt"})
    ), sorted(after)
    succeeds(*RUN, "-o", out, "--overwrite")
    assert set(visible(out)) == {"loads.nc", "report.txt"} and not hidden(home), hidden(home)
    return ("killed" if was_running else "had ended") + (", draft left and cleared" if left else "")


def round_of_study(
    home: Path, rng: random.Random, longest: float, number: int, expected: dict[str, object]
) -> str:
    """Kill a study, then resume it."""
    out = home / "study"
    was_running = killed(number, rng, longest, *STUDY, "-o", out)
    succeeds(*STUDY, "-o", out, "--resume")
    assert summary(out) == expected and not hidden(home), hidden(home)
    return "killed and resumed" if was_running else "had ended"


def summary(out: Path) -> dict[str, object]:
    """What a study found."""
    return json.loads((out / "summary.json").read_text())


def main() -> None:
    """Run all rounds and count."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng, counts = random.Random(arguments.seed), Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        begun = time.monotonic()
        succeeds(*RUN, "-o", home / "out")
        longest_run, begun = time.monotonic() - begun, time.monotonic()
        succeeds(*STUDY, "-o", home / "study")
        longest_study, expected = time.monotonic() - begun, summary(home / "study")
        for i in range(arguments.kills):
            place = home / f"round-{i}"
            place.mkdir()
            number = SIGNALS[i % 2]
            if i % 6 >= 4:
                done = round_of_study(place, rng, longest_study, number, expected)
            else:
                done = round_of_run(place, rng, longest_run, number, is_new=i % 6 >= 2)
            counts[f"{'study' if i % 6 >= 4 else 'run'}, {number.name}: {done}"] += 1
    for text, count in sorted(counts.items()):
        print(f"{count:5d}  {text}")
    print(f"{arguments.kills} rounds, all survived")


if __name__ == "__main__":
    main()
