"""Exact derivatives of what the program computes by the numbers of a machine."""

from guideload.sensitivity.linearised import Linearised
from guideload.sensitivity.modes import ModeDerivatives
from guideload.sensitivity.varied import Column, VariedMachine

__all__ = ["Column", "Linearised", "ModeDerivatives", "VariedMachine"]
