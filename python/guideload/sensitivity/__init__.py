"""Exact derivatives of what the program computes by the numbers of a machine."""

from guideload.sensitivity.columns import Column
from guideload.sensitivity.figures import CarriageQuantities
from guideload.sensitivity.influence import Influence, rank_influences
from guideload.sensitivity.linearised import Linearised
from guideload.sensitivity.modes import ModeDerivatives
from guideload.sensitivity.run import RunDerivatives
from guideload.sensitivity.sensitivities import sensitivities
from guideload.sensitivity.varied import VariedMachine

__all__ = [
    "Column",
    "CarriageQuantities",
    "Influence",
    "Linearised",
    "ModeDerivatives",
    "RunDerivatives",
    "VariedMachine",
    "rank_influences",
    "sensitivities",
]
