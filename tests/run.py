"""Everything that must hold, on a machine with nothing but Rust and Python: `python3 tests/run.py`.

Makes a virtual environment in .venv, builds and installs the package there, and runs formatting, lints, Rust tests, the
build without std and allocator, type checks, Python tests, and the documentation. Ends at the first failure.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
import venv
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ENVIRONMENT = ROOT / ".venv"
SCRIPTS = ENVIRONMENT / ("Scripts" if os.name == "nt" else "bin")
EMBEDDED = ROOT / "rust" / "embedded"


def main() -> None:
    """Run all steps."""
    python = str(SCRIPTS / "python")
    if shutil.which("cargo") is None:
        sys.exit("cargo is not on the path: install Rust from https://rustup.rs")
    if not (SCRIPTS / ("python.exe" if os.name == "nt" else "python")).exists():
        step("virtual environment", lambda: venv.create(ENVIRONMENT, with_pip=True))
    run("build and install", python, "-m", "pip", "install", "--quiet", ".[test,docs]")

    if component("rustfmt"):
        run("Rust formatting", "cargo", "fmt", "--all", "--check")
        for folder in (EMBEDDED, ROOT / "rust" / "firmware", ROOT / "rust" / "monitor-c"):
            run(f"Rust formatting, {folder.name}", "cargo", "fmt", "--check", cwd=folder)
    if component("clippy"):
        run("Rust lints", "cargo", "clippy", "--workspace", "--all-targets", "--", "-D", "warnings")
        run(
            "Rust lints, no std",
            "cargo",
            "clippy",
            "-p",
            "guideload",
            "--no-default-features",
            "--",
            "-D",
            "warnings",
        )
    run("licences and known vulnerabilities", python, "tests/advisories.py")
    run("Rust tests", "cargo", "test", "-p", "guideload")
    run("Rust tests, monitor", "cargo", "test", "-p", "guideload-monitor", "--features", "prepare")
    if sys.platform == "linux":
        run("no std, no allocator: build", "cargo", "build", "--release", "--quiet", cwd=EMBEDDED)
        program = EMBEDDED / "target" / "release" / "guideload-embedded"
        run("no std, no allocator: run", str(program))
        print(f"    program of {program.stat().st_size / 1024:.0f} KiB: the core, three methods, one scene")
        if shutil.which("size"):
            run("no std, no allocator: sizes", "size", str(program))

    run("load monitor on controllers", python, "tests/firmware.py")

    run("Python lints", python, "-m", "ruff", "check", ".")
    run("Python formatting", python, "-m", "ruff", "format", "--check", ".")
    run("Python types", python, "-m", "mypy")
    run("Python tests", python, "-m", "pytest", "-q", "-n", "auto")
    site = ["-W", "--keep-going", "-q", "-b", "html", "docs", "docs/_build/html"]
    run("documentation, warnings as errors", python, "-m", "sphinx", *site)
    print("\nall passed")


def component(name: str) -> bool:
    """Whether a part of the Rust toolchain is there, after trying to add it; says so if it is not."""
    command = {"rustfmt": "fmt", "clippy": "clippy"}[name]
    present = quiet("cargo", command, "--version")
    if not present and shutil.which("rustup"):
        present = quiet("rustup", "component", "add", name)
    if not present:
        print(f"\n==> {name} is neither installed nor to be had: its checks are LEFT OUT", flush=True)
    return present


def quiet(*command: str) -> bool:
    """Whether a command succeeds."""
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return done.returncode == 0


def run(name: str, *command: str, cwd: Path = ROOT) -> None:
    """A step that is a command."""

    def call() -> None:
        code = subprocess.run(command, cwd=cwd).returncode
        if code:
            sys.exit(f"\n{name} failed with exit code {code}: {' '.join(command)}")

    step(name, call)


def step(name: str, action: Callable[[], None]) -> None:
    """Do one step, with its name before and its time after it."""
    print(f"\n==> {name}", flush=True)
    start = time.perf_counter()
    action()
    print(f"    {time.perf_counter() - start:.1f} s", flush=True)


if __name__ == "__main__":
    main()
