"""What a trace can tell of a machine's answer: the band in which it shows accelerations, against the modes.

A trace shows a sudden change of acceleration as a ramp, for samples have a distance and smoothing takes time. The
ramp makes a mode ring less than the change did, and nothing in the trace tells the two apart. How much that can hide is
told by two runs of the machine's linear model, one under the sudden change and one under the ramp.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes, moving_dofs
from guideload.motion.motion import Motion

# Half amplitude of a ramp: sin(x) = x / 2, so a ramp of duration T shows half of what rings at 0.603 / T.
RAMP = 1.8954942670339809 / np.pi
# Hidden part of a dynamic load, over what is shown, from which on it is warned of: a simpler model that leaves out less
# than that counts as enough too.
HIDDEN = 0.1
NOTHING = 1e-3  # from which on it is told at all
EXCITED = 0.01  # of the answer of all modes together: below, a mode takes no part
ROUNDING = 1e-9  # of a force
SMALL = 0.1  # of the largest load: smaller ones are judged by this part of it
# Second differences of positions spread a jump over two samples: at the end of their band 0.6 of it lie within the
# ramp and 0.2 to either side, which leaves 0.4.
SPREAD = 2.5
FEW, PARTS = 3.0, 8  # samples in a ramp, below which a change may begin at so many places between two of them
CORNERS = 0.5  # of the usual step: stamps closer than that are corners that somebody set, no samples
PER_PERIOD, PERIODS = (
    32,
    2,
)  # instants per period of the fastest mode; periods of the slowest that hold the peak
MOST_INSTANTS = 20_000


def usable_bandwidth(time: Array, bandwidth: float) -> float:
    """The frequency [Hz] up to which a motion shows accelerations; inf if it is known exactly.

    time: (n,) s. bandwidth: Hz, of the smoothing, inf if it is unknown; half the rate of the samples limits it. A
    motion of unknown bandwidth whose stamps are corners, as of a made profile, is known exactly.
    """
    steps = np.diff(time)
    usual = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    if usual == 0.0 or (np.isinf(bandwidth) and steps.min() < CORNERS * usual):
        return np.inf
    return float(min(bandwidth, 0.5 / usual))


def ramp_time(band: float) -> float:
    """Duration [s] of the ramp as which a sudden change appears in a band [Hz]: it shows half of what rings there."""
    return float(RAMP / band)


def sudden_change(time: Array, acceleration: Array, ramp: float) -> float:
    """The largest change [m/s2] of an acceleration (n,) that may have been sudden, where changes appear as ramps.

    It is that within one ramp, less the change of the same sign within the ramp before or after it, for a change that
    goes on for longer was not sudden; times `SPREAD`, but no more than the acceleration changes over all three ramps.
    """
    parts = PARTS if ramp < FEW * float(np.median(np.diff(time))) else 1
    return max(_sudden_from(time + part * ramp / parts, time, acceleration, ramp) for part in range(parts))


def _sudden_from(starts: Array, time: Array, acceleration: Array, ramp: float) -> float:
    """The same of ramps that begin at `starts` (n,) s."""
    four = np.stack([np.interp(starts + k * ramp, time, acceleration) for k in (-1, 0, 1, 2)])
    before, start, end, after = np.sign(four[2] - four[1]) * four
    going_on = np.maximum(np.maximum(start - before, after - end), 0.0)
    most = np.maximum(end, after) - np.minimum(before, start)
    return float(np.minimum(SPREAD * (end - start - going_on), most).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class TraceResolution:
    """The band of a trace against the modes of a machine, and what the trace may hide.

    band       Hz, up to which the trace shows accelerations; inf if they are known exactly
    sample_step  s, usual distance of the samples
    frequency  (mode,) Hz, without damping
    moves      (mode,) the dofs that a mode moves most
    excited    (mode,) static answer of the links to an acceleration along x in this mode, over the sum of all modes'
    ringing    (mode,) part that the ramp leaves of the ringing after a sudden change
    largest    m/s2, largest acceleration along x
    change     m/s2, largest change of it that may have been sudden
    names      `carriage ...` for each carriage, then `link ...` for each link: a carriage's sum can hide a moment
    carriages  how many of the names are carriages
    shown      (name,) N, largest dynamic load as the trace shows it: of the largest acceleration standing still, or
               after the change as a ramp
    hidden     (name,) N, by which the peak after the change is higher if it was sudden
    """

    band: float
    sample_step: float
    frequency: Array
    moves: tuple[tuple[str, ...], ...]
    excited: Array
    ringing: Array
    largest: float
    change: float
    names: tuple[str, ...]
    carriages: int
    shown: Array
    hidden: Array

    @classmethod
    def of(
        cls, machine: Machine, modes: Modes, time: Array, acceleration: Array, band: float, sample_step: float
    ) -> TraceResolution:
        """What accelerations (n,) m/s2 along x at time (n,) s, shown up to `band` Hz, tell of the machine's answer.

        Links that are not linear count with their nominal stiffness. A load is the y-z resultant of a carriage's
        dynamic load, or the dynamic load of a link.
        """
        answer = _Answer.of(machine, modes)
        largest = float(np.abs(acceleration).max(initial=0.0))
        ramp = 0.0 if np.isinf(band) else ramp_time(band)
        change = sudden_change(time, acceleration, ramp) if ramp else 0.0
        sudden = answer.peaks(0.0)
        as_ramp = answer.peaks(ramp)
        return cls(
            band=band,
            sample_step=sample_step,
            frequency=modes.frequency,
            moves=tuple(tuple(moving_dofs(machine, shape)) for shape in modes.shape),
            excited=answer.excited,
            ringing=np.abs(np.sinc(modes.frequency * ramp)),
            largest=largest,
            change=change,
            names=answer.names,
            carriages=len(machine.carriages),
            shown=np.maximum(largest * answer.static, change * as_ramp),
            hidden=change * np.maximum(sudden - as_ramp, 0.0),
        )

    @classmethod
    def of_motion(cls, machine: Machine, motion: Motion) -> TraceResolution:
        """The same of a motion and its machine."""
        band = usable_bandwidth(motion.time, motion.bandwidth)
        step = float(np.median(np.diff(motion.time)))
        return cls.of(machine, Modes.of(machine), motion.time, motion.acceleration[:, 0], band, step)

    @property
    def worst(self) -> tuple[float, float, str]:
        """Hidden load over shown load, hidden load [N], and whose, where the first is largest.

        Of the carriages; of all where a link has more than twice the share.
        """
        least = SMALL * float(self.shown.max(initial=0.0))
        share = self.hidden / np.maximum(self.shown, least) if least else np.zeros_like(self.shown)
        of_carriages = share[: self.carriages]
        chosen = share if share.max() > 2.0 * of_carriages.max(initial=-1.0) else of_carriages
        at = int(chosen.argmax())
        return float(share[at]), float(self.hidden[at]), self.names[at]

    @property
    def taking_part(self) -> NDArray[np.bool_]:
        """(mode,) whether an acceleration along x excites the mode."""
        return np.asarray(self.excited > EXCITED)

    @property
    def text(self) -> str:
        """The band and what it may hide, in a line."""
        if np.isinf(self.band):
            return "the motion is known exactly, at all frequencies"
        band = f"up to {self.band:.3g} Hz"
        if not self.taking_part.any():
            return f"{band}; x excites no mode"
        count = int(self.taking_part.sum())
        within = int(np.count_nonzero(self.taking_part & (self.frequency <= self.band)))
        which = "below" if within == 0 else "with" if within == count else f"with {within} of"
        modes = f"{band}, {which} the {count} modes that x excites"
        share, load, name = self.worst
        if share < NOTHING:
            return f"{modes}; it hides nothing"
        return f"{modes}; it hides up to {100 * share:.2g} % ({load:.3g} N) of the dynamic load of {name}"

    def warnings(self) -> Iterator[str]:
        """What the trace may hide, where that is more than `HIDDEN` of what it shows, and what to change."""
        share, load, name = self.worst
        if share <= HIDDEN:
            return
        lost = np.where(self.taking_part, self.excited * (1.0 - self.ringing), 0.0)
        mode = int(lost.argmax())
        frequency = float(self.frequency[mode])
        dofs = ", ".join(self.moves[mode])
        yield (
            f"Note: the trace shows sudden changes up to {self.band:.3g} Hz: one looks like a ramp of "
            f"{1e3 * ramp_time(self.band):.3g} ms, which makes mode {mode + 1} ({dofs}, {frequency:.3g} Hz, excited "
            f"along x) ring {100 * self.ringing[mode]:.2g} % as much. If the change of {self.change:.3g} m/s2 that the "
            f"trace shows was sudden, the dynamic load of {name} is up to {100 * share:.2g} % ({load:.3g} N) above "
            f"what is shown, an upper bound for a single change. {self._way_out(frequency)}"
        )

    def _way_out(self, frequency: float) -> str:
        """What would move the end of the band beyond a mode."""
        rate = 10.0 * frequency
        if self.sample_step > 1.0 / rate:
            return f"Record at {float(f'{rate:.2g}'):g} Hz or faster."
        return "Noise sets the end of the band, not the samples' rate: a finer encoder or less noise would move it."


@dataclass(frozen=True, eq=False)
class _Answer:
    """How the loads of a machine answer an acceleration of 1 m/s2 along x; nominal stiffness.

    names, excited: as of `TraceResolution`; static (name,) N; slowest, fastest: Hz, of the modes that take part.
    """

    machine: Machine
    names: tuple[str, ...]
    static: Array
    excited: Array
    slowest: float
    fastest: float

    @classmethod
    def of(cls, machine: Machine, modes: Modes) -> _Answer:
        table = machine.link_table()
        (mass, _, stiffness), _ = machine.nominal_scene.matrices()
        rows = np.hstack([table.directions, np.cross(table.points, table.directions)])
        pull = -(modes.shape @ mass[:, 0])
        own = np.einsum("mi,ij,mj->m", modes.shape, stiffness, modes.shape)
        in_modes = (modes.shape @ rows.T) * table.stiffness * (pull / own)[:, None]
        sizes = np.abs(in_modes).max(axis=1)
        total = float(sizes.sum())
        # Where x excites no mode rounding is left, far below the mass times 1 m/s2.
        excited = sizes / total if total > ROUNDING * machine.body.mass else np.zeros(sizes.size)
        taking_part = modes.frequency[excited > EXCITED]
        names = (
            *(f"carriage {carriage.name}" for carriage in machine.carriages),
            *(f"link {name}" for name in table.names),
        )
        span = (float(taking_part.min()), float(taking_part.max())) if taking_part.size else (0.0, 0.0)
        return cls(machine, names, _loads(machine, in_modes.sum(axis=0)[None])[0], excited, *span)

    def peaks(self, ramp: float) -> Array:
        """(name,) N, peaks after an acceleration that grows to 1 m/s2 within `ramp` [s] and stays."""
        if self.slowest == 0.0:
            return self.static
        after = PERIODS / self.slowest
        start = max(ramp - after, 0.0)
        count = min(int((ramp + after - start) * PER_PERIOD * self.fastest) + 2, MOST_INSTANTS)
        times = np.linspace(start, ramp + after, count)
        stamps = np.array([0.0, ramp, ramp + after]) if ramp else np.array([0.0, after])
        acceleration = np.zeros((stamps.size, 3))
        acceleration[:, 0] = 1.0
        acceleration[0, 0] = 0.0 if ramp else 1.0
        scene = self.machine.nominal_scene
        solution = scene.solve(stamps, acceleration, method="exact", rtol=1e-6, times=times)
        dynamic = solution.link_loads("total") - scene.static_link_loads()
        # What is damped heavily comes to its static value later.
        found: Array = np.maximum(_loads(self.machine, dynamic).max(axis=0), self.static)
        return found


def _loads(machine: Machine, links: Array) -> Array:
    """(n, name) N, y-z resultants of the carriages from link loads (n, link) [N], and the links' own sizes."""
    directions = machine.link_table().directions
    sums = [links[:, own] @ directions[own, 1:] for own in machine.links_of_carriages]
    resultants = [np.linalg.norm(force, axis=1)[:, None] for force in sums]
    found: Array = np.hstack([*resultants, np.abs(links)])
    return found
