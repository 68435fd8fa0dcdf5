"""Dynamic load of linear rolling guides: from a machine and a measured motion to the load of every carriage.

    from guideload import Machine, motion_from_trace, read_trace, simulate

Names are imported when first used, so that `import guideload` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from guideload.audit import Audit
    from guideload.bench import work_precision
    from guideload.encoder import Trace, motion_from_trace, read_trace
    from guideload.errors import ArgumentError, ConfigError, GuideloadError, RunError, SceneError, TraceError
    from guideload.inspection import Inspection
    from guideload.limits import Stability, stability
    from guideload.machine import Machine
    from guideload.modes import Modes
    from guideload.motion import Motion
    from guideload.parts import Body, Carriage, Drive, Link, Rail
    from guideload.precision import WorkPrecision
    from guideload.result import Result
    from guideload.simulation import peak_loads, simulate
    from guideload.study.execute import StudyInterrupted, run_study
    from guideload.study.result import StudyResult
    from guideload.study.spec import Study

_HOMES = {
    "audit": ("Audit",),
    "bench": ("work_precision",),
    "encoder": ("Trace", "motion_from_trace", "read_trace"),
    "errors": ("ArgumentError", "ConfigError", "GuideloadError", "RunError", "SceneError", "TraceError"),
    "inspection": ("Inspection",),
    "limits": ("Stability", "stability"),
    "machine": ("Machine",),
    "modes": ("Modes",),
    "motion": ("Motion",),
    "parts": ("Body", "Carriage", "Drive", "Link", "Rail"),
    "precision": ("WorkPrecision",),
    "result": ("Result",),
    "simulation": ("peak_loads", "simulate"),
    "study.execute": ("StudyInterrupted", "run_study"),
    "study.result": ("StudyResult",),
    "study.spec": ("Study",),
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
