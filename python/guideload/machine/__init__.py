"""The machine: a rigid body on carriages, its drive, the elastic laws of its links, its natural modes."""

from guideload.machine.components import Body, Carriage, Link, Rail
from guideload.machine.drive import Drive, Friction
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.machine.payloads import Payload
from guideload.machine.points import PointOfInterest
from guideload.machine.response import FrequencyResponse, frequency_response
from guideload.machine.riders import Rider

__all__ = [
    "Body",
    "Carriage",
    "Drive",
    "FrequencyResponse",
    "Friction",
    "Link",
    "Machine",
    "Modes",
    "Payload",
    "PointOfInterest",
    "Rail",
    "Rider",
    "frequency_response",
]
