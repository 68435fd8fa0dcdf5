"""Trace resolution: which loads a trace may hide, because it shows a sudden change of acceleration as a ramp.

Sampling and smoothing turn a sudden change of acceleration into a ramp, which excites a mode less. The hidden load is
the difference of two runs of the linear model: under the sudden change, and under the ramp.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array, Flags
from guideload.base.number_text import counted, digits, percent
from guideload.base.warnings import LIMITS, WarningText
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes, moving_dofs
from guideload.motion.motion import Motion

# A ramp of duration T leaves half of the ringing at the frequency 0.603 / T, where sin(x) = x / 2 with x = pi f T.
RAMP = 1.8954942670339809 / np.pi
NEGLIGIBLE_SHARE = 1e-3  # hidden load over shown load that is not mentioned
PARTICIPATING = 0.01  # least participation of a mode that x excites
ROUNDING = 1e-9  # of a force
SMALL_LOAD = 0.1  # of the largest load: a smaller load is replaced by this in the share of hidden load
# Second differences of positions spread a jump over two samples: at the usable bandwidth 0.6 of the jump lie within the
# ramp and 0.2 on either side, so `sudden_change` finds 0.6 - 0.2 = 1 / SPREAD.
SPREAD = 2.5
# Ramps shorter than FEW_SAMPLES samples start at `SHIFTS` places between two samples, others at the samples.
FEW_SAMPLES, SHIFTS = 3.0, 8
# Instants per period of the fastest mode; periods of the slowest mode that contain the peak.
INSTANTS_PER_PERIOD, PERIODS = 32, 2
MOST_INSTANTS = 20_000


def ramp_time(bandwidth: float) -> float:
    """Duration [s] of the ramp as which a sudden change appears: it leaves half of the ringing at `bandwidth` [Hz]."""
    return float(RAMP / bandwidth)


def sudden_change(time: Array, acceleration: Array, ramp: float) -> float:
    """Largest change of acceleration [m/s2] that may have been a step, if steps appear as ramps of duration `ramp` [s].

    time: (n,) s. acceleration: (n,) m/s2. It is `SPREAD` times the change within one ramp less the larger change of the
    same sign within the ramp before or after it, as a longer change was no step; at most the change over all three.
    """
    shifts = SHIFTS if ramp < FEW_SAMPLES * float(np.median(np.diff(time))) else 1
    starts = time + np.arange(shifts)[:, None] * ramp / shifts
    values = np.stack([np.interp(starts + k * ramp, time, acceleration) for k in (-1, 0, 1, 2)])
    before, start, end, after = np.sign(values[2] - values[1]) * values  # the change end - start is positive
    beside = np.maximum(np.maximum(start - before, after - end), 0.0)
    overall = np.maximum(end, after) - np.minimum(before, start)
    return float(np.minimum(SPREAD * (end - start - beside), overall).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class TraceResolution:
    """The modes of a machine that a trace can show, and the load that it may hide.

    Nonlinear links have their nominal stiffness. A load is the y-z resultant of the dynamic load of a carriage, or the
    dynamic load of a link, as a moment does not appear in the resultant of its carriage.
    """

    bandwidth: float  # Hz, up to which the trace shows accelerations; inf if they are known exactly
    sample_step: float  # s, median distance of the samples
    frequency: Array  # (mode,) Hz, without damping
    moving: tuple[tuple[str, ...], ...]  # (mode,) the dofs that move most
    # (mode,) largest static link load in this mode under an acceleration along x, over the sum of modes
    participation: Array
    # (mode,) residual vibration after the ramp over that after a step, |sin(pi f T) / (pi f T)|
    ringing: Array
    largest: float  # m/s2, largest acceleration along x
    change: float  # m/s2, largest change of acceleration that may have been sudden
    names: tuple[str, ...]  # `carriage ...` for each carriage, then `link ...` for each link
    carriages: int  # number of carriages among the names
    # (name,) N, load that the trace shows: static under the largest acceleration, or peak after the change as a ramp,
    # whichever is larger
    shown: Array
    hidden: Array  # (name,) N, peak after the change as a step less the peak after the ramp

    @classmethod
    def of(
        cls,
        machine: Machine,
        modes: Modes,
        time: Array,
        acceleration: Array,
        bandwidth: float,
        sample_step: float,
    ) -> TraceResolution:
        """The resolution of accelerations (n,) m/s2 along x at `time` (n,) s, known up to `bandwidth` [Hz]."""
        static, participation = _unit_response(machine, modes)
        largest = float(np.abs(acceleration).max(initial=0.0))
        ramp = 0.0 if np.isinf(bandwidth) else ramp_time(bandwidth)
        change = sudden_change(time, acceleration, ramp) if ramp else 0.0
        excited = modes.frequency[participation > PARTICIPATING]
        after_step, after_ramp = (_peaks(machine, static, excited, time) for time in (0.0, ramp))
        return cls(
            bandwidth=bandwidth,
            sample_step=sample_step,
            frequency=modes.frequency,
            moving=tuple(tuple(moving_dofs(machine, shape)) for shape in modes.shape),
            participation=participation,
            ringing=np.abs(np.sinc(modes.frequency * ramp)),
            largest=largest,
            change=change,
            names=(
                *(f"carriage {carriage.name}" for carriage in machine.carriages),
                *(f"link {name}" for name in machine.link_table().names),
            ),
            carriages=len(machine.carriages),
            shown=np.maximum(largest * static, change * after_ramp),
            hidden=change * np.maximum(after_step - after_ramp, 0.0),
        )

    @classmethod
    def of_motion(cls, machine: Machine, motion: Motion) -> TraceResolution:
        """The resolution of a motion on a machine."""
        step = float(np.median(np.diff(motion.time)))
        bandwidth = motion.usable_bandwidth
        return cls.of(machine, Modes.of(machine), motion.time, motion.acceleration[:, 0], bandwidth, step)

    @property
    def worst(self) -> tuple[float, float, str]:
        """Largest hidden load over shown load, that hidden load [N], and its name.

        Of the carriages, unless the share of a link is more than twice as large.
        """
        least = SMALL_LOAD * float(self.shown.max(initial=0.0))
        share = self.hidden / np.maximum(self.shown, least) if least else np.zeros_like(self.shown)
        of_carriages = share[: self.carriages]
        candidates = share if share.max() > 2.0 * of_carriages.max(initial=-1.0) else of_carriages
        at = int(candidates.argmax())
        return float(share[at]), float(self.hidden[at]), self.names[at]

    @property
    def participating(self) -> Flags:
        """(mode,) whether an acceleration along x excites the mode."""
        return np.asarray(self.participation > PARTICIPATING)

    @property
    def text(self) -> str:
        """The usable bandwidth and the hidden load, in one line."""
        if np.isinf(self.bandwidth):
            return "the motion is known exactly, at all frequencies"
        excited = self.frequency[self.participating]
        if not excited.size:
            return f"follows changes up to {digits(self.bandwidth)} Hz; the travel excites no mode"
        within = int(np.count_nonzero(excited <= self.bandwidth))
        which = {0: "none of the", excited.size: "all" if within > 1 else "the"}.get(
            within, f"{within} of the"
        )
        counted_modes = f"{counted(excited.size, 'mode')} that the travel excites"
        text = f"follows changes up to {digits(self.bandwidth)} Hz and {which} {counted_modes}; hidden dynamic load"
        share, load, name = self.worst
        if share < NEGLIGIBLE_SHARE:
            return f"{text}: below {percent(NEGLIGIBLE_SHARE)}"
        return f"{text}: up to {digits(100 * share, 2)} % ({digits(load)} N) of that of {name} in the linear model"

    def warnings(self) -> Iterator[WarningText]:
        """The hidden load and the way out, if it is beyond its limit."""
        share, load, name = self.worst
        if LIMITS["hidden load"].holds(share):
            return
        missing = np.where(self.participating, self.participation * (1.0 - self.ringing), 0.0)
        mode = int(missing.argmax())
        frequency = float(self.frequency[mode])
        rate = 10.0 * frequency  # Hz, enough to show the mode
        way_out = (
            f"Record at {float(f'{rate:.2g}'):g} Hz or faster."
            if self.sample_step > 1.0 / rate
            else "Noise limits the bandwidth, not the sampling rate: a finer encoder or less noise would raise it."
        )
        yield WarningText(
            "hidden load",
            f"Warning: the trace shows sudden changes up to {digits(self.bandwidth)} Hz: one looks like a ramp of "
            f"{digits(1e3 * ramp_time(self.bandwidth))} ms, which makes mode {mode + 1} "
            f"({', '.join(self.moving[mode])}, {digits(frequency)} Hz, excited along x) ring "
            f"{digits(100 * self.ringing[mode], 2)} % as much. If the change of {digits(self.change)} m/s2 that the "
            f"trace shows was sudden, the dynamic load of {name} is up to {digits(load)} N above what is shown "
            f"({digits(100 * share, 2)} % of its dynamic load in the linear model), an upper bound for a single "
            f"change. {way_out}",
        )


def _unit_response(machine: Machine, modes: Modes) -> tuple[Array, Array]:
    """Static loads (name,) N of the linear model under 1 m/s2 along x, and the participation (mode,)."""
    table = machine.link_table()
    (mass, _, stiffness), _ = machine.nominal_scene.matrices()
    force = -(modes.shape @ mass[:, 0])
    modal_stiffness = np.einsum("mi,ij,mj->m", modes.shape, stiffness, modes.shape)
    in_modes = (modes.shape @ table.rows.T) * table.stiffness * (force / modal_stiffness)[:, None]
    sizes = np.abs(in_modes).max(axis=1)
    total = float(sizes.sum())
    # If x excites no mode, the loads are rounding, far below the mass times 1 m/s2.
    participation = sizes / total if total > ROUNDING * machine.whole_body.mass else np.zeros(sizes.size)
    return _loads(machine, in_modes.sum(axis=0)[None])[0], participation


def _peaks(machine: Machine, static: Array, frequency: Array, ramp: float) -> Array:
    """(name,) N, peaks after an acceleration along x that grows to 1 m/s2 within `ramp` [s] and stays constant.

    static: (name,) N, loads under 1 m/s2 at rest; frequency: Hz, of the modes that x excites.
    """
    if not frequency.size:
        return static
    after = PERIODS / float(frequency.min())
    start = max(ramp - after, 0.0)
    per_second = INSTANTS_PER_PERIOD * float(frequency.max())
    count = min(int((ramp + after - start) * per_second) + 2, MOST_INSTANTS)
    times = np.linspace(start, ramp + after, count)
    stamps = np.array([0.0, ramp, ramp + after] if ramp else [0.0, after])
    acceleration = np.outer(np.ones(stamps.size), [1.0, 0.0, 0.0])
    acceleration[0, 0] = not ramp
    scene = machine.nominal_scene
    solution = scene.solve(stamps, acceleration, method="exact", rtol=1e-6, times=times)
    dynamic = solution.link_loads("total") - scene.static_link_loads()
    # Heavily damped loads reach their static value after the end of the run.
    return np.asarray(np.maximum(_loads(machine, dynamic).max(axis=0), static))


def _loads(machine: Machine, links: Array) -> Array:
    """(n, name) N, y-z resultants of the carriages and magnitudes of the link loads, from link loads (n, link) [N]."""
    return np.hstack([machine.resultants(links), np.abs(links)])
