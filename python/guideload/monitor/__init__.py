"""Load monitor of a controller: its constants from a machine, and their source text in Rust or C."""

from guideload.monitor.design import Design, designed
from guideload.monitor.settings import MonitorSettings

__all__ = ["Design", "MonitorSettings", "designed"]
