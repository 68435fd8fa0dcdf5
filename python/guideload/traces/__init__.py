"""Measured traces: `format` reads tables, `content` finds columns and samples, `quality` checks and repairs them.

Names are imported when first used, so that the command line can list the options of reading at no cost.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from guideload.traces.forces import read_forces
    from guideload.traces.inspection import Inspection
    from guideload.traces.reading import Trace, motion_from_trace, read_trace

__all__ = ["Inspection", "Trace", "motion_from_trace", "read_forces", "read_trace"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = {"Inspection": "inspection", "read_forces": "forces"}.get(name, "reading")
    return getattr(import_module(f"{__name__}.{home}"), name)
