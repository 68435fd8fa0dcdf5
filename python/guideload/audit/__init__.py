"""The audit of a result: figures and warnings that judge its model, samples and method."""

from guideload.audit.audit import Audit

__all__ = ["Audit"]
