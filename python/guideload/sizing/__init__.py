"""Sizing: which product of a catalogue holds, and how far pace, payload or overhang may go."""

from guideload.sizing.limits import Limit, largest
from guideload.sizing.requirements import Margins, margins_of
from guideload.sizing.size import LARGER, Candidate, Sizing, size

__all__ = ["LARGER", "Candidate", "Limit", "Margins", "Sizing", "largest", "margins_of", "size"]
