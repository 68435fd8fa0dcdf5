"""Everything that must hold, on a machine with nothing but Rust and Python: `python3 tests/run.py`.

Makes a virtual environment in .venv, builds and installs the package there, and runs formatting, lints, Rust tests, the
build without std and allocator, type checks, Python tests, and the documentation. The package is built while the Rust
steps run. Ends at the first failure.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
import venv
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ENVIRONMENT = ROOT / ".venv"
SCRIPTS = ENVIRONMENT / ("Scripts" if os.name == "nt" else "bin")
EMBEDDED = ROOT / "rust" / "embedded"
PRINTING = threading.Lock()
FAILED = threading.Event()


def main() -> None:
    """Run all steps."""
    python = str(SCRIPTS / "python")
    if shutil.which("cargo") is None:
        sys.exit("cargo is not on the path: install Rust from https://rustup.rs")
    if not (SCRIPTS / ("python.exe" if os.name == "nt" else "python")).exists():
        step("virtual environment", lambda: venv.create(ENVIRONMENT, with_pip=True))
    with ThreadPoolExecutor(1) as beside:
        rust = beside.submit(rust_steps)
        run("build and install", python, "-m", "pip", "install", "--quiet", ".[test,docs]")
        run("licences and known vulnerabilities", python, "tests/advisories.py")
        run("Python lints", python, "-m", "ruff", "check", ".")
        run("Python formatting", python, "-m", "ruff", "format", "--check", ".")
        run("Python types", python, "-m", "mypy")
        rust.result()
    run("load monitor on controllers", python, "tests/firmware.py")
    run("Python tests", python, "-m", "pytest", "-q", "-n", "auto")
    site = ["-W", "--keep-going", "-q", "-b", "html", "docs", "docs/_build/html"]
    run("documentation, warnings as errors", python, "-m", "sphinx", *site)
    print("\nall passed")


def rust_steps() -> None:
    """The steps that need Rust alone."""
    if component("rustfmt"):
        run("Rust formatting", "cargo", "fmt", "--all", "--check")
        for folder in (EMBEDDED, ROOT / "rust" / "firmware", ROOT / "rust" / "monitor-c"):
            run(f"Rust formatting, {folder.name}", "cargo", "fmt", "--check", cwd=folder)
    if component("clippy"):
        deny = ("--", "-D", "warnings")
        run("Rust lints", "cargo", "clippy", "--workspace", "--all-targets", *deny)
        run("Rust lints, no std", "cargo", "clippy", "-p", "guideload", "--no-default-features", *deny)
    run("Rust tests", "cargo", "test", "-p", "guideload")
    run("Rust tests, monitor", "cargo", "test", "-p", "guideload-monitor", "--features", "prepare")
    if sys.platform == "linux":
        run("no std, no allocator: build", "cargo", "build", "--release", "--quiet", cwd=EMBEDDED)
        program = EMBEDDED / "target" / "release" / "guideload-embedded"
        run("no std, no allocator: run", str(program))
        size = f"{program.stat().st_size / 1024:.0f} KiB"
        say(f"    program of {size}: the core, three methods, one scene")
        if shutil.which("size"):
            run("no std, no allocator: sizes", "size", str(program))


def component(name: str) -> bool:
    """Whether a part of the Rust toolchain is there, after trying to add it; says so if it is not."""
    command = {"rustfmt": "fmt", "clippy": "clippy"}[name]
    present = quiet("cargo", command, "--version")
    if not present and shutil.which("rustup"):
        present = quiet("rustup", "component", "add", name)
    if not present:
        say(f"\n==> {name} is neither installed nor to be had: its checks are LEFT OUT")
    return present


def quiet(*command: str) -> bool:
    """Whether a command succeeds."""
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return done.returncode == 0


def run(name: str, *command: str, cwd: Path = ROOT) -> None:
    """A step that is a command. In a thread beside the main one its output is printed when it ends, else at once."""
    beside = threading.current_thread() is not threading.main_thread()
    pipe = subprocess.PIPE if beside else None

    def call() -> None:
        done = subprocess.run(command, cwd=cwd, stdout=pipe, stderr=subprocess.STDOUT if beside else None)
        if beside:
            say(f"\n==> {name}\n{done.stdout.decode(errors='replace').rstrip()}")
        if done.returncode:
            FAILED.set()
            sys.exit(f"\n{name} failed with exit code {done.returncode}: {' '.join(command)}")

    step(name, call, says_name=not beside)


def step(name: str, action: Callable[[], object], says_name: bool = True) -> None:
    """Do one step, with its name before and its time after it; none after a failure in the other thread."""
    if FAILED.is_set():
        sys.exit(1)
    if says_name:
        say(f"\n==> {name}")
    start = time.perf_counter()
    action()
    say(f"    {name}: {time.perf_counter() - start:.1f} s")


def say(text: str) -> None:
    """Print one text whole."""
    with PRINTING:
        print(text, flush=True)


if __name__ == "__main__":
    main()
