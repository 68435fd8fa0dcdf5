"""Process forces at a point of the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from guideload.base.arguments import require_type
from guideload.base.arrays import Array, ReadOnlyArrays
from guideload.motion.histories import checked_history, checked_stamps
from guideload.motion.origin import Origin


@dataclass(frozen=True, eq=False)
class Forces(ReadOnlyArrays):
    """Force and moment that act on the body at a point; linear between their stamps, zero before and after them.

    time    (n,) s, not decreasing; two equal stamps are a jump
    force   (n, 3) N
    moment  (n, 3) N m, about the point
    source  name of the file or data they come from, for reports
    notes   what was detected when they were read
    origin  the instant from which the stamps count, as that of a `Trace`; None for times in the motion

    The arrays are read-only copies in float64. Raises TraceError with the history and the index.
    """

    time: Array
    force: Array
    moment: Array
    source: str = "forces"
    notes: tuple[str, ...] = ()
    origin: Origin = None

    def __post_init__(self) -> None:
        time = checked_stamps(self.time)
        object.__setattr__(self, "time", time)
        for name in ("force", "moment"):
            object.__setattr__(self, name, checked_history(name, getattr(self, name), (time.size, 3)))
        for name, kind in (("source", str), ("notes", Sequence[str]), ("origin", Origin)):
            require_type(name, getattr(self, name), kind)
        object.__setattr__(self, "notes", tuple(self.notes))

    def __repr__(self) -> str:
        return (
            f"<Forces of {self.source}: {self.time.size} stamps from {self.time[0]:g} to {self.time[-1]:g} s>"
        )
