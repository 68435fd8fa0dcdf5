"""More stamps for a motion with too few samples for the vibration of a machine: its acceleration between them is known.

From six instants per period of a vibration on, the core finds its extremes between them too.
"""

from __future__ import annotations

import numpy as np

from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.motion.refinement import refined

STEP = 1.05  # rad of the fastest vibration, from one instant to the next
MOST_PARTS = 25  # of an interval: a vibration that is faster still is hardly excited by a motion with such samples
MOST_INSTANTS = 1_000_000


def with_enough_instants(machine: Machine, motion: Motion) -> Motion:
    """The motion with six stamps or more per period of the fastest vibration, within the limits above.

    It is the same motion: acceleration and process forces are linear between the stamps anyway.
    """
    fastest = float(np.abs(machine.scene.modes()[3].imag).max(initial=0.0))  # rad/s
    most = min(MOST_PARTS, max(1, MOST_INSTANTS // motion.time.size))
    wanted = np.ceil(np.diff(motion.time) * (fastest / STEP) * (1.0 - 1e-9))
    parts = np.clip(wanted, 1, most).astype(np.int64)
    return refined(motion, parts) if parts.max() > 1 else motion
