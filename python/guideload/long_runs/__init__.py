"""Runs over records that are too long for memory: the motion comes in blocks, peaks and life are kept."""

from guideload.long_runs.blocks import motion_blocks
from guideload.long_runs.long_run import LongRun

__all__ = ["LongRun", "motion_blocks"]
