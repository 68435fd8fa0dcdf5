"""More instants in a run whose motion has too few samples for the vibration of the machine.

From six instants per period of a vibration on, the core finds its extremes between them too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from guideload.machine.machine import Machine
from guideload.machine.stretches import Stretches
from guideload.motion.motion import Motion
from guideload.motion.refinement import refined

STEP = 1.05  # rad of the fastest vibration, from one instant to the next
# Of an interval: a vibration that is faster still is hardly excited by a motion with such samples.
MOST_PARTS = 25
MOST_INSTANTS = 1_000_000


def with_enough_instants(
    machine: Machine, motion: Motion, stretches: Stretches | None = None
) -> tuple[Motion, Stretches | None]:
    """The motion with six stamps or more per period of the fastest vibration, and the stretches of its payloads.

    Each interval has at most `MOST_PARTS`, and all together have some `MOST_INSTANTS`. It is the same motion:
    acceleration and process forces are linear between the stamps anyway.
    """
    parts = _parts(machine, motion)
    if parts.max() == 1:
        return motion, stretches
    if stretches is not None:
        places = np.append(0, np.cumsum(parts))
        stretches = replace(stretches, first=tuple(places[list(stretches.first)].tolist()))
    return refined(motion, parts), stretches


def _parts(machine: Machine, motion: Motion) -> NDArray[np.int64]:
    """Number of parts of each interval between stamps, (n - 1,)."""
    fastest = float(np.abs(machine.scene.modes()[3].imag).max(initial=0.0))  # rad/s
    most = min(MOST_PARTS, max(1, MOST_INSTANTS // motion.time.size))
    wanted = np.ceil(np.diff(motion.time) * (fastest / STEP) * (1.0 - 1e-9))
    return np.clip(wanted, 1, most).astype(np.int64)
