"""The chain in space: rings between flexures of six stiffnesses, any number of tendons, friction at every guide."""

from fem_models.spatial.drives import SpatialProgram, wheel_drives
from fem_models.spatial.parameters import SpatialSettings
from fem_models.spatial.rig import DeadLoads, SpatialJoint, SpatialRig, SpatialTendon, spatial_rig, with_masses
from fem_models.spatial.solve import SpatialSolution, solve_spatial

__all__ = [
    "DeadLoads",
    "SpatialJoint",
    "SpatialProgram",
    "SpatialRig",
    "SpatialSettings",
    "SpatialSolution",
    "SpatialTendon",
    "solve_spatial",
    "spatial_rig",
    "wheel_drives",
    "with_masses",
]
