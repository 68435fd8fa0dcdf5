"""Smoothing: acceleration and its uncertainty from samples of position or velocity."""

from guideload.smoothing.estimation import MotionEstimate
from guideload.smoothing.kinematics import Kinematics
from guideload.smoothing.smoothing import smooth

__all__ = ["MotionEstimate", "Kinematics", "smooth"]
