"""Coverage-guided fuzzing of the Rust core: `python tests/fuzz/core.py [SECONDS]`, of each target (60; an hour: 3600).

Needs `cargo install cargo-fuzz` and the nightly toolchain. The first build takes some minutes. What is found lies in
`rust/fuzz/artifacts`; once mended it belongs into `rust/fuzz/cases`, which every run tries first.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

FUZZ = Path(__file__).resolve().parents[2] / "rust" / "fuzz"
TARGETS = "scene", "batch"
LIMITS = "-timeout=10", "-max_len=600", "-len_control=0", "-rss_limit_mb=2048", "-verbosity=0"


def main() -> None:
    seconds = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    for command in (("cargo", "+nightly", "--version"), ("cargo", "fuzz", "--version")):
        try:
            subprocess.run(command, capture_output=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            print(f"`{' '.join(command)}` does not run: fuzzing of the core is LEFT OUT")
            return
    failed = []
    for target in TARGETS:
        corpus = FUZZ / "corpus" / target
        corpus.mkdir(parents=True, exist_ok=True)
        command = ("cargo", "+nightly", "fuzz", "run", "--fuzz-dir", str(FUZZ), "--sanitizer", "none", target)
        files = (str(corpus), str(FUZZ / "cases" / target))
        done = subprocess.run((*command, *files, "--", *LIMITS, f"-max_total_time={seconds}"), cwd=FUZZ)
        failed += [target] if done.returncode else []
    sys.exit(f"failed: {', '.join(failed)}" if failed else 0)


if __name__ == "__main__":
    main()
