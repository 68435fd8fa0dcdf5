"""The motions of riders in a run: on common stamps with the motion of the cart, and the checks of both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, ArgumentTypeError, shown
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion, find_jumps, with_stamps
from guideload.motion.origin import shown_origin, stamps_from
from guideload.motion.travel import travel_at, travel_of

# Speed at the ends of a rider's motion over its largest speed: below it the rider stands still before and after.
STILL = 1e-3


def with_riders(
    machine: Machine, motion: Motion, riders: Mapping[str, Motion] | None
) -> tuple[Machine, Motion, Array | None]:
    """The machine with its riders where they start, the motion of the cart, and the travel of the riders from there.

    The travel is (riders, n, 3) travel [m], speed [m/s] and acceleration [m/s2] at the stamps of the motion; None if
    none moves.

    riders: motions along x by the names of the riders, where x is the travel along the rider's direction. A rider
    without motion stands at its `position`. Raises ArgumentError with the name of the rider.
    """
    given = {name: _on_clock(name, one, motion) for name, one in _checked(machine, riders).items()}
    if not given:
        return machine, motion, None
    _require_alone(machine)
    others = list(given.values())
    common = with_stamps(
        motion,
        np.concatenate([one.time for one in others]),
        np.concatenate([find_jumps(one) for one in others]),
    )
    travel = np.zeros((len(machine.riders), common.time.size, 3))
    standing = list(machine.riders)
    for i, rider in enumerate(machine.riders):
        if rider.name in given:
            travel[i] = _travel(rider.name, given[rider.name], common.time)
            start = float(travel[i, 0, 0])
            travel[i, :, 0] -= start
            standing[i] = rider.model_copy(update={"position": start})
    machine = machine.model_copy(update={"riders": standing})
    return (machine, common, travel) if np.any(travel) else (machine, motion, None)


def _require_alone(machine: Machine) -> None:
    """Raise ArgumentError for a machine with what is not computed together with moving riders."""
    machine.require_no_payloads("a run with moving riders")
    for there, what, way_out in (
        (
            machine.base is not None,
            "an elastic base",
            "put its compliance into the stiffness of the carriages",
        ),
        (
            not machine.has_straight_rails,
            "rails that are not straight",
            "take the largest error as mounting_error",
        ),
    ):
        if there:
            raise ArgumentError(
                f"riders: moving riders are not computed on {what}; {way_out}, or give riders={{}} (or no key motion) "
                "and they stand at their positions"
            )


def _checked(machine: Machine, riders: Mapping[str, Motion] | None) -> dict[str, Motion]:
    names = [rider.name for rider in machine.riders]
    if riders is None:
        moving = [rider for rider in machine.riders if rider.motion is not None]
        if moving:
            raise ArgumentError(
                f'riders: "{moving[0].name}" has the motion {shown(moving[0].motion)}; guideload run, life, size and '
                f'compare read it, in Python give riders={{"{moving[0].name}": motion}}, or riders={{}} and it stands '
                "at its position"
            )
        return {}
    for name, motion in riders.items():
        if name not in names:
            raise ArgumentError(f"riders: expected a rider of the machine ({shown(names)}), got {name!r}")
        if not isinstance(motion, Motion):
            raise ArgumentTypeError(f"riders[{name!r}]: expected a Motion along x, got {motion!r:.80}")
        if np.any(motion.acceleration[:, 1:]) or motion.wrench is not None:
            raise ArgumentError(f"riders[{name!r}]: expected a motion along x without forces")
    return dict(riders)


def _on_clock(name: str, rider: Motion, cart: Motion) -> Motion:
    """The motion of a rider with stamps on the clock of the cart."""
    if rider.origin is not None and np.isnat(rider.origin):  # rows of a rate begin with the cart
        return rider
    time = stamps_from(rider.time, rider.origin, cart.origin)
    if time is None:
        raise ArgumentError(
            f"riders[{name!r}]: its stamps count from {shown_origin(rider.origin)}, those of the cart from "
            f"{shown_origin(cart.origin)}; record both with one clock, or give both in seconds from one instant"
        )
    return rider if time is rider.time else replace(rider, time=time, origin=cart.origin)


def _travel(name: str, motion: Motion, stamps: Array) -> Array:
    """Travel, speed and acceleration (n, 3) of a rider at stamps."""
    time, samples = motion.time, travel_of(motion)
    if np.array_equal(time, stamps):
        return samples
    if time[0] > stamps[-1] or time[-1] < stamps[0]:
        raise ArgumentError(
            f"riders[{name!r}]: its motion lasts from {time[0]:g} to {time[-1]:g} s, that of the cart from "
            f"{stamps[0]:g} to {stamps[-1]:g} s; expected motions of the same time, with stamps of one clock"
        )
    speed = samples[:, 1]
    fastest = float(np.abs(speed).max())
    for end, covers in ((0, stamps[0] >= time[0]), (-1, stamps[-1] <= time[-1])):
        if not covers and abs(speed[end]) > STILL * fastest:
            when = "begins after" if end == 0 else "ends before"
            raise ArgumentError(
                f"riders[{name!r}]: its motion {when} that of the cart, at {time[end]:g} s, with {speed[end]:.3g} m/s; "
                "expected one that covers the time of the cart, or begins and ends at rest"
            )
    return travel_at(time, samples, stamps)
