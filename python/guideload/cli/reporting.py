"""Commands that show a report: printed to standard output and, with --report, written as HTML."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from guideload.cli.options import overwrite_picture_option, report_option
from guideload.cli.outputs import require_report
from guideload.cli.terminal import print_report, print_text, status

if TYPE_CHECKING:
    from guideload.reports.report import Report

    Shown = Report | tuple[Report, Callable[[Any], str]]


def shows_report(command: Callable[..., Shown]) -> Callable[..., None]:
    """Decorator: adds --report, and --overwrite where it is missing.

    The command returns its report, or its report and a function that makes its page with figures of `html_report`.
    """
    options = {option.name for option in getattr(command, "__click_params__", ())}

    @wraps(command)
    def show(report: Path | None, **arguments: Any) -> None:
        overwrite = arguments["overwrite"] if "overwrite" in options else arguments.pop("overwrite")
        output = arguments.get("output")
        given = [*arguments.values(), *arguments.get("files", ())]
        read = [one for one in given if isinstance(one, Path) and one != output]
        require_report(report, overwrite, *read, folder=output)
        found = command(**arguments)
        shown, page = found if isinstance(found, tuple) else (found, None)
        print_report(shown)
        if report is not None:
            from guideload import html_report

            with status("writing the HTML report"):
                made = page(html_report) if page else html_report.report_page(shown)
                html_report.save_page(made, report, replace=overwrite)
        files = (output, arguments.get("table"), report)
        if written := [str(path) for path in files if path is not None]:
            print_text(f"Wrote {' and '.join(written)}.")

    shown: Any = (
        report_option(show) if "overwrite" in options else report_option(overwrite_picture_option(show))
    )
    given = shown.__click_params__  # the last one comes first in the help: these are to come last
    shown.__click_params__ = given[len(options) :] + given[: len(options)]
    return cast(Callable[..., None], shown)
