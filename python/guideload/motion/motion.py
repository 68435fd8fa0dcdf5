"""Motion: what excites a scene. The acceleration of L and, if there are any, process forces, piecewise linear
in time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from guideload.base.arrays import Array
from guideload.base.errors import TraceError
from guideload.motion.uncertainty import Uncertainty

# The histories of a Motion and the shape of one sample of each.
HISTORIES: dict[str, tuple[int, ...]] = {
    "acceleration": (3,),
    "velocity": (3,),
    "position": (3,),
    "wrench": (6,),
    "motor_speed": (),
}


@dataclass(frozen=True, eq=False)
class Motion:
    """The excitation of a scene at n time stamps; between them everything is linear (first-order hold).

    time          (n,) s, not decreasing; two equal stamps are a jump: the first holds before it, the second
        after
    acceleration  (n, 3) m/s2 of L, global axes
    velocity      (n, 3) m/s of the cart, for life and pictures, or None
    position      (n, 3) m of the cart, or None
    wrench        (n, 6) external force and moment about L [N, N, N, N m, N m, N m], or None
    motor_speed   (n,) rad/s as measured, or None
    source        where it comes from, for reports
    notes         what was detected and chosen on the way, for reports
    bandwidth     Hz, up to which the acceleration along x is known; inf if it is known, or nothing is known of it
    uncertainty   of the acceleration along x, at the same time stamps if it has none of its own, or None

    The arrays are copies in float64 and read-only. Raises TraceError naming the history and the index.
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

    def __repr__(self) -> str:
        source = f" of {self.source}" if self.source else ""
        return f"<Motion{source}: {self.time.size} stamps from {self.time[0]:g} to {self.time[-1]:g} s>"

    def __post_init__(self) -> None:
        time = _history("time", self.time, (np.size(self.time),))
        if time.size < 2:
            raise TraceError(f"time: expected at least 2 stamps, got {time.size}")
        steps = np.diff(time)
        back = np.flatnonzero(steps < 0.0)
        if back.size:
            at = int(back[0]) + 1
            raise TraceError(
                f"time[{at}]: expected at least {float(time[at - 1])!r} s, the stamp before it, "
                f"got {float(time[at])!r} ({back.size} such places)"
            )
        triple = np.flatnonzero((steps[1:] == 0.0) & (steps[:-1] == 0.0))
        if triple.size:
            at = int(triple[0])
            raise TraceError(f"time[{at}] to time[{at + 2}]: at most two equal stamps (a jump), got three")
        object.__setattr__(self, "time", time)
        for name, sample in HISTORIES.items():
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, _history(name, given, (time.size, *sample)))
        object.__setattr__(self, "notes", tuple(self.notes))
        if self.uncertainty is not None:
            stamps = time if self.uncertainty.time is None else self.uncertainty.time
            if self.uncertainty.variance.size != stamps.size:
                raise TraceError(
                    f"uncertainty: expected one of {stamps.size} stamps, got {self.uncertainty.variance.size}"
                )

    @classmethod
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
    ) -> Motion:
        """A motion along the rails: acceleration (n,) m/s2, velocity (n,) m/s, position (n,) m, all along x."""
        stamps = _history("time", time, (np.size(time),))

        def axis_x(name: str, given: ArrayLike) -> Array:
            history = np.zeros((stamps.size, 3))
            history[:, 0] = _history(name, given, (stamps.size,))
            return history

        return cls(
            time=stamps,
            acceleration=axis_x("acceleration", acceleration),
            velocity=None if velocity is None else axis_x("velocity", velocity),
            position=None if position is None else axis_x("position", position),
            motor_speed=None if motor_speed is None else _history("motor_speed", motor_speed, (stamps.size,)),
            source=source,
            notes=notes,
            bandwidth=bandwidth,
            uncertainty=uncertainty,
        )

    def with_force(
        self,
        point: ArrayLike,
        force: ArrayLike | None = None,
        moment: ArrayLike | None = None,
        *,
        time: ArrayLike | None = None,
    ) -> Motion:
        """The same motion with a process force added to what it has already.

        point: (3,) m from L, where the force acts; the moment about L becomes moment + point x force.
        force: (3,) or (k, 3) N; moment: (3,) or (k, 3) N m; global axes. (3,) is a constant.
        time: (k,) s, stamps of the two, linear between them, equal neighbours are a jump; zero before the first
        and after the last. Without it they belong to the motion's own stamps. The result has the stamps of both,
        which is exact because all histories, and deviations from them, are linear between stamps. What lies
        outside the motion's time is cut off.
        """
        own = self.time if time is None else _history("time", time, (np.size(time),))
        if force is None and moment is None:
            raise TraceError("with_force: expected force, moment or both, got neither")
        arm = _history("point", point, (3,))
        load = np.zeros((own.size, 6))
        if force is not None:
            load[:, :3] = _samples("force", force, own.size)
            load[:, 3:] = np.cross(arm, load[:, :3])
        if moment is not None:
            load[:, 3:] += _samples("moment", moment, own.size)
        note = f"process force at ({arm[0]:g}, {arm[1]:g}, {arm[2]:g}) m from L"
        notes = (*self.notes, note)
        if time is None:
            return replace(self, wrench=load if self.wrench is None else self.wrench + load, notes=notes)
        added = Motion(own, np.zeros((own.size, 3)), wrench=load)  # checks the stamps too
        stamps = np.unique(np.concatenate([self.time, added.time]))
        stamps = stamps[(stamps >= self.time[0]) & (stamps <= self.time[-1])]
        before, after = _sides(added.time, load, stamps, outside_zero=True)
        sides: dict[str, tuple[Array, Array]] = {}
        for name in HISTORIES:
            history = getattr(self, name)
            if history is not None:
                sides[name] = _sides(self.time, history, stamps)
        if "wrench" in sides:
            sides["wrench"] = (sides["wrench"][0] + before, sides["wrench"][1] + after)
        else:
            sides["wrench"] = (before, after)
        # A stamp stands twice where any history jumps; the motion starts after a jump at its first stamp and
        # ends before one at its last.
        jump = np.zeros(stamps.size, bool)
        for left, right in sides.values():
            jump |= np.any((left != right).reshape(stamps.size, -1), axis=1)
        own_jumps = self.time[1:][np.diff(self.time) == 0.0]
        jump |= np.isin(stamps, own_jumps)
        inside = (stamps > self.time[0]) & (stamps < self.time[-1])
        jump &= inside | np.isin(stamps, own_jumps)
        take = np.repeat(np.arange(stamps.size), 1 + jump)
        late = np.concatenate([[False], take[1:] == take[:-1]])
        late |= (stamps[take] == self.time[0]) & ~jump[take]
        united = {
            name: np.where(late.reshape(-1, *[1] * (left.ndim - 1)), right[take], left[take])
            for name, (left, right) in sides.items()
        }
        left_open = self.uncertainty
        if left_open is not None and left_open.time is None:
            left_open = replace(left_open, time=self.time)
        return replace(self, time=stamps[take], notes=notes, uncertainty=left_open, **united)


def _history(name: str, given: ArrayLike, shape: tuple[int, ...]) -> Array:
    """A read-only float64 copy of shape `shape`, all finite."""
    try:
        history = np.array(given, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise TraceError(f"{name}: expected numbers of shape {shape}, got {error}") from None
    if history.shape != shape:
        raise TraceError(f"{name}: expected shape {shape}, got {history.shape}")
    bad = np.argwhere(~np.isfinite(history))
    if bad.size:
        place = ", ".join(str(part) for part in bad[0])
        raise TraceError(
            f"{name}[{place}]: expected a finite number, got {history[tuple(bad[0])]} ({len(bad)} such)"
        )
    history.setflags(write=False)
    return history


def _samples(name: str, given: ArrayLike, count: int) -> Array:
    """(count, 3) from one constant vector or a history."""
    if np.ndim(given) == 1:
        return np.broadcast_to(_history(name, given, (3,)), (count, 3))
    return _history(name, given, (count, 3))


def _sides(time: Array, history: Array, stamps: Array, *, outside_zero: bool = False) -> tuple[Array, Array]:
    """The history just before and just after each stamp; they differ at jumps.

    Outside its own time the history is zero (`outside_zero`) or, where no stamp lies outside, not asked for.
    """
    last = time.size - 1
    before = np.searchsorted(time, stamps, side="left")  # first sample at or after the stamp
    after = np.searchsorted(time, stamps, side="right") - 1  # last sample at or before it
    lower, upper = np.clip(before - 1, 0, last), np.clip(before, 0, last)
    left = _between(time, history, stamps, lower, upper, exact=upper)
    lower, upper = np.clip(after, 0, last), np.clip(after + 1, 0, last)
    right = _between(time, history, stamps, lower, upper, exact=lower)
    if outside_zero:
        left[(stamps <= time[0]) | (stamps > time[-1])] = 0.0
        right[(stamps < time[0]) | (stamps >= time[-1])] = 0.0
    return left, right


def _between(
    time: Array,
    history: Array,
    stamps: Array,
    lower: NDArray[np.intp],
    upper: NDArray[np.intp],
    exact: NDArray[np.intp],
) -> Array:
    """Linear between the samples lower and upper; the sample `exact` itself where it lies on the stamp."""
    width = time[upper] - time[lower]
    share = np.where(width > 0.0, (stamps - time[lower]) / np.where(width > 0.0, width, 1.0), 0.0)
    share = share.reshape(-1, *[1] * (history.ndim - 1))
    value = history[lower] + share * (history[upper] - history[lower])
    hit = time[exact] == stamps
    value[hit] = history[exact[hit]]
    return value
