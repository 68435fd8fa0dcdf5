"""A study whose motion scatters: each sample draws its own from the posterior of the trace."""

from __future__ import annotations

import numpy as np

from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.study.description.metadata import DRAWN_MOTION, ParameterMetadata
from guideload.study.description.plan import digest
from guideload.study.description.refusals import refused_at

PLACE = ("motion", "posterior")
# The column of the numbers of the draws.
MOTION_PARAMETER = ParameterMetadata(
    name=DRAWN_MOTION, unit="1", targets=(), distribution="draws of the posterior of the trace"
)


def require_posterior(machine: Machine, motion: Motion, cases: object) -> None:
    """Raise ConfigError unless the motion has a posterior, and the samples are drawn."""
    if motion.uncertainty is None:
        reason = "its acceleration is known exactly" if motion.exact else "its acceleration came without one"
        hint = f"{reason}; a trace of encoder counts or positions has one, if its smoothing is not replaced"
        raise refused_at(PLACE, "false for a motion without uncertainty", True, hint)
    if cases is not None:
        hint = "cases are run as they are: draw the parameters by [[vary]] tables"
        raise refused_at(PLACE, "false beside cases", True, hint)
    if machine.drive is not None and machine.drive.pressure_angle is not None:
        hint = "the push of a rack follows the motion, and would stay that of the estimate"
        raise refused_at(PLACE, "false for a drive with pressure_angle", True, hint)


def draw_seed(seed: int) -> int:
    """The seed of the draws of the motion in a study with this seed."""
    # 0 to 4 are those of samples, second look and populations.
    return int(np.random.SeedSequence(seed, spawn_key=(5,)).generate_state(1, np.uint64)[0])


def digest_of_posterior(motion: Motion) -> str:
    """SHA-256 of all numbers on which the draws depend."""
    uncertainty = motion.uncertainty
    assert uncertainty is not None
    step, variance, covariance, segment, density, oscillator = uncertainty.model
    chain = [step, variance, covariance, segment.astype(np.float64), density]
    if oscillator is not None:
        chain.append(np.array(oscillator, dtype=np.float64))
    return digest(*chain, np.array([float(uncertainty.derivative)]), uncertainty.unit, uncertainty.time)
