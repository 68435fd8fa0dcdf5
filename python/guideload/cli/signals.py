"""Signals that ask a command to end: Ctrl-C (SIGINT), SIGTERM and SIGHUP, with the exit codes 130, 143 and 129.

Before a command begins, a signal ends the process at once, as nothing has been written. While it runs, a signal raises
an exception, so that drafts are removed. After it, signals are ignored, as everything is written.

This module imports next to nothing, because the handlers are set before all other modules are imported.
"""

from __future__ import annotations

import os
import signal
import sys

TYPE_CHECKING = False  # as in `typing`, which takes 10 ms to import
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType
    from typing import Any, ParamSpec, TypeVar

    P = ParamSpec("P")
    T = TypeVar("T")

NUMBERS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
RETRY = 0.005  # s, between attempts to raise an exception at a place where it is not lost
# Files whose functions an exception must not leave: an import would be lost or half done, a move of files half done;
# the C code of Sobol sequences prints an exception and goes on without its tables; HDF5 raises another error
# instead, or leaves open files whose finalisers fail later.
WHOLE = (
    "<frozen importlib._bootstrap>",
    os.path.join("guideload", "base", "atomic.py"),
    os.path.join("guideload", "base", "netcdf.py"),
    os.path.join("guideload", "traces", "format", "matlab.py"),
    os.path.join("scipy", "stats", "_qmc.py"),
)
_has_begun = False  # whether a command of this process has begun, or ended


def end_at_once() -> None:
    """From now on, until a command begins, a signal ends the process at once."""
    for number in NUMBERS:
        # Ignored is SIGHUP by nohup, and Ctrl-C by a shell for what runs in the background.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _at_once)


def ignore() -> None:
    """From now on signals are ignored: the end of the interpreter has no place for exceptions."""
    for number in NUMBERS:
        signal.signal(number, signal.SIG_IGN)


def _at_once(number: int, _: FrameType | None) -> None:
    if _has_begun:
        return
    if number == signal.SIGINT:
        try:
            os.write(2, b"Error: interrupted; nothing was written\n")
        except OSError:
            pass
    os._exit(128 + number)


def ended_in_order(command: Callable[P, T], *arguments: P.args, **options: P.kwargs) -> T:
    """Call `command`; meanwhile SIGINT raises KeyboardInterrupt, and the others SystemExit with 143 and 129.

    After that a second SIGTERM or SIGHUP ends the process at once. Signals that are ignored, or have a handler of the
    caller, are left alone.
    """
    import threading

    global _has_begun
    if threading.current_thread() is not threading.main_thread():  # only the main thread may set handlers
        return command(*arguments, **options)
    _has_begun = True
    known = (signal.SIG_DFL, signal.default_int_handler, _at_once)
    former: dict[int, Any] = {
        number: handler for number in NUMBERS if (handler := signal.getsignal(number)) in known
    }
    raiser = _Raiser()
    sys.unraisablehook = raiser.unraisable
    if raiser.can_wait:
        former[signal.SIGALRM] = signal.signal(signal.SIGALRM, raiser.again)
    try:
        for number in former.keys() & NUMBERS:
            signal.signal(number, raiser.asked)
        return command(*arguments, **options)
    except Exception as error:
        if raiser.raised is None:
            raise
        from click import ClickException

        from guideload.base.errors import ConfigError, GuideloadError

        # Reported: what goes wrong while the command ends, such as results that cannot be written. Not a ConfigError:
        # pydantic turns an exception that is raised while it serialises a model into the error of a value.
        reported = isinstance(error, (OSError, MemoryError, GuideloadError, ClickException))
        if reported and not isinstance(error, ConfigError):
            raise
        # Library code may lose the exception and fail at what it then misses, or raise its own instead.
        raise raiser.raised from error
    finally:
        raiser.is_running = False  # first: an exception in the lines below would leave the handlers
        if raiser.can_wait:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in former.items():
            signal.signal(number, handler)
        sys.unraisablehook = raiser.former_hook


class _Raiser:
    """Raises the exception of a signal where it is not lost: not within `WHOLE`, and again if it was not raisable."""

    def __init__(self) -> None:
        # Windows has no timer, and a caller may use it.
        self.can_wait = hasattr(signal, "SIGALRM") and signal.getsignal(signal.SIGALRM) is signal.SIG_DFL
        self.is_running = True
        self.is_due = False  # whether the exception is still to be raised
        self.number = 0
        self.raised: BaseException | None = None
        self.former_hook = sys.unraisablehook

    def asked(self, number: int, frame: FrameType | None) -> None:
        """Handler of a signal that asks the command to end."""
        self.number, self.is_due = number, True
        self.again(number, frame)

    def again(self, _: int, frame: FrameType | None) -> None:
        """Raise the exception, or wait a little; handler of the timer too."""
        if not (self.is_running and self.is_due):
            return
        if self.can_wait and _is_whole(frame):
            self._start_timer()
            return
        if self.can_wait:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        self.is_due = False
        if self.number == signal.SIGINT:
            self.raised = KeyboardInterrupt()
        else:
            signal.signal(self.number, signal.SIG_DFL)
            self.raised = SystemExit(128 + self.number)
        raise self.raised

    def unraisable(self, lost: sys.UnraisableHookArgs) -> Any:
        """Hook for exceptions that Python cannot raise, as in finalisers."""
        if self.can_wait and lost.exc_value is not None and lost.exc_value is self.raised:
            self.is_due = True
            self._start_timer()
        else:
            self.former_hook(lost)

    @staticmethod
    def _start_timer() -> None:
        """Try again every few milliseconds: a single tick just before the process sleeps is handled when it wakes."""
        signal.setitimer(signal.ITIMER_REAL, RETRY, RETRY)


def _is_whole(frame: FrameType | None) -> bool:
    """Whether the command is within a function of one of the files `WHOLE`."""
    while frame is not None and frame.f_code is not ended_in_order.__code__:
        if frame.f_code.co_filename.endswith(WHOLE):
            return True
        frame = frame.f_back
    return False
