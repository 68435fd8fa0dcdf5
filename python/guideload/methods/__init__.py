"""The integration methods themselves: work-precision on a scene, and the steps at which each is stable."""

from guideload.methods.diagram import WorkPrecision
from guideload.methods.runner import work_precision
from guideload.methods.step_stability import Stability, stability

__all__ = ["Stability", "WorkPrecision", "stability", "work_precision"]
