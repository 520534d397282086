"""A wrist in space as an Exudyn multibody system: the second engine for the rigs of :mod:`fem_models.spatial`."""

from fem_models.multibody.spatial.solve import MULTIBODY_SETTINGS, solve_spatial_multibody

__all__ = ["MULTIBODY_SETTINGS", "solve_spatial_multibody"]
