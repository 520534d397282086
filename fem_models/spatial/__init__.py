"""The chain in space: rings between flexures of six stiffnesses, any number of tendons, friction at every guide."""

from fem_models.spatial.drives import SpatialProgram, WheelProgram, circle, first_wheel, wheel_drives
from fem_models.spatial.motion.run_record import simulate_in_space
from fem_models.spatial.parameters import SpatialSettings
from fem_models.spatial.rig import (
    DeadLoads,
    SpatialJoint,
    SpatialRig,
    SpatialTendon,
    of_rig_in_space,
    spatial_rig,
    with_masses,
)
from fem_models.spatial.solve import SpatialSolution, solve_spatial

__all__ = [
    "DeadLoads",
    "SpatialJoint",
    "SpatialProgram",
    "SpatialRig",
    "SpatialSettings",
    "SpatialSolution",
    "SpatialTendon",
    "WheelProgram",
    "circle",
    "first_wheel",
    "of_rig_in_space",
    "simulate_in_space",
    "solve_spatial",
    "spatial_rig",
    "wheel_drives",
    "with_masses",
]
