"""The command that runs when a carriage passes its limit."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass

from guideload.base.errors import ArgumentError

PAUSE = 10.0  # s between two starts of the command
LONGEST_WAIT = 10.0  # s that the end of a watch waits for the command


@dataclass(frozen=True)
class Crossing:
    """A sample at which carriages rose above their limit: period of the loads, its time, names, loads Fy and Fz."""

    period: int
    time: float
    carriages: list[str]
    forces: list[tuple[float, float]]

    @property
    def environment(self) -> dict[str, str]:
        """The crossing as environment variables; of several carriages with commas between."""
        values = {
            "PERIOD": str(self.period),
            "TIME": repr(self.time),
            "CARRIAGE": ",".join(self.carriages),
            "FY": ",".join(repr(force[0]) for force in self.forces),
            "FZ": ",".join(repr(force[1]) for force in self.forces),
        }
        return {f"GUIDELOAD_{name}": text for name, text in values.items()}


class Command:
    """A command that is started at a crossing, without a shell, unless it was started less than `PAUSE` seconds ago.

    A command that still runs is not started again. say: called with each message for the user.
    """

    def __init__(
        self, text: str, say: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        try:
            self.words = shlex.split(text, posix=os.name != "nt")
        except ValueError as error:
            raise ArgumentError(f"--on-limit: {text}: {error}") from None
        if not self.words:
            raise ArgumentError("--on-limit: expected a command, got nothing")
        if shutil.which(self.words[0]) is None:
            raise ArgumentError(f"--on-limit: {self.words[0]}: there is no such program")
        self.say, self.clock = say, clock
        self.started = 0
        self._process: subprocess.Popen[bytes] | None = None
        self._next = -float("inf")

    def __call__(self, crossing: Crossing) -> None:
        """Start the command, if it is time."""
        if self.is_running() or self.clock() < self._next:
            return
        self._next = self.clock() + PAUSE
        self.started += 1
        try:
            self._process = subprocess.Popen(
                self.words,
                stdin=subprocess.DEVNULL,
                env=os.environ | crossing.environment,
                start_new_session=True,  # so that Ctrl-C is for the watch alone
            )
        except (OSError, ValueError) as error:
            self.say(f"--on-limit: {self.words[0]}: {getattr(error, 'strerror', None) or error}")

    def is_running(self) -> bool:
        """Whether the command runs; a failure is reported once."""
        code = None if self._process is None else self._process.poll()
        if code is not None:
            self._process = None
            if code:
                self.say(f"--on-limit: {self.words[0]} ended with exit code {code}")
        return self._process is not None

    def close(self) -> None:
        """Wait a while for the command."""
        if self._process is None:
            return
        try:
            self._process.wait(LONGEST_WAIT)
        except subprocess.TimeoutExpired:
            self.say(f"--on-limit: {self.words[0]} still runs")
            self._process.returncode = 0  # it goes on without us
        self.is_running()
