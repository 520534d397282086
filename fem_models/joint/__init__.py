"""One joint: its section, stiffness, strain, superelasticity, closure and friction, derived from a rig."""

from fem_models.joint.mechanics import JointMechanics, joint_mechanics
from fem_models.joint.row import JointRow, joint_row

__all__ = ["JointMechanics", "JointRow", "joint_mechanics", "joint_row"]
