"""Sizing: which product of a catalogue holds, and how far pace, payload or overhang may go."""

from guideload.sizing.limits import Limit, largest
from guideload.sizing.requirements import Margins, margins_of
from guideload.sizing.size import Candidate, Sizing, size

__all__ = ["Candidate", "Limit", "Margins", "Sizing", "largest", "margins_of", "size"]
