"""The load monitor on a PC: from lines of samples to loads in the terminal, in Parquet files, and for the page."""

from guideload.watch.status import WatchState

__all__ = ["WatchState"]
