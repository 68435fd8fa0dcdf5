"""From samples of position or velocity to acceleration with its uncertainty."""

from guideload.smoothing.estimation import Estimate
from guideload.smoothing.smoothing import Kinematics, smooth

__all__ = ["Estimate", "Kinematics", "smooth"]
