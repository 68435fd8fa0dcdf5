"""Runs commands with hostile files and options: `python tests/damage/hostile_runs.py --minutes 60 [--seed 1]`.

Each run is a process of its own with 2 GiB of address space and 30 s of processor time. It must end with finite numbers
in all that it prints and writes, or with an error of the documented exit codes; anything else is a failure, and is
printed with the way to repeat it, `--case N`, which leaves the folder behind. A share of the cases is a test.
"""

from __future__ import annotations

import argparse
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

import made_files
import small_project
from damaged_bytes import damaged, damaged_text
from finite_outputs import faults, faults_of_text
from hostile_values import hostile_toml, hostile_word, learn_keys

ADDRESSES = 2 << 30  # bytes
SECONDS = 30  # of processor time
OPTIONS_SHARE = 0.15  # of the cases change an option, the others a file
GROUPS = {0: "finite", 1: "refused", 2: "refused", 3: "refused", 4: "refused"}  # by exit code


@dataclass(frozen=True)
class Outcome:
    """How a run ended. kind: finite, refused, memory, or failed; text: what was wrong, or the message."""

    kind: str
    text: str
    seconds: float


def prepare(folder: Path, case: int, only: str = "") -> tuple[str, str]:
    """Copy the project into `folder / "case"` and damage it; the command line, and what was done, in words."""
    rng = np.random.default_rng(case)
    lines = [line for line in small_project.COMMANDS if only in line]
    line = lines[int(rng.integers(len(lines)))]
    work = folder / "case"
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(folder / "valid", work)
    (work / "out").mkdir()
    words = small_project.words_of(line)[0]
    values = [
        i for i, word in enumerate(words) if i and words[i - 1].startswith("-") and not word.startswith("-")
    ]
    values = [i for i in values if not words[i].startswith("out/") and not (work / words[i]).exists()]
    if values and rng.random() < OPTIONS_SHARE:
        place = values[int(rng.integers(len(values)))]
        words[place] = hostile_word(words[place], rng)
        return "\0".join(words), f"{words[place - 1]} {words[place]}"
    names = small_project.files_of(line, work)
    name = names[int(rng.integers(len(names)) * rng.random())]  # more often the first
    change(work / name, rng)
    return "\0".join(words), name


def change(file: Path, rng: np.random.Generator) -> None:
    """Damage a file in a way that suits its kind."""
    if file.suffix == ".toml":
        hostile_toml(file, rng)
    elif file.suffix == ".parquet" and rng.random() < 0.5:
        file.write_bytes(made_files.frame(rng))
    elif file.suffix == ".npz" and rng.random() < 0.5:
        file.write_bytes(made_files.npz(rng))
    else:
        change_bytes = damaged_text if file.suffix in (".csv", ".txt") else damaged
        file.write_bytes(change_bytes(file.read_bytes(), rng))


def _sleeps(process: int) -> bool:
    """Whether no thread of a process runs, waits for a processor while others run, or waits for a disk."""
    for file in Path(f"/proc/{process}/task").glob("*/stat"):
        with suppress(OSError):
            if file.read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()[0] in "RD":
                return False
    return True


def run(folder: Path, words: list[str], stdin: str | None) -> Outcome:
    """Run a command in `folder / "case"`, in a process that is a copy of this one."""
    work = folder / "case"
    child = os.fork()
    if child == 0:
        _become(work, words, stdin)
    watch = os.pidfd_open(child)
    asleep = 0  # s; one that sleeps has no processor time
    while not (ended := select.select([watch], [], [], 1.0)[0]) and asleep < 4 * SECONDS:
        asleep += _sleeps(child)
    if not ended:
        os.kill(child, signal.SIGKILL)
    os.close(watch)
    _, status, used = os.wait4(child, 0)
    seconds = used.ru_utime + used.ru_stime
    code = os.waitstatus_to_exitcode(status)
    out, err = (
        (folder / name).read_text(encoding="utf-8", errors="replace") for name in ("stdout", "stderr")
    )
    if not ended:
        return Outcome("failed", f"asleep for {asleep} s", seconds)
    if code < 0:
        what = (
            "beyond the processor time" if code in (-signal.SIGXCPU, -signal.SIGKILL) else f"signal {-code}"
        )
        return Outcome("failed", what, seconds)
    if "Traceback" in err or "panicked" in err or "Exception ignored" in err:
        return Outcome("failed", _last_lines(err), seconds)
    if code not in GROUPS:
        return Outcome("failed", f"exit code {code}", seconds)
    if "Warning: " in err and "Error: " not in err and re_warning(err):
        return Outcome("failed", f"a warning of Python: {_last_lines(err)}", seconds)
    if code == 0:
        wrong = faults_of_text(out, "printed") + faults(work / "out")
        return Outcome("failed", "; ".join(wrong), seconds) if wrong else Outcome("finite", "", seconds)
    if "Error: " not in err and "Usage: " not in err and code in (1, 2):
        return Outcome("failed", f"exit code {code} without a message", seconds)
    wrong = [f for f in faults(work / "out")]
    if wrong:
        return Outcome("failed", "; ".join(wrong), seconds)
    kind = "memory" if "not enough memory" in err else "refused"
    return Outcome(kind, err.strip(), seconds)


def re_warning(err: str) -> bool:
    """Whether a warning of Python or NumPy was printed."""
    return any(
        f"{name}: " in err
        for name in ("RuntimeWarning", "UserWarning", "DeprecationWarning", "FutureWarning")
    )


def _last_lines(err: str) -> str:
    """The error at the end of a traceback, and the last place of the package in it."""
    lines = err.strip().splitlines()
    places = [line.strip() for line in lines if "/guideload/" in line and line.strip().startswith("File")]
    return f"{lines[-1][:240]} ({places[-1].split('/guideload/')[-1] if places else ''})"


def _become(work: Path, words: list[str], stdin: str | None) -> None:
    """The child: run the command line, and never return."""
    code = 1
    try:
        os.chdir(work)
        for number, target in ((1, work.parent / "stdout"), (2, work.parent / "stderr")):
            os.dup2(os.open(target, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        os.dup2(os.open(work / stdin if stdin else os.devnull, os.O_RDONLY), 0)
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 5))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        from guideload.cli.main import main as guideload

        guideload(words, prog_name="guideload")
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def warm_up() -> None:
    """Import what commands import, so that each copy of this process has it; nothing runs, so that no thread exists."""
    import importlib
    import pkgutil

    import guideload

    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    for module in pkgutil.walk_packages(guideload.__path__, "guideload."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    for name in (
        "pandas",
        "scipy.stats",
        "scipy.optimize",
        "pyarrow.parquet",
        "h5py",
        "xarray",
        "matplotlib",
    ):
        importlib.import_module(name)
    learn_keys()


def outcome_of(folder: Path, case: int, only: str = "") -> tuple[str, str, Outcome]:
    """The command line, what was damaged, and how it ended."""
    line, what = prepare(folder, case, only)
    words = line.split("\0")
    stdin = "samples.txt" if words[:2] == ["monitor", "watch"] else None
    return " ".join(words), what, run(folder, words, stdin)


def main() -> None:
    """Run for the asked time, and print a table of outcomes by command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--count", type=int, default=10**9, help="end after so many cases")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="commands whose line has this text")
    parser.add_argument("--case", type=int, help="run this one case, show it, and keep its folder")
    asked = parser.parse_args()
    warm_up()
    folder = Path(tempfile.mkdtemp(prefix="guideload-hostile-"))
    (folder / "valid").mkdir()
    write = os.fork()  # writing computes, and would start threads here
    if write == 0:
        try:
            small_project.write_project(folder / "valid")
            os._exit(0)
        finally:
            os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(write, 0)[1]) == 0
    if asked.case is not None:
        line, what, found = outcome_of(folder, asked.case, asked.only)
        print(
            f"guideload {line}\n{what}, in {folder / 'case'}\n{found.kind} in {found.seconds:.1f} s: {found.text}"
        )
        print((folder / "stderr").read_text(encoding="utf-8", errors="replace"), file=sys.stderr)
        return
    end, case, first = time.monotonic() + 60 * asked.minutes, asked.seed * 1_000_000, {}
    option = f" --only {asked.only!r}" if asked.only else ""
    counts: dict[str, Counter[str]] = {}
    slowest: dict[str, float] = {}
    while time.monotonic() < end and case < asked.seed * 1_000_000 + asked.count:
        line, what, found = outcome_of(folder, case, asked.only)
        name = " ".join(line.split()[: 2 if line.startswith(("monitor", "catalogue")) else 1])
        counts.setdefault(name, Counter())[found.kind] += 1
        slowest[name] = max(slowest.get(name, 0.0), found.seconds)
        key = (name, found.text[:100])
        if found.kind == "failed" and key not in first:
            first[key] = case
            print(
                f"--case {case}{option}: {line[:120]} [{what[:60]}]: {found.text}",
                flush=True,
            )
        case += 1
    kinds = ("finite", "refused", "memory", "failed")
    print(f"{'command':<18}{'tried':>7}" + "".join(f"{kind:>9}" for kind in kinds) + "   slowest")
    for name, found in sorted(counts.items()):
        print(
            f"{name:<18}{found.total():>7}"
            + "".join(f"{found[kind]:>9}" for kind in kinds)
            + f"   {slowest[name]:.1f} s"
        )
    total = sum(counts.values(), Counter())
    print(f"{'all':<18}{total.total():>7}" + "".join(f"{total[kind]:>9}" for kind in kinds))
    shutil.rmtree(folder)
    sys.exit(bool(total["failed"]))


if __name__ == "__main__":
    main()
