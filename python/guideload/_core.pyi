"""The compiled core. Arrays are float64 and C-contiguous unless said otherwise; quantities are SI."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Groups = Sequence[NDArray[np.int64]]
Vector = tuple[float, float, float]

class Scene:
    """One rigid body on links, under gravity; immutable.

    center_of_mass, points: m from L. inertia: kg m2 about the centre of mass. gravity: m/s2, pointing down.
    free: names out of x y z rx ry rz. points, directions: (links, 3). stiffness: (links,) N/m.
    damping: (links,) N s/m. Raises SceneError for an impossible body or link, and for a body that its links
    leave unsupported, naming the motion that nothing resists.
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
        stiffness: Array,
        damping: Array,
    ) -> Scene: ...
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

        time: (n,) s. acceleration: (n, 3) m/s2 of L. wrench: (n, 6) external force [N] and moment about L
        [N m]. method: exact, rk45 or implicit. rtol: error of the link loads, relative to the load scale.
        load_scale: the largest load that a link can carry at rest plus what it would carry if the peaks of the
        excitation stood still. step: s, fixed instead; exact needs neither. times: (m,) s, instants to record
        instead of the samples, ascending within them. All arrays float64 and C-contiguous, else ValueError or
        TypeError. Raises TraceError, ArgumentError, RunError.
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

def carriage_links(
    center: Vector, length: float, stiffness: tuple[float, float], damping: tuple[float, float]
) -> tuple[Array, Array, Array, Array]:
    """The four links of a carriage (paper, 4.1): end -x along y and z, end +x along y and z.

    Returns points (4, 3), directions (4, 3), stiffness (4,), damping (4,).
    center: m from L. length: m between the ends. stiffness, damping: of the whole carriage along y and z;
    each end carries half.
    """
