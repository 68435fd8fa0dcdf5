"""The machine: a rigid body on carriages, its drive, the elastic laws of its links, its natural modes."""

from guideload.machine.components import Body, Carriage, Drive, Link, Rail
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes

__all__ = ["Body", "Carriage", "Drive", "Link", "Machine", "Modes", "Rail"]
