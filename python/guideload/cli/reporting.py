"""Commands that show a report: printed, with -o drawn as a picture, and with --report written as an HTML page."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial, wraps
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from guideload.base.errors import PictureError
from guideload.cli.exit_codes import exit_if
from guideload.cli.inputs import paths
from guideload.cli.options import overwrite_picture_option, picture_option, report_option
from guideload.cli.outputs import PAGE, PICTURE_ENDINGS, file_draft, require_file, write_page
from guideload.cli.terminal import print_report, print_text, status

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from guideload.reports.report import Report


class Shown(NamedTuple):
    """What a command shows."""

    report: Report
    picture: Callable[[Any], Axes] | None = None  # draws the picture of -o by the module `plots`
    # makes the HTML page by the module `html_report`; default: the report alone
    page: Callable[[Any], str] | None = None
    failure: PictureError | None = None  # error of pictures that are missing, for the exit code


def shows_report(command: Callable[..., Report | Shown], *, picture: bool = False) -> Callable[..., None]:
    """Decorator: prints the report that the command returns; adds --report, and --overwrite where it is missing."""
    own = _names(command)

    @wraps(command)
    def show(**arguments: Any) -> None:
        report, output, overwrite = arguments["report"], arguments.get("output"), arguments["overwrite"]
        arguments = {name: value for name, value in arguments.items() if name in own}
        inputs = [value for name, value in arguments.items() if name not in ("output", "report")]
        read = paths(*inputs, *arguments.get("files", ()))
        drawn = output if picture else None
        if report is not None:
            require_file(report, [PAGE], overwrite, *read, folder=output)
        if drawn is not None:
            require_file(drawn, PICTURE_ENDINGS, overwrite, *read)
        with nullcontext() if drawn is None else file_draft(drawn, overwrite) as draft:
            found = command(**arguments)
            shown = found if isinstance(found, Shown) else Shown(found)
            if draft is not None and shown.picture is not None:
                with status("drawing the picture"):
                    from guideload import plots

                    plots.save(shown.picture(plots), draft)
        print_report(shown.report)
        if report is not None:
            from guideload import html_report

            with status("writing the HTML report"):
                page = shown.page(html_report) if shown.page else html_report.report_page(shown.report)
                write_page(page, report, overwrite, output)
        files = (output, arguments.get("table"), report)
        if written := [str(path) for path in files if path is not None]:
            print_text(f"Wrote {' and '.join(written)}.")
        exit_if(shown.failure)

    with_picture = (picture_option, overwrite_picture_option) if picture else ()
    added = _with_options(show, *with_picture, report_option, overwrite_picture_option)
    return cast("Callable[..., None]", added)


# Decorator: `shows_report`, and -o, which writes the picture that the command returns.
draws_report = partial(shows_report, picture=True)


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
