"""From a machine and a motion to the loads, and the result with its files."""

from guideload.simulation.result import Result
from guideload.simulation.simulation import peak_loads, simulate

__all__ = ["Result", "peak_loads", "simulate"]
