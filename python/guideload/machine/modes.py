"""Natural modes of a machine: frequencies, damping ratios, mode shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array, Complex, Indices, ReadOnlyArrays, read_only
from guideload.machine.machine import DOFS, Machine

ROUNDING = 1e-12  # of an eigenvalue
Vectors = TypeVar("Vectors", Array, Complex)


@dataclass(frozen=True, eq=False)
class Modes(ReadOnlyArrays):
    """The n natural modes by ascending frequency; nonlinear links are in contact, with their nominal stiffness.

    frequency     (n,) Hz, natural frequencies of the undamped machine
    damping_ratio (n,) 1, -Re(lambda)/|lambda| of the damped eigenvalue with the same rank among the modes that vibrate;
                  of an overdamped mode the ratio without coupling to other modes
    damped_frequency (n,) Hz, of the damped vibration; 0 if a mode is overdamped
    shape         (n, 6) mode shapes, displacement and rotation of L [m, rad], without damping; the largest
                  displacement of the carriage centres (without carriages, or if all are in one line: of the links'
                  points) and of the centre of mass is 1
    eigenvalues   (2 n,) 1/s, complex, of the damped machine; for one mode -zeta omega +- i omega sqrt(1 - zeta^2)
    """

    frequency: Array
    damping_ratio: Array
    damped_frequency: Array
    shape: Array
    eigenvalues: Complex

    @classmethod
    @checked
    def of(cls, machine: Machine) -> Modes:
        """The modes of a machine. Raises SceneError if its links do not support the body."""
        frequency, alone, shapes, eigenvalues = machine.scene.modes()
        damping_ratio, damped_frequency = _damped(alone, eigenvalues)
        points = _guided_points(machine)
        largest = [np.linalg.norm(displacement(points, shape), axis=1).max() for shape in shapes]
        shapes = shapes / np.array(largest)[:, None]
        return cls(
            read_only(frequency / (2.0 * np.pi)),
            read_only(damping_ratio),
            read_only(damped_frequency),
            read_only(shapes),
            read_only(eigenvalues),
        )


def _damped(alone: Array, eigenvalues: Complex) -> tuple[Array, Array]:
    """Damping ratios (n,) and frequencies (n,) [Hz] of the damped modes, by the eigenvalues.

    alone: (n,) damping ratio of each mode without the coupling of modes by dampers. Modes whose frequencies are close
    are coupled even by light damping: of two at one frequency, one may take all of it.
    """
    modes, places = vibrating_modes(alone, eigenvalues)
    vibrating = eigenvalues[places]
    ratio, frequency = alone.copy(), np.zeros(alone.size)
    found = -vibrating.real / np.abs(vibrating)
    ratio[modes] = np.where(found > ROUNDING, found, 0.0)
    frequency[modes] = vibrating.imag / (2.0 * np.pi)
    return ratio, frequency


def vibrating_modes(alone: Array, eigenvalues: Complex) -> tuple[Indices, Indices]:
    """The modes that vibrate, and the places of their eigenvalues, those with a positive imaginary part, in order.

    The others are overdamped, each with two real eigenvalues: those with the largest damping ratios alone.
    """
    places = np.flatnonzero(eigenvalues.imag > ROUNDING * np.abs(eigenvalues))
    return np.sort(np.argsort(alone, kind="stable")[: places.size]), places


def _guided_points(machine: Machine) -> Array:
    """Carriage centres and the centre of mass, from L (n, 3) [m]; the links' points in place of no or aligned centres.

    Rotation about the line of the carriages of a single rail does not move their centres.
    """
    rolls = machine.in_one_line and "rx" in machine.free
    guided = machine.carriage_centers if machine.carriages and not rolls else machine.link_table().points
    return np.vstack([guided, machine.whole_body.center_of_mass])


def displacement(points: Array, q: Vectors) -> Vectors:
    """Displacement u + phi x r (..., n, 3) [m] of points r (n, 3) [m] for q = (u, phi) (..., 6) [m, rad], or its rate.

    Paper, eq. 14.
    """
    return q[..., None, :3] + np.cross(q[..., None, 3:], points)


def moving_dofs(machine: Machine, shape: Array) -> list[str]:
    """The dofs that move most in a mode shape (6,) [m, rad], largest first, down to half of the largest.

    Dofs are compared by the root mean square displacement of the points to which mode shapes are scaled [m].
    """
    moved = [displacement(_guided_points(machine), dof) for dof in np.diag(shape)]
    sizes = np.array([np.sqrt((field**2).sum(axis=1).mean()) for field in moved])
    return [DOFS[dof] for dof in np.argsort(-sizes) if sizes[dof] > 0 and sizes[dof] >= 0.5 * sizes.max()]
