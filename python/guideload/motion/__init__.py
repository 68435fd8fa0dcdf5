"""The motion that excites a machine, planned or measured, its uncertainty, and the loads that its trace may hide."""

from guideload.motion.forces import Forces
from guideload.motion.motion import Motion
from guideload.motion.moves import Move, MoveLimits, Moves
from guideload.motion.resolution import TraceResolution
from guideload.motion.uncertainty import Uncertainty

__all__ = ["Forces", "Motion", "Move", "MoveLimits", "Moves", "TraceResolution", "Uncertainty"]
