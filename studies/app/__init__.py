"""A local page with sliders: the loop and the tube of a rig, computed by the chain."""

from studies.app.page import serve

__all__ = ["serve"]
