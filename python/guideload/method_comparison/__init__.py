"""The integration methods themselves: work-precision on a scene, and the steps at which each is stable."""

from guideload.method_comparison.diagram import WorkPrecision
from guideload.method_comparison.runner import work_precision
from guideload.method_comparison.step_stability import Stability, stability

__all__ = ["Stability", "WorkPrecision", "stability", "work_precision"]
