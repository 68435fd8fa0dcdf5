"""The compiled core. Arrays are float64 and C-contiguous unless said otherwise; quantities are SI."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Groups = Sequence[NDArray[np.int64]]
Vector = tuple[float, float, float]

Segments = NDArray[np.uint32]

# Samples and their state-space model: step (n - 1,) between samples, > 0; value and variance (n,) of the samples and
# of their measurement noise; mean (N,) and covariance (N, N) of the state before the first sample; segment (n - 1,)
# of each interval; density (segments,) of the process noise. The state is the value and its derivatives, N = 2 to 6
# numbers; the N-th derivative is white process noise.
SampledModel = tuple[Array, Array, Array, Array, Array, Segments, Array]

def motion_likelihood(given: SampledModel) -> tuple[float, float]:
    """Sums of ln F and of v^2/F over the innovations v and their variances F of a Kalman filter."""

def smooth_motion(given: SampledModel) -> tuple[Array, Array, Array]:
    """Posterior given all samples: (n, 3) value and two derivatives, (n, 3) their variances, (n, 2) u and D.

    u/D is the leave-one-out residual of a sample, 1/D its variance.
    """

def adapt_motion(
    given: SampledModel, rounded: Array, quantum: float, level: float, rule: tuple[int, float, float, float]
) -> tuple[Array, float, Array, Array, Array, Array]:
    """Process-noise densities and measurement noise by likelihood, site approximations by expectation propagation.

    given: model to start from; its values and variances are the sites. rounded: (n,) the samples, rounded to
    `quantum` (0: not rounded) after measurement noise of variance `level`. rule: number of rounds; mode of the
    inverse gamma prior of the densities; its weight, in squared process noises; least measurement noise.

    Returns densities (segments,); measurement noise; values and variances (n,) of the sites; and of the last round the
    leave-one-out log predictive density (n,) and the normalised innovation variance (segments,): the squared process
    noise over its expectation.
    """

# State-space model without samples: step (n - 1,), variance (n,), covariance (N, N), segment (n - 1,), density, as in
# `SampledModel`; the variance of a missing sample is infinite.
StateSpaceModel = tuple[Array, Array, Array, Segments, Array]

def draw_motion(chain: StateSpaceModel, derivative: int, count: int, seed: int) -> Array:
    """(count, n) draws of the posterior deviation of a derivative from its estimate.

    derivative: its index in the state, below N. A draw depends on the seed and its own number only, on any processor.
    """

def load_spread(
    scene: Scene,
    chain: StateSpaceModel,
    derivative: int,
    unit: Array,
    time: Array,
    instants: Array,
    loads: Array,
    groups: Groups,
    centers: Array,
) -> tuple[Array, Array, Array, Array]:
    """Standard deviations of the loads of a linear scene, from the uncertainty of the acceleration along x.

    derivative, unit: index of the acceleration in the state, and (n,) m/s2 per unit of it. time: (n,) s, the stamps;
    the deviation is linear between them. instants: (m,) s, ascending, within the stamps. loads: (m, groups, 6) of the
    estimate, for the directions of the resultants. groups, centers: as in `Scene.peaks`.

    Returns acceleration (m,) m/s2; groups (m, groups, 6) N, N m; sizes (m, groups, 2): the y-z resultant of the
    force [N] and the magnitude of the moment [N m], to first order; links (m, links) N. ValueError if a link is not
    linear.
    """

def draw_peaks(
    scene: Scene,
    chain: StateSpaceModel,
    derivative: int,
    unit: Array,
    time: Array,
    instants: Array,
    loads: Array,
    wanted: NDArray[np.bool_],
    groups: Groups,
    centers: Array,
    count: int,
    seed: int,
    threads: int,
) -> Array:
    """(groups, count) N, largest y-z resultant of each group of a linear scene for each drawn motion.

    loads: (m, groups, 6) of the estimate. wanted: (m, groups), instants at which a peak is possible. The result does
    not depend on the number of threads. Others as in `load_spread` and `draw_motion`.
    """

class Law:
    """The elastic law of a link: force over deflection; immutable.

    The deflection [m] is positive in the link's direction, and 0 in the position without load. Raises SceneError with
    the field and the value if it is invalid.
    """

    @staticmethod
    def linear(stiffness: float) -> Law:
        """F = k d. stiffness: N/m, >= 0."""

    @staticmethod
    def sided(positive: float, negative: float, clearance: float) -> Law:
        """F = positive (d - clearance)+ - negative (-d - clearance)+: one stiffness per direction, outside a clearance.

        positive, negative: N/m, >= 0, not both 0. clearance: m to either side, >= 0.
        """

    @staticmethod
    def preloaded(stiffness: float, preload: float, exponent: float) -> Law:
        """Two rows pressed against each other: F = K ((d0 + d)+^n - (d0 - d)+^n), K = F0/d0^n, d0 = 2 n F0/k0.

        stiffness: k0, N/m at d = 0. preload: F0, N. exponent: n, 3/2 for balls, 10/9 for rollers. One row opens at
        |d| = d0, where |F| = 2^n F0.
        """

    @staticmethod
    def curve(points: Array) -> Law:
        """Straight lines between points (m, 2) of deflection [m] and force [N]; the end slopes go on beyond.

        2 to 16 points, deflections ascending, forces never falling.
        """

    @property
    def kind(self) -> str:
        """linear, sided, preloaded or curve."""

    @property
    def stiffness(self) -> float:
        """The nominal stiffness, N/m: k, the larger side, k0 at no load, or the steepest slope of a curve."""

    @property
    def edges(self) -> Array:
        """(m,) m, ascending: the deflections at which the law has a kink, such as loss of contact."""

    def scaled(self, factor: float) -> Law:
        """The law with all forces times `factor`."""

    def force(self, deflection: Array) -> Array:
        """(n,) N at deflections (n,) m."""

    def tangent(self, deflection: Array) -> Array:
        """(n,) N/m, dF/dd at deflections (n,) m."""

    def energy(self, deflection: Array) -> Array:
        """(n,) J, the integral of the force from 0 to deflections (n,) m."""

class Scene:
    """One rigid body on links, under gravity; immutable.

    center_of_mass, points: m from L. inertia: kg m2 about the centre of mass. gravity: m/s2, pointing down.
    free: names out of x y z rx ry rz. points, directions: (links, 3). laws: one per link. damping: (links,)
    N s/m. damping_in_contact: (links,) whether a link damps only outside its clearance. Raises SceneError for an
    impossible body or link, for a body that its links leave unsupported, naming the motion that no link resists,
    and if there is no static equilibrium.
    """

    def __new__(
        cls,
        *,
        mass: float,
        center_of_mass: Vector,
        inertia: Sequence[Sequence[float]],
        gravity: Vector,
        free: Sequence[str],
        points: Array,
        directions: Array,
        laws: Sequence[Law],
        damping: Array,
        damping_in_contact: NDArray[np.bool_],
    ) -> Scene: ...
    @property
    def model_level(self) -> str:
        """The lowest model level that covers all laws: linear, piecewise linear or smooth nonlinear."""

    @property
    def free_at_rest(self) -> Array:
        """(m, 6) motions (m, rad) in which the body is free within the clearances at rest; none if it is supported."""

    def solve(
        self,
        time: Array,
        acceleration: Array,
        wrench: Array | None = None,
        *,
        method: str,
        rtol: float,
        step: float | None = None,
        times: Array | None = None,
    ) -> Solution:
        """Integrate from static equilibrium.

        time: (n,) s. acceleration: (n, 3) m/s2 of L. wrench: (n, 6) external force [N] and moment about L [N
        m]. method: exact (linear and piecewise linear scenes only), rk45 or implicit. rtol: tolerance of the
        link loads, relative to the load scale: the largest static load of a link under the weight plus that under
        the peaks of the excitation. step: s, fixed step instead of rtol; exact needs neither. times: (m,) s, instants
        to record instead of the samples, ascending within them. All arrays float64 and
        C-contiguous, else ValueError or TypeError. Raises TraceError, ArgumentError, RunError.
        """

    def peaks(
        self,
        time: Array,
        acceleration: Array,
        wrench: Array | None = None,
        *,
        method: str,
        rtol: float,
        step: float | None = None,
        groups: Groups,
        centers: Array,
    ) -> list[Array]:
        """Smallest, largest, time of smallest, time of largest, each (groups, 8).

        Columns: Fx Fy Fz Mx My Mz, y-z resultant of the force, magnitude of the moment.
        As `solve`, but only the running extremes of the loads of the groups are stored.
        """

    def matrices(self) -> tuple[list[Array], Array]:
        """[M, C, K], each (6, 6), for (u, phi) of L, and the weight (6,) as force and moment about L."""

    def modes(self) -> tuple[Array, Array, Array, NDArray[np.complex128]]:
        """Angular frequencies (n,) rad/s, damping ratios (n,), shapes (n, 6), eigenvalues (2 n,) 1/s.

        Shapes are mass-normalised. Raises RunError if the eigenvalues do not converge.
        """

    def static_position(self) -> Array:
        """(6,) position of L at rest, m and rad."""

    def static_reaction(self) -> Array:
        """(6,) reaction of the held dofs at rest, N and N m."""

    def static_link_loads(self) -> Array:
        """(links,) N."""

    def static_group_loads(self, groups: Groups, centers: Array) -> Array:
        """(groups, 6) force [N] and moment about the centre [N m]."""

class Solution:
    """The states of a run."""

    @property
    def steps(self) -> int:
        """Accepted steps."""

    @property
    def rejected(self) -> int:
        """Rejected steps."""

    @property
    def contact_changes(self) -> int:
        """Number of times a link passed a kink of its law; 0 if all are linear."""

    @property
    def load_scale(self) -> float:
        """The load scale that the tolerance refers to, N."""

    def group_loads(self, groups: Groups, centers: Array, part: str) -> Array:
        """(time, groups, 6) force [N] and moment about the centre [N m]; part: total, elastic or damping."""

    def link_loads(self, part: str) -> Array:
        """(time, links) N along each link."""

    def position(self) -> Array:
        """(time, 6) position of L in the carriage frame, sag included, m and rad."""

    def velocity(self) -> Array:
        """(time, 6) velocity of L in the carriage frame, m/s and rad/s."""

    def acceleration(self) -> Array:
        """(time, 6) acceleration of L in the carriage frame, m/s2 and rad/s2."""

    def reaction(self) -> Array:
        """(time, 6) reaction of the held dofs, N and N m; zero for the free ones."""

    def inputs(self) -> Array:
        """(time, 9) the excitation at the recorded instants: acceleration, external force, moment about L."""

class Batch:
    """A base scene and motion, and their changes in each Monte Carlo sample; immutable, for all threads and chunks.

    mass to damping_in_contact: as in `Scene`; the base itself need not be supported. inertia_about_reference: whether
    the inertia is about L, also when mass or centre of mass change, rather than about the centre of mass. groups,
    centers: as in `Scene.peaks`. time, acceleration, wrench: as in `Scene.solve`. speed: (n,) m/s of the cart at the
    stamps, for the mean load. exponent: p of the mean load. method: as in `Scene.solve`, or auto: exact if the laws
    of a sample allow it, else rk45, or implicit if rk45 would be unstable.

    changes: (target, constant, [(column, factor), ...]): sets the target to constant + sum(factor * value[column]),
    each target at most once. Targets: ("mass", 0, 0) kg, ("center_of_mass", axis, 0) m, ("inertia", i, j) kg m2,
    ("gravity", axis, 0) m/s2, ("point", link, axis) m, ("damping", link, 0) N s/m, ("law", link, parameter) with
    stiffness, positive_stiffness, negative_stiffness [N/m], clearance [m], preload [N] or scale (of all forces),
    ("center", group, axis) m, ("acceleration", 0, 0) and ("wrench", 0, 0): factors on the motion.

    measures: (quantity, index, statistic), over the stamps of the motion. Of a group, by its index: Fx Fy Fz [N]
    Mx My Mz [N m] (about its centre), resultant (hypot(Fy, Fz)), and with index 0 the drive (reaction along x; nan if x
    is free) with min, time_of_min, max, time_of_max (the first of equal ones), rms (weighted by time) or start;
    ("load", group, "mean"): (int P^p |v| dt / int |v| dt)^(1/p), P = |Fy| + |Fz|, nan if the motion has no speed or
    never moves; ("contact", group, "lost"): 1 if at some stamp a link of the group has lost contact or one row
    of its preload is open, else 0.

    Raises SceneError for an impossible base, TraceError, and ArgumentError for changes and measures that do not match
    the base.
    """

    def __new__(
        cls,
        *,
        mass: float,
        center_of_mass: Vector,
        inertia: Sequence[Sequence[float]],
        inertia_about_reference: bool,
        gravity: Vector,
        free: Sequence[str],
        points: Array,
        directions: Array,
        laws: Sequence[Law],
        damping: Array,
        damping_in_contact: NDArray[np.bool_],
        groups: Groups,
        centers: Array,
        time: Array,
        acceleration: Array,
        wrench: Array | None,
        speed: Array | None,
        exponent: float,
        changes: Sequence[tuple[tuple[str, int, int | str], float, Sequence[tuple[int, float]]]],
        measures: Sequence[tuple[str, int, str]],
        method: str,
        rtol: float,
    ) -> Batch: ...
    def run(self, values: Array, threads: int, width: str = "widest") -> tuple[Array, list[tuple[int, str]]]:
        """Measures (n, measures) of samples with values (n, columns), and (row, reason) of those that failed.

        The row of a failed sample is nan. To the last bit, a row depends on its values only, for any number of threads
        and any width of the SIMD vectors for linear scenes: widest (of the processor), four or one.
        """

    def histories(self, values: Array) -> tuple[Array, list[tuple[int, str]]]:
        """(n, time, groups, 6) force [N] and moment about the centre [N m], and (row, reason) of those that failed."""

def carriage_links(center: Vector, length: float) -> tuple[Array, Array]:
    """The four links of a carriage (paper, 4.1): end -x along y and z, end +x along y and z.

    Returns points (4, 3) m from L and unit directions (4, 3). center: m from L. length: m between the ends.
    """
