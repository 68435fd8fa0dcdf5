"""The machine: a rigid body on carriages, its drive, the laws of its links, its natural modes."""

from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.machine.parts import Body, Carriage, Drive, Link, Rail

__all__ = ["Body", "Carriage", "Drive", "Link", "Machine", "Modes", "Rail"]
