"""Rails that are not straight, as an excitation: while the cart passes, the rail moves the end of each link.

A rail offset e(t) along a link changes the load of the link by -(k e + b e'), and so the force on the body. For linear
links this is exactly an additional force on a body on straight rails, and a correction of the link loads. Both are
linear between the stamps; the motion gets so many stamps that each wavelength has `STAMPS_PER_WAVE`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion, refined
from guideload.motion.stamps import is_late, sampled

# Stamps in the shortest wavelength. The polygon through them deviates from a wave by (2 pi / 200)^2 / 8 of its
# amplitude, 1.2e-4.
STAMPS_PER_WAVE = 200
MOST_STAMPS = 5_000_000  # some seconds of work, and some gigabytes for sixteen links


@dataclass(frozen=True, eq=False)
class StraightnessLoads:
    """What rails that are not straight add to the link loads, (n, link) [N], at the stamps (n,) [s] of a motion.

    elastic, damping: -k e and -b e', with the rail offset e less that at the start.
    """

    time: Array
    elastic: Array
    damping: Array

    def loads(self, part: str, times: Array | None) -> Array:
        """The loads (m, link) [N] at instants (m,) [s], by default the stamps. part: total, elastic or damping."""
        loads = {"elastic": self.elastic, "damping": self.damping}.get(part)
        loads = self.elastic + self.damping if loads is None else loads
        if times is None:
            return loads
        # After a jump at an instant, as the core reports it.
        return sampled(self.time, loads, times, np.ones(times.size, dtype=np.bool_))

    def at(self, stamps: Array) -> StraightnessLoads:
        """The same at other stamps (m,) [s], among which are all stamps."""
        late = is_late(stamps)
        parts = (sampled(self.time, loads, stamps, late) for loads in (self.elastic, self.damping))
        return StraightnessLoads(stamps, *parts)


def with_straightness_loads(
    machine: Machine, motion: Motion
) -> tuple[Machine, Motion, StraightnessLoads | None]:
    """The machine at rest where the motion starts, the motion with the force of the rails, and the link loads to add.

    The same machine and motion, and None, if all rails are straight. Raises ArgumentError for links that are not linear
    and for a motion without position, SceneError where a profile is not known.
    """
    if machine.has_straight_rails:
        return machine, motion, None
    rail = next(rail.name for rail in machine.rails if rail.profiles)
    if machine.model_level != "linear":
        raise ArgumentError(
            f"rail {rail} is not straight, but the machine is {machine.model_level}: rail profiles are computed for "
            "linear links only; give the carriages one stiffness each, or take the largest error as mounting_error"
        )
    if machine.base is not None:
        raise ArgumentError(
            f"rail {rail} is not straight, and the base is elastic: rail profiles are computed on a rigid base only; "
            "leave [base] out, or put its compliance into the stiffness of the carriages"
        )
    if motion.position is None or motion.velocity is None:
        raise ArgumentError(
            f"rail {rail} is not straight: expected a motion with position and velocity of the cart, which say where "
            "it is; this one has none"
        )
    machine = machine.model_copy(update={"rest_at": float(motion.position[0, 0])})
    motion = _with_stamps(machine, motion, rail)
    assert motion.position is not None and motion.velocity is not None
    displacement, slope = machine.rail_offsets(motion.position[:, 0])
    table = machine.link_table()
    elastic = -table.stiffness * (displacement - displacement[0])
    damping = -table.damping * slope * motion.velocity[:, :1]
    force = -(elastic + damping) @ table.rows
    wrench = force if motion.wrench is None else motion.wrench + force
    notes = (*motion.notes, f"over rails that are not straight, with {motion.time.size} stamps")
    return (
        machine,
        replace(motion, wrench=wrench, notes=notes),
        StraightnessLoads(motion.time, elastic, damping),
    )


def _with_stamps(machine: Machine, motion: Motion, rail: str) -> Motion:
    """The motion with so many stamps that each wavelength of the rails has `STAMPS_PER_WAVE`."""
    assert motion.position is not None and motion.velocity is not None
    shortest = min(profile.shortest for rail in machine.rails for profile in rail.profiles)
    speed = np.abs(motion.velocity[:, 0])
    way = np.maximum(
        np.abs(np.diff(motion.position[:, 0])), np.maximum(speed[1:], speed[:-1]) * np.diff(motion.time)
    )
    wanted = np.ceil(way * STAMPS_PER_WAVE / shortest)
    parts = np.maximum(wanted, 1.0)
    if parts.sum() > MOST_STAMPS:
        raise ArgumentError(
            f"rail {rail}: its shortest wavelength is {shortest:g} m, and the cart passes it so often that the motion "
            f"would need {parts.sum():.3g} stamps, more than {MOST_STAMPS}: take a longer shortest wavelength, points "
            "farther apart, or a part of the motion"
        )
    return refined(motion, parts.astype(np.int64)) if parts.max() > 1.0 else motion
