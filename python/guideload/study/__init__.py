"""Monte Carlo studies: the distribution of the loads of a machine whose parameters vary."""

from guideload.study.execution import StudyInterrupted, run_study
from guideload.study.rare import RareProbability, exceedance_probability
from guideload.study.result import StudyResult
from guideload.study.study import Study

__all__ = [
    "RareProbability",
    "Study",
    "StudyInterrupted",
    "StudyResult",
    "exceedance_probability",
    "run_study",
]
