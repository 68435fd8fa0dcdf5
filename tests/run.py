"""Everything that must hold, on a machine with nothing but Rust and Python: `python3 tests/run.py [--quick]`.

Makes a virtual environment in .venv, builds and installs the package there, and runs formatting, lints, Rust tests, the
build without std and allocator, type checks, Python tests, and the documentation. What the Python tests do not wait for
runs beside them. Ends at the first failure.

The compiled module and the Rust tests share one build of the core, by the profile `tests` of Cargo.toml: without
optimisation across crates, and with checks for overflow. tests/wheels.py builds and tries what is released.

--quick: for the developer's loop, after one whole run. The compiled module is built into the source tree, which the
tests import; unit tests of the core, and Python tests that took less than 0.5 s in their last run.
"""

from __future__ import annotations

import json
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
sys.path.insert(0, str(ROOT / "rust" / "py"))
from build_backend import lacks_avx2, without_paths  # noqa: E402

ENVIRONMENT = ROOT / ".venv"
SCRIPTS = ENVIRONMENT / ("Scripts" if os.name == "nt" else "bin")
PYTHON = SCRIPTS / ("python.exe" if os.name == "nt" else "python")
EMBEDDED = ROOT / "rust" / "embedded"
# The same profile and features wherever the core is built, or cargo would build it anew.
PROFILE = ("--profile", "tests")
PLAIN = "guideload-monitor/plain"
MOST_AGAIN = 20  # failed tests that are run again
PRINTING = threading.Lock()
FAILED = threading.Event()


def main() -> None:
    """Run all steps."""
    if shutil.which("cargo") is None:
        sys.exit("cargo is not on the path: install Rust from https://rustup.rs")
    quick = sys.argv[1:] == ["--quick"]
    if sys.argv[1:] and not quick:
        sys.exit(f"expected --quick or nothing, got {' '.join(sys.argv[1:])}")
    if quick and not PYTHON.exists():
        sys.exit("--quick needs the environment that `python3 tests/run.py` makes: run that once")
    if not PYTHON.exists():
        step("virtual environment", lambda: venv.create(ENVIRONMENT, with_pip=True))
    if not quick:
        os.environ["CARGO_INCREMENTAL"] = "0"  # what makes later builds faster takes a sixth of the first
    # One worker more than processors, as some tests wait for others; neighbours share fixtures.
    workers = str((os.cpu_count() or 1) + 1)
    tests = (str(PYTHON), "-m", "pytest", "-q", "-n", workers, "--dist", "worksteal")
    with ThreadPoolExecutor(2) as beside:
        others = [beside.submit(rust_lints_and_tests, quick)]
        if quick:
            build_module()
        else:
            # Most modules of the packages are never imported: to compile all takes longer than those that are.
            os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
            install = ("-m", "pip", "install", "--quiet", "--no-compile")
            step("dependencies", lambda: dependencies(install))
            features = f"{PLAIN},any-processor" if lacks_avx2() else PLAIN
            options = " ".join((*PROFILE, "--features", features))
            run("build and install", str(PYTHON), *install, ".[test,docs]", MATURIN_PEP517_ARGS=options)
        python_lints()
        others.append(beside.submit(types_controllers_and_documentation, quick))
        if quick:
            run("quick Python tests", *tests, "--quick", PYTHONPATH=str(ROOT / "python"))
        else:
            python_tests(*tests)
        for other in others:
            other.result()
    print("\nall passed")


def dependencies(install: tuple[str, ...]) -> None:
    """What the package and its tests need, by uv in a tenth of the time of pip. What uv cannot do is left to pip."""
    extras = ("-r", "pyproject.toml", "--extra", "test", "--extra", "docs")
    if quiet(str(PYTHON), *install, "--only-binary=:all:", "uv"):
        quiet(str(PYTHON), "-m", "uv", "pip", "install", "--python", str(PYTHON), *extras)


def python_tests(*tests: str) -> None:
    """All of them, with plain assertions: each worker would spend seconds on rewriting those of every file.

    What fails is run again with rewritten ones, for the values in its message; it has failed all the same.
    """
    try:
        run("Python tests", *tests, "--assert=plain")
    except SystemExit:
        noted = ROOT / ".pytest_cache" / "v" / "cache" / "lastfailed"
        names = json.loads(noted.read_text(encoding="utf-8")) if noted.exists() else {}
        if failed := [name for name in names if "::" in name]:  # the others are files that cannot be imported
            subprocess.run((str(PYTHON), "-m", "pytest", "-q", *failed[:MOST_AGAIN]), cwd=ROOT)
        raise


def python_lints() -> None:
    run("Python lints", str(PYTHON), "-m", "ruff", "check", ".")
    run("Python formatting", str(PYTHON), "-m", "ruff", "format", "--check", ".")


def rust_lints_and_tests(quick: bool) -> None:
    """The steps that need Rust alone."""
    if component("rustfmt"):
        run("Rust formatting", "cargo", "fmt", "--all", "--check")
        for folder in (EMBEDDED, ROOT / "rust" / "firmware", ROOT / "rust" / "monitor-c"):
            run(f"Rust formatting, {folder.name}", "cargo", "fmt", "--check", cwd=folder)
    if component("clippy"):
        deny = ("--", "-D", "warnings")
        run("Rust lints", "cargo", "clippy", "--workspace", "--all-targets", *deny)
    # No code for processors without AVX2, which this one would not run.
    without_fallback = ("--no-default-features", "--features")
    if quick:
        some = ("-p", "guideload", "--lib", "--test", "layers")
        run("Rust unit tests and layers", "cargo", "test", *some, *without_fallback, "std")
        return
    # The binding has no tests: it is there for the features that it asks of what the core depends on.
    names = ("guideload", "guideload-life", "guideload-monitor", "guideload-py")
    crates = (word for name in names for word in ("-p", name))
    features = f"guideload/std,guideload-monitor/prepare,{PLAIN}"
    run("Rust tests", "cargo", "test", *PROFILE, *crates, *without_fallback, features, **without_paths())
    if sys.platform == "linux":
        build = ("cargo", "build", "--release", "--quiet")
        run("no std, no allocator: build", *build, cwd=EMBEDDED, RUSTFLAGS="-D warnings")
        program = EMBEDDED / "target" / "release" / "guideload-embedded"
        run("no std, no allocator: run", str(program))
        size = f"{program.stat().st_size / 1024:.0f} KiB"
        say(f"    program of {size}: the core, three methods, one scene")
        if shutil.which("size"):
            run("no std, no allocator: sizes", "size", str(program))


def types_controllers_and_documentation(quick: bool) -> None:
    """What needs the package, but neither all cores nor the Python tests."""
    run("Python types", str(PYTHON), "-m", "mypy")
    if quick:
        return
    run("licences and known vulnerabilities", str(PYTHON), "tests/advisories.py")
    run("load monitor on controllers", str(PYTHON), "tests/firmware.py")
    site = ["-W", "--keep-going", "-q", "-b", "html", "docs", "docs/_build/html"]
    run("documentation, warnings as errors", str(PYTHON), "-m", "sphinx", *site)


def build_module() -> None:
    """The compiled module of the package in the source tree, where Python finds it by PYTHONPATH."""
    folder = ROOT / "target" / "quick"
    run(
        "compiled module",
        *("cargo", "build", *PROFILE, "--quiet", "-p", "guideload-py", "--target-dir", str(folder)),
        PYO3_PYTHON=str(PYTHON),
        CARGO_INCREMENTAL="1",
        **(
            {"RUSTFLAGS": "-C link-arg=-undefined -C link-arg=dynamic_lookup"}
            if sys.platform == "darwin"
            else {}
        ),
    )
    made, name = {
        "win32": ("_core.dll", "_core.pyd"),
        "darwin": ("lib_core.dylib", "_core.abi3.so"),
    }.get(sys.platform, ("lib_core.so", "_core.abi3.so"))
    place = ROOT / "python" / "guideload" / name
    shutil.copy(folder / "tests" / made, place.with_suffix(".new"))
    place.with_suffix(".new").replace(place)  # whole at any moment: another process may have it loaded


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


def run(name: str, *command: str, cwd: Path = ROOT, **environment: str) -> None:
    """A step that is a command, with these environment variables.

    In a thread beside the main one its output is printed when it ends, else at once. In the main thread it is ended if
    another step fails.
    """
    beside = threading.current_thread() is not threading.main_thread()

    def call() -> None:
        process = subprocess.Popen(
            command,
            cwd=cwd,
            env=os.environ | environment,
            stdout=subprocess.PIPE if beside else None,
            stderr=subprocess.STDOUT if beside else None,
        )
        if beside:
            output, _ = process.communicate()
            say(f"\n==> {name}\n{output.decode(errors='replace').rstrip()}")
        while process.poll() is None:
            if FAILED.wait(0.2):
                process.terminate()
                process.wait()
        if process.returncode:
            if not FAILED.is_set():
                say(f"\n{name} failed with exit code {process.returncode}: {' '.join(command)}")
            FAILED.set()
            sys.exit(1)

    step(name, call, says_name=not beside)


def step(name: str, action: Callable[[], object], says_name: bool = True) -> None:
    """Do one step, with its name before and its time after it; none after a failure in another thread."""
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
