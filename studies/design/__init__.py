"""From a requirement to a tube that can be cut: requirements, quantities of a tube, and P(met)."""

from studies.design.requirement import Requirement, Requirements, verdicts

__all__ = ["Requirement", "Requirements", "verdicts"]
