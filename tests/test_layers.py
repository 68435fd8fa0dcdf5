"""The layers of the house: packages import one way, and no files import each other in a circle, in both languages."""

import re
from pathlib import Path

import grimp

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
    "second_look",
    "tasks",
    "execution",
    "rare",
)

Imports = dict[str, set[str]]


def python_imports() -> Imports:
    """The modules that each module imports, lazy and type-checking imports included."""
    graph = grimp.build_graph("guideload")
    modules = graph.modules - {
        "guideload",
        "guideload.__main__",
    }  # the public names, and the command line's start
    return {module: graph.find_modules_directly_imported_by(module) for module in modules}


def circles(imports: Imports) -> list[list[str]]:
    """Modules that import each other, directly or through others (Tarjan's strongly connected components)."""
    reached: dict[str, set[str]] = {}
    for start in imports:
        found: set[str] = set()
        todo = [start]
        while todo:
            for module in imports.get(todo.pop(), set()) - found:
                found.add(module)
                todo.append(module)
        reached[start] = found
    together = {
        frozenset(b for b in found if a in reached.get(b, set()))
        for a, found in reached.items()
        if a in found
    }
    return sorted(sorted(group) for group in together)


def backwards(imports: Imports, layers: tuple[str, ...], level: int) -> list[str]:
    """Imports from a layer into one that stands after it; `level`: where the layer stands in a module's path."""
    found = []
    for module, imported in imports.items():
        for other in imported:
            here, there = ((path.split(".") + [""] * 4)[level] for path in (module, other))
            if here in layers and there in layers and layers.index(here) < layers.index(there):
                found.append(f"{module} imports {other}")
    return found


def test_every_package_has_its_layer() -> None:
    folder = ROOT / "python" / "guideload"
    packages = {path.parent.name for path in folder.glob("*/__init__.py")}
    assert packages == set(PYTHON)
    assert {path.stem for path in folder.glob("*.py")} == {"__init__", "__main__"}


def test_python_packages_import_one_way() -> None:
    assert not backwards(python_imports(), PYTHON, 1)


def test_the_reading_of_traces_imports_one_way() -> None:
    traces = {a: b for a, b in python_imports().items() if a.startswith("guideload.traces.")}
    assert not backwards(traces, TRACES, 2)


def test_studies_import_one_way() -> None:
    study = {a: b for a, b in python_imports().items() if a.startswith("guideload.study.")}
    assert not backwards(study, STUDY, 2)


def test_no_python_files_import_each_other_in_a_circle() -> None:
    assert not circles(python_imports())


def test_no_file_imports_the_public_names() -> None:
    """`import guideload` is for users; inside, each name comes from the file that defines it."""
    users = {module for module, imported in python_imports().items() if "guideload" in imported}
    assert not {module for module in users if not module.startswith("guideload.app.")}


def test_the_page_uses_the_public_names_alone() -> None:
    imports = {a: b for a, b in python_imports().items() if a.startswith("guideload.app.")}
    assert len(imports) > 5
    for module, imported in imports.items():
        assert all(one == "guideload" or one.startswith("guideload.app.") for one in imported), module
    for file in (ROOT / "python" / "guideload" / "app").glob("*.py"):
        used = set(re.findall(r"\bguideload\.(\w+)", file.read_text(encoding="utf-8"))) - {"app"}
        assert used <= set(guideload.__all__), file.name


def test_a_circle_and_a_backward_import_would_be_found() -> None:
    imports = {"g.base.a": {"g.cli.b"}, "g.cli.b": {"g.cli.c"}, "g.cli.c": {"g.base.a"}}
    assert circles(imports) == [["g.base.a", "g.cli.b", "g.cli.c"]]
    assert backwards(imports, ("base", "cli"), 1) == ["g.base.a imports g.cli.b"]
