"""Reads damaged files by the thousand: `python tests/damage/damage_runs.py --seed 1 --count 2000 [--only npz,npy]`.

Each file must end in a finite result, or in a GuideloadError (a MemoryError, if damage asks for too much) whose message
begins with the name of the file; within LIMIT seconds, without a warning and without the end of the process. Files are
read in a process of their own, because damage may crash or stall the libraries below; it is started again after each
such case. `--case N` of one format reads one file here, with its traceback.
"""

from __future__ import annotations

import argparse
import multiprocessing
import shutil
import sys
import tempfile
import time
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

import made_files
from damaged_bytes import damaged, damaged_text

from guideload.base.errors import GuideloadError
from guideload.simulation.result import Result
from guideload.study.result import StudyResult
from guideload.study.storage import open_store
from guideload.traces.reading import motion_from_trace, read_trace

LIMIT = 60.0  # s for one file, far above the usual 0.05 s, also on a busy computer
START = 300.0  # s for the start of the process
TEXTS = made_files.texts()
TRACES = (*(f"{name}.csv" for name in TEXTS), "npz", "npy", "parquet", "mat", "v73.mat")
RESULTS = ("loads.nc", "loads.parquet")
STUDY = ("study.json", "samples", "histories.nc")
FORMATS = (*TRACES, *RESULTS, *STUDY)


def finite(*arrays: np.ndarray) -> None:
    """All numbers are finite."""
    assert all(np.isfinite(array).all() for array in arrays), "numbers that are not finite"


def path_of(folder: Path, name: str) -> Path:
    """The file or folder that is read, which errors must name."""
    if name in STUDY:
        return folder / "out"
    return folder / (f"trace.{name}" if name in TRACES and not name.endswith(".csv") else name)


def read_damaged_trace(path: Path, name: str, rng: np.random.Generator) -> None:
    """A damaged trace, read and smoothed."""
    made = {"npz": made_files.npz, "npy": made_files.npy, "parquet": made_files.frame}
    made |= {"mat": made_files.mat, "v73.mat": made_files.mat73}
    stem = name.removesuffix(".csv")
    path.write_bytes(damaged_text(TEXTS[stem], rng) if stem in TEXTS else made[name](rng))
    options = made_files.options_of(stem) | ({"kind": "position"} if name == "npy" else {})
    options |= {"column": "x_m"} if name.endswith(("npz", "parquet", "mat")) else {}
    if rng.random() < 0.4:
        options |= {"repair": "all"}
    options = options if rng.random() < 0.9 else {}
    trace = read_trace(path, **options)
    finite(trace.time, trace.value, np.array([trace.quantum, trace.tick, trace.jitter]))
    if trace.kind != "motor_speed" and trace.time.size < 10_000:
        finite(motion_from_trace(trace).acceleration)


def read_damaged_result(path: Path, name: str, rng: np.random.Generator) -> None:
    """A damaged result, with its peaks and its audit."""
    path.write_bytes(_changed((path.parent / "valid" / name).read_bytes(), name, rng))
    result = Result.load(path)
    if result.quantities["time"].size:
        result.peaks()
        assert result.audit.lines
    finite(*(each.values for each in result.quantities.variables.values() if each.values.dtype.kind == "f"))


def read_damaged_study(study: Path, name: str, rng: np.random.Generator) -> None:
    """A damaged study: its statistics, and whether it can be resumed."""
    shutil.rmtree(study, ignore_errors=True)
    shutil.copytree(study.parent / "valid" / "study", study)
    files = sorted(study.glob("samples/*.parquet")) if name == "samples" else [study / name]
    path = files[int(rng.integers(len(files)))]
    path.write_bytes(_changed(path.read_bytes(), name, rng))
    loaded = StudyResult.load(study)
    loaded.store.histories()
    assert loaded.failed >= 0 and loaded.finished <= loaded.runs
    loaded.summary(), loaded.failures(), loaded.table()
    with open_store(loaded.metadata, study, True) as store:
        finite(*(table["sample"].to_numpy() for table in store.tables()))


def _changed(content: bytes, name: str, rng: np.random.Generator) -> bytes:
    if name.endswith(".json") and rng.random() < 0.1:
        return made_files.nested(int(10 ** rng.uniform(1, 6)))
    is_text = name.endswith((".csv", ".json")) and rng.random() < 0.7
    return damaged_text(content, rng) if is_text else damaged(content, rng)


def reader_of(name: str) -> Callable[[Path, str, np.random.Generator], object]:
    """The function that damages and reads this format."""
    if name in TRACES:
        return read_damaged_trace
    return read_damaged_study if name in STUDY else read_damaged_result


def outcome(folder: Path, name: str, seed: int) -> str:
    """`valid`, `refused`, or what went wrong."""
    rng, path = np.random.default_rng((zlib.crc32(name.encode()), seed)), path_of(folder, name)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            reader_of(name)(path, name, rng)
        except (GuideloadError, MemoryError) as error:
            text = str(error)
            is_named = text.startswith((str(path), path.name)) and len(text) < 4000
            return "refused" if is_named else f"no file name: {type(error).__name__}: {text[:160]}"
        except Exception as error:
            return f"{type(error).__name__}: {' '.join(str(error).split())[:160]}"
    return "valid"


def valid_files(folder: Path) -> None:
    """The valid files that are damaged later."""
    (folder / "valid").mkdir()
    made_files.result_files(folder / "valid")
    made_files.study_folder(folder / "valid" / "study")


def _worker(pipe: Connection, folder: str) -> None:
    pipe.send("ready")
    while True:
        pipe.send(outcome(Path(folder), *pipe.recv()))


def outcomes(folder: Path, cases: list[tuple[str, int]]) -> Iterator[str]:
    """The outcome of each case; `stalled` and `crashed` are outcomes too."""
    spawn = multiprocessing.get_context("spawn")
    process, pipe = None, None
    for case in cases:
        if process is None:
            pipe, end = spawn.Pipe()
            process = spawn.Process(target=_worker, args=(end, str(folder)), daemon=True)
            process.start()
            end.close()
            assert pipe.poll(START) and pipe.recv() == "ready"
        found = "stalled"
        try:
            pipe.send(case)
            if pipe.poll(LIMIT):
                found = pipe.recv()
        except (EOFError, BrokenPipeError, ConnectionResetError):
            process.join()
            found = f"crashed, exit code {process.exitcode}"
        if found.startswith(("stalled", "crashed")):
            process.kill()
            process.join()
            process = None
        yield found
    if process is not None:
        process.kill()
        process.join()


def main() -> None:
    """Read as many damaged files as asked, and print a table of outcomes and the cases that went wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1000, help="files of each format")
    parser.add_argument("--only", default=",".join(FORMATS), help="formats, with commas")
    parser.add_argument("--case", type=int, help="read this one case here")
    asked = parser.parse_args()
    names = asked.only.split(",")
    with tempfile.TemporaryDirectory() as space:
        folder = Path(space)
        valid_files(folder)
        if asked.case is not None:
            warnings.simplefilter("error")
            rng = np.random.default_rng((zlib.crc32(names[0].encode()), asked.case))
            reader_of(names[0])(path_of(folder, names[0]), names[0], rng)
            return
        failed = 0
        print(f"{'format':<16}{'tried':>7}{'valid':>7}{'refused':>9}{'failed':>8}   slowest")
        for name in names:
            counts: Counter[str] = Counter()
            first: dict[str, int] = {}
            slowest, before = 0.0, time.perf_counter()
            seeds = range(asked.seed * 1_000_000, asked.seed * 1_000_000 + asked.count)
            for seed, found in zip(seeds, outcomes(folder, [(name, one) for one in seeds]), strict=True):
                counts[found] += 1
                first.setdefault(found, seed)
                slowest, before = max(slowest, time.perf_counter() - before), time.perf_counter()
            wrong = {found: count for found, count in counts.items() if found not in ("valid", "refused")}
            failed += sum(wrong.values())
            print(
                f"{name:<16}{asked.count:>7}{counts['valid']:>7}{counts['refused']:>9}{sum(wrong.values()):>8}"
                f"   {slowest:.1f} s",
                flush=True,
            )
            for found, count in sorted(wrong.items(), key=lambda item: -item[1])[:25]:
                print(f"    {count:>5} x {found}   (--only {name} --case {first[found]})", flush=True)
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
