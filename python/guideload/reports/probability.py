"""The report of a small probability of exceeding a limit."""

from __future__ import annotations

from guideload.base.number_text import digits, percent, scientific
from guideload.reports.report import Report
from guideload.reports.study_tables import limit_text
from guideload.study.metadata import StudyMetadata
from guideload.study.rare import RareProbability


def probability_report(found: RareProbability, metadata: StudyMetadata) -> Report:
    """Probability, coefficient of variation, interval, work and doubts."""
    stem, _, carriage = found.name.partition("[")
    owner = f"carriage {carriage.removesuffix(']')}" if carriage else "machine"
    text = f"Probability of {limit_text(stem, found.limit, metadata)}, {owner}: "
    if found.probability:
        ends = f"{digits(found.low, 2)} to {digits(found.high, 2)}"
        text += f"{digits(found.probability, 2)} ({ends} at 95 %), coefficient of variation "
        text += percent(found.coefficient_of_variation)
    else:
        text += f"below {scientific(found.high)}"
    work = f"{found.populations} populations of a subset simulation, {found.runs} runs, seed {found.seed}"
    warnings = [*found.doubts, *metadata.warnings]
    return Report.of(metadata.machine, "probability", answer=[f"{text}. {work}."], warnings=warnings)
