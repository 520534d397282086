"""One single notched ring (SNR) as a solid: mesh, linear stiffness, large superelastic bending, CalculiX."""

from fem_models.solid.large_bending import moment_angle
from fem_models.solid.linear import snr_stiffness, solid_snr
from fem_models.solid.mesh import snr_mesh

__all__ = ["moment_angle", "snr_mesh", "snr_stiffness", "solid_snr"]
