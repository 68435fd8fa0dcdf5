"""Sizing: which product of a catalogue holds, and how far pace, payload or overhang may go."""

from guideload.sizing.limits import Limit, largest
from guideload.sizing.size import Candidate, Sizing, size

__all__ = ["Candidate", "Limit", "Sizing", "largest", "size"]
