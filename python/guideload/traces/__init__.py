"""Measured traces: `format` reads tables, `content` finds columns and samples, `quality` checks and repairs them."""

from guideload.traces.inspection import Inspection
from guideload.traces.reading import Trace, motion_from_trace, read_trace

__all__ = ["Inspection", "Trace", "motion_from_trace", "read_trace"]
