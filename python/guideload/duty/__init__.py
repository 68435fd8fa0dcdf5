"""Duty cycles: load cases with their shares, and the life and static safety that they give together."""

from guideload.duty.duty_cycle import DutyCycle, LoadCase, duty_cycle

__all__ = ["DutyCycle", "LoadCase", "duty_cycle"]
