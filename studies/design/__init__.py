"""From a requirement to a tube that can be cut: what is asked, what a tube gives, and how surely."""

from studies.design.requirement import Requirement, Requirements, verdicts

__all__ = ["Requirement", "Requirements", "verdicts"]
