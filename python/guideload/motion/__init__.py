"""The motion that excites a machine, its uncertainty, and the loads that its trace may hide."""

from guideload.motion.motion import Motion
from guideload.motion.resolution import TraceResolution
from guideload.motion.uncertainty import Uncertainty

__all__ = ["Motion", "TraceResolution", "Uncertainty"]
