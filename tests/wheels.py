"""The files of a release, made and tried: `python tests/wheels.py [--out FOLDER]`.

Makes wheels for Linux on x86-64 and aarch64 that ask for glibc 2.17 (manylinux2014), and the source distribution. A
plain `maturin build --release` links against the glibc of the machine at hand and asks for one nearly as new. Needs
Rust and a network: maturin and the linker (zig) come from PyPI into an environment that is thrown away.

Tried is then that
    the libraries hold no path of this machine, and ask for no newer glibc than their wheels say;
    the wheel for this processor installs where no compiler is on the path, and `guideload demo` runs there;
    the source distribution holds what a build needs and nothing else, installs, and `guideload demo` runs.

A wheel for another processor is not run. Exit code 0: all made; 2: a wheel was left out, as the last lines say. Ends at
the first failure with 1.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "rust" / "py"))
from build_backend import cargo_home, sysroot, without_paths  # noqa: E402

TARGETS = {"x86_64": "x86_64-unknown-linux-gnu", "aarch64": "aarch64-unknown-linux-gnu"}
NEWEST_GLIBC = (2, 17)  # of manylinux2014
COMPILERS = ("cargo", "rustc", "rustup", "maturin", "zig", "cc", "gcc", "clang", "ld")
SOURCES = {"PKG-INFO", "Cargo.lock", "Cargo.toml", "pyproject.toml", "README.md"}
SOURCES |= {
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "python/guideload",
    "rust/life",
    "rust/core",
    "rust/monitor",
    "rust/py",
}
NOT_SOURCES = {"rust/core/tests", "rust/core/examples", "rust/monitor/tests"}


@dataclass
class Made:
    """A file that was made, and what was found of it."""

    file: Path
    tag: str
    tried: list[str]


def main() -> None:
    """Make all, try all, print what there is."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=Path, default=ROOT / "target" / "release-files", help="folder for the files"
    )
    out = parser.parse_args().out.resolve()
    if shutil.which("cargo") is None:
        sys.exit("cargo is not on the path: install Rust from https://rustup.rs")
    out.mkdir(parents=True, exist_ok=True)
    for old in [*out.glob("guideload-*.whl"), *out.glob("guideload-*.tar.gz")]:
        old.unlink()
    left_out: list[str] = []
    with tempfile.TemporaryDirectory(prefix="guideload-") as folder:
        work = Path(folder)
        say("environment with maturin and zig")
        tools = new_environment(work / "tools", "maturin[zig]>=1.9,<2")
        made = [
            *(wheel for name in TARGETS if (wheel := built_wheel(name, tools, out, left_out)) is not None),
            source_distribution(tools, out),
        ]
        for each in made:
            if each.file.suffix != ".whl":
                try_source(each, work)
            elif platform.machine() in each.tag and sys.platform == "linux":
                try_wheel(each, work)
            else:
                each.tried.append("not run: for another processor")
    print()
    print_table(made)
    for reason in left_out:
        print(f"left out: {reason}")
    sys.exit(2 if left_out else 0)


# ---- making


def built_wheel(name: str, tools: Path, out: Path, left_out: list[str]) -> Made | None:
    """The wheel for a processor, if the standard library for it is there or can be had."""
    target = TARGETS[name]
    say(f"wheel for {name}")
    if not (standard_library(target) or (added(target) and standard_library(target))):
        left_out.append(
            f"wheel for {name}: no Rust standard library for {target} (rustup target add {target})"
        )
        print(f"    {left_out[-1]}")
        return None
    before = set(out.glob("*.whl"))
    run(
        *(
            str(tools / "maturin"),
            "build",
            "--release",
            "--locked",
            "--zig",
            "--features",
            "any-processor",
            "--compatibility",
            "manylinux2014",
        ),
        *("--target", target, "--out", str(out)),
        env=os.environ | {"PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", **without_paths()},
    )
    (file,) = set(out.glob("*.whl")) - before
    made = Made(file, tag=file.stem.split("-", 2)[2], tried=[])
    library = library_of(file)
    found = [path.decode() for path in paths_here() if path in library]
    if found:
        sys.exit(f"{file.name} holds paths of this machine: {', '.join(found)}")
    made.tried.append("no paths")
    newest = max(tuple(map(int, v.split(b"."))) for v in re.findall(rb"GLIBC_(\d+\.\d+)", library))
    if newest > NEWEST_GLIBC:
        sys.exit(f"{file.name} asks for glibc {newest}, newer than {NEWEST_GLIBC}")
    made.tried.append(f"glibc {newest[0]}.{newest[1]}")
    return made


def standard_library(target: str) -> bool:
    """Whether Rust's standard library for a target is installed."""
    asked = subprocess.run(
        ["rustc", "--print", "target-libdir", "--target", target], capture_output=True, text=True, cwd=ROOT
    )
    return asked.returncode == 0 and any(Path(asked.stdout.strip()).glob("libstd-*"))


def added(target: str) -> bool:
    """Whether rustup could add a target."""
    if shutil.which("rustup") is None:
        return False
    try:
        return subprocess.run(["rustup", "target", "add", target], cwd=ROOT, timeout=300.0).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def paths_here() -> list[bytes]:
    """What no library may hold."""
    folders = {Path.home(), cargo_home(), sysroot(), ROOT, Path(tempfile.gettempdir())}
    return sorted(f"{folder}{os.sep}".encode() for folder in folders) + [b".cargo"]


def library_of(wheel: Path) -> bytes:
    """The compiled core in a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".so"))
        return archive.read(name)


def source_distribution(tools: Path, out: Path) -> Made:
    """The source distribution, with what it must hold and nothing else."""
    say("source distribution")
    run(str(tools / "maturin"), "sdist", "--out", str(out))
    (file,) = out.glob("guideload-*.tar.gz")
    with tarfile.open(file) as archive:
        names = [name.split("/", 1)[1] for name in archive.getnames() if "/" in name]
    missing = sorted(part for part in SOURCES if not any(inside(name, part) for name in names))
    surplus = sorted(
        name
        for name in names
        if not any(inside(name, part) for part in SOURCES) or any(inside(name, part) for part in NOT_SOURCES)
    )
    if missing or surplus:
        sys.exit(f"{file.name}: missing {missing}, of no use {surplus}")
    return Made(file, tag="sources", tried=[f"{len(names)} files"])


def inside(name: str, part: str) -> bool:
    """Whether a file is a part, or in it."""
    return name == part or name.startswith(part + "/")


# ---- trying


def try_wheel(made: Made, work: Path) -> None:
    """Install a wheel and run the demonstration, with nothing on the path but the fresh environment."""
    say(f"{made.file.name} without a compiler")
    scripts = new_environment(work / "wheel")
    bare = {key: value for key, value in os.environ.items() if not key.startswith(("CARGO", "RUST"))}
    bare |= {"PATH": str(scripts)}
    present = [name for name in COMPILERS if shutil.which(name, path=bare["PATH"])]
    if present:
        sys.exit(f"on the path of the fresh environment: {', '.join(present)}")
    install(scripts, made.file, "--only-binary", ":all:", env=bare)
    demonstrate(scripts, work / "of-wheel", env=bare)
    made.tried.append("installs and runs without a compiler")


def try_source(made: Made, work: Path) -> None:
    """Build and install the source distribution in a fresh environment."""
    say(f"{made.file.name}: build and install")
    scripts = new_environment(work / "source")
    start = time.perf_counter()
    install(scripts, made.file, env=dict(os.environ))
    seconds = time.perf_counter() - start
    demonstrate(scripts, work / "of-source", env=dict(os.environ))
    made.tried.append(f"builds and installs in {seconds:.0f} s, runs")


def new_environment(folder: Path, *packages: str) -> Path:
    """A virtual environment with these packages; the folder of its programs."""
    venv.create(folder, with_pip=True)
    scripts = folder / ("Scripts" if os.name == "nt" else "bin")
    if packages:
        run(str(scripts / "python"), "-m", "pip", "install", "--quiet", *packages)
    return scripts


def install(scripts: Path, file: Path, *options: str, env: dict[str, str]) -> None:
    """Install one file and what it depends on."""
    run(str(scripts / "python"), "-m", "pip", "install", "--quiet", *options, str(file), env=env)


def demonstrate(scripts: Path, folder: Path, env: dict[str, str]) -> None:
    """Run `guideload demo`, away from the sources."""
    folder.mkdir()
    run(str(scripts / "guideload"), "demo", cwd=folder, env=env, quiet=True)
    if not any(path.is_file() for path in folder.rglob("*")):
        sys.exit("guideload demo wrote nothing")


# ---- telling


def run(*command: str, cwd: Path = ROOT, env: dict[str, str] | None = None, quiet: bool = False) -> None:
    """A command that must succeed."""
    done = subprocess.run(command, cwd=cwd, env=env, stdout=subprocess.DEVNULL if quiet else None)
    if done.returncode:
        sys.exit(f"\nexit code {done.returncode}: {' '.join(command)}")


def say(step: str) -> None:
    """The name of a step."""
    print(f"\n==> {step}", flush=True)


def print_table(made: list[Made]) -> None:
    """A line per file."""
    rows = [("file", "MB", "tag", "tried")]
    rows += [
        (each.file.name, f"{each.file.stat().st_size / 1e6:.2f}", each.tag, ", ".join(each.tried))
        for each in made
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    for row in rows:
        print("  ".join([*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[3]]))


if __name__ == "__main__":
    main()
