"""Commands that show a report: printed, with -o drawn as a picture, and with --report written as an HTML page."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from guideload.base.errors import PictureError
from guideload.cli.exit_codes import exit_if
from guideload.cli.options import overwrite_picture_option, picture_option, report_option
from guideload.cli.outputs import PICTURE_ENDINGS, file_draft, require_file
from guideload.cli.terminal import print_report, print_text, status

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from guideload.reports.report import Report


class Shown(NamedTuple):
    """What a command shows.

    picture  draws the picture of `draws_report` by the module `plots`
    page     makes the HTML page by the module `html_report`; default: the report alone
    failure  error of pictures that are missing, for the exit code
    """

    report: Report
    picture: Callable[[Any], Axes] | None = None
    page: Callable[[Any], str] | None = None
    failure: PictureError | None = None


def draws_report(command: Callable[..., Shown]) -> Callable[..., None]:
    """Decorator: `shows_report`, and -o, which writes the picture that the command returns."""
    has_overwrite = "overwrite" in _names(command)

    @wraps(command)
    def draw(output: Path | None, overwrite: bool, **arguments: Any) -> Shown:
        if has_overwrite:
            arguments["overwrite"] = overwrite
        if output is None:
            return command(**arguments)
        require_file(output, PICTURE_ENDINGS, overwrite, *_paths(arguments))
        with file_draft(output, overwrite) as draft:
            shown = command(**arguments)
            if shown.picture is not None:
                with status("drawing the picture"):
                    from guideload import plots

                    plots.save(shown.picture(plots), draft)
        return shown

    return shows_report(_with_options(draw, picture_option, overwrite_picture_option))


def shows_report(command: Callable[..., Report | Shown]) -> Callable[..., None]:
    """Decorator: prints the report that the command returns; adds --report, and --overwrite where it is missing."""
    has_overwrite = "overwrite" in _names(command)

    @wraps(command)
    def show(report: Path | None, **arguments: Any) -> None:
        overwrite = arguments["overwrite"] if has_overwrite else arguments.pop("overwrite")
        output = arguments.get("output")
        if report is not None:
            read = [path for path in _paths(arguments) if path != output]
            require_file(report, [".html"], overwrite, *read, folder=output)
        found = command(**arguments)
        shown = found if isinstance(found, Shown) else Shown(found)
        print_report(shown.report)
        if report is not None:
            from guideload import html_report

            with status("writing the HTML report"):
                page = shown.page(html_report) if shown.page else html_report.report_page(shown.report)
                html_report.save_page(page, report, replace=overwrite)
        files = (output, arguments.get("table"), report)
        if written := [str(path) for path in files if path is not None]:
            print_text(f"Wrote {' and '.join(written)}.")
        exit_if(shown.failure)

    return cast("Callable[..., None]", _with_options(show, report_option, overwrite_picture_option))


def _paths(arguments: dict[str, Any]) -> list[Path]:
    """The files among the arguments of a command."""
    given = [*arguments.values(), *arguments.get("files", ())]
    return [one for one in given if isinstance(one, Path)]


def _names(command: Any) -> set[str]:
    return {option.name for option in command.__click_params__}


def _with_options(command: Any, *options: Callable[[Any], Any]) -> Any:
    """The command with more options, last in its help; those that it has already are left out."""
    for option in options:
        known = _names(command)
        option(command)
        added = command.__click_params__.pop()
        if added.name not in known:
            command.__click_params__.insert(0, added)  # the last one comes first in the help
    return command
