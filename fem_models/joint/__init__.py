"""One joint: its section, stiffness, strain, superelasticity, closure and friction, derived from a rig."""

from fem_models.joint.mechanics import JointMechanics, joint_mechanics

__all__ = ["JointMechanics", "joint_mechanics"]
