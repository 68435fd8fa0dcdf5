"""Figures of the audit, computed from the machine and the histories of the result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.audit.histories import Histories
from guideload.base.arrays import Array, Flags, Indices, Integers, median_step
from guideload.base.quantities import Quantities
from guideload.machine.modes import Modes
from guideload.motion.resolution import TraceResolution

POWER_SHARE = 0.99  # of the excitation's power that lies within its bandwidth
PAUSE = 100.0  # median steps: a longer step of time is a pause without samples
# Load over preload at which the unloaded row of a preloaded contact opens: 2^n.
BALL_ROW = 2.0**1.5
ROLLER_ROW = 2.0 ** (10 / 9)
ROLLERS = BALL_ROW / ROLLER_ROW
STATICS = "weight, m a and process forces"  # what a static calculation knows; it knows no errors of rails


@dataclass(frozen=True)
class Rotation:
    """The largest rotation, and the second-order terms that the model neglects."""

    largest: float  # rad, of L from the unloaded position
    time: float  # s, instant of the largest rotation
    # largest change of a link load by the second-order terms, relative to the largest link load
    second_order: float


def rotation(histories: Histories) -> Rotation:
    """The largest rotation, and an estimate of the second-order terms that the model neglects.

    Second-order displacement of a link's point: phi x (phi x p) / 2. Second-order moments: link forces act at points
    displaced by phi x p, weight and inertial force at the centre of mass displaced by phi x r_S. The change of load is
    the quasi-static response, with nominal stiffness, to these displacements and moments.
    For linear links the estimate agrees with a model of finite rotations to about 10 %. It neglects gyroscopic forces
    and the vibration that the changes excite.
    """
    body, links, load = histories.machine.whole_body, histories.links, histories.data["link_load"]
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
    """Loss of contact, and the preload that would prevent it."""

    # (time, link) whether a link with clearance carries no load, or a preloaded link has a row open
    lost: Flags
    share: Array  # (link,) fraction of the time for which `lost` is true
    never_touching: tuple[str, ...]  # names of the links with clearance that are never in contact
    changes: int  # number of contact changes that the solver counted
    changing_sign: tuple[str, ...]  # names of the links whose elastic load changes its sign
    preloaded: Flags  # (link,) whether the link is preloaded
    # (carriage, 2) N, along y and z: preload of the whole carriage that keeps both rows of balls loaded under these
    # loads; rollers need `ROLLERS` times as much
    preload_needed: Array

    def lost_by(self, links: Integers) -> Flags:
        """Whether any of the links with these indices has lost contact, shape (time,)."""
        return np.asarray(self.lost[:, links].any(axis=1))

    def words(self, links: Integers) -> str:
        """What "lost" means for the links with these indices that lose contact."""
        rows = self.preloaded[links[self.lost[:, links].any(axis=0)]]
        if not rows.any():
            return "contact lost"
        return "a row open" if rows.all() else "contact lost or a row open"


def contact(histories: Histories) -> Contact:
    """Loss of contact, and the preload that would prevent it: a row opens at 2^n times the preload."""
    links = histories.links
    lost = np.zeros(histories.deflection.shape, dtype=np.bool_)
    preloaded = np.array([law.kind == "preloaded" for law in links.laws])
    if not histories.linear:
        slack = (histories.by_law("force") == 0.0) & (histories.by_law("tangent") == 0.0)
        lost = np.where(preloaded, np.abs(histories.deflection) >= histories.edges, slack)
    elastic = histories.data["link_load_elastic"]
    high, low = elastic.max(axis=0), elastic.min(axis=0)
    largest = np.maximum(high, -low)
    rounding = 1e-9 * largest.max()
    names = np.array(links.names)
    return Contact(
        lost=lost,
        share=share_of_time(histories.time, lost),
        never_touching=tuple(names[lost.all(axis=0) & ~preloaded].tolist()),
        changes=int(histories.data.attrs["contact_changes"]),
        changing_sign=tuple(names[(high > rounding) & (low < -rounding)].tolist()),
        preloaded=preloaded,
        preload_needed=_preload_needed(histories, largest),
    )


def _preload_needed(histories: Histories, largest: Array) -> Array:
    """Preload (carriage, 2) [N] along y and z of which each link has its share, from the largest link loads (link,)."""
    axis, carriages = histories.links.axis, histories.machine.links_of_carriages
    needed = np.zeros((len(carriages), 2))
    for needs, of_carriage in zip(needed, carriages, strict=True):
        for i in range(2):
            along = of_carriage[axis[of_carriage] == i + 1]
            needs[i] = along.size * (largest[along].max() / BALL_ROW)
    return needed


@dataclass(frozen=True)
class Sampling:
    """Sample steps, natural frequencies, and bandwidth of the excitation.

    lowest, highest Hz, natural frequencies
    """

    step: float | None  # s, median step of the reported instants; None for a single instant
    trace_step: float  # s, median step of the motion's samples
    lowest: float
    highest: float
    band: float | None  # Hz, bandwidth of the excitation; see `excitation_band`
    between: bool  # whether peaks between the reported instants are known too

    @property
    def per_period(self) -> float | None:
        """Reported instants per period of the highest mode."""
        return None if self.step is None else 1.0 / (self.step * self.highest)

    @property
    def missed(self) -> float:
        """Largest part of a vibration of the highest mode that the reported instants miss."""
        if self.per_period is None or self.between:
            return 0.0
        return float(1.0 - np.cos(np.pi / max(self.per_period, 2.0)))


def sampling(histories: Histories, modes: Modes) -> Sampling:
    """The sample steps, the natural frequencies and the bandwidth of the excitation."""
    lowest, highest = float(modes.frequency.min()), float(modes.frequency.max())
    step = histories.step or None
    between = "peak_resultant" in histories.data
    return Sampling(step, histories.trace_step, lowest, highest, excitation_band(histories), between)


def resolution(histories: Histories, modes: Modes) -> TraceResolution | None:
    """The trace resolution, of the machine without payloads; None if the instants are coarser than the motion."""
    if not histories.as_fine_as_motion:
        return None
    along_x = histories.cart_acceleration[:, 0]
    band, step = histories.usable_bandwidth, histories.trace_step
    return TraceResolution.of(histories.given_machine, modes, histories.time, along_x, band, step)


def excitation_band(histories: Histories) -> float | None:
    """Bandwidth of the excitation [Hz]: 99 % of its power lies below.

    None without excitation, and if the instants are further apart than the samples of the motion.

    Power is the mean square of the quasi-static link loads without weight; for an acceleration along one axis it is
    proportional to the mean square of the acceleration. The mean has frequency 0.
    """
    inputs = np.hstack([histories.cart_acceleration, histories.wrench])
    acting = np.flatnonzero(inputs.any(axis=0))
    if not histories.as_fine_as_motion or not acting.size:
        return None
    forces = np.vstack([-histories.mass[:, :3].T, np.eye(6)])[acting]
    loads = forces @ histories.response
    step, columns = uniform(histories.time, inputs[:, acting])
    transform = np.fft.rfft(columns, axis=0)
    power = np.einsum("fi,ij,fj->f", transform, loads @ loads.T, transform.conj()).real
    power[1 : (len(columns) + 1) // 2] *= 2.0  # negative frequencies
    total = np.cumsum(power)
    if total[-1] <= 0.0:  # no link is loaded
        return None
    return float(np.searchsorted(total, POWER_SHARE * total[-1])) / (len(columns) * step)


def uniform(time: Array, columns: Array, step: float | None = None) -> tuple[float, Array]:
    """The step [s], by default the median one, and the columns (n, ...) at uniform steps, without long pauses.

    Columns with uneven steps are interpolated linearly, which reduces the highest frequencies.
    """
    time = without_pauses(time)
    step = median_step(time) if step is None else step
    even = time[0] + step * np.arange(int((time[-1] - time[0]) / step * (1 + 1e-12)) + 1)
    if even.size == time.size and np.allclose(np.diff(time), step, rtol=1e-6, atol=0):
        return step, columns
    flat = columns.reshape(time.size, -1)
    flat = np.stack([np.interp(even, time, column) for column in flat.T], axis=1)
    return step, flat.reshape(even.size, *columns.shape[1:])


def without_pauses(time: Array) -> Array:
    """Times (n,) [s] with steps of at most `PAUSE` median ones: of a weekend without samples there is no spectrum."""
    beyond = np.maximum(np.diff(time) - PAUSE * median_step(time), 0.0)
    return np.asarray(time - np.append(0.0, np.cumsum(beyond)))


@dataclass(frozen=True, eq=False)
class SimplerModels:
    """Peaks of simpler models, and the peaks of the result."""

    names: tuple[str, ...]  # names of the carriages; of the links if there are no carriages
    # (name,) N, largest y-z resultant of the carriage, or largest load of the link, at the instants
    peak: Array
    at_any_time: Array  # (name,) N, the same between the instants too, if it is known
    quasi_static: Array  # (name,) N, peak on rails without errors of K q = Q + E - M_u a at every instant
    # (name,) N, peak with the nominal stiffness of every link; None if all links are linear, or if the instants do not
    # contain the whole excitation from the start, or payloads come and go
    linear: Array | None
    links: tuple[str, ...]  # names of the links
    # (link,) N, largest |load - static load|; of links, because the resultant of a carriage has no moments
    dynamic: Array
    quasi_static_dynamic: Array  # (link,) N, largest change of the quasi-static load from rest

    @property
    def dynamic_factor(self) -> Array:
        """Peak at any time over quasi-static peak, (name,): the load factor f_W of catalogues; 1 without load."""
        ones = np.ones_like(self.peak)
        return np.divide(self.at_any_time, self.quasi_static, out=ones, where=self.quasi_static > 0.0)

    def deviation(self, peak: Array) -> tuple[float, str]:
        """Largest relative error of peaks of a simpler model (negative: too small), and the name where it occurs."""
        return _worst(self.names, peak, self.peak)

    @property
    def dynamic_deviation(self) -> tuple[float, str]:
        """Largest relative error of the quasi-static dynamic loads, and the link where it occurs."""
        return _worst(self.links, self.quasi_static_dynamic, self.dynamic)


def simpler_models(histories: Histories) -> SimplerModels:
    """The peaks of simpler models, in which nonlinear links have their nominal stiffness."""
    machine, data, links = histories.machine, histories.data, histories.links.names
    load, linear = data["link_load"], None
    if not histories.linear and histories.repeatable and not histories.changes:
        linear = _peak(histories, histories.solve("exact", 1e-6, 1.0, machine.nominal_scene))
    peak = _peak(histories, load)
    return SimplerModels(
        names=tuple(carriage.name for carriage in machine.carriages) or links,
        peak=peak,
        at_any_time=data["peak_resultant"] if machine.carriages and "peak_resultant" in data else peak,
        quasi_static=_peak(histories, histories.quasi_static),
        linear=linear,
        links=links,
        dynamic=np.abs(load - data["static_link_load"]).max(axis=0),
        quasi_static_dynamic=np.abs(histories.quasi_static_change).max(axis=0),
    )


def vibration(histories: Histories) -> tuple[float, float]:
    """Largest difference of a resultant from the quasi-static one, and the largest one [N]; else of link loads."""
    load, quasi_static = histories.data["link_load"], histories.quasi_static + histories.rail_load
    if histories.machine.carriages:
        load, quasi_static = histories.data["resultant"], histories.machine.resultants(quasi_static)
    return float(np.abs(load - quasi_static).max()), float(np.abs(load).max())


def peak_instants(data: Quantities) -> Indices:
    """Indices (carriage, 3) of the instants of largest resultant, dynamic force in y and z, and dynamic moment."""
    across = data["force"][:, :, 1:]
    dynamic = across - data["static_force"][:, 1:], data["moment"] - data["static_moment"]
    return np.stack(
        [np.linalg.norm(vectors, axis=2).argmax(axis=0) for vectors in (across, *dynamic)], axis=1
    )


def _peak(histories: Histories, load: Array) -> Array:
    """Peaks (name,) [N], from link loads (n, link) [N]: see `SimplerModels.peak`."""
    sizes = histories.machine.resultants(load) if histories.machine.carriages else np.abs(load)
    return np.asarray(sizes.max(axis=0))


def _worst(names: tuple[str, ...], load: Array, reference: Array) -> tuple[float, str]:
    """The largest relative deviation from the reference (at least 10 % of its maximum), and its name."""
    largest = max(float(reference.max()), float(load.max()))
    if not largest:
        return 0.0, names[0]
    deviation = (load - reference) / np.maximum(reference, 0.1 * largest)
    at = int(np.abs(deviation).argmax())
    return float(deviation[at]), names[at]


def share_of_time(time: Array, flags: Flags) -> Array:
    """Fraction of the time for which flags (time, column) are true, (column,), by the trapezoidal rule."""
    span = time[-1] - time[0]
    if span == 0.0:
        return np.asarray(flags.mean(axis=0))
    return np.asarray(np.diff(time) @ (0.5 * (flags[1:] + flags[:-1].astype(np.float64))) / span)
