"""The figure of ``docs/theory/three-dimensions.md``."""
