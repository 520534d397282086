"""Compiled part of the chain in space: one joint, guides, Newton's method, the path."""

__all__: list[str] = []
