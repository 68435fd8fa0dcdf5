"""Dynamic load of linear rolling guides: from a machine and a measured motion to the load of every carriage.

    from guideload import Machine, motion_from_trace, read_trace, simulate

A name is imported when it is first used, so that `import guideload` takes no time.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in `typing`, which would take longer to import than all else here
if TYPE_CHECKING:
    from typing import Any

    from guideload.audit import Audit as Audit
    from guideload.base.errors import ArgumentError as ArgumentError
    from guideload.base.errors import ConfigError as ConfigError
    from guideload.base.errors import DoubtfulResult as DoubtfulResult
    from guideload.base.errors import GuideloadError as GuideloadError
    from guideload.base.errors import LifeError as LifeError
    from guideload.base.errors import PictureError as PictureError
    from guideload.base.errors import RunError as RunError
    from guideload.base.errors import SceneError as SceneError
    from guideload.base.errors import TraceError as TraceError
    from guideload.catalogue import Catalogue as Catalogue
    from guideload.catalogue import LifeConditions as LifeConditions
    from guideload.catalogue import Product as Product
    from guideload.catalogue import Rating as Rating
    from guideload.duty import DutyCycle as DutyCycle
    from guideload.duty import LoadCase as LoadCase
    from guideload.duty import duty_cycle as duty_cycle
    from guideload.identification import Identification as Identification
    from guideload.identification import identify as identify
    from guideload.life import Life as Life
    from guideload.life import life_of as life_of
    from guideload.long_runs import LongRun as LongRun
    from guideload.long_runs import motion_blocks as motion_blocks
    from guideload.machine import Body as Body
    from guideload.machine import Carriage as Carriage
    from guideload.machine import Drive as Drive
    from guideload.machine import FrequencyResponse as FrequencyResponse
    from guideload.machine import Friction as Friction
    from guideload.machine import Link as Link
    from guideload.machine import Machine as Machine
    from guideload.machine import Modes as Modes
    from guideload.machine import Payload as Payload
    from guideload.machine import PointOfInterest as PointOfInterest
    from guideload.machine import Rail as Rail
    from guideload.machine import Rider as Rider
    from guideload.machine import frequency_response as frequency_response
    from guideload.method_comparison import Stability as Stability
    from guideload.method_comparison import WorkPrecision as WorkPrecision
    from guideload.method_comparison import stability as stability
    from guideload.method_comparison import work_precision as work_precision
    from guideload.motion import Forces as Forces
    from guideload.motion import Motion as Motion
    from guideload.motion import Move as Move
    from guideload.motion import MoveLimits as MoveLimits
    from guideload.motion import Moves as Moves
    from guideload.sensitivity import VariedMachine as VariedMachine
    from guideload.sensitivity import sensitivities as sensitivities
    from guideload.simulation import Result as Result
    from guideload.simulation import peak_loads as peak_loads
    from guideload.simulation import simulate as simulate
    from guideload.study import RareProbability as RareProbability
    from guideload.study import Study as Study
    from guideload.study import StudyInterrupted as StudyInterrupted
    from guideload.study import StudyResult as StudyResult
    from guideload.study import exceedance_probability as exceedance_probability
    from guideload.study import run_study as run_study
    from guideload.traces import Inspection as Inspection
    from guideload.traces import Trace as Trace
    from guideload.traces import motion_from_trace as motion_from_trace
    from guideload.traces import read_forces as read_forces
    from guideload.traces import read_trace as read_trace

_HOMES = {
    "audit": ("Audit",),
    "base.errors": (
        "ArgumentError",
        "ConfigError",
        "DoubtfulResult",
        "GuideloadError",
        "LifeError",
        "PictureError",
        "RunError",
        "SceneError",
        "TraceError",
    ),
    "catalogue": ("Catalogue", "LifeConditions", "Product", "Rating"),
    "duty": ("DutyCycle", "LoadCase", "duty_cycle"),
    "identification": ("Identification", "identify"),
    "life": ("Life", "life_of"),
    "long_runs": ("LongRun", "motion_blocks"),
    "machine": (
        "Body",
        "Carriage",
        "Drive",
        "FrequencyResponse",
        "Friction",
        "Link",
        "Machine",
        "Modes",
        "Payload",
        "PointOfInterest",
        "Rail",
        "Rider",
        "frequency_response",
    ),
    "method_comparison": ("Stability", "WorkPrecision", "stability", "work_precision"),
    "motion": ("Forces", "Motion", "Move", "MoveLimits", "Moves"),
    "sensitivity": ("VariedMachine", "sensitivities"),
    "simulation": ("Result", "peak_loads", "simulate"),
    "study": (
        "RareProbability",
        "Study",
        "StudyInterrupted",
        "StudyResult",
        "exceedance_probability",
        "run_study",
    ),
    "traces": ("Inspection", "Trace", "motion_from_trace", "read_forces", "read_trace"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

_PACKAGES = ("html_report", "plots")

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in _HOME_OF:
        return getattr(import_module(f"guideload.{_HOME_OF[name]}"), name)
    if name in _PACKAGES:
        return import_module(f"guideload.{name}")
    raise AttributeError(f"module 'guideload' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, *_PACKAGES]
