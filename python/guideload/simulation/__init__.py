"""Simulation of a machine under a motion, and its result with its files."""

from guideload.simulation.result import Result
from guideload.simulation.simulation import peak_loads, simulate

__all__ = ["Result", "peak_loads", "simulate"]
