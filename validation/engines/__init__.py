"""Engines against each other: analytic curve, chain and multibody model, static and dynamic."""

from validation.engines.agreement import EngineAgreement, compare_engines

__all__ = ["EngineAgreement", "compare_engines"]
