"""Compiled part of the chain in space: one joint, guides, Newton's method, the path."""

from fem_models.spatial.kernels.follow import follow

__all__ = ["follow"]
