"""A monitor of the packaged machine, and samples of a motion for it."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from guideload import Machine
from guideload.cli.inputs import EXAMPLES
from guideload.monitor import Monitor, MonitorSettings
from guideload.monitor.description import monitor_text
from guideload.monitor.estimator import filter_taps
from guideload.watch.inputs import Input
from guideload.watch.lines import Lines
from guideload.watch.session import Session

LIMIT = 4600.0  # N, which the motion passes on carriage 2b
SETTINGS = MonitorSettings(
    period=1e-3, travel_per_count=20e-6, lag=20, max_acceleration=40.0, load_limit=LIMIT
)
SMOOTHER = (3, 2.2)


@cache
def machine() -> Machine:
    return Machine.from_toml(EXAMPLES / "manipulator.toml")


def new_monitor() -> Monitor:
    order, time_constant = SMOOTHER
    return Monitor(machine(), SETTINGS, filter_taps(order, time_constant, SETTINGS.lag))


def write_monitor(folder: Path) -> Path:
    """The monitor file of `new_monitor`."""
    path = folder / "monitor.toml"
    path.write_text(monitor_text(SETTINGS, *SMOOTHER, EXAMPLES / "manipulator.toml", folder, ["A test."]))
    return path


@cache
def samples(count: int = 4000) -> tuple[Any, Any]:
    """Stamps and counts: at rest until the monitor has settled, then to and fro."""
    stamps = np.arange(count)
    time = 1e-3 * np.maximum(stamps - 1500, 0)
    position = 0.05 * (1.0 - np.cos(2 * np.pi * 1.2 * time))
    return stamps, np.round(position / SETTINGS.travel_per_count).astype(np.int64)


def text_of(stamps: Any, counts: Any) -> bytes:
    """The samples as lines."""
    return b"".join(b"%d,%d\n" % sample for sample in zip(stamps.tolist(), counts.tolist(), strict=True))


class Pieces(Input):
    """An input whose bytes come in pieces, as given; texts among them end a stream."""

    name = "pieces"

    def __init__(self, *pieces: bytes | str) -> None:
        self.pieces = list(pieces)

    def read(self, timeout: float) -> bytes | str | None:
        return self.pieces.pop(0) if self.pieces else None


def run(session: Session) -> Session:
    """Run a session to the end of its input."""
    while session.step():
        pass
    return session


def watched(*pieces: bytes | str, **options: Any) -> Session:
    """A session that has taken these bytes."""
    return run(Session(new_monitor(), Pieces(*pieces), Lines(), **options))
