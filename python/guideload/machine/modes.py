"""Natural modes of a machine: frequencies, damping, shapes, and what a shape moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.machine.machine import DOFS, Machine


@dataclass(frozen=True, eq=False)
class Modes:
    """The natural modes, n of them, by ascending frequency.

    Links that are not linear count with their nominal stiffness, all in contact.

    frequency     (n,) Hz, without damping
    damping_ratio (n,) of critical, each mode on its own (exact where damping is proportional to stiffness)
    shape         (n, 6) displacement and rotation of L [m, rad], without damping; scaled so that the carriage
                  centre or centre of mass that moves most moves by 1
    eigenvalues   (2 n,) 1/s, complex, of the damped machine: -zeta omega +- i omega sqrt(1 - zeta^2)
    """

    frequency: Array
    damping_ratio: Array
    shape: Array
    eigenvalues: NDArray[np.complex128]

    @property
    def damped_frequency(self) -> Array:
        """(n,) Hz; 0 where a mode is overdamped."""
        return self.frequency * np.sqrt(np.maximum(1.0 - self.damping_ratio**2, 0.0))

    @classmethod
    def of(cls, machine: Machine) -> Modes:
        """The modes of a machine. Raises SceneError if its links leave the body unsupported."""
        frequency, damping_ratio, shapes, eigenvalues = machine.scene.modes()
        points = np.vstack([machine.carriage_centers, machine.body.center_of_mass])
        largest = [np.linalg.norm(displacement(points, shape), axis=1).max() for shape in shapes]
        return cls(frequency / (2.0 * np.pi), damping_ratio, shapes / np.array(largest)[:, None], eigenvalues)


def displacement(points: Array, q: Array) -> Array:
    """u + phi x r (paper, eq. 14), shape (n, 3) [m], of points (n, 3) [m] for q = (u, phi) (6,) [m, rad]."""
    return np.asarray(q[:3] + np.cross(q[3:], points))


def moving_dofs(machine: Machine, shape: Array) -> list[str]:
    """The dofs that make up a mode, largest first: those with at least half the largest share in its motion.

    A rotation counts with the motion it gives the carriages and the centre of mass (root mean square), so
    that metres and radians compare. shape: (6,) [m, rad].
    """
    points = np.vstack([machine.carriage_centers, machine.body.center_of_mass])
    parts = [displacement(points, part) for part in np.diag(shape)]
    shares = np.array([np.sqrt((part**2).sum(axis=1).mean()) for part in parts])
    order = np.argsort(-shares)
    return [DOFS[dof] for dof in order if shares[dof] > 0 and shares[dof] >= 0.5 * shares.max()]
