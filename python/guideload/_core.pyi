"""The compiled core. Arrays are float64 and C-contiguous; quantities are in SI units."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Groups = Sequence[Integers]
Vector = tuple[float, float, float]

Segments = NDArray[np.uint32]

# Samples and their state-space model: step (n - 1,) > 0 between samples; value (n,) of the samples; variance (n,) of
# their measurement noise; mean (N,) and covariance (N, N) of the state before the first sample; index of the segment
# (n - 1,) of each step; process-noise density (segments,). The state is the value and its derivatives, N = 2 to 6
# numbers; the N-th derivative is white process noise. With an oscillator (undamped frequency w in radians per unit of
# time, damping ratio D, index of the acceleration a in the state), N = 4 to 6: the acceleration and the numbers before
# it, y, the acceleration c of the drive and its derivatives, the last of which is the integral of white process noise;
# a' = y - 2 D w (a - c), y' = -w^2 (a - c).
OscillatorOfModel = tuple[float, float, int]
SampledModel = tuple[Array, Array, Array, Array, Array, Segments, Array, OscillatorOfModel | None]

# Equivalent load of a carriage: weights (2, 5, 2) of the groups A and B, of Fy, Fz, Mx, My, Mz, for positive and for
# negative values; factor on the smaller group; preload [N], and how it raises small loads: as the loaded one of
# two rows of balls or rollers, "ball" or "roller", or as printed, "power" (Rexroth) or "linear" (Thomson).
Rule = tuple[Array, float, float, str]
# Mass, centre of mass, inertia, whether that is about L, and (first stamp, the one after the last) of each stay.
PayloadOfBatch = tuple[float, Vector, Sequence[Sequence[float]], bool, Sequence[tuple[int, int]]]

def enough_parts(intervals: Array, starts: bool, fastest: float) -> Integers:
    """Parts of each interval between stamps (n - 1,) [s], so that a vibration has six stamps or more per period.

    starts: whether the excitation is not zero at the first stamp. fastest: rad/s; 0 if nothing vibrates. Of an
    excitation without jumps, parts are not shorter than a 25th of the shortest interval.
    """

def limited_parts(parts: Integers, most: int) -> Integers:
    """Parts of intervals, the largest numbers reduced to the same one, so that all are at most `most`."""

def equivalent_load_integrals(
    time: Array,
    velocity: Array,
    acceleration: Array,
    loads: Array,
    rule: Rule,
    exponent: float,
    bows: Array | None = None,
) -> tuple[Array, Array]:
    """int P^p |v| dt [N^p m] and int |v| dt [m] of the n - 1 intervals between instants; p: exponent from 1 to 100.

    Exact, with rounding, for loads (n, 6) [N, N m] and an acceleration along x (n,) [m/s2] linear in time. bows:
    (n - 1, 6) of the loads, as from `Scene.group_load_bows`: in each interval the line is shifted by this.
    """

def equivalent_load_weights(
    time: Array, velocity: Array, acceleration: Array, loads: Array, rule: Rule, exponent: float
) -> Array:
    """Derivatives (n, 6) of the sum of the first integrals of `equivalent_load_integrals` by the loads."""

def raised_loads(loads: Array, rule: Rule) -> Array:
    """Loads (n,) [N] with the effect of the preload of a rule, from loads (n,) [N] without it."""

def largest_equivalent_load(loads: Array, rule: Rule) -> tuple[int, float, list[float]]:
    """Index of the largest equivalent load, this load [N], and the largest size of each column.

    loads: (n, 6) N and N m. The index is the first of equal loads; 0 and -inf without loads.
    """

def motion_likelihood(given: SampledModel) -> tuple[float, float]:
    """Sum of ln F and sum of v^2/F, where v are the innovations of a Kalman filter and F their variances."""

def smooth_motion(given: SampledModel) -> tuple[Array, Array, Array]:
    """Posterior given all samples: value and two derivatives (n, 3), their variances (n, 3), u and D (n, 2).

    u/D is the leave-one-out residual of a sample, 1/D its variance.
    """

def adapt_motion(
    given: SampledModel, rounded: Array, quantum: float, level: float, rule: tuple[int, float, float, float]
) -> tuple[Array, float, Array, Array, Array, Array]:
    """Process-noise densities and measurement noise by likelihood, site approximations by expectation propagation.

    given: initial model, whose values and variances are those of the site approximations. rounded: (n,) samples with
    measurement noise of variance `level`, rounded to `quantum` (0: not rounded). rule: number of rounds; mode of the
    inverse gamma prior of the densities; its weight, as a number of squared process noises; least measurement noise.

    Returns densities (segments,); measurement noise; values (n,) and variances (n,) of the site approximations; and
    from the last round the leave-one-out log predictive density (n,) and the normalised innovation variance
    (segments,): squared process noise over its expectation.
    """

# State-space model without samples: step (n - 1,), variance (n,), covariance (N, N), segment (n - 1,), density,
# oscillator, as in `SampledModel`; the variance of a missing sample is infinite.
StateSpaceModel = tuple[Array, Array, Array, Segments, Array, OscillatorOfModel | None]

def draw_motion(chain: StateSpaceModel, derivative: int, count: int, seed: int) -> Array:
    """Draws (count, n) from the posterior of the deviation of a derivative from its estimate.

    derivative: its index in the state, below N. A draw depends only on the seed and on its index, on any processor.
    """

class MotionDraws:
    """Draws of the motion for the samples of a `Batch`: deviations of the acceleration along x from its estimate.

    chain, derivative: as in `draw_motion`. unit: (n,) m/s2 per unit of this derivative. stamps: (n,) s, of the chain.
    time: (m,) s, of the motion; the deviation is linear between the stamps, and constant outside them.
    """

    def __new__(
        cls, chain: StateSpaceModel, derivative: int, unit: Array, stamps: Array, time: Array, seed: int
    ) -> MotionDraws: ...
    def deviation(self, number: int) -> Array:
        """The draw (m,) m/s2 of this number; it depends on the seed and the number alone, on any processor."""

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
    *,
    quasi_static: bool = False,
) -> tuple[Array, Array, Array, Array]:
    """Standard deviations of the loads of a linear scene due to the uncertainty of the acceleration along x.

    derivative: index of the acceleration in the state. unit: (n,) m/s2 per unit of this derivative. time: (n,) s, the
    stamps; the deviation is linear between them. quasi_static: whether the scene starts in the quasi-static state of
    its first acceleration, instead of at rest. instants: (m,) s, ascending, within the stamps. loads: (m, groups, 6)
    of the estimate, for the directions of the resultants. groups, centers: as in `Scene.peaks`.

    Returns standard deviations of the acceleration (m,) m/s2; of the loads of the groups (m, groups, 6) N, N m; of the
    y-z resultant [N] and the magnitude of the moment [N m], to first order (m, groups, 2); and of the link loads
    (m, links) N. Raises ValueError if a link is not linear.
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
    *,
    quasi_static: bool = False,
) -> Array:
    """Largest y-z resultant of each group of a linear scene under each drawn motion, (groups, count) [N].

    loads: (m, groups, 6) of the estimate. wanted: (m, groups), whether the peak can be at the instant. The result does
    not depend on the number of threads. Other arguments: as in `load_spread` and `draw_motion`.
    """

class Cancellation:
    """Ends calls of the core on other threads than the main one, which receive no signals."""

    def __new__(cls) -> Cancellation: ...
    def set(self) -> None:
        """From now on every call of the core within `run` ends with KeyboardInterrupt."""

    def run(self, function: Callable[[Any], Any], argument: Any) -> Any:
        """`function(argument)`."""

class Law:
    """The elastic law of a link: force over deflection; immutable.

    The deflection [m] is positive in the direction of the link, and 0 in the unloaded position. Raises SceneError with
    the name and the value of an invalid argument.
    """

    @staticmethod
    def linear(stiffness: float) -> Law:
        """F = k d. stiffness: N/m, >= 0."""

    @staticmethod
    def sided(positive: float, negative: float, clearance: float) -> Law:
        """F = positive (d - clearance)+ - negative (-d - clearance)+: a stiffness for each side.

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
        """Piecewise linear curve through points (m, 2) of deflection [m] and force [N], extrapolated linearly.

        2 to 16 points; deflections ascend, forces do not fall.
        """

    @property
    def kind(self) -> str:
        """linear, sided, preloaded or curve."""

    @property
    def stiffness(self) -> float:
        """Nominal stiffness [N/m]: k, the larger of two sides, k0 at no load, or the steepest slope of a curve."""

    @property
    def edges(self) -> Array:
        """Deflections (m,) [m] at which the law has a kink, such as loss of contact; ascending."""

    def scaled(self, factor: float) -> Law:
        """The law with all forces times `factor`."""

    def force(self, deflection: Array) -> Array:
        """Forces (n,) [N] at deflections (n,) [m]."""

    def tangent(self, deflection: Array) -> Array:
        """Tangent stiffness dF/dd (n,) [N/m] at deflections (n,) [m]."""

    def energy(self, deflection: Array) -> Array:
        """Elastic energy (n,) [J]: integral of the force from 0 to deflections (n,) [m]."""

class Monitor:
    """Load monitor of a linear scene, as on a controller, in f64.

    groups, centers: as in `Scene.peaks`, at most 16. judged: for each group (rule as in `equivalent_load_integrals`,
    limit N, width of a bin of the histogram N, N^p m that use up the rating life or 0). period: s. quantum: m/count.
    input: ticks per period, tolerance of a stamp [ticks], bits of the counter, largest change of the step from one
    period to the next, allowance for noise, band of noise at standstill [1/16 count], most missing samples.
    taps: (n, 2), see `guideload.monitor.estimator`. lag: samples. roller: exponent 10/3 instead of 3.
    Raises SceneError for a scene that is not linear, has a mode without damping, or has too much of something.
    """

    def __new__(
        cls,
        scene: Scene,
        *,
        groups: Groups,
        centers: Array,
        judged: Sequence[tuple[tuple[Array, float, float, str], float, float, float]],
        period: float,
        quantum: float,
        input: Sequence[int],
        taps: Array,
        lag: int,
        roller: bool,
    ) -> Self: ...
    def push(
        self, stamps: NDArray[np.int64], counts: NDArray[np.uint32], until_limit: bool = False
    ) -> tuple[NDArray[np.uint32], NDArray[np.int64], Array]:
        """Takes n samples: time stamps in ticks, of a clock of 64 or 32 bits, and counter, which may wrap.

        until_limit: stop after the sample at which a group rises above its limit; the first two arrays end there.

        Returns what became of each (n,): 0 used, 1 early, 2 suspect, 3 bridged, 4 counter set, 5 restarted; the number
        of the period of the loads after it (n,), -1 before the first; and the loads (n, groups, 5) Fy Fz Mx My Mz.
        """

    def push_motion(self, velocity: Array, acceleration: Array) -> Array:
        """Goes on by n periods to known velocities [m/s] and accelerations [m/s2]; loads (n, groups, 5)."""

    @property
    def is_settling(self) -> bool:
        """Whether the loads still depend on the state at the last restart."""

    @property
    def motion(self) -> tuple[float, float] | None:
        """Estimated velocity [m/s] and acceleration [m/s2] at the instant of the loads; None before the first."""

    def totals(self) -> dict[str, Any]:
        """Extremes, sums, histograms and counts, by name; lists have an entry per group."""

    def save(self, number: int) -> bytes:
        """The totals as record `number`."""

    def restore(self, first: bytes, second: bytes) -> int:
        """Goes on with the newer of two records; its number. Raises ValueError if neither can be used."""

    def constants(self) -> dict[str, Any]:
        """The constants of a controller, by name."""

class Scene:
    """One rigid body on links, under gravity; immutable.

    center_of_mass, points: m from L. inertia: kg m2 about the centre of mass. gravity: m/s2, pointing down.
    free: some of x y z rx ry rz. points: (links, 3) m. directions: (links, 3) unit vectors. laws: one for each
    link. damping: (links,) N s/m. damping_in_contact: (links,) whether the damping acts only outside the clearance.
    offsets: (links,) m, displacement of each foot along its link, from which its deflection counts; None: 0.
    base_compliance: (6, 6) m/N, 1/N, rad/(N m) of an elastic base about L under all links, which must then be linear;
    None: rigid.
    riders: (mass [kg], centre of mass [m from L], inertia [kg m2], direction) of each body that rides on the main one;
    where they stand here they are a part of it.
    Raises SceneError for an impossible body or link, for a body that the links do not support (the message names the
    motion that no link resists), and if there is no static equilibrium.
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
        offsets: Array | None = None,
        base_compliance: Sequence[Sequence[float]] | None = None,
        riders: Sequence[tuple[float, Vector, Sequence[Sequence[float]], Vector]] | None = None,
    ) -> Scene: ...
    @property
    def has_segments(self) -> bool:
        """Whether a link has clearance, one side or a curve."""

    @property
    def model_level(self) -> str:
        """The lowest model level that covers all laws: linear, piecewise linear or smooth nonlinear."""

    @property
    def free_at_rest(self) -> Array:
        """Motions (m, 6) [m, rad] in which the body is free within its clearance at rest; none if it is supported."""

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
        start: str | Array = "rest",
        travel: Array | None = None,
    ) -> Solution:
        """Integrate from static equilibrium.

        time: (n,) s. acceleration: (n, 3) m/s2 of L. wrench: (n, 6) external force [N] and moment about L [N
        m]. method: exact (linear and piecewise linear scenes only), exponential (not on smooth nonlinear scenes with
        segments; exact where nothing is preloaded), rk45 or implicit. rtol: tolerance of the link loads, relative to
        the load scale: largest link load at rest plus quasi-static link load under the peaks of the excitation. step:
        s, fixed step instead of step-size control; exact uses neither. times: (m,) s, ascending
        instants between the first and the last sample, reported instead of the samples. start: rest (equilibrium under
        the weight), quasi-static (under the weight, the first sample of the excitation, and the riders' inertia
        forces there), or a state as `Solution.end` gives it. travel: (riders, n, 3) travel [m] from where they stand in
        the scene, speed [m/s] and acceleration [m/s2] of the riders, which then move; by rk45 or implicit. Raises
        TraceError, ArgumentError, RunError; ValueError or TypeError for an array that is not float64 or not
        C-contiguous.
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
        start: str | Array = "rest",
        travel: Array | None = None,
        less: Array | None = None,
        rules: Sequence[Rule | None] | None = None,
    ) -> list[Array]:
        """Smallest and largest loads of groups of links, without histories, and their times [s]; each (groups, 8).

        Then, (rules, 2), of each group with a rule the largest equivalent load [N] without the effect of a preload,
        and its time [s]. rules: one per group, or None.

        Columns: Fx Fy Fz [N], Mx My Mz about the centre [N m], y-z resultant [N], magnitude of the moment [N m].
        groups: indices of the links of each group. centers: (groups, 3) m from L, or (groups, 4) with
        the roll [rad] about x of the axes in which the loads are given. less: (groups, 6), constant loads; rows for the
        loads less these are then appended, which have only the largest magnitudes: the others are infinite. Other
        arguments: as in `solve`. Extremes are those at any time, if the fastest vibration has six samples per period or
        more; the smallest magnitudes are those at the samples.
        """

    def matrices(self) -> tuple[list[Array], Array]:
        """Matrices [M, C, K], each (6, 6), for (u, phi) of L; and the weight (6,), force and moment about L."""

    def modes(self) -> tuple[Array, Array, Array, NDArray[np.complex128]]:
        """Angular frequencies (n,) rad/s, damping ratios (n,), shapes (n, 6), eigenvalues (2 n,) 1/s.

        Shapes are mass-normalised. Raises RunError if the eigenvalues do not converge.
        """

    def static_position(self) -> Array:
        """Position (6,) of L at rest [m, rad]."""

    def static_reaction(self) -> Array:
        """Reaction (6,) of the held dofs at rest [N, N m]."""

    def static_link_loads(self) -> Array:
        """Link loads at rest, (links,) [N]."""

    def static_group_loads(self, groups: Groups, centers: Array) -> Array:
        """Loads of groups of links at rest, (groups, 6): force [N] and moment about the centre [N m]."""

    def group_load_bows(
        self,
        time: Array,
        position: Array,
        velocity: Array,
        acceleration: Array,
        groups: Groups,
        centers: Array,
    ) -> Array:
        """Mean load of groups of links in each interval less the mean of both ends, (n - 1, groups, 6) [N, N m].

        position, velocity, acceleration: (n, 6) of L at n instants. By Simpson's rule, with the quintic polynomial of
        the motion in the middle; zero where the motion is not smooth enough for it, as between samples of noise.
        """

def solve_stretches(
    scenes: Sequence[Scene],
    kept: Sequence[Scene],
    first: Sequence[int],
    time: Array,
    acceleration: Array,
    wrench: Array | None = None,
    *,
    method: str,
    rtol: float,
    step: float | None = None,
    times: Array | None = None,
    start: str = "rest",
) -> Solution:
    """As `Scene.solve`, for a machine whose mass changes: scene `i` from sample first[i] to before first[i + 1].

    At a change the motion has two stamps at one time. kept: (scenes - 1), with the masses that are on the machine both
    before and after each change. Position and momentum there: `Start::after_change` of the core. Instants of `times` at
    a change are those after it.
    """

def peaks_of_stretches(
    scenes: Sequence[Scene],
    kept: Sequence[Scene],
    first: Sequence[int],
    time: Array,
    acceleration: Array,
    wrench: Array | None = None,
    *,
    method: str,
    rtol: float,
    step: float | None = None,
    groups: Groups,
    centers: Array,
    start: str = "rest",
    less: Array | None = None,
    rules: Sequence[Rule | None] | None = None,
) -> list[Array]:
    """As `Scene.peaks`, for a machine whose mass changes: see `solve_stretches`."""

class Solution:
    """The solution of a run at the reported instants."""

    @property
    def steps(self) -> int:
        """Accepted steps."""

    @property
    def rejected(self) -> int:
        """Rejected steps."""

    @property
    def contact_changes(self) -> int:
        """Number of contact changes; 0 if all links are linear. By exponential those between the ends of steps."""

    @property
    def load_scale(self) -> float:
        """Load scale [N]: the tolerance is relative to it."""

    def group_loads(self, groups: Groups, centers: Array, part: str) -> Array:
        """Loads of groups of links, (time, groups, 6): force [N] and moment about the centre [N m].

        part: total, elastic or damping.
        """

    def link_loads(self, part: str) -> Array:
        """Link loads (time, links) [N]. part: total, elastic or damping."""

    def position(self) -> Array:
        """Position (time, 6) of L in the travelling frame, sag included [m, rad]."""

    def some_positions(self, every: int) -> Array:
        """Position (instants, 6) at the first of each `every` instants, from the start of each stretch."""

    def largest_velocity_change(self) -> Array:
        """Largest change (6,) of each component of `velocity` from one instant to the next [m/s, rad/s]."""

    def velocity(self) -> Array:
        """Velocity (time, 6) of L in the travelling frame [m/s, rad/s]."""

    def end(self) -> Array:
        """Position [m, rad] and velocity [m/s, rad/s] of L in the travelling frame at the end of the motion, (2, 6)."""

    def acceleration(self) -> Array:
        """Acceleration (time, 6) of L in the travelling frame [m/s2, rad/s2]."""

    def reaction(self) -> Array:
        """Reaction (time, 6) of the held dofs [N, N m]; 0 for free dofs."""

    def rider_travel(self) -> Array:
        """Travel [m], speed [m/s] and acceleration [m/s2] of the moving riders, (riders, time, 3)."""

    def rider_wrench(self) -> Array:
        """Force [N] and moment about L [N m], (time, 6), by which moving riders differ from riders where they stand."""

    def rider_forces(self) -> Array:
        """Force of the drive on each moving rider along its direction, (time, riders) [N]; no columns if none moves."""

    def inputs(self) -> Array:
        """Excitation (time, 9): acceleration of L [m/s2], external force [N], external moment about L [N m]."""

class VariedScene:
    """A base scene, and the changes of its numbers by columns of values; immutable.

    mass to damping_in_contact: as in `Scene`; the base need not be supported. inertia_about_reference: whether the
    inertia is about L and not about the centre of mass, also where mass or centre of mass change. groups, centers: as
    in `Scene.peaks`. payloads: masses that the body carries in their stays, as in `peaks_of_stretches`. columns: of
    values, by default as many as the changes use.

    changes: (target, constant, [(column, factor), ...]) sets target = constant + sum(factor * value[column]); each
    target at most once. Targets: ("mass", 0, 0) kg, ("center_of_mass", axis, 0) m, ("inertia", i, j) kg m2,
    ("gravity", axis, 0) m/s2, ("point", link, axis) m, ("damping", link, 0) N s/m, ("offset", link, 0) m,
    ("law", link, parameter) with stiffness, positive_stiffness, negative_stiffness [N/m], clearance [m], preload [N] or
    scale (of all forces), ("center", group, axis) m, ("payload_mass", payload, 0) kg,
    ("payload_center_of_mass", payload, axis) m, ("acceleration", 0, 0) and ("wrench", 0, 0): factors on the
    motion.

    Raises SceneError for an impossible base, and ArgumentError.
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
        changes: Sequence[tuple[tuple[str, int, int | str], float, Sequence[tuple[int, float]]]],
        columns: int | None = None,
        offsets: Array | None = None,
        base_compliance: Sequence[Sequence[float]] | None = None,
        payloads: Sequence[PayloadOfBatch] | None = None,
    ) -> VariedScene: ...
    def fastest_vibrations(self, values: Array) -> Array:
        """Angular frequencies (n,) [rad/s] of the fastest vibration with values (n, columns), without payloads.

        nan where there is no scene.
        """
    def at(self, values: Array) -> VariedSystem:
        """The scene with values (columns,), which carries all payloads whatever their stays.

        Raises SceneError, and ArgumentError where there are no derivatives.
        """

class Batch:
    """A scene that varies from sample to sample of a study, and its motion; immutable.

    time, acceleration, wrench: as in `Scene.solve`; where payloads of the scene change, two stamps at one time. speed:
    (n,) m/s, of the cart along x at the stamps, with its sign, for the mean load. exponent: p of the mean load. method:
    as in `Scene.solve`, or auto: exact or else exponential if the laws of a sample allow it, else rk45, or implicit if
    rk45 would be unstable. rules: of each group, the equivalent loads of ("load", group, "mean") and of ("load", group,
    "max"), as in `equivalent_load_integrals`; by default |Fy| + |Fz|. start: of all samples, as in `Scene.solve`.
    draws: each sample runs under the motion plus the draw whose number, a whole one, is in this column of values.

    measures: (quantity, index, statistic) over the motion. min, max and their times are those at any time, or, with
    at_samples, those at the stamps; rms and mean are by the values at the stamps. Quantities: Fx Fy Fz [N],
    Mx My Mz [N m] (about the centre) and resultant (hypot(Fy, Fz)) [N] of the group with this index; drive (reaction
    along x [N]; nan if x is free), index 0. Statistics: min, time_of_min, max, time_of_max (first instant of equal
    values), rms (weighted by time), start. Also ("load", group, "mean"): (int P^p |v| dt / int |v| dt)^(1/p) of the
    equivalent load P, exact for loads linear in time, nan if the speed is unknown or always 0; ("load", group, "max"):
    its largest value; and ("contact", group, "lost"): 1 if at any stamp a link of the group has lost contact or has a
    row open, else 0.

    Raises TraceError for an invalid motion, and ArgumentError for changes and measures that do not match the scene.
    """

    def __new__(
        cls,
        scene: VariedScene,
        *,
        time: Array,
        acceleration: Array,
        wrench: Array | None,
        speed: Array | None,
        exponent: float,
        measures: Sequence[tuple[str, int, str]],
        method: str,
        rtol: float,
        rules: Sequence[tuple[Rule, Rule]] | None = None,
        start: str = "rest",
        draws: tuple[MotionDraws, int] | None = None,
        at_samples: bool = False,
    ) -> Batch: ...
    def run(self, values: Array, threads: int, width: str = "widest") -> tuple[Array, list[tuple[int, str]]]:
        """Measures (n, measures) of samples with values (n, columns), and (row, reason) of each failed sample.

        The row of a failed sample is nan. A row depends only on its values, to the last bit, for any number of threads
        and any width. width: numbers in a SIMD vector for linear scenes: widest (of the processor), four or one.
        """

    def histories(self, values: Array) -> tuple[Array, list[tuple[int, str]]]:
        """Loads (n, time, groups, 6): force [N] and moment about the centre [N m]; (row, reason) of failed samples."""

class VariedSystem:
    """A scene with given values, and its derivatives by each column of them."""

    @property
    def factors(self) -> list[float]:
        """Factors on the accelerations of the motion and on its external loads."""

    def run(
        self, time: Array, acceleration: Array, wrench: Array | None = None, *, start: str = "rest"
    ) -> VariedRun:
        """The run under a motion without the factors, of a linear scene. Arguments and errors as `Scene.solve`."""

    def scene(self) -> Scene:
        """The scene."""

    def matrices(self) -> tuple[list[Array], Array]:
        """Derivatives of [M, C, K], each (columns, 6, 6), and of the weight (columns, 6)."""

    def static_position(self) -> Array:
        """Derivative of the position of L at rest, (columns, 6)."""

    def static_link_loads(self) -> Array:
        """Derivative of the link loads at rest, (columns, links)."""

    def static_group_loads(self) -> tuple[Array, Array]:
        """Loads of the groups at rest (groups, 6), and their derivative (columns, groups, 6)."""

    def out_of_contact(self) -> list[int]:
        """Indices of the links without contact at rest, which count in K and in the modes with nominal stiffness."""

class VariedRun:
    """A run of a linear scene, and derivatives of all that is computed from its states, by each column of values.

    quantity: link_loads or group_loads, whose `part` is as in `Solution`; position, velocity, acceleration or reaction.
    """

    def derivatives(self, quantity: str, part: str = "total") -> Array:
        """Derivatives (columns, time, numbers of the quantity), those of groups one after the other."""

    def gradient(self, quantity: str, weights: Array, part: str = "total") -> Array:
        """Derivative of a figure (columns,), from its derivatives by a quantity (time, numbers of the quantity)."""

    def at(self, time: Array) -> VariedInstants:
        """The run at instants (n,) in ascending order, not only at its samples. Raises ArgumentError for others."""

class VariedInstants:
    """A run of a linear scene at n instants, and its derivatives by time and by each column of values."""

    def inputs(self) -> tuple[Array, Array]:
        """Accelerations of L's frame and external loads (n, 9), and their derivatives by time."""

    def histories(self, quantity: str, along: Array, part: str = "total") -> tuple[Array, Array, Array]:
        """Sums of the numbers of a quantity of `VariedRun` with factors `along` (k, numbers of the quantity).

        Their values (n, k), and derivatives by time (n, k) and by the columns (columns, n, k).
        """
