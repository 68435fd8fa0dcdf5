"""Licences and known vulnerabilities of what the program is made of: `python tests/advisories.py`.

The licences and sources of all Rust crates are checked always. `cargo deny` and `pip-audit` compare versions with
public lists of vulnerabilities; each is LEFT OUT, and says so, where the tool is not installed or its list cannot be
reached.
Exit code 1 if something was found.
"""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[1]
UNREACHABLE = re.compile(
    r"failed to (fetch|update|clone)|error sending request|Connection|resolve host|timed out"
)


def crates() -> list[str]:
    """Crates whose licence is not among those of deny.toml, or that are from elsewhere than crates.io."""
    allowed = set(tomllib.loads((ROOT / "deny.toml").read_text())["licenses"]["allow"])
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    packages = json.loads(subprocess.check_output(command, cwd=ROOT))["packages"]
    found = []
    for package in packages:
        name, licence = f"{package['name']} {package['version']}", package["license"] or "no licence"
        if not permits(licence, allowed):
            found.append(f"{name}: {licence}")
        if package["source"] not in (None, "registry+https://github.com/rust-lang/crates.io-index"):
            found.append(f"{name}: from {package['source']}")
    print(f"    {len(packages)} crates: {len(found)} with another licence or source than deny.toml allows")
    return found


def permits(licence: str, allowed: set[str]) -> bool:
    """Whether an SPDX expression can be met with allowed licences: one of its alternatives, all parts of each sum."""
    words = re.sub(r" WITH ", "_WITH_", licence.replace("/", " OR "))
    tokens = re.findall(r"[()]|[^\s()]+", words)
    known = {name.replace(" ", "_") for name in allowed}
    logic = {"OR": "or", "AND": "and", "(": "(", ")": ")"}
    return bool(
        eval(" ".join(logic.get(token, str(token in known)) for token in tokens))
    )  # of True, False and these


def tool(name: str, command: list[str], works: bool) -> list[str]:
    """What a tool finds; nothing if it is missing or its list cannot be reached, which is said."""
    if not works:
        print(f"    {name} is not installed: its check is LEFT OUT")
        return []
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    said = done.stdout + done.stderr
    if done.returncode and UNREACHABLE.search(said):
        print(f"    {name} cannot reach its list: its check is LEFT OUT")
        return []
    print(f"    {name}: {'found something' if done.returncode else 'nothing found'}")
    return [said] if done.returncode else []


def main() -> None:
    """Check all."""
    deny = ["cargo", "deny", "check", "advisories", "bans", "licenses", "sources"]
    found = [
        *crates(),
        *tool("cargo deny", deny, shutil.which("cargo-deny") is not None),
        *tool(
            "pip-audit",
            [sys.executable, "-m", "pip_audit", "--local", "--skip-editable", "--progress-spinner", "off"],
            importlib.util.find_spec("pip_audit") is not None,
        ),
    ]
    sys.exit("\n".join(found) if found else 0)


if __name__ == "__main__":
    main()
