"""The audit of a result: whether the model suits the scene, and what its numbers are worth."""

from guideload.audit.audit import Audit

__all__ = ["Audit"]
