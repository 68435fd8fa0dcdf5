"""The compiled core. Arrays are float64 and C-contiguous unless said otherwise; quantities are SI."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Groups = Sequence[NDArray[np.int64]]
Vector = tuple[float, float, float]

Cells = NDArray[np.uint32]

# Samples and what is assumed of their motion: step (n - 1,) between samples, > 0; value, variance (n,), samples and the
# variances of their noise; mean (N,) and covariance (N, N) of the state before the first sample, N = 2 to 6: the value
# and its derivatives, the next one white noise; cell (n - 1,) of each interval, and intensity of the noise per cell.
SampledModel = tuple[Array, Array, Array, Array, Array, Cells, Array]

def motion_likelihood(given: SampledModel) -> tuple[float, float]:
    """Sum of ln F and of v^2/F over the innovations v and their variances F of a Kalman filter."""

def smooth_motion(given: SampledModel) -> tuple[Array, Array, Array]:
    """Given all samples: (n, 3) value and two derivatives, (n, 3) their variances, (n, 2) u and D.

    u/D is a sample less its estimate from all others, 1/D the variance of that.
    """

def adapt_motion(
    given: SampledModel, rounded: Array, quantum: float, level: float, rule: tuple[int, float, float, float]
) -> tuple[Array, float, Array, Array, Array, Array]:
    """Intensities of the cells, noise level, values and variances of the sites by likelihood, from those given on.

    rounded: the samples, rounded to `quantum` (0: not rounded) after noise of variance `level`. rule: rounds; the
    intensity that each cell is drawn to, and how much, in squared noises; the least level. Last: log density of each
    sample given all others, and noise found in each cell over what is expected, as the last round found them.
    """

# What samples leave open about a motion, beside their values: step (n - 1,), variance (n,), covariance (N, N), cell
# (n - 1,), intensity; as of `SampledModel`, but a variance may be infinite, of a sample that tells nothing.
Chain = tuple[Array, Array, Array, Cells, Array]

def draw_motion(chain: Chain, derivative: int, count: int, seed: int) -> Array:
    """(count, n) deviations of a derivative from its estimate, drawn from all that fit the samples.

    derivative: below N. A draw depends on the seed and its number alone, on every processor.
    """

def load_spread(
    scene: Scene,
    chain: Chain,
    derivative: int,
    unit: Array,
    time: Array,
    instants: Array,
    loads: Array,
    groups: Groups,
    centers: Array,
) -> tuple[Array, Array, Array, Array]:
    """Standard deviations of what a deviation of the acceleration along x makes of the loads of a linear scene.

    derivative, unit: the number of the chain's state that is the acceleration, (n,) m/s2 per unit of it. time: (n,) s,
    its stamps; it is linear between them. instants: (m,) s, ascending, within the stamps. loads: (m, groups, 6) of the
    estimate, for the directions of the sizes. groups, centers: as for `Scene.peaks`.

    Returns acceleration (m,) m/s2; groups (m, groups, 6) N, N m; sizes (m, groups, 2): the y-z resultant of the
    force [N] and the magnitude of the moment [N m], to first order; links (m, links) N. ValueError if a link is not
    linear.
    """

def draw_peaks(
    scene: Scene,
    chain: Chain,
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
    """(groups, count) N: the largest y-z resultant of each group in drawn motions through a linear scene.

    loads: (m, groups, 6), what deviations are added to. wanted: (m, groups) where to look for a peak. The result is
    the same on any number of threads. Others as of `load_spread` and `draw_motion`.
    """

class Law:
    """The elastic law of a link: force over deflection; immutable.

    The deflection [m] is positive where the body moves along the link's direction, and 0 where the law starts to
    count. Raises SceneError naming the field and the value that no law can have.
    """

    @staticmethod
    def linear(stiffness: float) -> Law:
        """F = k d. stiffness: N/m, >= 0."""

    @staticmethod
    def sided(positive: float, negative: float, clearance: float) -> Law:
        """F = positive (d - clearance)+ - negative (-d - clearance)+: sides of their own about a dead band.

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
        """(m,) m, ascending: the deflections at which the slope changes its law, as where contact is lost."""

    def scaled(self, factor: float) -> Law:
        """The law of the same deflections with all forces times `factor`."""

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
    impossible body or link, for a body that its links leave unsupported, naming the motion that nothing resists,
    and where no position at rest exists.
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
        """The model level that the laws ask for: linear, piecewise linear or smooth nonlinear."""

    @property
    def free_at_rest(self) -> Array:
        """(m, 6) motions (m, rad) in which the body is free within its clearance at rest; none if it is held."""

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
        """Run from static equilibrium.

        time: (n,) s. acceleration: (n, 3) m/s2 of L. wrench: (n, 6) external force [N] and moment about L [N
        m]. method: exact (linear and piecewise linear scenes only), rk45 or implicit. rtol: error of the link
        loads, relative to the load scale. load_scale: the largest load that a link can carry at rest plus what
        it would carry if the peaks of the excitation stood still. step: s, fixed instead; exact needs neither.
        times: (m,) s, instants to record instead of the samples, ascending within them. All arrays float64 and
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
        As `solve`, but only the running extremes of the groups' loads are kept.
        """

    def matrices(self) -> tuple[list[Array], Array]:
        """[M, C, K], each (6, 6), of (u, phi) of L, and the weight (6,) as force and moment about L."""

    def modes(self) -> tuple[Array, Array, Array, NDArray[np.complex128]]:
        """Angular frequencies (n,) rad/s, damping ratios (n,), shapes (n, 6), eigenvalues (2 n,) 1/s.

        Shapes are mass-normalised. Raises RunError if the eigenvalues do not settle.
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
        """How often a link passed an edge of its law; 0 where all are linear."""

    @property
    def load_scale(self) -> float:
        """The load that the tolerance was relative to, N."""

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
    """One base scene and motion, and what varies; immutable, one serves all threads and chunks.

    mass to damping_in_contact: as for `Scene`; the base itself need not be supported. inertia_about_reference: whether
    the inertia is about L, and stays so where mass and centre of mass change, rather than about the centre of mass.
    groups, centers: as for `Scene.peaks`. time, acceleration, wrench: as for `Scene.solve`. speed: (n,) m/s of the
    cart at the samples, for the mean load. exponent: p of the mean load. method: as for `Scene.solve`, or auto: exact
    where the laws of a sample allow it, else rk45, or implicit where rk45 would not be stable.

    changes: (target, constant, [(column, factor), ...]): sets the target to constant + sum(factor * value[column]),
    each target at most once. Targets: ("mass", 0, 0) kg, ("center_of_mass", axis, 0) m, ("inertia", i, j) kg m2,
    ("gravity", axis, 0) m/s2, ("point", link, axis) m, ("damping", link, 0) N s/m, ("law", link, parameter) with
    stiffness, positive_stiffness, negative_stiffness [N/m], clearance [m], preload [N] or scale (of all forces),
    ("center", group, axis) m, ("acceleration", 0, 0) and ("wrench", 0, 0): factors on the motion.

    measures: (quantity, index, statistic), all over the samples of the motion. Of a group, by its index: Fx Fy Fz [N]
    Mx My Mz [N m] (about its centre), resultant (hypot(Fy, Fz)), and with index 0 the drive (reaction along x; nan if x
    is free) with min, time_of_min, max, time_of_max (the first of equal ones), rms (weighted by time) or start;
    ("load", group, "mean"): (int P^p |v| dt / int |v| dt)^(1/p), P = |Fy| + |Fz|, nan if the motion has no speed or
    never moves; ("contact", group, "lost"): 1 if at some sample a link of the group carries nothing, or has a
    row of its preload open, else 0.

    Raises SceneError for a base that no sample could start from, TraceError, ArgumentError for changes and measures
    that the base has no place for.
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
        """Measures (n, measures) of samples with values (n, columns), and (row, reason) of those without a result.

        A row without a result is nan. A row depends on its values alone, to the last bit, for any number of threads
        and any width of the vectors in which linear scenes run side by side: widest (of the processor), four or one.
        """

    def histories(self, values: Array) -> tuple[Array, list[tuple[int, str]]]:
        """(n, time, groups, 6) force [N] and moment about the centre [N m], and (row, reason) of those without."""

def carriage_links(center: Vector, length: float) -> tuple[Array, Array]:
    """The four links of a carriage (paper, 4.1): end -x along y and z, end +x along y and z.

    Returns points (4, 3) m from L and unit directions (4, 3). center: m from L. length: m between the ends.
    """
