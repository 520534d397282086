"""Joint models against the solid: stiffness, superelasticity, and the whole chain in every model."""

from validation.joints.models import ModelComparison, compare_models
from validation.joints.notches import NotchCase, NotchResult

__all__ = ["ModelComparison", "NotchCase", "NotchResult", "compare_models"]
