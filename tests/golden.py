"""Golden files of help texts, error messages and reports: `python tests/golden.py [--write]`.

Says which differ from what the program says now, and exits with 1 if any does; with --write they are written anew.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "helpers"))

import golden_pages
import golden_reports

if __name__ == "__main__":
    write = sys.argv[1:] == ["--write"]
    found = [*golden_pages.stale(write), *golden_reports.stale(write)]
    print(*found, sep="\n")
    sys.exit(bool(found) and not write)
