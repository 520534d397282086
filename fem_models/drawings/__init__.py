"""Drawings of a notched tube: flat cutting pattern, DXF out and in, dimensioned side view."""

from fem_models.drawings.pattern import FlatPattern, flat_pattern
from fem_models.drawings.side_view import side_view_pdf, side_view_svg

__all__ = ["FlatPattern", "flat_pattern", "side_view_pdf", "side_view_svg"]
