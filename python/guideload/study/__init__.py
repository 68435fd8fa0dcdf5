"""Monte Carlo studies: the distribution of the loads where the parameters of a machine scatter."""

from guideload.study.description.study import Study
from guideload.study.execution import StudyInterrupted, run_study
from guideload.study.results.result import StudyResult

__all__ = ["Study", "StudyInterrupted", "StudyResult", "run_study"]
