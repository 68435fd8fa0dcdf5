"""The command `guideload monitor watch`."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.cli import options
from guideload.cli.exit_codes import LIMIT_PASSED, InputError
from guideload.cli.outputs import unwritable
from guideload.cli.signals import NUMBERS
from guideload.cli.terminal import print_report

if TYPE_CHECKING:
    from guideload.monitor.monitor import Monitor
    from guideload.watch.inputs import Input
    from guideload.watch.lines import Refused
    from guideload.watch.reaction import Command, Crossing
    from guideload.watch.session import Session
    from guideload.watch.store import Store

REFRESH = 0.5  # s between two pictures of the state
MOST_REFUSED = 10  # malformed lines that are named; all are counted


@click.command()
@click.argument("monitor_file", metavar="MONITOR.TOML", type=options.InputFile)
@click.option(
    "--follow",
    type=options.FilePath,
    help="Growing file to read from its start, instead of standard input.",
)
@click.option(
    "--seconds", is_flag=True, help="Time stamps are in seconds; by default they are whole numbers of ticks."
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for samples and loads by the hour (Parquet), for the record from which the next watch goes on, and "
    "for the state that guideload app shows.",
)
@click.option("--record-only", is_flag=True, help="Write the record into the folder of -o, but no samples.")
@click.option("--stop-at-limit", is_flag=True, help="End with exit code 4 when a carriage passes its limit.")
@click.option(
    "--on-limit",
    metavar="COMMAND",
    help="Command to start when a carriage passes its limit, at most every 10 s; it gets GUIDELOAD_CARRIAGE, "
    "GUIDELOAD_TIME, GUIDELOAD_PERIOD, GUIDELOAD_FY and GUIDELOAD_FZ in its environment.",
)
@click.option("--strict", is_flag=True, help="End with exit code 2 at a malformed line.")
def watch(
    monitor_file: Path,
    follow: Path | None,
    seconds: bool,
    output: Path | None,
    record_only: bool,
    stop_at_limit: bool,
    on_limit: str | None,
    strict: bool,
) -> None:
    """Watch the loads of a machine as its samples come in.

    MONITOR.TOML: from `guideload monitor build`. A sample is a line with a time stamp and a counter, from standard
    input or a file that grows. The summary is printed at the end of the input, or at Ctrl-C.
    """
    from guideload.monitor.monitor import Monitor
    from guideload.reports.monitor import monitor_report
    from guideload.watch.inputs import GrowingFile, StandardInput
    from guideload.watch.lines import Lines
    from guideload.watch.reaction import Command
    from guideload.watch.session import Session

    if record_only and output is None:
        raise click.UsageError("--record-only needs -o: the record is in that folder")
    monitor = Monitor.from_toml(monitor_file)
    if (stop_at_limit or on_limit) and monitor.settings.load_limit is None:
        raise InputError(f"{monitor_file}: there is no limit to pass: add load_limit")
    with ExitStack() as stack:
        ends = stack.enter_context(asked_to_end())
        say = _Voice(ends if strict else None, seconds)
        command = None if on_limit is None else Command(on_limit, say)

        def react(crossing: Crossing) -> bool:
            if command is not None:
                command(crossing)
            if stop_at_limit:
                ends.code = LIMIT_PASSED
            return stop_at_limit

        source: Input = StandardInput() if follow is None else GrowingFile(follow)
        stack.callback(source.close)
        store = None if output is None else stack.enter_context(_opened_store(output, monitor, record_only))
        session = Session(
            monitor,
            source,
            Lines(monitor.settings.ticks / monitor.settings.period if seconds else None),
            store,
            on_crossing=react,
            on_refused=say.refused,
            say=say,
        )
        _run(session, command, ends, say)
        session.close()  # not after an error: what is in the folder is whole without it
        status = session.status()
        if command is not None:
            command.close()
    print_report(monitor_report(status, monitor.machine))
    if ends.code == LIMIT_PASSED:
        click.echo("Ended because a carriage passed its limit.", err=True)
    elif ends.code not in (None, InputError.exit_code):
        click.echo("Ended by a signal; all samples that came in are in the totals.", err=True)
    if ends.code:
        sys.exit(ends.code)


class Ends:
    """Whether and with which exit code the watch is to end."""

    code: int | None = None


@contextmanager
def asked_to_end() -> Iterator[Ends]:
    """Until the block ends, Ctrl-C, SIGTERM and SIGHUP only ask the watch to end; a second one ends it at once."""
    ends = Ends()
    if threading.current_thread() is not threading.main_thread():  # only the main thread may set handlers
        yield ends
        return

    def ask(number: int, _: Any) -> None:
        ends.code = 128 + number
        for each, handler in former.items():
            signal.signal(each, handler)

    former = {number: signal.getsignal(number) for number in NUMBERS}
    former = {number: handler for number, handler in former.items() if handler is not signal.SIG_IGN}
    for number in former:
        signal.signal(number, ask)
    try:
        yield ends
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


class _Voice:
    """Messages on standard error; of malformed lines the first ones.

    ends: what the first malformed line ends, if any; seconds: whether time stamps are in seconds.
    """

    def __init__(self, ends: Ends | None, seconds: bool) -> None:
        self.ends, self.seconds, self.count = ends, seconds, 0
        self.say: Callable[[str], None] = lambda text: click.echo(text, err=True)

    def __call__(self, text: str) -> None:
        from guideload.base.visible_text import visible

        self.say(visible(f"Note: {text}."))

    def refused(self, line: Refused) -> bool:
        """A line that is no sample; whether it ends the watch."""
        self.count += 1
        if self.count <= MOST_REFUSED:
            more = "; further ones are only counted" if self.count == MOST_REFUSED else ""
            then = f"left out{more}" if self.ends is None else "the watch ends before it"
            expected = "expected a time stamp and a counter, as in 1200,35210"
            hint = "" if self.seconds or "." not in line.text else " (stamps in seconds need --seconds)"
            self(f'line {line.number}: {expected}, got "{line.text}"{hint}; {then}')
        if self.ends is not None:
            self.ends.code = InputError.exit_code
        return self.ends is not None


@contextmanager
def _opened_store(folder: Path, monitor: Monitor, record_only: bool) -> Iterator[Store]:
    """The store in a folder, which is locked for this process."""
    from guideload.base.atomic import exclusive_lock
    from guideload.watch.store import Store

    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise unwritable(folder, error) from None
    with exclusive_lock(folder):
        yield Store(folder, monitor, not record_only)


def _run(session: Session, command: Command | None, ends: Ends, say: _Voice) -> None:
    """Take samples until the end, and show the state meanwhile."""
    from rich.console import Console
    from rich.live import Live

    from guideload.reports.monitor import monitor_report

    console = Console(highlight=False, markup=False, emoji=False)
    with ExitStack() as stack:
        live = None
        if console.is_terminal:
            live = stack.enter_context(Live(console=console, auto_refresh=False, transient=True))
            say.say = console.print
        due = time.monotonic()
        while ends.code is None and session.step():
            if time.monotonic() >= due:
                due = time.monotonic() + REFRESH
                session.show()
                if command is not None:
                    command.is_running()  # so that a failure is said now
                if live is not None:
                    rate = f"{session.per_second:.0f} samples/s from {session.source.name}"
                    report = monitor_report(session.status(), session.monitor.machine)
                    text = report.text(console.width, console.encoding)
                    live.update(f"{text}\n{rate}", refresh=True)
