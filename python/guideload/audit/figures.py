"""Figures of the audit: each from the machine and the histories of the result alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.audit.histories import Histories
from guideload.base.arrays import Array, median_step
from guideload.base.quantities import Quantities
from guideload.machine.modes import Modes
from guideload.motion.resolution import TraceResolution

FEWEST_PER_PERIOD = 2.0  # samples per period of the highest mode
POWER_SHARE = 0.99  # of the excitation's power, which lies below the end of its band
NUDGE = 1e-9  # relative growth of the excitation, far below the error of any trace
# Load over preload at which a preloaded contact opens its unloaded row, 2^n: balls, and rollers.
BALL_ROW = 2.0**1.5
ROLLER_ROW = 2.0 ** (10 / 9)
ROLLERS = BALL_ROW / ROLLER_ROW


@dataclass(frozen=True)
class Rotation:
    """The largest rotation and the terms of second order that the model leaves out.

    largest       rad, of L from the unloaded position
    time          s, when it is reached
    second_order  largest change of a link's load by the terms of second order, relative to the largest link load; see
                  `rotation`
    """

    largest: float
    time: float
    second_order: float


def rotation(histories: Histories) -> Rotation:
    """The largest rotation, and an estimate of the second-order terms that the model leaves out.

    For every instant: the links' ends move by phi x (phi x p) / 2 more; link forces act at points that have moved by
    phi x p, and weight and inertia at a centre of mass that has moved by phi x r_S. The load changes by the
    quasi-static response of the links, with nominal stiffness, to these forces and displacements.
    Compared with a model of finite rotations the estimate is right to about 10 % where links are linear. Gyroscopic
    forces and the vibration that the changes excite are left out.
    """
    body, links, load = histories.machine.body, histories.links, histories.data["link_load"]
    points, directions = links.points, links.directions
    phi = histories.position[:, 3:]
    size = np.linalg.norm(phi, axis=1)
    along = np.einsum("ij,ij->i", points, directions)
    turned = phi @ directions.T
    extra = 0.5 * ((phi @ points.T) * turned - along * (size**2)[:, None]) * links.stiffness
    change = -extra @ histories.rows
    change[:, 3:] -= (load * turned) @ points - phi * (load @ along)[:, None]
    center, acceleration = np.array(body.center_of_mass), histories.acceleration
    inertial = histories.machine.gravity - histories.cart_acceleration - acceleration[:, :3]
    inertial -= np.cross(acceleration[:, 3:], center)
    change[:, 3:] += np.cross(np.cross(phi, center), body.mass * inertial)
    change_of_load = change @ histories.response + extra
    largest_load = float(np.abs(load).max())
    at = int(size.argmax())
    second_order = float(np.abs(change_of_load).max()) / largest_load if largest_load else 0.0
    return Rotation(float(size[at]), float(histories.time[at]), second_order)


@dataclass(frozen=True, eq=False)
class Contact:
    """Where links carry nothing, or would if they could not pull.

    lost            (time, link) whether a link carries nothing (clearance) or on one row only (preload)
    share           (link,) fraction of the time for which that is so
    never_touching  names of the links that have clearance and never touch
    changes         number of contact changes, counted while solving
    changing_sign   names of the links whose elastic load pulls and pushes, in the links' order
    preloaded       (link,) whether `lost` means an open row, not a link that carries nothing
    preload_needed  (carriage, 2) N, along y and z: preload of the whole carriage with which balls stay loaded on
                    both rows under these loads; rollers need `ROLLERS` times as much
    """

    lost: NDArray[np.bool_]
    share: Array
    never_touching: tuple[str, ...]
    changes: int
    changing_sign: tuple[str, ...]
    preloaded: NDArray[np.bool_]
    preload_needed: Array

    def lost_by(self, links: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(time,) whether any of these links, given by their indices, has lost contact."""
        return np.asarray(self.lost[:, links].any(axis=1))

    def words(self, links: NDArray[np.int64]) -> str:
        """What happens to those of these links that lose contact."""
        rows = self.preloaded[links[self.lost[:, links].any(axis=0)]]
        return (
            "contact lost" if not rows.any() else "a row open" if rows.all() else "contact lost or a row open"
        )


def contact(histories: Histories) -> Contact:
    """Contact that was lost, and the preload that would prevent it: a row opens at 2^n times the preload."""
    links = histories.links
    lost = np.zeros(histories.deflection.shape, dtype=np.bool_)
    for i, law in enumerate(() if histories.linear else links.laws):
        deflection = np.ascontiguousarray(histories.deflection[:, i])
        if law.kind == "preloaded":
            lost[:, i] = np.abs(deflection) >= law.edges[-1]
        elif law.kind != "linear":
            lost[:, i] = (law.force(deflection) == 0.0) & (law.tangent(deflection) == 0.0)
    preloaded = np.array([law.kind == "preloaded" for law in links.laws])
    elastic = histories.data["link_load_elastic"]
    high, low = elastic.max(axis=0), elastic.min(axis=0)
    largest = np.maximum(high, -low)
    rounding = 1e-9 * largest.max()
    ends = np.array([largest[of_carriage] for of_carriage in histories.machine.links_of_carriages])
    half_needed = ends.reshape(-1, 2, 2).max(axis=1) / BALL_ROW  # an end has half of the carriage's preload
    names = np.array(links.names)
    return Contact(
        lost=lost,
        share=share_of_time(histories.time, lost),
        never_touching=tuple(names[lost.all(axis=0) & ~preloaded].tolist()),
        changes=int(histories.data.attrs["contact_changes"]),
        changing_sign=tuple(names[(high > rounding) & (low < -rounding)].tolist()),
        preloaded=preloaded,
        preload_needed=2.0 * half_needed,
    )


@dataclass(frozen=True)
class Sampling:
    """Step of the samples, natural frequencies and bandwidth of the excitation.

    step            s, median distance of the reported instants; None for a single one
    trace_step      s, median distance of the motion's samples
    lowest, highest Hz, natural frequencies
    band            Hz, the frequency below which `POWER_SHARE` of the excitation's power lies; see `excitation_band`
    """

    step: float | None
    trace_step: float
    lowest: float
    highest: float
    band: float | None

    @property
    def per_period(self) -> float | None:
        """Reported instants per period of the highest mode."""
        return None if self.step is None else 1.0 / (self.step * self.highest)


def sampling(histories: Histories, modes: Modes) -> Sampling:
    """The steps of the samples beside the natural frequencies and the bandwidth of the excitation."""
    lowest, highest = float(modes.frequency.min()), float(modes.frequency.max())
    step = histories.step or None
    return Sampling(step, histories.trace_step, lowest, highest, excitation_band(histories))


def resolution(histories: Histories, modes: Modes) -> TraceResolution | None:
    """The resolution of the trace; None where the instants do not hold all of the motion."""
    if not histories.fine:
        return None
    along_x = histories.cart_acceleration[:, 0]
    band, step = histories.usable_bandwidth, histories.trace_step
    return TraceResolution.of(histories.machine, modes, histories.time, along_x, band, step)


def excitation_band(histories: Histories) -> float | None:
    """The frequency [Hz] below which 99 % of the excitation's power lies.

    None without any excitation, and where the instants are further apart than the motion's samples.

    Power is the mean square of the quasi-static link loads under the excitation, weight not included: for an
    acceleration along one axis, that of the acceleration itself. Its mean counts as frequency 0.
    """
    inputs = np.hstack([histories.cart_acceleration, histories.wrench])
    acting = np.flatnonzero(inputs.any(axis=0))
    if not histories.fine or not acting.size:
        return None
    forces = np.vstack([-histories.mass[:, :3].T, np.eye(6)])[acting]
    loads = forces @ histories.response
    step, columns = uniform(histories.time, inputs[:, acting])
    transform = np.fft.rfft(columns, axis=0)
    power = np.einsum("fi,ij,fj->f", transform, loads @ loads.T, transform.conj()).real
    power[1 : (len(columns) + 1) // 2] *= 2.0  # the mirror images
    total = np.cumsum(power)
    if total[-1] <= 0.0:  # it moves no link
        return None
    return float(np.searchsorted(total, POWER_SHARE * total[-1])) / (len(columns) * step)


def uniform(time: Array, columns: Array) -> tuple[float, Array]:
    """Step [s] and columns (n, ...) of a record, which is interpolated linearly where its steps are uneven.

    The step is the median one. Interpolation is fine enough to read peaks, but not exact: it weakens the highest
    frequencies.
    """
    step = median_step(time)
    even = time[0] + step * np.arange(int((time[-1] - time[0]) / step * (1 + 1e-12)) + 1)
    if even.size == time.size and np.allclose(np.diff(time), step, rtol=1e-6, atol=0):
        return step, columns
    flat = columns.reshape(time.size, -1)
    flat = np.stack([np.interp(even, time, column) for column in flat.T], axis=1)
    return step, flat.reshape(even.size, *columns.shape[1:])


@dataclass(frozen=True, eq=False)
class SimplerModels:
    """Peaks by simpler models, beside those of the result.

    names         carriages; links where the machine has no carriage
    peak          (name,) N, of the y-z resultant (of a link: of its load), of the result
    quasi_static  (name,) N, peak of K q = Q + E - M_u a at every instant: static calculation with m a
    linear        (name,) N, peak with the nominal stiffness of every link; None where links are linear already, and
                  where the instants do not hold the whole excitation from the start on
    links         names of the links
    dynamic       (link,) N, largest distance of the load from the static one; sums over a carriage can hide a moment
    quasi_static_dynamic  (link,) N, largest distance of the quasi-static load from the static one
    """

    names: tuple[str, ...]
    peak: Array
    quasi_static: Array
    linear: Array | None
    links: tuple[str, ...]
    dynamic: Array
    quasi_static_dynamic: Array

    @property
    def dynamic_factor(self) -> Array:
        """(name,) peak over the quasi-static peak: the load factor f_W of catalogues; 1 where there is no load."""
        ones = np.ones_like(self.peak)
        return np.divide(self.peak, self.quasi_static, out=ones, where=self.quasi_static > 0.0)

    def deviation(self, peak: Array) -> tuple[float, str]:
        """Worst relative deviation of the peaks of a simpler model (negative: too small), and of which name."""
        return _worst(self.names, peak, self.peak)

    @property
    def dynamic_deviation(self) -> tuple[float, str]:
        """Worst relative deviation of the dynamic parts of the quasi-static link loads, and of which link."""
        return _worst(self.links, self.quasi_static_dynamic, self.dynamic)


def simpler_models(histories: Histories) -> SimplerModels:
    """The peaks that simpler models give; where links are not linear, with nominal stiffness."""
    machine, links, load = histories.machine, histories.links.names, histories.data["link_load"]
    moved, at_rest = histories.excitation @ histories.response, histories.weight @ histories.response
    repeat = not histories.linear and histories.repeatable
    return SimplerModels(
        names=tuple(carriage.name for carriage in machine.carriages) or links,
        peak=_peak(histories, load),
        quasi_static=_peak(histories, at_rest + moved),
        linear=_peak(histories, histories.solved(machine.nominal_scene)) if repeat else None,
        links=links,
        dynamic=np.abs(load - histories.data["static_link_load"]).max(axis=0),
        quasi_static_dynamic=np.abs(moved).max(axis=0),
    )


def sensitivity(histories: Histories) -> float | None:
    """Largest change of a link load when the excitation grows by `NUDGE`, relative to the largest link load.

    Impacts multiply small differences. None where links are linear, where the method is not exact, and where the run
    cannot be repeated from the instants.
    """
    if histories.linear or histories.data.attrs["method"] != "exact" or not histories.repeatable:
        return None
    load = histories.data["link_load"]
    largest = float(np.abs(load).max())
    change = np.abs(histories.solved(histories.machine.scene, 1.0 + NUDGE) - load)
    return float(change.max()) / largest if largest else 0.0


def peak_instants(data: Quantities) -> NDArray[np.intp]:
    """(carriage, 3): which instants have the largest resultant, dynamic force across the rail and dynamic moment."""
    across = data["force"][:, :, 1:]
    dynamic = across - data["static_force"][:, 1:], data["moment"] - data["static_moment"]
    return np.stack(
        [np.linalg.norm(vectors, axis=2).argmax(axis=0) for vectors in (across, *dynamic)], axis=1
    )


def _peak(histories: Histories, load: Array) -> Array:
    """(name,) N, largest y-z resultant of each carriage from link loads (n, link) [N]; without carriages of links."""
    machine, directions = histories.machine, histories.links.directions
    if not machine.carriages:
        return np.asarray(np.abs(load).max(axis=0))
    sums = (load[:, links] @ directions[links, 1:] for links in machine.links_of_carriages)
    return np.array([np.hypot(force[:, 0], force[:, 1]).max() for force in sums])


def _worst(names: tuple[str, ...], load: Array, reference: Array) -> tuple[float, str]:
    """The largest deviation of loads, and whose; relative to the load, or to 10 % of the largest if that is more."""
    largest = max(float(reference.max()), float(load.max()))
    if not largest:
        return 0.0, names[0]
    deviation = (load - reference) / np.maximum(reference, 0.1 * largest)
    at = int(np.abs(deviation).argmax())
    return float(deviation[at]), names[at]


def share_of_time(time: Array, flags: NDArray[np.bool_]) -> Array:
    """(column,) fraction of the time for which flags (time, column) hold, by the trapezoidal rule."""
    span = time[-1] - time[0]
    if span == 0.0:
        return np.asarray(flags.mean(axis=0))
    return np.asarray(np.diff(time) @ (0.5 * (flags[1:] + flags[:-1].astype(np.float64))) / span)
