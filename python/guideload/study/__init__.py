"""Monte Carlo studies: the distribution of the loads of a machine whose parameters vary."""

from guideload.study.description.study import Study
from guideload.study.execution import StudyInterrupted, run_study
from guideload.study.rare.exceedance_probability import RareProbability, exceedance_probability
from guideload.study.results.result import StudyResult

__all__ = [
    "RareProbability",
    "Study",
    "StudyInterrupted",
    "StudyResult",
    "exceedance_probability",
    "run_study",
]
