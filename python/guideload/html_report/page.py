"""Any report as one HTML file that needs no network: the template `page.html` with its style and script."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from importlib.resources import files
from os import PathLike
from pathlib import Path

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from guideload.base.atomic import atomic_write
from guideload.base.versions import version
from guideload.html_report.figures import Figure
from guideload.reports.key_figures import KeyFigures
from guideload.reports.report import Report, Section


def report_page(
    report: Report, figures: Mapping[str, Iterable[Figure]] | None = None, summary: KeyFigures | None = None
) -> str:
    """A report as HTML, below the key figures of `summary`.

    figures: by the title of the section below whose text they stand; a new one is added.
    """
    drawn = {title: list(each) for title, each in (figures or {}).items()}
    titles = [one.title for one in report.sections]
    added = [Section(title) for title in drawn if title not in titles]
    page = replace(report, sections=[*report.sections, *added])
    return _template().render(
        report=page,
        summary=summary,
        figures={one.title: drawn.get(one.title, []) for one in page.sections},
        kind_of=lambda part: type(part).__name__,
        version=version("guideload"),
        style=Markup(package_file("page.css")),
        script=Markup(package_file("page.js")),
    )


def save_page(text: str, path: str | PathLike[str], *, replace: bool = True) -> Path:
    """Write a page, whole or not at all; returns its path.

    replace: whether a file that exists is replaced; if not, that is an error. Raises OSError if it cannot be written.
    """
    with atomic_write(Path(path), replace=replace) as draft:
        draft.write_text(text, encoding="utf-8")
    return Path(path)


@cache
def _template() -> Template:
    environment = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
    return environment.from_string(package_file("page.html"))


def package_file(name: str) -> str:
    """The text of a file of this package."""
    return (files(__package__) / name).read_text(encoding="utf-8")
