"""Load monitor of a controller: its constants from a machine, their source text in Rust or C, and its use in Python."""

from guideload.monitor.design import Design, designed
from guideload.monitor.monitor import Monitor
from guideload.monitor.settings import MonitorSettings

__all__ = ["Design", "Monitor", "MonitorSettings", "designed"]
