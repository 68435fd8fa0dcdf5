"""Dynamic load of linear rolling guides: from a machine and a measured motion to the load of every carriage.

    from guideload import Machine, motion_from_trace, read_trace, simulate

A name is imported when it is first used, so that `import guideload` takes no time.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from guideload.audit import Audit
    from guideload.base.errors import (
        ArgumentError,
        ConfigError,
        GuideloadError,
        RunError,
        SceneError,
        TraceError,
    )
    from guideload.machine import Body, Carriage, Drive, Link, Machine, Modes, Rail
    from guideload.method_comparison import Stability, WorkPrecision, stability, work_precision
    from guideload.motion import Motion
    from guideload.simulation import Result, peak_loads, simulate
    from guideload.study import Study, StudyInterrupted, StudyResult, run_study
    from guideload.traces import Inspection, Trace, motion_from_trace, read_trace

_HOMES = {
    "audit": ("Audit",),
    "base.errors": ("ArgumentError", "ConfigError", "GuideloadError", "RunError", "SceneError", "TraceError"),
    "machine": ("Body", "Carriage", "Drive", "Link", "Machine", "Modes", "Rail"),
    "method_comparison": ("Stability", "WorkPrecision", "stability", "work_precision"),
    "motion": ("Motion",),
    "simulation": ("Result", "peak_loads", "simulate"),
    "study": ("Study", "StudyInterrupted", "StudyResult", "run_study"),
    "traces": ("Inspection", "Trace", "motion_from_trace", "read_trace"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "ArgumentError",
    "Audit",
    "Body",
    "Carriage",
    "ConfigError",
    "Drive",
    "GuideloadError",
    "Inspection",
    "Link",
    "Machine",
    "Modes",
    "Motion",
    "Rail",
    "Result",
    "RunError",
    "SceneError",
    "Stability",
    "Study",
    "StudyInterrupted",
    "StudyResult",
    "Trace",
    "TraceError",
    "WorkPrecision",
    "motion_from_trace",
    "peak_loads",
    "read_trace",
    "run_study",
    "simulate",
    "stability",
    "work_precision",
]


def __getattr__(name: str) -> Any:
    if name in _HOME_OF:
        return getattr(import_module(f"guideload.{_HOME_OF[name]}"), name)
    if name == "plots":
        return import_module("guideload.plots")
    raise AttributeError(f"module 'guideload' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "plots"]
