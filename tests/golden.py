"""Golden files of help texts and error messages: `python tests/golden.py [--write]`.

Says which differ from what the program says now, and exits with 1 if any does; with --write they are written anew.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "helpers"))

from golden_pages import stale

if __name__ == "__main__":
    write = sys.argv[1:] == ["--write"]
    found = stale(write)
    print(*found, sep="\n")
    sys.exit(bool(found) and not write)
