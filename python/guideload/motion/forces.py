"""Process forces at a point of the body."""

from __future__ import annotations

from dataclasses import dataclass

from guideload.base.arrays import Array


@dataclass(frozen=True, eq=False)
class Forces:
    """Force and moment that act on the body at a point; linear between their stamps, zero before and after them.

    time        (n,) s, not decreasing; two equal stamps are a jump
    force       (n, 3) N
    moment      (n, 3) N m, about the point
    source      name of the file or data they come from, for reports
    notes       what was detected when they were read
    from_first  whether the stamps count from the first one, so that their place in a motion is not known
    """

    time: Array
    force: Array
    moment: Array
    source: str = "forces"
    notes: tuple[str, ...] = ()
    from_first: bool = False

    def __repr__(self) -> str:
        return (
            f"<Forces of {self.source}: {self.time.size} stamps from {self.time[0]:g} to {self.time[-1]:g} s>"
        )
