"""The motion that excites a scene: acceleration of L and process forces, linear in time between stamps."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arguments import checked, require_type
from guideload.base.arrays import Array, Indices, Integers, ReadOnlyArrays
from guideload.base.errors import TraceError
from guideload.base.number_text import counted
from guideload.machine.points import PointOfInterest
from guideload.motion.forces import Forces
from guideload.motion.histories import checked_history, checked_stamps
from guideload.motion.origin import Origin, stamps_from
from guideload.motion.stamps import is_late, sampled, usable_bandwidth
from guideload.motion.uncertainty import Uncertainty

# The histories of a Motion and the shape of one sample of each.
HISTORIES: dict[str, tuple[int, ...]] = {
    "acceleration": (3,),
    "velocity": (3,),
    "position": (3,),
    "wrench": (6,),
    "motor_speed": (),
}
ROUNDING = 1e-12  # of the largest velocity: one that is smaller and against those at both ends is none
OTHERS = {"source": str, "bandwidth": float, "exact": bool, "recorded": bool, "origin": Origin}


@dataclass(frozen=True, eq=False)
class Motion(ReadOnlyArrays):
    """The excitation of a scene at n time stamps; linear between them (first-order hold).

    time          (n,) s, not decreasing; two equal stamps are a jump: the values before it, and those after it
    acceleration  (n, 3) m/s2 of L, global axes
    velocity      (n, 3) m/s of the cart, for mean loads and pictures, or None
    position      (n, 3) m of the cart, or None
    wrench        (n, 6) external force and moment about L [N, N, N, N m, N m, N m], or None
    motor_speed   (n,) rad/s as measured, or None
    source        name of the file or data it comes from, for reports
    notes         what was detected and chosen when the trace was read, for reports
    warnings      what speaks against the trace or its smoothing, for reports
    origin        the instant from which the stamps count, as that of a `Trace`, or None
    samples       (m,) s, the samples as they were given, if stamps were put between them, or None
    bandwidth     Hz, of the acceleration along x; inf if the acceleration is exact, or if its bandwidth is unknown
    uncertainty   of the acceleration along x, or None; if its `time` is None, it has the stamps of the motion
    exact         whether the acceleration is known between the stamps too, as that of planned moves
    recorded      whether it is a record, which may begin under way; any other motion begins at standstill

    The arrays are read-only copies in float64. Raises TraceError with the history and the index, ArgumentTypeError for
    values that are no real numbers, ArgumentError for masked values.
    """

    time: Array
    acceleration: Array
    velocity: Array | None = None
    position: Array | None = None
    wrench: Array | None = None
    motor_speed: Array | None = None
    source: str = ""
    notes: tuple[str, ...] = ()
    bandwidth: float = np.inf
    uncertainty: Uncertainty | None = None
    exact: bool = False
    recorded: bool = False
    warnings: tuple[str, ...] = ()
    samples: Array | None = None
    origin: Origin = None

    def __repr__(self) -> str:
        source = f" of {self.source}" if self.source else ""
        return f"<Motion{source}: {self.time.size} stamps from {self.time[0]:g} to {self.time[-1]:g} s>"

    def __post_init__(self) -> None:
        time = checked_stamps(self.time)
        object.__setattr__(self, "time", time)
        for name, sample in HISTORIES.items():
            values = getattr(self, name)
            if values is not None or name == "acceleration":
                object.__setattr__(self, name, checked_history(name, values, (time.size, *sample)))
        for name, kind in OTHERS.items():
            require_type(name, getattr(self, name), kind)
        if self.samples is not None:
            object.__setattr__(self, "samples", checked_stamps(self.samples))
        for name in ("notes", "warnings"):
            if (texts := getattr(self, name)) != ():
                require_type(name, texts, Sequence[str])
                object.__setattr__(self, name, tuple(texts))
        if not self.bandwidth > 0.0:
            raise TraceError(f"bandwidth: expected > 0 Hz, inf if it is unknown, got {self.bandwidth:g}")
        if self.uncertainty is not None:
            require_type("uncertainty", self.uncertainty, Uncertainty)
            expected, got = self.uncertainty.stamps(time).size, self.uncertainty.variance.size
            if got != expected:
                raise TraceError(f"uncertainty: expected one of {expected} stamps, got {got}")

    @property
    def sample_times(self) -> Array:
        """The samples [s] as they were given, without stamps that were put between them."""
        return self.time if self.samples is None else self.samples

    @property
    def excitation(self) -> Motion:
        """What acts on the body, without the histories that do not."""
        return _changed(self, velocity=None, position=None, motor_speed=None, uncertainty=None)

    @property
    def usable_bandwidth(self) -> float:
        """Frequency [Hz] up to which the motion shows accelerations; inf if it is known exactly."""
        return np.inf if self.exact else usable_bandwidth(self.time, self.bandwidth)

    @classmethod
    @checked
    def along_x(
        cls,
        time: ArrayLike,
        acceleration: ArrayLike,
        *,
        velocity: ArrayLike | None = None,
        position: ArrayLike | None = None,
        motor_speed: ArrayLike | None = None,
        source: str = "",
        notes: tuple[str, ...] = (),
        bandwidth: float = np.inf,
        uncertainty: Uncertainty | None = None,
        exact: bool = False,
        recorded: bool = False,
        warnings: tuple[str, ...] = (),
        origin: Origin = None,
    ) -> Motion:
        """A motion along the rails: acceleration (n,) m/s2, velocity (n,) m/s and position (n,) m along x."""
        shape = (np.size(time),)

        def axis_x(name: str, values: ArrayLike) -> Array:
            return np.pad(checked_history(name, values, shape)[:, None], ((0, 0), (0, 2)))

        return cls(
            time=checked_history("time", time, shape),
            acceleration=axis_x("acceleration", acceleration),
            velocity=None if velocity is None else axis_x("velocity", velocity),
            position=None if position is None else axis_x("position", position),
            motor_speed=None if motor_speed is None else checked_history("motor_speed", motor_speed, shape),
            source=source,
            notes=notes,
            bandwidth=bandwidth,
            uncertainty=uncertainty,
            exact=exact,
            recorded=recorded,
            warnings=warnings,
            origin=origin,
        )

    @checked
    def with_force(
        self,
        point: ArrayLike,
        force: ArrayLike | None = None,
        moment: ArrayLike | None = None,
        *,
        time: ArrayLike | None = None,
    ) -> Motion:
        """The motion with another process force.

        point: (3,) m from L, where the force acts; the moment about L is moment + point x force.
        force: (3,) or (k, 3) N; moment: (3,) or (k, 3) N m; global axes; (3,) is a constant.
        time: (k,) s, the stamps of force and moment; the stamps of the motion if None. Force and moment are linear
        between stamps, jump at two equal stamps, and are zero before the first and after the last.

        The result has the stamps of motion and force: this is exact, as all histories are linear between stamps. Force
        and moment outside the time of the motion are cut off. Raises TraceError.
        """
        stamps = self.time if time is None else checked_stamps(time)
        if force is None and moment is None:
            raise TraceError("with_force: expected force, moment or both, got neither")
        arm = checked_history("point", point, (3,))
        load = np.zeros((stamps.size, 6))
        if force is not None:
            load[:, :3] = _samples("force", force, stamps.size)
            load[:, 3:] = np.cross(arm, load[:, :3])
        if moment is not None:
            load[:, 3:] += _samples("moment", moment, stamps.size)
        notes = (*self.notes, f"process force at ({arm[0]:g}, {arm[1]:g}, {arm[2]:g}) m from L")
        if time is None:
            return replace(self, wrench=load if self.wrench is None else self.wrench + load, notes=notes)
        return replace(self._with_wrench(stamps, load), notes=notes)

    @checked
    def with_forces(
        self, forces: Forces, at: PointOfInterest, *, own_axes: bool = False, start: float | None = None
    ) -> Motion:
        """The motion with process forces on the body at a point, as `machine.point("tool")`.

        own_axes: force and moment are in the axes of the point instead of those of the machine. start: s, added to the
        stamps of the forces; by default both keep their clock, if both have dates (or times of day, ...). It is needed
        if only the stamps of the forces count from the first one. The result has the stamps of both, as in
        `with_force`. Raises TraceError for forces outside the time of the motion, unless they are zero there.
        """
        stamps = (
            stamps_from(forces.time, forces.origin, self.origin) if start is None else forces.time + start
        )
        if stamps is None:
            raise TraceError(
                f"{forces.source}: the stamps count from the first one: give the time of the first in the motion, "
                "as in start=0.0 (--forces-start 0)"
            )
        vectors = [forces.force, forces.moment]
        outside = (stamps < self.time[0]) | (stamps > self.time[-1])
        lost = np.flatnonzero(outside & np.any(np.hstack(vectors) != 0.0, axis=1))
        if lost.size:
            raise TraceError(
                f"{forces.source}: expected no forces outside the time of the motion, {self.time[0]:g} to "
                f"{self.time[-1]:g} s, got some at {counted(lost.size, 'stamp')}, the first at "
                f"{stamps[lost[0]]:.6g} s; cut them off, set them to zero there, or shift them (start, --forces-start)"
            )
        if own_axes:
            vectors = [vector @ at.rotation for vector in vectors]
        moved = self.with_force(at.at, *vectors, time=stamps)
        start = float(stamps[0] - forces.time[0])
        shift = f", shifted by {start:g} s" if start else ""
        own = own_axes and not np.array_equal(at.rotation, np.eye(3))
        axes = "its own axes" if own else "the axes of the machine"
        note = f"process forces of {forces.source} at {at.name}, in {axes}{shift}"
        return replace(moved, notes=(*self.notes, note, *forces.notes))

    def _with_wrench(self, time: Array, wrench: Array) -> Motion:
        """This motion plus a wrench (k, 6) at `time` (k,), zero outside `time`; the result has the stamps of both."""
        added = np.pad(time, 1, mode="edge"), np.pad(wrench, ((1, 1), (0, 0)))
        before, after = (sampled(*added, time, np.full(time.size, late)) for late in (False, True))
        motion = with_stamps(self, time, time[np.any(before != after, axis=1)])
        load = sampled(*added, motion.time, is_late(motion.time))
        return replace(motion, wrench=load if motion.wrench is None else motion.wrench + load)


def refined(motion: Motion, parts: Integers) -> Motion:
    """The motion with each interval between stamps in so many equal parts, (n - 1,)."""
    first = np.repeat(np.arange(parts.size), parts)
    share = (np.arange(first.size) - np.repeat(np.cumsum(parts) - parts, parts)) / np.repeat(parts, parts)
    stamps = motion.time
    return _at(motion, first, share, stamps[first] + share * np.diff(stamps)[first])


def divided(motion: Motion, at: Indices, share: float) -> Motion:
    """The motion with one more stamp in each of the intervals `at`, at this share of its length.

    at: ascending; intervals that last.
    """
    stamps, shares = motion.time, np.zeros(motion.time.size - 1 + at.size)
    shares[at + 1 + np.arange(at.size)] = share
    first = np.insert(np.arange(stamps.size - 1), at + 1, at)
    return _at(motion, first, shares, stamps[first] + shares * (stamps[first + 1] - stamps[first]))


def with_instants(motion: Motion, times: Array) -> Motion:
    """The motion with stamps at these times [s] too, as far as it lasts then and has none there."""
    stamps = motion.time
    new = np.setdiff1d(times[(times > stamps[0]) & (times < stamps[-1])], stamps)
    if not new.size:
        return motion
    before = np.searchsorted(stamps, new, side="right") - 1
    share = (new - stamps[before]) / (stamps[before + 1] - stamps[before])
    first = np.insert(np.arange(stamps.size - 1), before + 1, before)
    shares = np.insert(np.zeros(stamps.size - 1), before + 1, share)
    time = np.insert(stamps[:-1], before + 1, new)
    return _at(motion, first, shares, time)


def velocity_at(motion: Motion, times: Array) -> Array:
    """The velocity (m, 3) [m/s] at times (m,) [s], ascending and within a motion that has velocities."""
    stamps = motion.time
    before = np.minimum(np.searchsorted(stamps, times, side="right") - 1, stamps.size - 2)
    lasting = stamps[before + 1] - stamps[before]
    shares = np.divide(times - stamps[before], lasting, out=np.ones_like(lasting), where=lasting > 0.0)
    return _velocity(motion, before, shares)


def with_stamps(motion: Motion, times: Array, twice: Array) -> Motion:
    """The motion with stamps at these times [s] too, as far as it lasts then, and with two stamps at each of `twice`.

    At its ends one stamp is enough for a jump: a run begins after it, and ends before it.
    """
    motion = with_instants(motion, times)
    single = np.diff(motion.time, prepend=-np.inf) > 0.0
    single[:-1] &= single[1:]
    single[[0, -1]] = False
    index = np.repeat(np.arange(single.size), 1 + (single & np.isin(motion.time, twice)))
    if index.size == single.size:
        return motion
    given = {name: values for name in HISTORIES if (values := getattr(motion, name)) is not None}
    histories: dict[str, Any] = {name: values[index] for name, values in given.items()}
    histories |= {"time": motion.time[index], "samples": motion.sample_times}
    return replace(motion, uncertainty=_own_uncertainty(motion), **histories)


def find_jumps(motion: Motion) -> Array:
    """The times [s] at which a motion has two stamps."""
    jumps: Array = motion.time[1:][np.diff(motion.time) == 0.0]
    return jumps


def _at(motion: Motion, first: Integers, shares: Array, time: Array) -> Motion:
    """The motion at `time`, at shares of the intervals that begin with the stamps `first`, and at its end.

    Acceleration and process forces are linear between the stamps anyway. The velocity is the parabola through those at
    the stamps with the slope of the acceleration, the position the cubic through positions and velocities: both are
    exact where they are the integrals of the acceleration.
    """
    share = shares[:, None]

    def with_end(values: Array, history: Array) -> Array:
        return np.concatenate([values.reshape(first.size, *history.shape[1:]), history[-1:]])

    histories: dict[str, Any] = {"time": np.append(time, motion.time[-1])}
    smooth = () if motion.velocity is None else ("velocity", "position")
    for name in HISTORIES:
        if name not in smooth and (history := getattr(motion, name)) is not None:
            start, rise = _starts_and_rises(history, first)
            histories[name] = with_end(start + share * rise, history)
    if motion.velocity is not None:
        histories["velocity"] = with_end(_velocity(motion, first, shares), motion.velocity)
    if motion.velocity is not None and motion.position is not None:
        (_, h), (x, way), (v, gain) = (
            _starts_and_rises(each, first) for each in (motion.time, motion.position, motion.velocity)
        )
        # Hermite's cubic x + h v s + a s^2 + b s^3.
        a, b = 3.0 * way - h * (3.0 * v + gain), h * (2.0 * v + gain) - 2.0 * way
        histories["position"] = with_end(x + share * (h * v + share * (a + share * b)), motion.position)
    for values in histories.values():
        values.setflags(write=False)
    # The new stamps show no higher frequencies, and the uncertainty keeps its own.
    histories |= {"bandwidth": motion.usable_bandwidth, "uncertainty": _own_uncertainty(motion)}
    return _changed(motion, **histories, samples=motion.sample_times)


def _changed(motion: Motion, **fields: Any) -> Motion:
    """The motion with other values of these fields, without the checks of a new one, which take long."""
    made = copy(motion)
    for name, value in fields.items():
        object.__setattr__(made, name, value)
    return made


def _starts_and_rises(history: Array, first: Integers) -> tuple[Array, Array]:
    """Value at the stamps `first` and rise from each to the next one, (m, columns)."""
    columns = history.reshape(history.shape[0], -1)
    return columns.take(first, axis=0), np.diff(columns, axis=0).take(first, axis=0)


def _velocity(motion: Motion, first: Integers, shares: Array) -> Array:
    """The velocity (m, 3) at shares (m,) of the intervals that begin with the stamps `first`, by the acceleration.

    Beside a standstill, rounding may turn its sign, and with it friction and power: there it is 0.
    """
    assert motion.velocity is not None
    (_, h), (_, gain), (start, rise) = (
        _starts_and_rises(each, first) for each in (motion.time, motion.acceleration, motion.velocity)
    )
    share = shares[:, None]
    found = start + share * (rise - 0.5 * h * gain * (1.0 - share))
    against = np.sign(2.0 * start + rise) * found < 0.0
    return np.where(against & (np.abs(found) <= ROUNDING * np.abs(motion.velocity).max()), 0.0, found)


def _own_uncertainty(motion: Motion) -> Uncertainty | None:
    """The uncertainty of a motion with stamps of its own, so that it stays as the motion gets others."""
    uncertainty = motion.uncertainty
    if uncertainty is None or uncertainty.time is not None:
        return uncertainty
    return replace(uncertainty, time=motion.time)


def _samples(name: str, values: ArrayLike, count: int) -> Array:
    """(count, 3) from a constant vector or a history."""
    shape = (3,) if np.ndim(values) == 1 else (count, 3)
    return np.broadcast_to(checked_history(name, values, shape), (count, 3))
