"""Figures that the audit of a result judges: each from the machine and the labelled histories alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from guideload._core import Scene
from guideload.base.arrays import Array
from guideload.machine.machine import DOFS, Machine
from guideload.machine.modes import Modes
from guideload.motion.resolution import TraceResolution

if TYPE_CHECKING:
    import xarray as xr

POWER_SHARE = 0.99  # of the excitation's power, which lies below the end of its band
NUDGE = 1e-9  # of the excitation: far less than any trace is right to
BALL_ROW = 2.0**1.5  # of the preload: the load at which a preloaded ball contact opens its unloaded row
ROLLER_ROW = 2.0 ** (10 / 9)


class Histories:
    """What the checks read: a machine and a result's labelled arrays as plain ones, time first, SI.

    `excitation` (time, 6) is the force [N] and moment about L [N m] that drives L in the carriage frame: external
    ones and those of the cart's acceleration, E - M_u a. `rows` (link, 6) give deflections from positions.
    """

    def __init__(self, machine: Machine, data: xr.Dataset) -> None:
        self.machine = machine
        self.data = data
        self.links = machine.link_table()
        self.linear = machine.scene.model_level == "linear"
        points, directions = self.links.points, self.links.directions
        self.rows: Array = np.hstack([directions, np.cross(points, directions)])
        self.free = [DOFS.index(dof) for dof in machine.free]
        (mass, *_), self.weight = machine.scene.matrices()
        self.mass: Array = mass
        self.time: Array = data["time"].values
        self.position, self.velocity, self.acceleration = (
            self.of(name, "dof") for name in ("displacement", "velocity", "acceleration")
        )
        self.cart_acceleration = self.of("cart_acceleration", "axis")
        self.wrench = self.of("wrench", "dof") if "wrench" in data else np.zeros((self.time.size, 6))
        self.excitation: Array = self.wrench - self.cart_acceleration @ mass[:, :3].T
        self.deflection: Array = self.position @ self.rows.T

    def of(self, name: str, *labels: str) -> Array:
        """The history `name`, shape (time, *labels)."""
        values: Array = self.data[name].transpose("time", *labels).values
        return values

    @cached_property
    def stiffness(self) -> Array:
        """(6, 6) of L, with the nominal stiffness of every link."""
        return np.asarray((self.rows.T * self.links.stiffness) @ self.rows)

    @cached_property
    def response(self) -> Array:
        """(6, link) link loads [N] per steady force [N] and moment about L [N m]; nominal stiffness."""
        held = np.ix_(self.free, self.free)
        position = np.zeros((6, 6))
        position[held] = np.linalg.inv(self.stiffness[held])
        return np.asarray(position @ (self.rows.T * self.links.stiffness))

    @property
    def rests_at_first(self) -> bool:
        """Whether the first instant is that of the start, where nothing moves yet."""
        return not np.any(self.velocity[0])

    @cached_property
    def step(self) -> float | None:
        """Median distance of the instants [s]; None where there is only one."""
        steps = np.diff(self.time)
        steps = steps[steps > 0]
        return float(np.median(steps)) if steps.size else None

    @property
    def trace_step(self) -> float:
        """Median distance of the motion's samples [s]."""
        return float(self.data.attrs["motion_step_s"])

    @property
    def usable_bandwidth(self) -> float:
        """Up to which frequency the motion shows accelerations [Hz]; see `information`."""
        half_rate = 0.5 / self.trace_step if self.trace_step else np.inf
        return float(self.data.attrs.get("motion_bandwidth_Hz", half_rate))  # files of before have none

    @property
    def hidden_jumps(self) -> int:
        """Jumps of the excitation that the instants do not show from both sides."""
        return int(self.data.attrs["motion_jumps"]) - int(np.count_nonzero(np.diff(self.time) == 0.0))

    @property
    def repeatable(self) -> bool:
        """Whether the run can be made again from the instants: they hold the whole excitation, from the start on."""
        return self.rests_at_first and self.fine and not self.hidden_jumps

    def solved(self, scene: Scene, factor: float = 1.0) -> Array:
        """(time, link) N, link loads of a scene under the excitation times a factor; links not preloaded."""
        acceleration, wrench = factor * self.cart_acceleration, factor * self.wrench
        return scene.solve(self.time, acceleration, wrench, method="exact", rtol=1e-6).link_loads("total")

    @property
    def fine(self) -> bool:
        """Whether the instants are as close as the motion's samples, so that no excitation is lost between them."""
        return self.step is not None and self.step <= 1.001 * self.trace_step


@dataclass(frozen=True)
class Rotation:
    """The largest rotation and what small rotations neglect.

    largest       rad, of L from the unloaded position
    time          s, when it is reached
    second_order  change of a link's load by the terms of second order, relative to the largest link load; see
                  `rotation`
    """

    largest: float
    time: float
    second_order: float


def rotation(of: Histories) -> Rotation:
    """The largest rotation, and an estimate of the second-order terms that the model leaves out.

    For every instant: the links' ends move by phi x (phi x p) / 2 more; link forces act at points that have moved by
    phi x p, and weight and inertia at a centre of mass that has moved by phi x r_S. The body answers these forces
    standing still, on the nominal stiffness of the links; the change of load is that of the links under both.
    Against a model with finite rotations the figure is right to about 10 % where links are linear. Left out
    are gyroscopic forces and the vibration that the changes excite.
    """
    phi = of.position[:, 3:]
    size = np.linalg.norm(phi, axis=1)
    points, directions, stiffness = of.links.points, of.links.directions, of.links.stiffness
    along = np.einsum("ij,ij->i", points, directions)
    turned = phi @ directions.T
    extra = 0.5 * ((phi @ points.T) * turned - along * (size**2)[:, None]) * stiffness
    load = of.of("link_load", "link")
    change = -extra @ of.rows
    change[:, 3:] -= (load * turned) @ points - phi * (load @ along)[:, None]
    center = np.array(of.machine.body.center_of_mass)
    body = of.machine.gravity - of.cart_acceleration - of.acceleration[:, :3]
    body -= np.cross(of.acceleration[:, 3:], center)
    change[:, 3:] += np.cross(np.cross(phi, center), of.machine.body.mass * body)
    change_of_load = change @ of.response + extra
    largest_load = float(np.abs(load).max())
    at = int(size.argmax())
    second_order = float(np.abs(change_of_load).max()) / largest_load if largest_load else 0.0
    return Rotation(float(size[at]), float(of.time[at]), second_order)


@dataclass(frozen=True, eq=False)
class Contact:
    """Where links carry nothing, or would if they could not pull.

    lost            (time, link) whether a link carries nothing (clearance) or on one row only (preload)
    share           (link,) part of the time for which that is so
    never           names of the links that have clearance and never touch
    changes         how many times a link passed an edge of its law, counted while solving
    changing_sign   names of the links whose elastic load pulls and pushes, in the links' order
    preloaded       (link,) whether `lost` means a row that is open, not a link that carries nothing
    preload_needed  (carriage, 2) N, along y and z: preload of the whole carriage with which balls stay loaded on
                    both rows under these loads; rollers need `ROLLERS` times as much
    """

    lost: NDArray[np.bool_]
    share: Array
    never: tuple[str, ...]
    changes: int
    changing_sign: tuple[str, ...]
    preloaded: NDArray[np.bool_]
    preload_needed: Array

    def lost_by(self, links: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(time,) whether any of these links has lost contact, by their indices."""
        return np.asarray(self.lost[:, links].any(axis=1))

    def words(self, links: NDArray[np.int64]) -> str:
        """What it means that some of these links have lost contact."""
        rows = self.preloaded[links[self.lost[:, links].any(axis=0)]]
        return (
            "contact lost" if not rows.any() else "a row open" if rows.all() else "contact lost or a row open"
        )


ROLLERS = BALL_ROW / ROLLER_ROW


def contact(of: Histories) -> Contact:
    """Contact that was lost, and the preload that would keep it: a row opens at 2^n times the preload."""
    lost = np.zeros(of.deflection.shape, dtype=np.bool_)
    clear = np.zeros(len(of.links.names), dtype=np.bool_)
    for i, law in enumerate(() if of.linear else of.links.laws):
        deflection = np.ascontiguousarray(of.deflection[:, i])
        if law.kind == "preloaded":
            lost[:, i] = np.abs(deflection) >= law.edges[-1]
        elif law.kind != "linear":
            lost[:, i] = (law.force(deflection) == 0.0) & (law.tangent(deflection) == 0.0)
            clear[i] = True
    elastic = of.of("link_load_elastic", "link")
    high, low = elastic.max(axis=0), elastic.min(axis=0)
    largest = np.maximum(high, -low)
    rounding = 1e-9 * largest.max()
    ends = np.array([largest[links] for links in of.machine.links_of_carriages]).reshape(-1, 2, 2)
    return Contact(
        lost=lost,
        share=share_of_time(of.time, lost),
        never=_chosen(of.links.names, clear & lost.all(axis=0)),
        changes=int(of.data.attrs["contact_changes"]),
        changing_sign=_chosen(of.links.names, (high > rounding) & (low < -rounding)),
        preloaded=np.array([law.kind == "preloaded" for law in of.links.laws]),
        preload_needed=2.0 * ends.max(axis=1) / BALL_ROW,  # an end has half of the carriage's preload
    )


@dataclass(frozen=True)
class Sampling:
    """Samples against modes.

    step            s, median distance of the reported instants; None for a single one
    trace_step      s, the same of the motion's samples
    lowest, highest Hz, natural frequencies
    band            Hz, the frequency below which `POWER_SHARE` of the excitation's power lies; see `band`
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


def sampling(of: Histories, modes: Modes) -> Sampling:
    """The distance of samples against the modes and the band of the excitation."""
    lowest, highest = float(modes.frequency.min()), float(modes.frequency.max())
    return Sampling(of.step, of.trace_step, lowest, highest, band(of))


def resolution(of: Histories, modes: Modes) -> TraceResolution | None:
    """The trace's band against the modes; None where the instants do not hold the whole motion."""
    if not of.fine:
        return None
    along_x = of.cart_acceleration[:, 0]
    return TraceResolution.of(of.machine, modes, of.time, along_x, of.usable_bandwidth, of.trace_step)


def band(of: Histories) -> float | None:
    """The frequency [Hz] below which 99 % of the excitation's power lies.

    None without any excitation, and where the instants are further apart than the motion's samples.

    Power is the mean square of the link loads that the excitation would cause standing still, weight not included:
    for an acceleration along one axis, that of the acceleration itself. Its mean counts as frequency 0.
    """
    inputs = np.hstack([of.cart_acceleration, of.wrench])
    acting = np.flatnonzero(inputs.any(axis=0))
    if not of.fine or not acting.size:
        return None
    forces = np.vstack([-of.mass[:, :3].T, np.eye(6)])[acting]
    loads = forces @ of.response
    step, columns = uniform(of.time, inputs[:, acting])
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
    steps = np.diff(time)
    step = float(np.median(steps[steps > 0]))
    even = time[0] + step * np.arange(int((time[-1] - time[0]) / step * (1 + 1e-12)) + 1)
    if even.size == time.size and np.allclose(steps, step, rtol=1e-6, atol=0):
        return step, columns
    flat = columns.reshape(time.size, -1)
    flat = np.stack([np.interp(even, time, column) for column in flat.T], axis=1)
    return step, flat.reshape(even.size, *columns.shape[1:])


@dataclass(frozen=True, eq=False)
class Below:
    """Peaks by simpler models, against those of the result.

    names         carriages; links where the machine has no carriage
    peak          (name,) N, of the y-z resultant (of a link: of its load), as the result has it
    quasi_static  (name,) N, peak of K q = Q + E - M_u a at every instant: static calculation with m a
    linear        (name,) N, peak with the nominal stiffness of every link; None where links are linear already, and
                  where the instants do not hold the whole excitation from the start on
    links         names of the links
    dynamic       (link,) N, largest distance of its load from the static one; sums over a carriage can hide a moment
    quasi_static_dynamic  (link,) N, the same of the quasi-static loads
    """

    names: tuple[str, ...]
    peak: Array
    quasi_static: Array
    linear: Array | None
    links: tuple[str, ...]
    dynamic: Array
    quasi_static_dynamic: Array

    def deviation(self, peak: Array) -> tuple[float, str]:
        """How far the peaks of a simpler model lie off, worst one: relative (negative: too small), and name."""
        return _worst(self.names, peak, self.peak)

    @property
    def dynamic_deviation(self) -> tuple[float, str]:
        """The same of the dynamic parts of the quasi-static link loads."""
        return _worst(self.links, self.quasi_static_dynamic, self.dynamic)


def below(of: Histories) -> Below:
    """What the rungs below this model would have given; where links are not linear, with nominal stiffness."""
    links = of.links.names
    names = tuple(carriage.name for carriage in of.machine.carriages) or links
    load, static = of.of("link_load", "link"), of.data["static_link_load"].values
    moved, at_rest = of.excitation @ of.response, of.weight @ of.response
    return Below(
        names=names,
        peak=_peak(of, load),
        quasi_static=_peak(of, at_rest + moved),
        linear=None if of.linear or not of.repeatable else _peak(of, of.solved(of.machine.nominal_scene)),
        links=links,
        dynamic=np.abs(load - static).max(axis=0),
        quasi_static_dynamic=np.abs(moved).max(axis=0),
    )


def sensitivity(of: Histories) -> float | None:
    """Largest change of a link load when the excitation grows by `NUDGE` of it, relative to the largest link load.

    Impacts multiply small differences. None where links are linear, where a method with an error of its own solved
    them, and where the run cannot be made again from the instants.
    """
    if of.linear or of.data.attrs["method"] != "exact" or not of.repeatable:
        return None
    load = of.of("link_load", "link")
    largest = float(np.abs(load).max())
    return float(np.abs(of.solved(of.machine.scene, 1.0 + NUDGE) - load).max()) / largest if largest else 0.0


def peak_instants(of: Histories) -> NDArray[np.intp]:
    """(carriage, 3): which instants have the largest resultant, dynamic force across the rail and dynamic moment."""
    static = [of.data[f"static_{name}"].transpose("carriage", "axis").values for name in ("force", "moment")]
    force, moment = of.of("force", "carriage", "axis"), of.of("moment", "carriage", "axis")
    across = force[:, :, 1:]
    histories = (across, across - static[0][:, 1:], moment - static[1])
    return np.stack([np.linalg.norm(history, axis=2).argmax(axis=0) for history in histories], axis=1)


def _peak(of: Histories, load: Array) -> Array:
    """(name,) N, largest y-z resultant of each carriage from link loads (n, link) [N]; without carriages of links."""
    if not of.machine.carriages:
        return np.asarray(np.abs(load).max(axis=0))
    sums = (load[:, links] @ of.links.directions[links, 1:] for links in of.machine.links_of_carriages)
    return np.array([np.hypot(force[:, 0], force[:, 1]).max() for force in sums])


def _worst(names: tuple[str, ...], found: Array, right: Array) -> tuple[float, str]:
    """The largest deviation of loads, and whose; relative to the load, or to 10 % of the largest if that is more."""
    largest = max(float(right.max()), float(found.max()))
    deviation = (found - right) / np.maximum(right, 0.1 * largest) if largest else np.zeros_like(right)
    at = int(np.abs(deviation).argmax())
    return float(deviation[at]), names[at]


def share_of_time(time: Array, flags: NDArray[np.bool_]) -> Array:
    """(column,) part of the time for which flags (time, column) hold, by the trapezoidal rule."""
    span = time[-1] - time[0]
    if span == 0.0:
        return np.asarray(flags.mean(axis=0))
    return np.asarray(np.diff(time) @ (0.5 * (flags[1:] + flags[:-1].astype(np.float64))) / span)


def _chosen(names: Iterable[str], flags: NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(name for name, flag in zip(names, flags, strict=True) if flag)
