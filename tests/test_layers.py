"""The layers of the house: packages import one way, and no files import each other in a circle, in both languages;
and what an import loads."""

import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import pytest

import guideload

ROOT = Path(__file__).resolve().parents[1]
# A package imports only from those that stand before it.
PYTHON = (
    "base",
    "catalogue",
    "machine",
    "motion",
    "parameters",
    "smoothing",
    "traces",
    "audit",
    "simulation",
    "life",
    "drive",
    "sensitivity",
    "sizing",
    "method_comparison",
    "monitor",
    "watch",
    "study",
    "duty",
    "long_runs",
    "identification",
    "reports",
    "plots",
    "html_report",
    "app",
    "cli",
)
TRACES = ("options", "format", "content", "quality", "channels", "reading", "inspection")
STUDY = (
    "distributions",
    "sampling",
    "varied_parameters",
    "quantities",
    "metadata",
    "factors",
    "options",
    "rated",
    "plan",
    "study",
    "storage",
    "statistics",
    "columns",
    "result",
    "verification",
    "tasks",
    "execution",
    "rare",
)

GRAPH = grimp.build_graph("guideload")  # lazy and type-checking imports included


def imports(prefix: str = "guideload.") -> dict[str, set[str]]:
    """The modules that each module below a package imports; not of the start of the command line."""
    modules = {one for one in GRAPH.modules if one.startswith(prefix)} - {"guideload.__main__"}
    return {module: GRAPH.find_modules_directly_imported_by(module) for module in modules}


def test_every_package_has_its_layer() -> None:
    folder = ROOT / "python" / "guideload"
    packages = {path.parent.name for path in folder.glob("*/__init__.py")}
    assert packages == set(PYTHON)
    assert {path.stem for path in folder.glob("*.py")} == {"__init__", "__main__"}


@pytest.mark.parametrize(
    ("package", "layers"), [("guideload", PYTHON), ("guideload.traces", TRACES), ("guideload.study", STUDY)]
)
def test_packages_import_one_way(package: str, layers: tuple[str, ...]) -> None:
    assert not GRAPH.find_illegal_dependencies_for_layers(layers=layers[::-1], containers={package})


def test_no_python_files_import_each_other_in_a_circle() -> None:
    TopologicalSorter(imports()).prepare()  # raises CycleError, which names the files


def test_no_file_imports_the_public_names() -> None:
    """`import guideload` is for users; inside, each name comes from the file that defines it."""
    users = {module for module, imported in imports().items() if "guideload" in imported}
    assert not {module for module in users if not module.startswith("guideload.app.")}


def test_the_page_uses_the_public_names_alone() -> None:
    of_page = imports("guideload.app.")
    assert len(of_page) > 5
    for module, imported in of_page.items():
        assert all(one == "guideload" or one.startswith("guideload.app.") for one in imported), module
    for file in (ROOT / "python" / "guideload" / "app").glob("*.py"):
        used = set(re.findall(r"\bguideload\.(\w+)", file.read_text(encoding="utf-8"))) - {"app"}
        assert used <= set(guideload.__all__), file.name


@pytest.mark.parametrize(
    ("module", "heavy"),
    [
        ("guideload", "pandas xarray scipy matplotlib pydantic pyarrow h5netcdf h5py rich"),
        ("guideload.cli.main", "nicegui tomlkit fastapi starlette"),
        ("guideload.html_report", "pandas pyarrow guideload.study"),
        ("guideload.traces.options", "numpy"),
        ("guideload.traces.reading", "pandas pyarrow scipy.linalg xarray"),
    ],
)
def test_an_import_loads_nothing_that_it_does_not_need(module: str, heavy: str) -> None:
    command = [sys.executable, "-c", f"import sys, {module}; print(*sys.modules)"]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert module in loaded and not set(heavy.split()) & set(loaded)
