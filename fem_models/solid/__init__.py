"""One single notched ring (SNR) as a solid: mesh, linear stiffness, large superelastic bending, CalculiX."""

from hysteresis.extras import require_extra

require_extra("solid", "the solid notch")  # before anything imports its libraries

from fem_models.solid.large_bending import moment_angle  # noqa: E402
from fem_models.solid.linear import snr_stiffness, solid_snr  # noqa: E402
from fem_models.solid.mesh import snr_mesh  # noqa: E402

__all__ = ["moment_angle", "snr_mesh", "snr_stiffness", "solid_snr"]
