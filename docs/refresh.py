"""Write every number and picture in README.md and docs/ that comes from the program: `python docs/refresh.py`.

    --check         change nothing; say which blocks differ, and exit with 1 if any does
    --no-pictures   numbers only

A block stands in a page between `<!-- begin: name -->` and `<!-- end: name -->`; the functions of `BLOCKS` write
them. The pictures of benchmarks, `speed-accuracy.png`, `monte-carlo.png`, `monitor-lag.png`, `torture.png` and
`measured-*.png`, are written by tests/benchmarks, and so are the tables between marks that name a script there.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
from click.testing import CliRunner
from example import (
    EXAMPLES,
    described,
    machine,
    paper,
    result,
    static_with_inertia,
    study,
)
from pictures import PICTURES

from guideload.base.warnings import LIMITS
from guideload.cli.main import main

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"(<!-- begin: ([\w-]+) -->\n)(.*?)(<!-- end: \2 -->)", re.DOTALL)


def pages() -> list[Path]:
    """README and all pages of the site."""
    return [
        ROOT / "README.md",
        *sorted(path for path in ROOT.glob("docs/**/*.md") if "_build" not in path.parts),
    ]


# ---- blocks


def newtons(value: float) -> str:
    return f"{value:,.0f} N".replace(",", " ")


def peaks() -> str:
    """Peak and static load of every carriage, with all dofs and with the paper's."""
    tables = [each.peaks()[["peak_resultant_N", "static_resultant_N"]] for each in (result(), paper())]
    rows = [
        "| carriage | peak resultant, guides carry all | static | peak resultant, the paper's dofs | static |",
        "|---|---:|---:|---:|---:|",
    ]
    for carriage in machine().carriages:
        loads = [newtons(load) for table in tables for load in table.loc[carriage.name]]
        rows.append(f"| {carriage.name} | {' | '.join(loads)} |")
    return "\n".join(rows)


def weight() -> str:
    vertical = paper().data["static_force"].sel(axis="y").sum().item()
    total = machine().body.mass * 9.80665
    return (
        f"In the example the guides' vertical loads then add up to {newtons(abs(vertical))} "
        f"under a weight of {newtons(total)}."
    )


def dynamics() -> str:
    """How far the dynamic peaks stand above a static calculation with m a."""
    damping = 100.0 * result().modes.damping_ratio
    table = result().peaks()
    by_hand = static_with_inertia()
    peak, dynamic = (
        np.hypot(*np.moveaxis(force, 2, 0)).max(axis=0) for force in (by_hand, by_hand - by_hand[0])
    )
    factor = table["peak_resultant_N"].to_numpy() / peak
    of_dynamic = table["dynamic_resultant_N"].to_numpy() / dynamic
    i = int(factor.argmax())
    return (
        f"The modes of the example are damped by {damping.min():.1f} to {damping.max():.1f} %. "
        f"Carriage {machine().carriages[i].name} peaks at {newtons(table['peak_resultant_N'].iloc[i])}; "
        f"a static calculation with weight and m a gives {newtons(peak[i])}. The peak is {factor[i]:.2f} times the "
        f"static one (a catalogue's f_W); the part above the load at rest is {of_dynamic[i]:.2f} times as large."
    )


def figure() -> str:
    """The largest load, where, when, and how sure."""
    row = result().peaks().sort_values("peak_resultant_N").iloc[-1]
    return (
        f"> Carriage {row.name} carries {newtons(row['peak_resultant_N'])} at most, at {row['time_of_peak_s']:.3f} s; "
        f"95 % credible band {newtons(row['peak_lower_N'])} to {newtons(row['peak_upper_N'])}."
    )


def limits() -> str:
    """The limits of the warnings."""
    rows = ["| figure | no warning | reason |", "|---|---|---|"]
    return "\n".join([*rows, *(f"| {one.figure} | {one.text} | {one.reason} |" for one in LIMITS.values())])


def study_table() -> str:
    limit = described().limits["peak_resultant"]
    rows = [f"| carriage | median | 95 % | 99 % | above {limit} |", "|---|---:|---:|---:|---:|"]
    for carriage in [each.name for each in machine().carriages]:
        name = f"peak_resultant_N[{carriage}]"
        quantiles = study().quantiles(name, [0.5, 0.95, 0.99])
        cells = [
            f"{newtons(value)} ± {error:.0f}"
            for value, error in zip(quantiles["value"], quantiles["standard_error"], strict=True)
        ]
        above = study().probability_above(name, limit)
        cells.append(f"{100 * above.value:.2f} % ± {100 * above.standard_error:.2f}".removesuffix(" ± nan"))
        rows.append(f"| {carriage} | {' | '.join(cells)} |")
    return "\n".join(rows)


def first(count: int) -> Callable[[list[str]], list[str]]:
    """The first paragraphs."""
    return lambda paragraphs: paragraphs[:count]


def between(begin: str, end: str) -> Callable[[list[str]], list[str]]:
    """The paragraphs from the one that begins with these words to the one before that which begins with those."""

    def chosen(paragraphs: list[str]) -> list[str]:
        at = [next(i for i, one in enumerate(paragraphs) if one.startswith(words)) for words in (begin, end)]
        return paragraphs[at[0] : at[1]]

    return chosen


def answer_and_table(paragraphs: list[str]) -> list[str]:
    """The first two paragraphs of a report and its first table."""
    return [*paragraphs[:2], next(paragraph for paragraph in paragraphs if "───" in paragraph)]


def printed(*arguments: str, choose: Callable[[list[str]], list[str]] = lambda all_of_it: all_of_it) -> str:
    """What a command prints in a folder with the packaged examples, or some paragraphs of it."""
    with example_folder():
        return chosen(output(*arguments), choose)


def chosen(text: str, choose: Callable[[list[str]], list[str]]) -> str:
    """A block with some paragraphs of what a command printed."""
    paragraphs = "\n\n".join(choose(text.strip("\n").split("\n\n")))
    return f"```text\n{paragraphs}\n```"


@contextmanager
def example_folder() -> Iterator[None]:
    """A folder with the packaged examples, as working directory."""
    here = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for file in EXAMPLES.glob("*.*"):
                Path(file.name).write_bytes(file.read_bytes())
            yield
        finally:
            os.chdir(here)


def output(*arguments: str, given: bytes = b"") -> str:
    """What a command prints. given: its standard input."""
    done = CliRunner().invoke(main, arguments, input=given, catch_exceptions=False)
    if done.exit_code:
        raise RuntimeError(f"guideload {' '.join(arguments)}: {done.output}")
    return done.stdout


def monitor_watch() -> str:
    """What the watch of the page on the monitor prints, from its first code."""
    page = (ROOT / "docs" / "how-to" / "monitor.md").read_text(encoding="utf-8")
    build = next(row for row in re.findall(r"^guideload (monitor build (?:.*\\\n)*.*)", page, re.MULTILINE))
    code = re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0]
    with example_folder():
        output(*shlex.split(build.replace("\\\n", " ")))
        exec(code, {})
        command, choose = ON_PAGE["monitor-watch"]
        return chosen(output(*command[:-2], given=Path(command[-1]).read_bytes()), choose)


@cache
def identification_report() -> str:
    return printed("identify", "identify.toml").removeprefix("```text\n").removesuffix("\n```")


def identification(choose: Callable[[list[str]], list[str]]) -> str:
    """Some paragraphs of the report of the packaged identify file."""
    text = "\n\n".join(choose(identification_report().split("\n\n")))
    return f"```text\n{text}\n```"


RUN = ("run", "manipulator.toml", "manipulator.csv", "-o", "out", "--no-pictures")


def stiffness_of_carriages() -> str:
    """Printed and estimated stiffness [N/um] by carriage and preload class."""
    sys.path.insert(0, str(ROOT / "tests" / "helpers"))
    from printed_stiffness import in_place_of_print, printed

    rows = [
        "| carriage | class | edition | printed | estimated | estimated/printed |",
        "|---|---|---|---:|---:|---:|",
    ]
    for name, preload_class, edition, stiffness in printed():
        estimate = in_place_of_print(name, preload_class).stiffness
        figures = f"{1e-6 * stiffness:.0f} | {1e-6 * estimate:.0f} | {estimate / stiffness:.2f}"
        rows.append(f"| {name} | {preload_class} | {edition} | {figures} |")
    return "\n".join(rows)


# Blocks of pages whose own code runs the same command, with what of its output they show: the test of such a page
# compares them, and the command, which takes long, does not run a second time.
ON_PAGE: dict[str, tuple[tuple[str, ...], Callable[[list[str]], list[str]]]] = {
    "monitor-watch": (("monitor", "watch", "monitor.toml", "<", "samples.csv"), lambda all_of_it: all_of_it),
    "probability": (
        ("probability", "study.toml", "--limit", "peak_resultant=8 kN", "--error", "20"),
        first(1),
    ),
}
BLOCKS: dict[str, Callable[[], str]] = {
    "peaks": peaks,
    "weight": weight,
    "dynamics": dynamics,
    "figure": figure,
    "limits": limits,
    "study": study_table,
    "probability": lambda: printed(*ON_PAGE["probability"][0], choose=ON_PAGE["probability"][1]),
    "report-head": lambda: printed(*RUN, choose=answer_and_table),
    "audit": lambda: f"```text\n{result().audit}\n```",
    "check": lambda: printed("check", "machine.toml"),
    "encoder": lambda: printed(
        "encoder", "manipulator.csv", "--machine", "manipulator.toml", choose=first(7)
    ),
    "monitor-watch": monitor_watch,
    "identify": lambda: identification(first(5)),
    "identify-worth": lambda: identification(between("What these", "Differences")),
    "stiffness": stiffness_of_carriages,
    "identify-next": lambda: identification(between("Which model", "Search")),
}


@cache
def block(name: str) -> str:
    """What the program gives for a block; pages share some."""
    return BLOCKS[name]()


# ---- writing


def refreshed(text: str) -> str:
    """The text of a page with its blocks as the program gives them."""
    return BLOCK.sub(lambda found: f"{found[1]}{block(found[2])}\n{found[4]}", text)


def stale(left_out: Collection[str] = ()) -> list[str]:
    """The blocks that differ from what the program gives, as "page: name"."""
    differing = []
    for page in pages():
        for _, name, inside, _ in BLOCK.findall(page.read_text(encoding="utf-8")):
            if name not in left_out and inside != f"{block(name)}\n":
                differing.append(f"{page.relative_to(ROOT)}: {name}")
    return differing


def run() -> None:
    parser = argparse.ArgumentParser(description="Refresh the numbers and pictures of README and docs.")
    parser.add_argument("--check", action="store_true", help="change nothing, exit with 1 if a block differs")
    parser.add_argument("--no-pictures", action="store_true", help="numbers only")
    options = parser.parse_args()
    differing = stale()
    print("\n".join(differing) or "all blocks are up to date")
    if options.check:
        sys.exit(bool(differing))
    for page in pages():
        text = page.read_text(encoding="utf-8")
        page.write_text(refreshed(text), encoding="utf-8", newline="\n")
    for name in () if options.no_pictures else PICTURES:
        print(PICTURES[name]().relative_to(ROOT))


if __name__ == "__main__":
    run()
