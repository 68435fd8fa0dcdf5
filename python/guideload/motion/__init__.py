"""The motion that excites a machine, its uncertainty, and which modes it resolves."""

from guideload.motion.motion import Motion
from guideload.motion.resolution import TraceResolution
from guideload.motion.uncertainty import Uncertainty

__all__ = ["Motion", "TraceResolution", "Uncertainty"]
