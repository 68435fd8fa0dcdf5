"""The HTML report: whole, without network, with every figure of the text report, and drawn by a real browser."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from command_line import EXAMPLES, MACHINE, TRACE, guideload, refused
from lives import PRODUCT, cart, moved
from machines import carriage, link, machine
from moves import BRISK
from reference import example
from texts import one_line, page_text

from guideload import Result, html_report, simulate
from guideload.catalogue.product import Product
from guideload.html_report.figures import MOST_POINTS, Line, chart
from guideload.plots.run import drawings
from guideload.plots.saving import save_each
from guideload.reports.report import Column, Definitions, Report, Section, Table
from guideload.reports.run import result_report

BROWSERS = "chromium", "chromium-browser", "google-chrome"
CHROMIUM = next(filter(None, map(shutil.which, BROWSERS)), None)
HOSTILE = '</script><img src="x" onerror="alert(1)">&$b_$'


@pytest.fixture(scope="module")
def result() -> Result:
    return simulate(*example())


@pytest.fixture(scope="module")
def page(result: Result, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = html_report.save(result, tmp_path_factory.mktemp("page") / "report.html")
    return path.read_text(encoding="utf-8")


class Elements(HTMLParser):
    """Elements with their attributes; fails on an element that is closed by another."""

    VOID = {"meta", "img", "br", "hr", "link"}

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def charts(text: str) -> list[dict[str, object]]:
    found = re.findall(r'<script type="application/json">(.*?)</script>', text, flags=re.DOTALL)
    return [json.loads(data) for data in found]


def unpacked(text: object, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(str(text)), dtype=kind)


def test_a_page_says_all_that_the_text_says(result: Result, page: str) -> None:
    """Every sentence, and every cell of every table."""
    report, words = result_report(result), one_line(page_text(page))
    for part in (part for one in report.sections for part in one.parts):
        if isinstance(part, Table):
            assert all(" ".join(cell.split()) in words for row in part.rows for cell in row)
        elif isinstance(part, str | list):
            assert all(text in words for text in ([part] if isinstance(part, str) else part))
        else:
            assert part is not None and all(text in words for text in part.texts)
    assert all(text in words for text in (*report.answer, *report.warnings, report.about))


def test_charts_have_the_histories(result: Result, page: str) -> None:
    """The charts hold the resultant of every carriage to single precision, at every sample."""
    resultants = next(one for one in charts(page) if one["title"] == "Resultant of Fy and Fz")
    data = result.quantities
    assert np.array_equal(unpacked(resultants["time"], "<f8"), data["time"])
    lines = resultants["lines"]
    assert isinstance(lines, list) and len(lines) == len(result.machine.carriages)
    for i, line in enumerate(lines):
        assert np.allclose(unpacked(line["values"], "<f4"), data["resultant"][:, i], rtol=1e-7, atol=0)


def test_long_histories_keep_their_extremes() -> None:
    """The envelope of a long history has its extremes, and its size does not grow with the history."""
    rng = np.random.default_rng(1)
    for size in (MOST_POINTS + 1, 10 * MOST_POINTS + 7):
        time, values = np.arange(size) * 1e-3, rng.standard_normal(size)
        data = json.loads(chart("noise", "N", time, [Line("a", values, "red")]).data)
        (line,) = data["lines"]
        drawn, instants = unpacked(line["values"], "<f4"), unpacked(data["time"], "<f8")
        assert drawn.size == instants.size == MOST_POINTS
        assert drawn.max() == np.float32(values.max()) and drawn.min() == np.float32(values.min())
        assert instants[0] == time[0] and instants[-1] == time[-1] and (np.diff(instants) >= 0).all()


def test_names_are_text() -> None:
    """A name with markup is shown as it is written."""
    hostile = machine(
        carriage(HOSTILE, x=-0.5),
        carriage("b", x=0.5),
        name=HOSTILE,
        links=[link(HOSTILE + "l", stiffness=1e8)],
        free=("x", "y", "z", "ry", "rz"),
    )
    page = html_report.run_page(simulate(hostile, moved(BRISK)))
    lines = charts(page)[0]["lines"]
    assert isinstance(lines, list) and lines[0]["name"] == HOSTILE
    parts = (Table(Column(HOSTILE, [HOSTILE], HOSTILE)), Definitions(HOSTILE), [HOSTILE], HOSTILE)
    report = Report(HOSTILE, [HOSTILE], [HOSTILE], HOSTILE, [Section(HOSTILE, *parts)])
    for text in (page, html_report.report_page(report)):
        found = Elements(text).found
        assert all(tag != "img" for tag, _ in found)
        assert not any(name.startswith("on") for _, attributes in found for name in attributes)


def test_ratings_that_nobody_compared_are_told_beside_the_verdict(pages: dict[str, str]) -> None:
    """In the first box, once; then causes of the worst load with their definitions."""
    product = Product(**PRODUCT | {"unverified": ["static"]})
    given = cart().model_copy(update={"products": (product,)})
    page = unescape(html_report.run_page(simulate(given, moved(BRISK))))
    note = "20: not checked by a person: static"
    box = re.search('<div class="answer[^>]*>(.*?)</div>', page, flags=re.DOTALL)
    assert box is not None and "static safety" in box[1] and note in box[1] and page.count(note) == 1
    causes = page[page.index("<h2>Causes of the worst instant</h2>") :]
    assert (
        "Acceleration: quasi-static load of the acceleration of the body (m a)"
        in causes[: causes.index("</section>")]
    )
    sized = unescape(pages["size"])
    assert sized.index("HGH25CA: not checked by a person") < sized.index("<table>")


def test_saved_whole_or_not_at_all(tmp_path: Path, page: str) -> None:
    assert page.endswith("</html>\n")
    with pytest.raises(OSError, match="there is no folder"):
        html_report.save_page(page, tmp_path / "missing" / "report.html")


def opened(page: str, folder: Path) -> str:
    """The page as Chromium shows it; fails on an error of its script."""
    path = folder / "report.html"
    path.write_text(page, encoding="utf-8")
    options = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-logging=stderr",
        f"--user-data-dir={folder}",
    ]
    ended = subprocess.run(
        [str(CHROMIUM), *options, "--virtual-time-budget=5000", "--dump-dom", path.as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 0
    without_pictures = re.sub(r"base64,[\w+/=]+", "", ended.stdout)  # random letters
    assert "CONSOLE" not in ended.stderr and "NaN" not in without_pictures
    return ended.stdout


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory, result: Result) -> dict[str, str]:
    """The reports that commands write, by command."""
    home = tmp_path_factory.mktemp("reports")
    other = home / "other.toml"
    other.write_text(
        Path(MACHINE).read_text(encoding="utf-8").replace("1250 kg", "1300 kg"), encoding="utf-8"
    )
    study = EXAMPLES / "study.toml"
    commands = {
        "run": ("run", MACHINE, TRACE, "-o", home / "out", "--no-pictures"),
        "check": ("check", MACHINE, TRACE),
        "modes": ("modes", MACHINE),
        "compare": ("compare", MACHINE, other, TRACE),
        "size": ("size", MACHINE, TRACE, "--from", EXAMPLES / "catalogue.toml", "--life", "5000 km"),
        "study": ("study", study, "-o", home / "study", "--samples", 32, "--no-pictures"),
    }
    found = {}
    for name, words in commands.items():
        report = home / f"{name}.html"
        assert str(report) in guideload(*words, "--report", report).stdout
        found[name] = report.read_text(encoding="utf-8")
    assert "exists" in refused(*commands["compare"], "--report", home / "compare.html")
    assert "no folder" in refused(*commands["compare"], "--report", home / "none" / "compare.html")
    assert ".html" in refused(*commands["compare"], "--report", home / "compare.pdf")
    return found


def test_a_run_may_write_the_report_alone(tmp_path: Path, pages: dict[str, str]) -> None:
    """Without -o there is no folder; the report is the same, and options about the folder are refused."""
    report = tmp_path / "run.html"
    text = guideload("run", MACHINE, TRACE, "--report", report).stdout
    assert "the largest load is" in " ".join(text.split()) and text.endswith(f"Wrote {report}.\n")
    assert list(tmp_path.iterdir()) == [report] and report.read_text(encoding="utf-8") == pages["run"]
    told = refused("run", MACHINE, TRACE)
    assert "-o" in told and "--report" in told
    for option in (("--format", "csv"), ("--no-pictures",)):
        assert f"{option[0]} needs -o" in refused(
            "run", MACHINE, TRACE, "--report", tmp_path / "b.html", *option
        )


@pytest.mark.parametrize("command", ["run", "check", "modes", "compare", "size", "study"])
def test_reports_of_commands(pages: dict[str, str], command: str, tmp_path: Path) -> None:
    """Each is a whole page without network, below 2 MB; Chromium draws every line of its charts without an error."""
    page = pages[command]
    assert len(page) < 2e6
    for tag, attributes in Elements(page).found:
        assert tag not in ("link", "iframe", "object")
        for name in ("src", "href", "xlink:href"):
            assert (attributes.get(name) or "#").startswith(("#", "data:")), tag
    assert "default-src 'none'" in page and not re.search(r"url\((?!#)|@import|fetch\(|XMLHttpRequest", page)
    assert "<table>" in page and (command in ("check", "modes") or "<svg" in page or charts(page))
    if CHROMIUM is not None:
        drawn = re.findall(r'<path d="M[\d. L-]+" stroke="[^"]+" class="line"', opened(page, tmp_path))
        assert len(drawn) == sum(len(one["lines"]) for one in charts(page))


def test_pictures_that_are_saved_already_make_the_same_page(
    result: Result, page: str, tmp_path: Path
) -> None:
    pictures = drawings(result)
    save_each(pictures, tmp_path)
    assert pictures["scene.png"]() is pictures["scene.png"]()  # drawn once
    number = re.compile(r"-?\d+\.\d{6}")  # of a picture, in points
    shown = html_report.run_page(result, pictures)
    assert number.sub("", shown) == number.sub("", page)
    places = [np.array(number.findall(text), dtype=float) for text in (shown, page)]
    np.testing.assert_allclose(*places, rtol=0.0, atol=2e-6)  # places found a second time are rounded anew
